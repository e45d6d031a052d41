//! Columns of training on one grid of steps, so that seeds can be averaged: episodes end where they like.

use serde::Serialize;

/// Most points of a curve.
const POINTS: usize = 1000;
/// The box filter averages over this share of training.
const WINDOW: f64 = 0.05;
/// The paper's box filter, episodes; offered where training has twice as many.
const EPISODES: f64 = 200.0;

/// Equal bins of steps, each long enough to see the end of an episode.
pub struct Grid {
    pub last: u64,
    pub bins: usize,
    /// The first is shown.
    pub filters: Vec<Filter>,
}

/// A box filter: the mean of the last `window` bins.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Filter {
    pub name: &'static str,
    pub window: usize,
}

/// The filters on `bins` of a training of so many episodes.
fn filters(bins: usize, episodes: f64) -> Vec<Filter> {
    let over = |share: f64| ((bins as f64 * share).round() as usize).max(1);
    let mut filters = vec![Filter { name: "box filter 5\u{a0}%", window: over(WINDOW) }];
    if episodes >= 2.0 * EPISODES {
        filters.push(Filter { name: "box filter 200", window: over(EPISODES / episodes) });
    }
    filters.push(Filter { name: "raw", window: 1 });
    filters
}

impl Grid {
    /// `most`: of bins, from the number of filters.
    pub fn new(last: u64, horizon: usize, episodes: f64, most: impl Fn(usize) -> usize) -> Grid {
        let most = most(filters(2, episodes).len()).clamp(2, POINTS);
        let bins = (last / horizon.max(1) as u64).clamp(2, most as u64) as usize;
        Grid { last, bins, filters: filters(bins, episodes) }
    }

    /// The steps at the end of each bin.
    pub fn steps(&self) -> Vec<u64> {
        let end = |bin| u128::from(self.last) * bin as u128 / self.bins as u128;
        (1..=self.bins).map(|bin| end(bin) as u64).collect()
    }

    /// Mean of the episodes that end in each bin, empty bins from their neighbours; nothing after the last episode.
    pub fn resample(&self, steps: &[u64], column: &[f64]) -> Vec<Option<f64>> {
        let mut sums = vec![(0.0, 0.0); self.bins];
        for (step, value) in steps.iter().zip(column).filter(|(_, value)| value.is_finite()) {
            let bin = (step.saturating_sub(1) as usize).saturating_mul(self.bins) / self.last as usize;
            if let Some((sum, count)) = sums.get_mut(bin) {
                *sum += value;
                *count += 1.0;
            }
        }
        let seen: Vec<(usize, f64)> =
            sums.iter().enumerate().filter(|(_, s)| s.1 > 0.0).map(|(bin, s)| (bin, s.0 / s.1)).collect();
        (0..self.bins)
            .map(|bin| {
                let after = seen.partition_point(|&(other, _)| other < bin);
                let (right, right_value) = *seen.get(after)?;
                let (left, left_value) = *seen.get(after.wrapping_sub(1)).unwrap_or(&(right, right_value));
                let share = (bin as f64 - left as f64) / ((right - left) as f64).max(1.0);
                Some(if right == bin { right_value } else { left_value + share * (right_value - left_value) })
            })
            .collect()
    }

    /// The box filter over `window` bins.
    pub fn smooth(&self, values: &[Option<f64>], window: usize) -> Vec<Option<f64>> {
        let mean = |bin: usize| {
            let known = values.get((bin + 1).saturating_sub(window)..=bin)?.iter().flatten();
            let (sum, count) = known.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
            values.get(bin).copied().flatten().map(|_| sum / count)
        };
        (0..values.len()).map(mean).collect()
    }

    /// The end of a bin as a share of training.
    pub fn place(&self, bin: usize) -> f64 {
        (bin + 1) as f64 / self.bins as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn empty_bins_take_the_line_between_their_neighbours() {
        let grid = Grid { last: 100, bins: 5, filters: vec![] };
        assert_eq!(grid.steps(), [20, 40, 60, 80, 100]);
        let values = grid.resample(&[10, 20, 70], &[1.0, 3.0, 8.0]);
        assert_eq!(values, [Some(2.0), Some(4.0), Some(6.0), Some(8.0), None]);
        assert_eq!(grid.smooth(&values, 2), [Some(2.0), Some(3.0), Some(5.0), Some(7.0), None]);
    }

    #[test]
    fn the_papers_filter_needs_a_long_training() {
        let windows = |episodes: f64| {
            let grid = Grid::new(200_000, 200, episodes, |_| 500);
            grid.filters.iter().map(|filter| filter.window).collect::<Vec<_>>()
        };
        assert_eq!(windows(399.0), [25, 1]);
        assert_eq!(windows(1000.0), [25, 100, 1]);
    }

    #[test]
    fn values_that_are_not_numbers_leave_no_trace() {
        let grid = Grid { last: 40, bins: 2, filters: vec![] };
        assert_eq!(grid.resample(&[20, 40], &[f64::NAN, 5.0]), [Some(5.0), Some(5.0)]);
        assert_eq!(grid.resample(&[], &[]), [None, None]);
    }
}
