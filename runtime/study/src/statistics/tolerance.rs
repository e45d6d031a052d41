//! Between which values most seeds lie, not only those that were run.

use super::proper;

/// Between `lo` and `hi` lies at least `share` of all that could be drawn, with the confidence asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    pub lo: f64,
    pub hi: f64,
    pub share: f64,
}

/// Tolerance interval without any assumption about the distribution (Wilks 1941): the r-th smallest and r-th
/// largest value, r as large as `share` and `confidence` allow. A sample too small for `share` gives its whole
/// range, and the smaller share that this covers. `None` below two values, of a value that is not finite, or
/// if `share` or `confidence` is outside (0, 1).
///
/// What lies between two order statistics has a beta distribution, so that these cover at least p unless a
/// binomial variable of n trials with chance 1 − p stays below 2r.
pub fn tolerance(x: &[f64], share: f64, confidence: f64) -> Option<Tolerance> {
    let n = x.len();
    if n < 2 || !proper(share) || !proper(confidence) || !x.iter().all(|value| value.is_finite()) {
        return None;
    }
    let doubt = 1.0 - confidence;
    let covers = |r: usize, share: f64| fewer(2 * r, n, 1.0 - share) <= doubt;
    let rank = (1..=n / 2).take_while(|r| covers(*r, share)).last();
    let share = if rank.is_some() { share } else { largest(|share| covers(1, share)) };
    let mut sorted = x.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let rank = rank.unwrap_or(1);
    Some(Tolerance { lo: *sorted.get(rank - 1)?, hi: *sorted.get(n - rank)?, share })
}

/// P(X < k) of a binomial X of n trials with chance q; 0 < k ≤ n.
fn fewer(k: usize, n: usize, q: f64) -> f64 {
    let odds = libm::log(q) - libm::log1p(-q);
    let mut log_term = n as f64 * libm::log1p(-q);
    let mut sum = libm::exp(log_term);
    for j in 1..k {
        log_term += odds + libm::log((n - j + 1) as f64 / j as f64);
        sum += libm::exp(log_term);
    }
    sum
}

/// The largest number in (0, 1) that passes a test which small numbers pass and large ones do not.
fn largest(passes: impl Fn(f64) -> bool) -> f64 {
    let (mut lo, mut hi) = (0.0, 1.0);
    loop {
        let middle = lo + (hi - lo) / 2.0;
        if middle <= lo || middle >= hi {
            return lo;
        }
        if passes(middle) {
            lo = middle;
        } else {
            hi = middle;
        }
    }
}
