//! What this CPU can do at most: multiply-adds in registers, and passes over arrays in memory.

use super::lanes::Lanes;
use super::pointer::Pointer;

/// Sums that grow side by side in [`multiply_adds`]: enough to hide the latency of one on two units, few
/// enough for 16 registers.
const CHAINS: usize = 12;

/// `rounds` times [`CHAINS`] vectors of fused multiply-adds that do not wait for each other; gives their sum,
/// so that none can be left out, and their number.
///
/// # Safety
///
/// The CPU has the features of `L`.
#[inline(always)]
pub(super) unsafe fn multiply_adds<L: Lanes>(rounds: usize) -> (f32, usize) {
    // SAFETY: the caller's promise; `lanes` has room for the widest vector.
    unsafe {
        let (factor, term) = (L::splat(std::hint::black_box(0.5)), L::splat(std::hint::black_box(1.0)));
        let mut sums = [term; CHAINS];
        for _ in 0..rounds {
            for sum in &mut sums {
                *sum = sum.mul_add(factor, term);
            }
        }
        let total = sums.into_iter().reduce(|a, b| a.add(b)).unwrap_or(term);
        let mut lanes = [0.0f32; 16];
        total.store(lanes.as_mut_ptr());
        (lanes.iter().sum(), rounds * CHAINS * L::WIDTH)
    }
}

/// The sum of an array.
///
/// # Safety
///
/// The CPU has the features of `L`; `from` is valid for `len` floats, a multiple of `8 · L::WIDTH`.
#[inline(always)]
pub(super) unsafe fn read<L: Lanes>(from: Pointer, len: usize) -> f32 {
    // SAFETY: every load lies within `len`; `lanes` has room for the widest vector.
    unsafe {
        let mut sums = [L::splat(0.0); 8];
        let mut place = 0;
        while place < len {
            for (k, sum) in sums.iter_mut().enumerate() {
                *sum = sum.add(from.add(place + k * L::WIDTH).load());
            }
            place += 8 * L::WIDTH;
        }
        let total = sums.into_iter().reduce(|a, b| a.add(b)).unwrap_or(L::splat(0.0));
        let mut lanes = [0.0f32; 16];
        total.store(lanes.as_mut_ptr());
        lanes.iter().sum()
    }
}

/// Reads and writes four arrays side by side, as training does with weights, moments and targets.
///
/// # Safety
///
/// The CPU has the features of `L`; each array is valid for `len` floats, a multiple of `L::WIDTH`, and they
/// do not overlap.
#[inline(always)]
pub(super) unsafe fn read_and_write<L: Lanes>(arrays: [Pointer; 4], len: usize) {
    // SAFETY: every vector lies within `len`.
    unsafe {
        let factor = L::splat(std::hint::black_box(1.0));
        let mut place = 0;
        while place < len {
            for array in arrays {
                let there = array.add(place);
                there.store(there.load::<L>().mul(factor));
            }
            place += L::WIDTH;
        }
    }
}
