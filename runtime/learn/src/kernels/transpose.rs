//! From rows to panels and back.

use super::Activation;
use super::lanes::Lanes;
use super::pointer::Pointer;
use super::storage::{BLOCK, Panels, Rows};

/// Copies a batch into panels.
pub(crate) fn to_panels(rows: &Rows, panels: &mut Panels) {
    for row in 0..rows.rows() {
        for (feature, &value) in rows.row(row).iter().enumerate() {
            panels.set(row, feature, value);
        }
    }
}

/// Operands of [`through`], for one panel; all hold whole blocks of features and of samples.
pub(super) struct Through {
    pub(super) activation: Activation,
    /// `[BLOCK][stride]`
    pub(super) h: Pointer,
    /// `[stride][BLOCK]`
    pub(super) d: Pointer,
    /// `[BLOCK][stride]`
    pub(super) d_rows: Pointer,
    pub(super) stride: usize,
}

/// `d` is multiplied by the derivative of the activation whose output is `h`, and `d_rows` becomes the same as
/// `d`.
///
/// # Safety
///
/// The CPU has the features of `L`; all three are valid for [`BLOCK`] samples of `stride` features, a
/// multiple of [`BLOCK`], and do not overlap.
#[inline(always)]
pub(super) unsafe fn through<L: Lanes>(a: &Through) {
    for feature in (0..a.stride).step_by(L::WIDTH) {
        for sample in (0..BLOCK).step_by(L::WIDTH) {
            // SAFETY: the tile of WIDTH × WIDTH floats lies within all three.
            unsafe {
                let row = sample * a.stride + feature;
                let (tile, tile_rows) = (a.d.add(feature * BLOCK + sample), a.d_rows.add(row));
                tile.transpose::<L>(BLOCK, tile_rows, a.stride);
                for k in 0..L::WIDTH {
                    let to = tile_rows.add(k * a.stride);
                    let (d, h): (L, L) = (to.load(), a.h.add(row + k * a.stride).load());
                    to.store(match a.activation {
                        Activation::Relu => d.where_positive(h),
                        // d · (1 − h²)
                        Activation::Tanh => d.mul(L::splat(-1.0).mul(h).mul_add(h, L::splat(1.0))),
                    });
                }
                tile_rows.transpose::<L>(a.stride, tile, BLOCK);
            }
        }
    }
}
