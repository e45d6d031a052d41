//! The table at the end of a run.

use std::fmt::Write;

use mpgx_study::summary::{Statistic, Summary};

/// Results by protocol, a line a method, then comparisons, claims and failures.
pub fn results(summary: &Summary) -> String {
    let mut out = String::new();
    for (protocol, methods) in &summary.protocols {
        let width = methods.keys().map(|label| label.chars().count()).max().unwrap_or(0).max(6);
        let _ = writeln!(
            out,
            "\n{protocol:<width$}  {:>24}  {:>9}  {:>9}  {:>10}",
            "return [95 %]", "error", "× oracle", "collisions"
        );
        for (label, metrics) in methods {
            let cell = |name: &str, show: &dyn Fn(&Statistic) -> String| {
                metrics.get(name).map_or("–".to_string(), show)
            };
            let _ = writeln!(
                out,
                "{label:<width$}  {:>24}  {:>9}  {:>9}  {:>10}",
                cell("return", &interval),
                cell("error_m", &|error| format!("{:.1} mm", 1000.0 * error.iqm)),
                cell("error_over_oracle", &|ratio| format!("{:.3}", ratio.iqm)),
                cell("collision_episodes", &|share| format!("{:.1} %", 100.0 * share.mean)),
            );
        }
    }
    if !summary.comparisons.is_empty() {
        out += "\n";
    }
    for comparison in &summary.comparisons {
        let _ = writeln!(
            out,
            "{}: {} against {} on {}: {:+.4}{}  {}",
            comparison.protocol,
            comparison.a,
            comparison.b,
            comparison.metric,
            comparison.difference,
            match (comparison.lo, comparison.hi) {
                (Some(lo), Some(hi)) => format!(" [{lo:+.4}, {hi:+.4}]"),
                _ => String::new(),
            },
            comparison.verdict,
        );
    }
    for claim in &summary.expect {
        let _ =
            writeln!(out, "\n{} {}\n  {}", if claim.holds { "✓" } else { "✗" }, claim.text, claim.because);
    }
    for failure in &summary.failures {
        let _ = writeln!(
            out,
            "\n✗ {} seed {} failed at step {}: {} ({})",
            failure.algorithm, failure.seed, failure.step, failure.cause, failure.at
        );
    }
    out
}

fn interval(statistic: &Statistic) -> String {
    match (statistic.lo, statistic.hi) {
        (Some(lo), Some(hi)) => format!("{:.3} [{lo:.3}, {hi:.3}]", statistic.iqm),
        _ => format!("{:.3}", statistic.iqm),
    }
}
