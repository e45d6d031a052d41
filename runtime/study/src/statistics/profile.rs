//! Performance profiles.

/// F(τ): the share of the sample above each threshold; NaN of an empty sample.
pub fn performance_profile(x: &[f64], thresholds: &[f64]) -> Vec<f64> {
    let above = |tau: &f64| x.iter().filter(|value| *value > tau).count() as f64 / x.len() as f64;
    thresholds.iter().map(above).collect()
}
