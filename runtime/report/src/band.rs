//! Bands of learning curves: the interquartile mean over seeds and its bootstrap interval, at many points.
//!
//! The resamples are drawn once and used at every point, so that a band is smooth along the curve and
//! hundreds of points cost milliseconds.

use mpgx_random::{Address, Purpose};

const RESAMPLES: usize = 1000;

/// Below this number of seeds an interval would say little; none is drawn.
pub const FEWEST_SEEDS: usize = 5;

/// Bootstrap resamples of n seeds: how often each seed is drawn.
pub struct Resamples {
    counts: Vec<Vec<u32>>,
}

/// A value and its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    pub mid: f64,
    pub interval: Option<(f64, f64)>,
}

impl Resamples {
    pub fn new(seeds: usize) -> Resamples {
        let address = Address {
            master: 0,
            purpose: Purpose::Bootstrap,
            protocol: u16::MAX,
            part: 0,
            seed: seeds as u32,
            episode: 0,
            step: 0,
        };
        let mut stream = address.stream();
        let wanted = if seeds < FEWEST_SEEDS { 0 } else { RESAMPLES };
        let mut draw = || {
            let mut counts = vec![0; seeds];
            for _ in 0..seeds {
                if let Some(count) = counts.get_mut(stream.below(seeds as u64) as usize) {
                    *count += 1;
                }
            }
            counts
        };
        Resamples { counts: (0..wanted).map(|_| draw()).collect() }
    }

    /// Interquartile mean and percentile interval of one value a seed. `None` for no values or a wrong number.
    pub fn estimate(&self, values: &[f64]) -> Option<Estimate> {
        let mut ranked: Vec<(f64, usize)> = values.iter().copied().zip(0..).collect();
        ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mid = trimmed_mean(ranked.iter().map(|&(value, _)| (value, 1)), values.len())?;
        let mut means: Vec<f64> = self
            .counts
            .iter()
            .filter(|counts| counts.len() == values.len())
            .filter_map(|counts| {
                let weighted = ranked.iter().filter_map(|&(value, seed)| Some((value, *counts.get(seed)?)));
                trimmed_mean(weighted, values.len())
            })
            .collect();
        means.sort_by(f64::total_cmp);
        let interval = percentile(&means, 0.025).zip(percentile(&means, 0.975));
        Some(Estimate { mid, interval })
    }
}

/// Mean of the middle half of n ascending values with multiplicities: ⌊n/4⌋ are dropped at each end.
fn trimmed_mean(ascending: impl Iterator<Item = (f64, u32)>, n: usize) -> Option<f64> {
    let (first, end) = (n / 4, n - n / 4);
    let (mut seen, mut sum) = (0, 0.0);
    for (value, count) in ascending {
        let next = seen + count as usize;
        let kept = next.min(end).saturating_sub(seen.max(first));
        sum += value * kept as f64;
        seen = next;
    }
    (n > 0).then(|| sum / (end - first) as f64)
}

/// Linear interpolation between the order statistics.
fn percentile(ascending: &[f64], share: f64) -> Option<f64> {
    let place = share * ascending.len().checked_sub(1)? as f64;
    let below = *ascending.get(place as usize)?;
    let above = ascending.get(place as usize + 1).copied().unwrap_or(below);
    Some(below + (above - below) * (place - place.floor()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_half_counts() {
        let few = Resamples::new(4).estimate(&[1.0, 100.0, 2.0, 3.0]);
        assert_eq!(few, Some(Estimate { mid: 2.5, interval: None }));
        assert_eq!(Resamples::new(0).estimate(&[]), None);
    }

    #[test]
    fn the_interval_holds_the_middle_and_shrinks_with_the_spread() {
        let resamples = Resamples::new(10);
        let width = |scale: f64| {
            let values: Vec<f64> = (0..10).map(|k| 5.0 + scale * f64::from(k * k % 7)).collect();
            let estimate = resamples.estimate(&values).unwrap();
            let (lo, hi) = estimate.interval.unwrap();
            assert!(lo <= estimate.mid && estimate.mid <= hi, "{estimate:?}");
            hi - lo
        };
        assert!(width(1.0) > 0.0);
        assert!((width(2.0) / width(1.0) - 2.0).abs() < 1e-9);
        assert_eq!(width(0.0), 0.0);
    }

    #[test]
    fn percentiles_lie_between_neighbours() {
        assert_eq!(percentile(&[0.0, 1.0, 2.0, 3.0], 0.5), Some(1.5));
        assert_eq!(percentile(&[], 0.5), None);
    }
}
