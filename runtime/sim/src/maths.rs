//! Plane vectors, and the functions of the language defined to the last bit.
//!
//! Everything here gives the same bits on every machine: the basic operations and square roots are exact by
//! IEEE 754, the rest comes from `libm`. A NaN that goes in comes out.

/// x and y.
pub(crate) type Vec2 = [f64; 2];

pub(crate) fn add(a: Vec2, b: Vec2) -> Vec2 {
    [a[0] + b[0], a[1] + b[1]]
}

pub(crate) fn subtract(a: Vec2, b: Vec2) -> Vec2 {
    [a[0] - b[0], a[1] - b[1]]
}

pub(crate) fn scale(a: Vec2, factor: f64) -> Vec2 {
    [a[0] * factor, a[1] * factor]
}

pub(crate) fn divide(a: Vec2, by: f64) -> Vec2 {
    [a[0] / by, a[1] / by]
}

pub(crate) fn dot(a: Vec2, b: Vec2) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// z of the cross product.
pub(crate) fn cross(a: Vec2, b: Vec2) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

pub(crate) fn x(a: Vec2) -> f64 {
    a[0]
}

pub(crate) fn y(a: Vec2) -> f64 {
    a[1]
}

pub(crate) fn norm(a: Vec2) -> f64 {
    dot(a, a).sqrt()
}

pub(crate) fn distance(a: Vec2, b: Vec2) -> f64 {
    norm(subtract(a, b))
}

/// Turned anticlockwise by `angle` radians.
pub(crate) fn rotate(a: Vec2, angle: f64) -> Vec2 {
    let (sin, cos) = libm::sincos(angle);
    [a[0] * cos - a[1] * sin, a[0] * sin + a[1] * cos]
}

/// A vector over its length; (0, 0) for (0, 0).
pub(crate) fn unit(a: Vec2) -> Vec2 {
    let length = norm(a);
    if length == 0.0 { [0.0, 0.0] } else { divide(a, length) }
}

/// The lesser number; NaN if one is.
pub(crate) fn lesser(a: f64, b: f64) -> f64 {
    if a <= b || a.is_nan() { a } else { b }
}

/// The greater number; NaN if one is.
pub(crate) fn greater(a: f64, b: f64) -> f64 {
    if a >= b || a.is_nan() { a } else { b }
}

/// x, but not below `low` nor above `high` (which wins).
pub(crate) fn clamp(x: f64, low: f64, high: f64) -> f64 {
    lesser(greater(x, low), high)
}

/// Both axes clamped to the same limits.
pub(crate) fn clamp_axes(a: Vec2, (low, high): (f64, f64)) -> Vec2 {
    a.map(|x| clamp(x, low, high))
}

/// x mod y: has the sign of y.
pub(crate) fn modulo(x: f64, y: f64) -> f64 {
    let rest = libm::fmod(x, y);
    if rest * y < 0.0 { rest + y } else { rest }
}

/// −1, 0 or 1.
pub(crate) fn sign(x: f64) -> f64 {
    if x > 0.0 {
        1.0
    } else if x < 0.0 {
        -1.0
    } else {
        x
    }
}

/// x to the power y; exact for squares and square roots.
pub(crate) fn power(x: f64, y: f64) -> f64 {
    if y == 2.0 {
        x * x
    } else if y == 0.5 {
        x.sqrt()
    } else {
        libm::pow(x, y)
    }
}

/// The same angle in (−π, π].
pub(crate) fn wrap(angle: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    if angle > -PI && angle <= PI { angle } else { angle - TAU * ((angle - PI) / TAU).ceil() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn functions_keep_their_word_at_the_corners() {
        assert_eq!(modulo(-0.5, 2.0), 1.5);
        assert_eq!(modulo(7.0, 2.0), 1.0);
        assert_eq!(modulo(7.0, -2.0), -1.0);
        assert_eq!(modulo(-4.0, 2.0), 0.0);
        assert_eq!([sign(-3.0), sign(0.0), sign(9.0)], [-1.0, 0.0, 1.0]);
        assert_eq!(unit([0.0, 0.0]), [0.0, 0.0]);
        assert_eq!(unit([0.0, -2.0]), [0.0, -1.0]);
        assert_eq!([power(-3.0, 2.0), power(9.0, 0.5), power(2.0, -1.0)], [9.0, 3.0, 0.5]);
        assert_eq!(clamp(5.0, 1.0, -1.0), -1.0);
    }

    #[test]
    fn nan_is_never_lost() {
        let nan = f64::NAN;
        for x in [lesser(nan, 1.0), lesser(1.0, nan), greater(nan, 1.0), greater(1.0, nan)] {
            assert!(x.is_nan());
        }
        assert!(clamp(nan, 0.0, 1.0).is_nan() && sign(nan).is_nan() && modulo(nan, 1.0).is_nan());
        assert!(unit([nan, 0.0])[1].is_nan());
    }

    #[test]
    fn wrapped_angles_lie_in_the_half_open_turn() {
        assert_eq!(wrap(PI), PI);
        assert_eq!(wrap(-PI), PI);
        assert_eq!(wrap(1.25), 1.25);
        assert!((wrap(1.25 + 6.0 * PI) - 1.25).abs() < 1e-14);
        assert!((wrap(-9.0 * PI + 0.5) - (0.5 - PI)).abs() < 1e-14);
    }
}
