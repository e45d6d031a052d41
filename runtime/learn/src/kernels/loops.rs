//! The loops, written once for every width.
//!
//! One order of summation: lanes run over outputs or over the batch, and the sum inside a lane is
//! sequential, one fused multiply-add after another. Blocking changes which sums run side by side, never
//! the order within one.

use super::lanes::Lanes;
use super::pointer::Pointer;
use super::storage::BLOCK;

/// Operands of [`forward`]: y\[b\]\[o\] = bias\[o\] + Σ_i x\[b\]\[i\] w\[i\]\[o\], i ascending.
pub(super) struct Forward {
    pub(super) x: Pointer,
    pub(super) x_stride: usize,
    pub(super) rows: usize,
    pub(super) inputs: usize,
    /// `[inputs + 1][stride]`, the biases last.
    pub(super) w: Pointer,
    /// Of `w` and `y`; whole blocks.
    pub(super) stride: usize,
    pub(super) y: Pointer,
    pub(super) relu: bool,
}

/// In blocks of `R` rows by `C` vectors of outputs.
///
/// # Safety
///
/// The CPU has the features of `L`; x is valid for `rows` rows of `x_stride ≥ inputs`, w for `inputs + 1`
/// rows and y for `rows` rows of `stride`, a multiple of [`BLOCK`]; y overlaps neither.
#[inline(always)]
pub(super) unsafe fn forward<L: Lanes, const R: usize, const C: usize>(a: &Forward) {
    let vectors = a.stride / L::WIDTH;
    let mut v = 0;
    while v < vectors {
        // SAFETY: the strip of 1, 2 or C vectors from v on lies within the stride.
        unsafe {
            v += match vectors - v {
                left if left >= C => forward_strip::<L, R, C>(a, v),
                left if left >= 2 => forward_strip::<L, R, 2>(a, v),
                _ => forward_strip::<L, R, 1>(a, v),
            };
        }
    }
}

/// All rows of `C` vectors of outputs; gives `C`.
///
/// # Safety
///
/// As [`forward`], and vectors `v..v + C` lie within the stride.
#[inline(always)]
unsafe fn forward_strip<L: Lanes, const R: usize, const C: usize>(a: &Forward, v: usize) -> usize {
    let column = v * L::WIDTH;
    if a.rows < R {
        for row in 0..a.rows {
            // SAFETY: row < rows.
            unsafe { forward_block::<L, 1, C>(a, row, column) };
        }
    } else {
        let mut row = 0;
        while row < a.rows {
            // The last block may overlap the one before: it writes the same values again.
            // SAFETY: the R rows end at `rows` or before.
            unsafe { forward_block::<L, R, C>(a, row.min(a.rows - R), column) };
            row += R;
        }
    }
    C
}

/// # Safety
///
/// As [`forward`], and the block lies within y.
#[inline(always)]
unsafe fn forward_block<L: Lanes, const R: usize, const C: usize>(a: &Forward, row: usize, column: usize) {
    // SAFETY: by the caller's promise every address below lies within x, w or y.
    unsafe {
        let x = a.x.add(row * a.x_stride);
        let w = a.w.add(column);
        let mut sum = [[L::splat(0.0); C]; R];
        for c in 0..C {
            let bias: L = w.add(a.inputs * a.stride + c * L::WIDTH).load();
            for sums in &mut sum {
                sums[c] = bias;
            }
        }
        for i in 0..a.inputs {
            let mut weights = [L::splat(0.0); C];
            for (c, weight) in weights.iter_mut().enumerate() {
                *weight = w.add(i * a.stride + c * L::WIDTH).load();
            }
            for (r, sums) in sum.iter_mut().enumerate() {
                let value = L::splat(x.add(r * a.x_stride + i).get());
                for (total, weight) in sums.iter_mut().zip(weights) {
                    *total = value.mul_add(weight, *total);
                }
            }
        }
        for (r, sums) in sum.into_iter().enumerate() {
            for (c, total) in sums.into_iter().enumerate() {
                let y = if a.relu { total.relu() } else { total };
                a.y.add((row + r) * a.stride + column + c * L::WIDTH).store(y);
            }
        }
    }
}

/// Operands of [`backward`]: dx\[i\]\[b\] = Σ_o dy\[o\]\[b\] w\[i\]\[o\] in every panel, o ascending.
pub(super) struct Backward {
    pub(super) panels: usize,
    /// `[panels][stride][BLOCK]`
    pub(super) dy: Pointer,
    pub(super) outputs: usize,
    /// `[to][stride]`
    pub(super) w: Pointer,
    pub(super) stride: usize,
    /// `[panels][dx_stride][BLOCK]`
    pub(super) dx: Pointer,
    pub(super) dx_stride: usize,
}

/// Rows `from..to` of w, in blocks of `R` rows by the `N` vectors of a panel.
///
/// # Safety
///
/// The CPU has the features of `L`; `N · L::WIDTH = BLOCK`; dy and dx are valid for their panels, w for `to`
/// rows of `stride ≥ outputs`; `to ≤ dx_stride`; dx overlaps neither.
#[inline(always)]
pub(super) unsafe fn backward<L: Lanes, const R: usize, const N: usize>(
    a: &Backward,
    from: usize,
    to: usize,
) {
    for panel in 0..a.panels {
        // SAFETY: the panel lies within dy and dx.
        unsafe {
            let dy = a.dy.add(panel * a.stride * BLOCK);
            let dx = a.dx.add(panel * a.dx_stride * BLOCK);
            backward_panel::<L, R, N>(&Backward { dy, dx, ..*a }, from, to);
        }
    }
}

/// # Safety
///
/// As [`backward`], for one panel.
#[inline(always)]
unsafe fn backward_panel<L: Lanes, const R: usize, const N: usize>(a: &Backward, from: usize, to: usize) {
    let mut i = from;
    while i < to {
        if to - from >= R {
            // The last block may overlap the one before: it writes the same values again.
            // SAFETY: the R rows end at `to` or before, and begin at `from` or after.
            unsafe { backward_block::<L, R, N>(a, i.min(to - R)) };
            i += R;
        } else {
            // SAFETY: i < to.
            unsafe { backward_block::<L, 1, N>(a, i) };
            i += 1;
        }
    }
}

/// # Safety
///
/// As [`backward`], for rows `i..i + R`.
#[inline(always)]
unsafe fn backward_block<L: Lanes, const R: usize, const N: usize>(a: &Backward, i: usize) {
    // SAFETY: by the caller's promise every address below lies within dy, w or dx.
    unsafe {
        let w = a.w.add(i * a.stride);
        let mut sum = [[L::splat(0.0); N]; R];
        for o in 0..a.outputs {
            let mut d = [L::splat(0.0); N];
            for (n, d) in d.iter_mut().enumerate() {
                *d = a.dy.add(o * BLOCK + n * L::WIDTH).load();
            }
            for (r, sums) in sum.iter_mut().enumerate() {
                let weight = L::splat(w.add(r * a.stride + o).get());
                for (total, d) in sums.iter_mut().zip(d) {
                    *total = weight.mul_add(d, *total);
                }
            }
        }
        for (r, sums) in sum.into_iter().enumerate() {
            for (n, total) in sums.into_iter().enumerate() {
                a.dx.add((i + r) * BLOCK + n * L::WIDTH).store(total);
            }
        }
    }
}

/// One step of Adam (Kingma and Ba, 2015), the bias corrections folded into `rate` and `epsilon`:
/// m ← β₁ m + (1 − β₁) g, v ← β₂ v + (1 − β₂) g², w ← w − rate · m / (√v + epsilon); then, where there is a
/// target, target ← target + τ (w − target). Moments below the least normal number become 0: arithmetic on
/// subnormal numbers is slow.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AdamStep {
    pub(crate) beta_1: f32,
    pub(crate) beta_2: f32,
    /// α √(1 − β₂ᵗ) / (1 − β₁ᵗ)
    pub(crate) rate: f32,
    /// ε √(1 − β₂ᵗ)
    pub(crate) epsilon: f32,
    pub(crate) tau: f32,
}

/// Operands of [`update`]: the gradient is g\[i\]\[o\] = Σ_b x\[b\]\[i\] dy\[b\]\[o\], b ascending; it is
/// never stored.
pub(super) struct Update<'a> {
    pub(super) x: Pointer,
    pub(super) x_stride: usize,
    pub(super) rows: usize,
    pub(super) dy: Pointer,
    /// Of `dy`, `w`, `m`, `v` and `target`; whole blocks.
    pub(super) stride: usize,
    pub(super) w: Pointer,
    pub(super) m: Pointer,
    pub(super) v: Pointer,
    pub(super) target: Option<Pointer>,
    pub(super) step: &'a AdamStep,
}

/// Rows `from..to` of the weights, in blocks of `R` rows by `C` vectors.
///
/// # Safety
///
/// The CPU has the features of `L`; x is valid for `rows` rows of `x_stride ≥ to`, dy for `rows` rows of
/// `stride`, a multiple of [`BLOCK`]; w, m, v and, if there is one, target are valid for `to` rows of `stride`;
/// nothing that is written overlaps anything else.
#[inline(always)]
pub(super) unsafe fn update<L: Lanes, const R: usize, const C: usize>(a: &Update, from: usize, to: usize) {
    let mut i = from;
    while i < to {
        // SAFETY: the rows from i on, R or 1 of them, end at `to` or before.
        unsafe {
            i += if to - i >= R { update_strip::<L, R, C>(a, i) } else { update_strip::<L, 1, C>(a, i) };
        }
    }
}

/// The biases, row `inputs` of the weights: their inputs are all 1.
///
/// # Safety
///
/// As [`update`] for `inputs + 1` rows, but x is not read.
#[inline(always)]
pub(super) unsafe fn update_biases<L: Lanes, const C: usize>(a: &Update, inputs: usize) {
    let row = inputs * a.stride;
    // SAFETY: the row of biases lies within w, m, v and target; one float, read again for every sample, is x.
    unsafe {
        let target = a.target.map(|target| target.add(row));
        let (x, w, m, v) = (Pointer::to(&[1.0]), a.w.add(row), a.m.add(row), a.v.add(row));
        update_strip::<L, 1, C>(&Update { x, x_stride: 0, w, m, v, target, ..*a }, 0);
    }
}

/// `R` whole rows from row `i` on; gives `R`.
///
/// # Safety
///
/// As [`update`], for rows `i..i + R`.
#[inline(always)]
unsafe fn update_strip<L: Lanes, const R: usize, const C: usize>(a: &Update, i: usize) -> usize {
    let vectors = a.stride / L::WIDTH;
    let mut v = 0;
    while v < vectors {
        // SAFETY: the 1, 2 or C vectors from v on lie within the stride.
        unsafe {
            v += match vectors - v {
                left if left >= C => update_block::<L, R, C>(a, i, v * L::WIDTH),
                left if left >= 2 => update_block::<L, R, 2>(a, i, v * L::WIDTH),
                _ => update_block::<L, R, 1>(a, i, v * L::WIDTH),
            };
        }
    }
    R
}

/// # Safety
///
/// As [`update`], and the block lies within the weights.
#[inline(always)]
unsafe fn update_block<L: Lanes, const R: usize, const C: usize>(
    a: &Update,
    i: usize,
    column: usize,
) -> usize {
    // SAFETY: by the caller's promise every address below lies within x, dy, w, m, v or target.
    unsafe {
        let x = a.x.add(i);
        let dy = a.dy.add(column);
        let mut gradient = [[L::splat(0.0); C]; R];
        for b in 0..a.rows {
            let mut d = [L::splat(0.0); C];
            for (c, d) in d.iter_mut().enumerate() {
                *d = dy.add(b * a.stride + c * L::WIDTH).load();
            }
            for (r, gradients) in gradient.iter_mut().enumerate() {
                let value = L::splat(x.add(b * a.x_stride + r).get());
                for (total, d) in gradients.iter_mut().zip(d) {
                    *total = value.mul_add(d, *total);
                }
            }
        }
        for (r, gradients) in gradient.into_iter().enumerate() {
            for (c, g) in gradients.into_iter().enumerate() {
                adam(a, (i + r) * a.stride + column + c * L::WIDTH, g);
            }
        }
    }
    C
}

/// # Safety
///
/// As [`update`], and a vector at `place` lies within the weights.
#[inline(always)]
unsafe fn adam<L: Lanes>(a: &Update, place: usize, g: L) {
    let AdamStep { beta_1, beta_2, rate, epsilon, tau } = *a.step;
    // SAFETY: the vector at `place` lies within w, m, v and target.
    unsafe {
        let m: L = a.m.add(place).load();
        let v: L = a.v.add(place).load();
        let w: L = a.w.add(place).load();
        let m = L::splat(beta_1).mul_add(m, L::splat(1.0 - beta_1).mul(g)).flush();
        let v = L::splat(beta_2).mul_add(v, L::splat(1.0 - beta_2).mul(g.mul(g))).flush();
        let w = L::splat(-rate).mul_add(m.div(v.sqrt().add(L::splat(epsilon))), w);
        a.m.add(place).store(m);
        a.v.add(place).store(v);
        a.w.add(place).store(w);
        if let Some(place_of_target) = a.target.map(|target| target.add(place)) {
            let target: L = place_of_target.load();
            place_of_target.store(L::splat(tau).mul_add(w.sub(target), target));
        }
    }
}
