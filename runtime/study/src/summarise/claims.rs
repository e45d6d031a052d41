//! Claims decided, with the reason in plain words.
//!
//! Each claim was written before the run and stands for itself: its interval has its own confidence and is not
//! adjusted for the other claims.

use mpgx_lang::plan::{Claim, ClaimKind};

use super::comparisons::differences;
use super::scores::{Sample, Scores, higher_is_better};
use super::words::{name, percent, quantity, seeds};
use super::{ENOUGH_SEEDS, FEWEST_SEEDS};
use crate::statistics::{Interval, bootstrap, iqm, mean};
use crate::summary::ClaimResult;

/// A claim that cannot be decided does not hold.
pub(super) fn decide(claim: &Claim, scores: &Scores) -> ClaimResult {
    let (holds, because) = match &claim.kind {
        ClaimKind::Bound { protocol, metric, method, below, bound, confidence } => {
            match scores.get(protocol, metric, method) {
                Some(sample) => decide_bound(sample, metric, *below, *bound, *confidence),
                None => (false, unmeasured(protocol, metric, method)),
            }
        }
        ClaimKind::Beats { better, worse, protocol, metric, confidence } => {
            match (scores.get(protocol, metric, better), scores.get(protocol, metric, worse)) {
                (Some(a), Some(b)) => decide_beats(a, b, metric, *confidence),
                (None, _) => (false, unmeasured(protocol, metric, better)),
                (_, None) => (false, unmeasured(protocol, metric, worse)),
            }
        }
    };
    let at = format!("{}:{}:{}", claim.at.file, claim.at.line, claim.at.column);
    ClaimResult { text: claim.text.clone(), at, holds, because }
}

/// The interval of the interquartile mean lies on one side of the bound; of a controller, its value.
fn decide_bound(sample: &Sample, metric: &str, below: bool, bound: f64, confidence: f64) -> (bool, String) {
    let value = iqm(&sample.scores);
    let measured = format!("{} of {} is {}", name(metric), sample.method, quantity(value, metric));
    let within = |lo: f64, hi: f64| if below { hi < bound } else { lo > bound };
    let side = format!("{} {}", if below { "below" } else { "above" }, quantity(bound, metric));
    if !sample.learned {
        let holds = within(value, value);
        return (holds, format!("{measured}, {}{side}", if holds { "" } else { "not " }));
    }
    let Some(interval) = interval(&sample.scores, confidence, iqm) else {
        return (false, format!("{measured} over {}; an interval needs {FEWEST_SEEDS}", seeds(sample)));
    };
    let holds = within(interval.lo, interval.hi);
    let reach = shown(interval, confidence, metric);
    let verdict = if holds { "all of it" } else { "not all of it" };
    (holds, format!("{measured} (interquartile mean over {}), {reach}, {verdict} {side}", seeds(sample)))
}

/// The interval of the mean difference excludes 0 on the better side, over enough seeds; of two controllers,
/// their values decide.
fn decide_beats(a: &Sample, b: &Sample, metric: &str, confidence: f64) -> (bool, String) {
    let sign = if higher_is_better(metric) { 1.0 } else { -1.0 };
    let advantages: Vec<f64> = differences(a, b).iter().map(|difference| sign * difference).collect();
    let advantage = mean(&advantages);
    let measured = format!(
        "{} is ahead of {} by {} on {}",
        a.method,
        b.method,
        quantity(advantage, metric),
        name(metric)
    );
    let learned = match (a.learned, b.learned) {
        (true, _) => a,
        (_, true) => b,
        (false, false) => return (advantage > 0.0, measured),
    };
    let measured = format!("{measured} (mean over {})", seeds(learned));
    let Some(interval) = interval(&advantages, confidence, mean) else {
        return (false, format!("{measured}; a comparison needs {ENOUGH_SEEDS} seeds"));
    };
    let ahead = interval.lo > 0.0;
    let enough = advantages.len() >= ENOUGH_SEEDS;
    let reach = shown(interval, confidence, metric);
    let verdict = if ahead { "all of it" } else { "not all of it" };
    let caution =
        if enough { String::new() } else { format!("; exploratory: \"better\" needs {ENOUGH_SEEDS} seeds") };
    (ahead && enough, format!("{measured}, {reach}, {verdict} above 0{caution}"))
}

/// `None` below [`FEWEST_SEEDS`] values.
fn interval(x: &[f64], confidence: f64, statistic: fn(&[f64]) -> f64) -> Option<Interval> {
    if x.len() < FEWEST_SEEDS { None } else { bootstrap(x, confidence, statistic) }
}

fn shown(interval: Interval, confidence: f64, metric: &str) -> String {
    let (lo, hi) = (quantity(interval.lo, metric), quantity(interval.hi, metric));
    format!("{} interval {lo} to {hi}", percent(confidence))
}

fn unmeasured(protocol: &str, metric: &str, method: &str) -> String {
    format!("{} of {method} was not measured under {protocol}", name(metric))
}
