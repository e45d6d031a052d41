//! Time of a compilation, the standard library included.

use super::Figure;
use super::stopwatch::{Windows, seconds_a_run};
use crate::scenario;

/// Every scenario that comes with mpgx.
pub fn figures(windows: Windows) -> Vec<Figure> {
    let one = |&(name, text): &(&str, &str)| {
        let seconds = seconds_a_run(windows, || {
            std::hint::black_box(scenario::compile(name, &[]).ok());
        });
        Figure::new(format!("{name}, {} lines", text.lines().count()), seconds * 1e3, "ms")
    };
    scenario::EMBEDDED.iter().map(one).collect()
}
