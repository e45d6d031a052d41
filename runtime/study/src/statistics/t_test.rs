//! Means compared by Student's t.

use super::{Interval, critical_value, mean, two_sided_p, variance};

/// A two-sided test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TTest {
    /// Infinite if the means differ and nothing spreads; 0 if they are equal and nothing spreads.
    pub statistic: f64,
    pub df: f64,
    pub p: f64,
}

/// t interval of the mean. `None` below two values or for a confidence outside (0, 1).
pub fn t_interval(x: &[f64], confidence: f64) -> Option<Interval> {
    let n = x.len() as f64;
    let half = critical_value(confidence, n - 1.0) * libm::sqrt(variance(x) / n);
    Interval::finite(mean(x) - half, mean(x) + half)
}

/// Whether the mean differs from a known value (one sample). `None` below two values.
pub fn t_test(x: &[f64], expected: f64) -> Option<TTest> {
    let n = x.len() as f64;
    decide(mean(x) - expected, variance(x) / n, n - 1.0)
}

/// Whether two means differ, variances unequal (Welch 1947; degrees of freedom after Satterthwaite). `None`
/// if a sample has fewer than two values.
pub fn welch_test(x: &[f64], y: &[f64]) -> Option<TTest> {
    let (n_x, n_y) = (x.len() as f64, y.len() as f64);
    let (v_x, v_y) = (variance(x) / n_x, variance(y) / n_y);
    let total = v_x + v_y;
    let df = if total == 0.0 {
        n_x + n_y - 2.0
    } else {
        let (share_x, share_y) = (v_x / total, v_y / total);
        1.0 / (share_x * share_x / (n_x - 1.0) + share_y * share_y / (n_y - 1.0))
    };
    decide(mean(x) - mean(y), total, df)
}

/// The test of a difference with this squared standard error.
fn decide(difference: f64, squared_error: f64, df: f64) -> Option<TTest> {
    let statistic =
        if difference == 0.0 && squared_error == 0.0 { 0.0 } else { difference / libm::sqrt(squared_error) };
    let p = two_sided_p(statistic, df);
    p.is_finite().then_some(TTest { statistic, df, p })
}
