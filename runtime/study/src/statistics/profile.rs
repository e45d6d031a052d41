//! Performance profiles.

use super::bootstrap::resampled;
use super::{Interval, location::quantile, proper};

/// F(τ): the share of the sample above each threshold; NaN of an empty sample. (Agarwal et al., "Deep RL at
/// the edge of the statistical precipice", 2021.)
pub fn performance_profile(x: &[f64], thresholds: &[f64]) -> Vec<f64> {
    let mut sorted = x.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    shares_above(&sorted, thresholds).collect()
}

/// Percentile interval of F at each threshold, over the resamples of [`super::bootstrap`], the same ones at
/// every threshold; as in rliable it holds threshold by threshold. `None` of an empty sample or of a
/// confidence outside (0, 1).
pub fn profile_band(x: &[f64], thresholds: &[f64], confidence: f64) -> Option<Vec<Interval>> {
    if !proper(confidence) {
        return None;
    }
    let mut at_threshold = vec![Vec::new(); thresholds.len()];
    resampled(x, |drawn| {
        drawn.sort_unstable_by(f64::total_cmp);
        for (shares, share) in at_threshold.iter_mut().zip(shares_above(drawn, thresholds)) {
            shares.push(share);
        }
    });
    let tail = (1.0 - confidence) / 2.0;
    let interval = |shares: &mut Vec<f64>| {
        shares.sort_unstable_by(f64::total_cmp);
        Interval::finite(quantile(shares, tail)?, quantile(shares, 1.0 - tail)?)
    };
    at_threshold.iter_mut().map(interval).collect()
}

fn shares_above(ascending: &[f64], thresholds: &[f64]) -> impl Iterator<Item = f64> {
    let n = ascending.len();
    thresholds.iter().map(move |tau| (n - ascending.partition_point(|value| value <= tau)) as f64 / n as f64)
}
