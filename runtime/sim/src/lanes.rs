//! Numbers of environments side by side: each operation is done for all before the next.
//!
//! A lane holds one environment. Every lane gets the bits that the scalar operation gives, so whoever runs
//! beside an environment changes nothing in it.

use crate::maths::{Vec2, wrap};

/// Environments side by side.
pub(crate) const LANES: usize = 16;

/// One number of each environment.
pub(crate) type Lanes = [f64; LANES];
/// One truth value of each.
pub(crate) type Mask = [bool; LANES];
/// One plane vector of each: all x, then all y.
pub(crate) type Plane = [Lanes; 2];

pub(crate) const ZEROS: Lanes = [0.0; LANES];
pub(crate) const NOBODY: Mask = [false; LANES];
pub(crate) const EVERYBODY: Mask = [true; LANES];

/// A function of numbers or vectors, and the same over lanes.
#[derive(Debug)]
pub(crate) struct Lifted<One, Many> {
    pub one: One,
    pub many: Many,
}

impl<One: Copy, Many: Copy> Clone for Lifted<One, Many> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<One: Copy, Many: Copy> Copy for Lifted<One, Many> {}

pub(crate) type Function1 = Lifted<fn(f64) -> f64, fn(&Lanes) -> Lanes>;
pub(crate) type Function2 = Lifted<fn(f64, f64) -> f64, fn(&Lanes, &Lanes) -> Lanes>;
pub(crate) type OfVector = Lifted<fn(Vec2) -> f64, fn(&Plane) -> Lanes>;
pub(crate) type OfVectors = Lifted<fn(Vec2, Vec2) -> f64, fn(&Plane, &Plane) -> Lanes>;
pub(crate) type Comparison = Lifted<fn(&f64, &f64) -> bool, fn(&Lanes, &Lanes) -> Mask>;

/// Lifts a function by `map`, `map2`, … so that the loop over lanes knows it.
macro_rules! lift {
    ($map:ident, $f:expr, $($x:ident),+) => {
        $crate::lanes::Lifted { one: $f, many: |$($x),+| $crate::lanes::$map($($x),+, $f) }
    };
}
pub(crate) use lift;

#[inline(always)]
pub(crate) fn map(x: &Lanes, f: impl Fn(f64) -> f64) -> Lanes {
    let mut out = ZEROS;
    for (out, x) in out.iter_mut().zip(x) {
        *out = f(*x);
    }
    out
}

#[inline(always)]
pub(crate) fn map2(a: &Lanes, b: &Lanes, f: impl Fn(f64, f64) -> f64) -> Lanes {
    let mut out = ZEROS;
    for (out, (a, b)) in out.iter_mut().zip(a.iter().zip(b)) {
        *out = f(*a, *b);
    }
    out
}

#[inline(always)]
pub(crate) fn map_vector(v: &Plane, f: impl Fn(Vec2) -> f64) -> Lanes {
    map2(&v[0], &v[1], |x, y| f([x, y]))
}

#[inline(always)]
pub(crate) fn map_vectors(a: &Plane, b: &Plane, f: impl Fn(Vec2, Vec2) -> f64) -> Lanes {
    let mut out = ZEROS;
    for (lane, out) in out.iter_mut().enumerate() {
        *out = f([a[0][lane], a[1][lane]], [b[0][lane], b[1][lane]]);
    }
    out
}

#[inline(always)]
pub(crate) fn compare(a: &Lanes, b: &Lanes, f: impl Fn(&f64, &f64) -> bool) -> Mask {
    let mut out = NOBODY;
    for (out, (a, b)) in out.iter_mut().zip(a.iter().zip(b)) {
        *out = f(a, b);
    }
    out
}

/// Each axis by itself.
#[inline(always)]
pub(crate) fn by_axis(a: &Plane, b: &Plane, f: impl Fn(f64, f64) -> f64) -> Plane {
    [map2(&a[0], &b[0], &f), map2(&a[1], &b[1], &f)]
}

/// Each axis with the same number.
#[inline(always)]
pub(crate) fn by_number(v: &Plane, x: &Lanes, f: impl Fn(f64, f64) -> f64) -> Plane {
    [map2(&v[0], x, &f), map2(&v[1], x, &f)]
}

/// A vector of each lane from that of the other.
#[inline(always)]
pub(crate) fn each(v: &Plane, f: impl Fn(usize, Vec2) -> Vec2) -> Plane {
    let mut out = [ZEROS; 2];
    for lane in 0..LANES {
        put(&mut out, lane, f(lane, at(v, lane)));
    }
    out
}

pub(crate) fn at(v: &Plane, lane: usize) -> Vec2 {
    [v[0][lane], v[1][lane]]
}

pub(crate) fn put(v: &mut Plane, lane: usize, [x, y]: Vec2) {
    v[0][lane] = x;
    v[1][lane] = y;
}

/// `a` where the mask holds, else `b`.
#[inline(always)]
pub(crate) fn select<T: Copy>(mask: &Mask, a: &[T; LANES], b: &[T; LANES]) -> [T; LANES] {
    let mut out = *b;
    for ((out, a), mask) in out.iter_mut().zip(a).zip(mask) {
        *out = if *mask { *a } else { *out };
    }
    out
}

pub(crate) fn select_plane(mask: &Mask, a: &Plane, b: &Plane) -> Plane {
    [select(mask, &a[0], &b[0]), select(mask, &a[1], &b[1])]
}

#[inline(always)]
pub(crate) fn and(mut a: Mask, b: Mask) -> Mask {
    a.iter_mut().zip(&b).for_each(|(a, b)| *a &= *b);
    a
}

#[inline(always)]
pub(crate) fn or(mut a: Mask, b: Mask) -> Mask {
    a.iter_mut().zip(&b).for_each(|(a, b)| *a |= *b);
    a
}

#[inline(always)]
pub(crate) fn not(a: Mask) -> Mask {
    a.map(|a| !a)
}

/// Whether it holds anywhere.
#[inline(always)]
pub(crate) fn some(mask: Mask) -> bool {
    mask != NOBODY
}

/// Sines and cosines. Angles that are small in all lanes take the polynomials of `libm` on [−π/4, π/4] (after
/// FreeBSD's msun), which it would choose too; otherwise it is asked lane by lane.
#[inline(always)]
pub(crate) fn sincos(angle: &Lanes) -> (Lanes, Lanes) {
    let small = angle.iter().fold(true, |small, x| small & (x.abs() < SMALL));
    let (mut sin, mut cos) = (ZEROS, ZEROS);
    if small {
        for ((sin, cos), x) in sin.iter_mut().zip(&mut cos).zip(angle) {
            (*sin, *cos) = sincos_of_small(*x);
        }
    } else {
        for ((sin, cos), x) in sin.iter_mut().zip(&mut cos).zip(angle) {
            (*sin, *cos) = libm::sincos(*x);
        }
    }
    (sin, cos)
}

/// Below π/4, where `libm` reduces no angle.
const SMALL: f64 = 0.785;

#[inline(always)]
#[allow(clippy::excessive_precision)]
fn sincos_of_small(x: f64) -> (f64, f64) {
    const S: [f64; 6] = [
        -1.66666666666666324348e-01,
        8.33333333332248946124e-03,
        -1.98412698298579493134e-04,
        2.75573137070700676789e-06,
        -2.50507602534068634195e-08,
        1.58969099521155010221e-10,
    ];
    const C: [f64; 6] = [
        4.16666666666666019037e-02,
        -1.38888888888741095749e-03,
        2.48015872894767294178e-05,
        -2.75573143513906633035e-07,
        2.08757232129817482790e-09,
        -1.13596475577881948265e-11,
    ];
    let z = x * x;
    let w = z * z;
    let r = S[1] + z * (S[2] + z * S[3]) + z * w * (S[4] + z * S[5]);
    let sin = x + z * x * (S[0] + z * r);
    // The polynomial would lose the sign of −0.
    let sin = if x == 0.0 { x } else { sin };
    let r = z * (C[0] + z * (C[1] + z * C[2])) + w * w * (C[3] + z * (C[4] + z * C[5]));
    let half = 0.5 * z;
    let w = 1.0 - half;
    let cos = w + (((1.0 - w) - half) + z * r);
    (sin, cos)
}

/// The same angles in (−π, π].
pub(crate) fn wrapped(angle: &Lanes) -> Lanes {
    map(angle, wrap)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn assert_like_libm(x: f64) {
        let (sin, cos) = sincos(&[x; LANES]);
        let (s, c) = libm::sincos(x);
        let found = [sin[3].to_bits(), cos[3].to_bits()];
        assert_eq!(found, [s.to_bits(), c.to_bits()], "{x:e}");
    }

    #[test]
    fn sines_have_the_bits_of_libm_at_the_edges() {
        let tiny = 2f64.powi(-27) * 2f64.sqrt();
        for x in
            [0.0, 5e-324, 1e-310, 1e-30, 1e-9, tiny, tiny.next_down(), SMALL, SMALL.next_down(), 0.786, 9.0]
        {
            assert_like_libm(x);
            assert_like_libm(-x);
        }
    }

    proptest! {
        #![proptest_config(crate::sample::cases(20_000))]

        #[test]
        fn sines_have_the_bits_of_libm(x in -0.9..0.9f64, shrink in 0..40i32) {
            assert_like_libm(x);
            assert_like_libm(x * 2f64.powi(-shrink));
        }
    }
}
