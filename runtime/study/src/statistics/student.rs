//! Student's t distribution, through the regularised incomplete beta function.

use std::f64::consts::PI;

use super::proper;

/// P(|T| ≥ |t|) with `df` > 0 degrees of freedom; 0 where t² overflows.
///
/// It is I_x(df/2, 1/2) at x = df/(df + t²), by the continued fraction of Numerical Recipes 6.4 on the side
/// where that converges fast.
pub fn two_sided_p(t: f64, df: f64) -> f64 {
    let square = t * t;
    if square.is_infinite() {
        return 0.0;
    }
    let (a, b) = (df / 2.0, 0.5);
    let (x, complement) = (df / (df + square), square / (df + square));
    // x^a (1 − x)^b / B(a, b)
    let front =
        libm::exp(-a * libm::log1p(square / df)) * libm::sqrt(complement) * gamma_ratio(a) / libm::sqrt(PI);
    if x < (a + 1.0) / (a + b + 2.0) {
        front * continued_fraction(a, b, x) / a
    } else {
        1.0 - front * continued_fraction(b, a, complement) / b
    }
}

/// The t with P(|T| ≤ t) = `confidence`; NaN if that is outside (0, 1) or `df` is not positive.
pub fn critical_value(confidence: f64, df: f64) -> f64 {
    if !proper(confidence) || df.is_nan() || df <= 0.0 {
        return f64::NAN;
    }
    let above = |t: f64| two_sided_p(t, df) < 1.0 - confidence;
    let mut hi = 1.0;
    while !above(hi) {
        hi *= 2.0;
    }
    let mut lo = 0.0;
    loop {
        let middle = lo + (hi - lo) / 2.0;
        if middle <= lo || middle >= hi {
            return middle;
        }
        if above(middle) {
            hi = middle;
        } else {
            lo = middle;
        }
    }
}

/// Γ(a + ½)/Γ(a): the asymptotic series (Tricomi and Erdélyi 1951) at a + 20, and down from there by
/// Γ(x + 1) = x Γ(x).
fn gamma_ratio(a: f64) -> f64 {
    /// Of Γ(n + ½)/(Γ(n) √n) in powers of 1/n.
    const SERIES: [f64; 9] = [
        1.0,
        -1.0 / 8.0,
        1.0 / 128.0,
        5.0 / 1024.0,
        -21.0 / 32768.0,
        -399.0 / 262144.0,
        869.0 / 4194304.0,
        39325.0 / 33554432.0,
        -334477.0 / 2147483648.0,
    ];
    const STEPS: i32 = 20;
    let large = a + f64::from(STEPS);
    let r = 1.0 / large;
    let series = SERIES.iter().rev().fold(0.0, |sum, coefficient| sum * r + coefficient);
    (0..STEPS).fold(libm::sqrt(large) * series, |ratio, step| {
        let x = a + f64::from(step);
        ratio * x / (x + 0.5)
    })
}

/// The continued fraction of I_x(a, b), by Lentz's method.
fn continued_fraction(a: f64, b: f64, x: f64) -> f64 {
    const TINY: f64 = 1e-300;
    const MOST: u32 = 20_000;
    let guarded = |value: f64| if value.abs() < TINY { TINY } else { value };
    let mut c = 1.0;
    let mut d = 1.0 / guarded(1.0 - (a + b) * x / (a + 1.0));
    let mut fraction = d;
    for m in 1..MOST {
        let m = f64::from(m);
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        let before = fraction;
        for coefficient in [even, odd] {
            d = 1.0 / guarded(1.0 + coefficient * d);
            c = guarded(1.0 + coefficient / c);
            fraction *= c * d;
        }
        if (fraction - before).abs() <= f64::EPSILON * fraction.abs() {
            break;
        }
    }
    fraction
}
