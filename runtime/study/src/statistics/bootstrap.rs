//! Percentile bootstrap over seeds.

use mpgx_random::{Address, Purpose, Stream};

use super::{Interval, location::quantile, proper};

/// Resamples behind each interval.
pub const RESAMPLES: usize = 2000;

/// Percentile interval of `statistic` over [`RESAMPLES`] resamples of `x` with replacement. `None` of an
/// empty sample, of a confidence outside (0, 1), or if an end is not finite.
///
/// Samples of one size meet the same resamples, so intervals of paired quantities hang together.
pub fn bootstrap(x: &[f64], confidence: f64, statistic: impl Fn(&[f64]) -> f64) -> Option<Interval> {
    let mut sample = Resampler::new(x, 0)?;
    percentile((0..RESAMPLES).map(|_| statistic(sample.draw())).collect(), confidence)
}

/// As [`bootstrap`], of a statistic of two samples that are drawn independently of each other.
pub fn bootstrap_two(
    x: &[f64],
    y: &[f64],
    confidence: f64,
    statistic: impl Fn(&[f64], &[f64]) -> f64,
) -> Option<Interval> {
    let mut first = Resampler::new(x, 0)?;
    let mut second = Resampler::new(y, 1)?;
    percentile((0..RESAMPLES).map(|_| statistic(first.draw(), second.draw())).collect(), confidence)
}

/// Shows each of the resamples that [`bootstrap`] draws; none of an empty sample.
pub(super) fn resampled(x: &[f64], mut show: impl FnMut(&mut [f64])) {
    if let Some(mut sample) = Resampler::new(x, 0) {
        (0..RESAMPLES).for_each(|_| show(sample.draw()));
    }
}

/// Draws from a sample that is not empty.
struct Resampler<'a> {
    from: &'a [f64],
    drawn: Vec<f64>,
    stream: Stream,
}

impl<'a> Resampler<'a> {
    fn new(from: &'a [f64], part: u16) -> Option<Self> {
        let address = Address {
            master: 0,
            purpose: Purpose::Bootstrap,
            protocol: 0,
            part,
            seed: 0,
            episode: 0,
            step: 0,
        };
        (!from.is_empty()).then(|| Resampler { from, drawn: from.to_vec(), stream: address.stream() })
    }

    fn draw(&mut self) -> &mut [f64] {
        for place in &mut self.drawn {
            *place = self.from[self.stream.below(self.from.len() as u64) as usize];
        }
        &mut self.drawn
    }
}

fn percentile(mut estimates: Vec<f64>, confidence: f64) -> Option<Interval> {
    if !proper(confidence) || estimates.iter().any(|estimate| estimate.is_nan()) {
        return None;
    }
    estimates.sort_unstable_by(f64::total_cmp);
    let tail = (1.0 - confidence) / 2.0;
    Interval::finite(quantile(&estimates, tail)?, quantile(&estimates, 1.0 - tail)?)
}
