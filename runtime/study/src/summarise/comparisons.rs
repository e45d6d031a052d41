//! The first learner against every other method.

use mpgx_lang::plan::Plan;

use super::scores::{Sample, Scores, higher_is_better};
use super::{CONFIDENCE, ENOUGH_SEEDS, FEWEST_SEEDS, methods};
use crate::statistics::{
    Interval, TTest, bootstrap, bootstrap_two, holm, mean, probability_of_improvement, t_test, welch_test,
};
use crate::summary::Comparison;

pub(crate) const COMPARED: [&str; 2] = ["return", "error_m"];

/// Every protocol and metric in turn. `p_holm` and the verdicts allow for all of these at once.
pub(super) fn compare(plan: &Plan, scores: &Scores) -> Vec<Comparison> {
    let Some(first) = plan.learners.first() else { return Vec::new() };
    let mut comparisons = Vec::new();
    for protocol in &plan.protocols {
        for metric in COMPARED {
            for other in methods(plan).filter(|method| method.label != first.label) {
                let sample = |label| scores.get(&protocol.name, metric, label);
                if let (Some(a), Some(b)) = (sample(&first.label), sample(&other.label)) {
                    let place = (protocol.name.as_str(), metric);
                    let difference = Difference::paired(a, b);
                    comparisons.extend(contrast(place, higher_is_better(metric), (a, b), difference));
                }
            }
        }
    }
    adjust(comparisons.iter_mut().collect(), higher_is_better);
    comparisons
}

/// a − b, seed by seed; against a controller, each seed minus its one value.
pub(super) fn differences(a: &Sample, b: &Sample) -> Vec<f64> {
    let score = |sample: &Sample, seed: u32| {
        let place = if sample.learned { sample.seeds.iter().position(|other| *other == seed)? } else { 0 };
        sample.scores.get(place).copied()
    };
    let seeds = if a.learned { &a.seeds } else { &b.seeds };
    seeds.iter().filter_map(|seed| Some(score(a, *seed)? - score(b, *seed)?)).collect()
}

/// How far two means are apart.
pub(crate) struct Difference {
    value: f64,
    interval: Option<Interval>,
    test: Option<TTest>,
    seeds: usize,
}

impl Difference {
    /// Seed by seed.
    pub fn paired(a: &Sample, b: &Sample) -> Difference {
        let differences = differences(a, b);
        Difference {
            value: mean(&differences),
            interval: bootstrap(&differences, CONFIDENCE, mean),
            test: if b.learned { welch_test(&a.scores, &b.scores) } else { t_test(&differences, 0.0) },
            seeds: differences.len(),
        }
    }

    /// Of samples that have no seeds in common.
    pub fn independent(a: &Sample, b: &Sample) -> Difference {
        let difference = |x: &[f64], y: &[f64]| mean(x) - mean(y);
        Difference {
            value: difference(&a.scores, &b.scores),
            interval: bootstrap_two(&a.scores, &b.scores, CONFIDENCE, difference),
            test: welch_test(&a.scores, &b.scores),
            seeds: a.scores.len().min(b.scores.len()),
        }
    }
}

/// One comparison; its verdict speaks of the number of seeds only. `None` if no seed is common to both.
pub(crate) fn contrast(
    (protocol, metric): (&str, &str),
    higher_is_better: bool,
    (a, b): (&Sample, &Sample),
    difference: Difference,
) -> Option<Comparison> {
    let improvement = |x: &[f64], y: &[f64]| {
        if higher_is_better { probability_of_improvement(x, y) } else { probability_of_improvement(y, x) }
    };
    let judged = difference.seeds >= FEWEST_SEEDS;
    let interval = difference.interval.filter(|_| judged);
    let chance = judged.then(|| bootstrap_two(&a.scores, &b.scores, CONFIDENCE, improvement)).flatten();
    let verdict = match difference.seeds {
        0..FEWEST_SEEDS => "too few seeds",
        FEWEST_SEEDS..ENOUGH_SEEDS => "exploratory",
        _ => "no difference shown",
    };
    difference.value.is_finite().then(|| Comparison {
        protocol: protocol.to_string(),
        metric: metric.to_string(),
        a: a.method.clone(),
        b: b.method.clone(),
        difference: difference.value,
        lo: interval.map(|interval| interval.lo),
        hi: interval.map(|interval| interval.hi),
        probability_of_improvement: improvement(&a.scores, &b.scores),
        probability_lo: chance.map(|interval| interval.lo),
        probability_hi: chance.map(|interval| interval.hi),
        p: difference.test.filter(|_| judged).map(|test| test.p),
        p_holm: None,
        verdict: verdict.to_string(),
    })
}

/// Holm's adjustment over all comparisons, and the words better and worse where they are earned.
pub(crate) fn adjust(comparisons: Vec<&mut Comparison>, higher_is_better: impl Fn(&str) -> bool) {
    let tested: Vec<f64> = comparisons.iter().filter_map(|comparison| comparison.p).collect();
    let mut adjusted = holm(&tested).into_iter();
    for comparison in comparisons {
        comparison.p_holm = comparison.p.and_then(|_| adjusted.next());
        let sure = comparison.p_holm.is_some_and(|p| p < 1.0 - CONFIDENCE);
        let (Some(lo), Some(hi)) = (comparison.lo, comparison.hi) else { continue };
        if comparison.verdict == "no difference shown" && sure && (lo > 0.0 || hi < 0.0) {
            let better = (lo > 0.0) == higher_is_better(&comparison.metric);
            comparison.verdict = if better { "better" } else { "worse" }.to_string();
        }
    }
}
