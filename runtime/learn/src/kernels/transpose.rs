//! From rows to panels and back.

use super::lanes::Lanes;
use super::storage::{BLOCK, Panels, Rows};

/// Copies a batch into panels.
pub(crate) fn to_panels(rows: &Rows, panels: &mut Panels) {
    for row in 0..rows.rows() {
        for (feature, &value) in rows.row(row).iter().enumerate() {
            panels.set(row, feature, value);
        }
    }
}

/// Operands of [`through_relu`], for one panel; all hold whole blocks of features and of samples.
pub(super) struct ThroughRelu {
    /// `[BLOCK][stride]`
    pub(super) h: *const f32,
    /// `[stride][BLOCK]`
    pub(super) d: *mut f32,
    /// `[BLOCK][stride]`
    pub(super) d_rows: *mut f32,
    pub(super) stride: usize,
}

/// `d` becomes 0 where `h` is not positive, and `d_rows` becomes the same as `d`.
///
/// # Safety
///
/// The CPU has the features of `L`; all three are valid for [`BLOCK`] samples of `stride` features, a
/// multiple of [`BLOCK`], and do not overlap.
#[inline(always)]
pub(super) unsafe fn through_relu<L: Lanes>(a: &ThroughRelu) {
    for feature in (0..a.stride).step_by(L::WIDTH) {
        for sample in (0..BLOCK).step_by(L::WIDTH) {
            // SAFETY: the tile of WIDTH × WIDTH floats lies within all three.
            unsafe {
                let row = sample * a.stride + feature;
                let (tile, tile_rows) = (a.d.add(feature * BLOCK + sample), a.d_rows.add(row));
                L::transpose(tile, BLOCK, tile_rows, a.stride);
                for k in 0..L::WIDTH {
                    let to = tile_rows.add(k * a.stride);
                    L::load(to).where_positive(L::load(a.h.add(row + k * a.stride))).store(to);
                }
                L::transpose(tile_rows, a.stride, tile, BLOCK);
            }
        }
    }
}
