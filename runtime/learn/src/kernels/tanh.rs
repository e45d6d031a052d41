//! The hyperbolic tangent of hidden layers, in operations that round the same in every width.

use super::lanes::Lanes;
use super::pointer::Pointer;

/// tanh x = x + x³ P(x²) below this magnitude, and 1 − 2 / (e²ˣ + 1) from it on.
const SMALL: f32 = 0.625;
/// P, the highest power first.
const ODD: [f32; 5] = [-5.704_988_7e-3, 2.063_909e-2, -5.373_971_6e-2, 1.333_144_2e-1, -3.333_328e-1];
/// eʳ for |r| ≤ ½ ln 2, the highest power first.
const EXP: [f32; 8] =
    [1.987_569_1e-4, 1.398_199_9e-3, 8.333_452e-3, 4.166_579_6e-2, 1.666_666_5e-1, 0.5, 1.0, 1.0];
/// ln 2 in two parts: whole multiples of the first, up to 2⁸, are exact.
const LN_2: [f32; 2] = [0.693_359_4, -2.121_944_4e-4];
/// From here on tanh rounds to 1.
const ONE: f32 = 10.0;
/// 1.5 · 2²³ + 127: what is added to it is rounded to a whole number n, and its last bits become the exponent
/// of 2ⁿ.
const WHOLE: f32 = 12_583_039.0;

/// Within 2 units in the last place of the exact value, odd, and never falling where x rises. ±∞ give ±1, NaN
/// stays NaN.
///
/// Source of the method and the coefficients: Moshier's Cephes library, `tanhf` and `expf`.
///
/// # Safety
///
/// The CPU has the features of `L`.
#[inline(always)]
pub(super) unsafe fn tanh<L: Lanes>(x: L) -> L {
    // SAFETY: the caller's promise; nothing here touches memory.
    unsafe {
        let magnitude = x.abs().at_most(L::splat(ONE));
        let square = magnitude.mul(magnitude);
        let small = polynomial(ODD, square).mul_add(square.mul(magnitude), magnitude);

        let doubled = magnitude.add(magnitude);
        let whole = doubled.mul_add(L::splat(std::f32::consts::LOG2_E), L::splat(WHOLE));
        let n = whole.sub(L::splat(WHOLE));
        let rest = LN_2.iter().fold(doubled, |rest, part| n.mul_add(L::splat(-part), rest));
        let exp = polynomial(EXP, rest).mul(whole.last_bits_as_exponent());
        let large = L::splat(1.0).sub(L::splat(2.0).div(exp.add(L::splat(1.0))));

        magnitude.choose_below(L::splat(SMALL), small, large).with_sign_of(x)
    }
}

/// Horner's rule, the highest power first.
///
/// # Safety
///
/// The CPU has the features of `L`.
#[inline(always)]
unsafe fn polynomial<L: Lanes, const N: usize>(coefficients: [f32; N], x: L) -> L {
    // SAFETY: the caller's promise.
    unsafe {
        let mut sum = L::splat(coefficients[0]);
        for &coefficient in &coefficients[1..] {
            sum = sum.mul_add(x, L::splat(coefficient));
        }
        sum
    }
}

/// [`tanh`] of `len` floats, in place.
///
/// # Safety
///
/// The CPU has the features of `L`; `values` is valid for `len`, a multiple of the width.
#[inline(always)]
pub(super) unsafe fn tanh_of_all<L: Lanes>(values: Pointer, len: usize) {
    for k in (0..len).step_by(L::WIDTH) {
        // SAFETY: k + WIDTH ≤ len.
        unsafe {
            let place = values.add(k);
            place.store(tanh::<L>(place.load()));
        }
    }
}
