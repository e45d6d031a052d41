//! Measuring this machine: what `mpgx bench` runs, one file a part.

pub mod compiler;
pub mod environment;
pub mod kernels;
pub mod learners;
mod stopwatch;
pub mod tracking;
pub mod training;

use mpgx_learn::measure::{self, Limits, Shape};

pub use stopwatch::Windows;

use stopwatch::seconds_a_run;

/// One figure: the median of several windows.
pub struct Figure {
    pub what: String,
    pub value: f64,
    pub unit: &'static str,
    /// Share of what the machine could do at most.
    pub share: Option<f64>,
}

impl Figure {
    pub fn new(what: impl Into<String>, value: f64, unit: &'static str) -> Self {
        Figure { what: what.into(), value, unit, share: None }
    }
}

/// What one core does at most, measured now with arrays as large as this learner's.
pub fn limits(windows: Windows, shape: &Shape) -> Limits {
    let [flops, read, moved] = measure::machine(shape).map(|mut kernel| {
        let work = kernel.work;
        let seconds = seconds_a_run(windows, &mut kernel.run);
        (work.flops / seconds, work.read / seconds, (work.read + work.written) / seconds)
    });
    Limits { flops_per_s: flops.0, read_bytes_per_s: read.1, bytes_per_s: moved.2 }
}
