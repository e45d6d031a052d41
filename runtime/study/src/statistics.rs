//! Statistics over seeds: plain functions of slices, the same bits on every machine.
//!
//! The seed is the unit, never the episode. Transcendental functions come from `libm`, sums run in the order
//! of the slice, and resamples are drawn by address. Fixtures from rliable, SciPy, statsmodels and NumPy hold
//! each function to 1e-12.

mod bootstrap;
mod location;
mod multiple;
mod profile;
mod rank;
mod student;
mod t_test;
mod tolerance;

pub use bootstrap::{RESAMPLES, bootstrap, bootstrap_two};
pub use location::{iqm, mean, quantile, variance};
pub use multiple::holm;
pub use profile::{performance_profile, profile_band};
pub use rank::probability_of_improvement;
pub use student::{critical_value, two_sided_p};
pub use t_test::{TTest, t_interval, t_test, welch_test};
pub use tolerance::{Tolerance, tolerance};

/// A confidence interval, both ends finite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    pub lo: f64,
    pub hi: f64,
}

impl Interval {
    /// `None` unless both ends are finite.
    fn finite(lo: f64, hi: f64) -> Option<Interval> {
        (lo.is_finite() && hi.is_finite()).then_some(Interval { lo, hi })
    }
}

/// Whether `confidence` is a probability strictly between 0 and 1.
fn proper(confidence: f64) -> bool {
    confidence > 0.0 && confidence < 1.0
}
