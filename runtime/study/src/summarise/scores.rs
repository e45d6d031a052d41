//! What each seed of each method scored on each metric under each protocol.

use std::collections::BTreeMap;

use mpgx_lang::plan::{Plan, Protocol};

use super::{methods, records_of};
use crate::record::{CellRecord, Evaluation, Told};
use crate::statistics::mean;

/// All samples of a study.
pub(crate) struct Scores(Vec<Measured>);

/// One metric under one protocol.
struct Measured {
    protocol: String,
    metric: String,
    /// Methods in the Plan's order.
    samples: Vec<Sample>,
}

/// One method on one metric under one protocol: one entry a seed, by seed.
#[derive(Clone)]
pub(crate) struct Sample {
    pub method: String,
    /// False for a controller, which has one value and no seeds.
    pub learned: bool,
    pub seeds: Vec<u32>,
    /// `None`: the seed failed or its value is not finite.
    pub measured: Vec<Option<f64>>,
    /// The same with the worst score of all methods in place of `None`.
    pub scores: Vec<f64>,
}

/// Returns and reward terms are the better the higher; errors and shares the lower.
pub(crate) fn higher_is_better(metric: &str) -> bool {
    metric == "return" || metric.starts_with("reward/")
}

impl Scores {
    pub fn measure(plan: &Plan, records: &BTreeMap<String, CellRecord>) -> Scores {
        let of_protocol = |protocol| {
            metrics(plan, protocol, records).into_iter().filter_map(move |(metric, value)| {
                let samples = samples(plan, protocol, records, &metric, &value)?;
                Some(Measured { protocol: protocol.name.clone(), metric, samples })
            })
        };
        Scores(plan.protocols.iter().flat_map(of_protocol).collect())
    }

    /// Protocol, metric and sample of everything measured.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &str, &Sample)> {
        self.0.iter().flat_map(|measured| {
            measured
                .samples
                .iter()
                .map(|sample| (measured.protocol.as_str(), measured.metric.as_str(), sample))
        })
    }

    pub fn get(&self, protocol: &str, metric: &str, method: &str) -> Option<&Sample> {
        self.iter()
            .find(|(p, m, sample)| *p == protocol && *m == metric && sample.method == method)
            .map(|(_, _, sample)| sample)
    }
}

type Value = Box<dyn Fn(&Evaluation) -> f64>;

/// Every metric's name and its value for one seed.
fn metrics(plan: &Plan, protocol: &Protocol, records: &BTreeMap<String, CellRecord>) -> Vec<(String, Value)> {
    let mut metrics: Vec<(String, Value)> = vec![
        ("return".into(), Box::new(|held_out| mean(&held_out.returns))),
        ("error_m".into(), Box::new(|held_out| mean(&held_out.error_m))),
        ("collision_episodes".into(), Box::new(|held_out| share(&held_out.collision_steps))),
        ("late_collision_episodes".into(), Box::new(|held_out| share(&held_out.late_collision_steps))),
        ("outside_episodes".into(), Box::new(|held_out| share(&held_out.outside_steps))),
    ];
    let oracle = plan.controllers.iter().find(|controller| controller.what.name == "oracle");
    let oracle = oracle.and_then(|oracle| records_of(oracle, records).first()?.protocols.get(&protocol.name));
    if let Some(of_oracle) = oracle.map(|held_out| mean(&held_out.error_m)) {
        metrics.push((
            "error_over_oracle".into(),
            Box::new(move |held_out| mean(&held_out.error_m) / of_oracle),
        ));
    }
    let world = protocol.world.as_deref().unwrap_or(&plan.world);
    if world.groups.iter().any(|group| group.solid.is_some()) {
        metrics.push(("hit_episodes".into(), Box::new(|held_out| share(&held_out.hit_steps))));
        metrics.push(("late_hit_episodes".into(), Box::new(|held_out| share(&held_out.late_hit_steps))));
    }
    if !world.localised.is_empty() {
        let of = |column: fn(&Told) -> &Vec<f64>| -> Value {
            Box::new(move |held_out| held_out.told.as_ref().map_or(f64::NAN, |told| mean(column(told))))
        };
        metrics.push(("position_error_m".into(), of(|told| &told.position_error_m)));
        metrics.push(("heading_error_rad".into(), of(|told| &told.heading_error_rad)));
    }
    for (k, term) in world.reward.iter().enumerate() {
        let sum_of_term = move |terms: &Vec<f64>| terms.get(k).copied().unwrap_or(f64::NAN);
        metrics.push((
            format!("reward/{}", term.name),
            Box::new(move |held_out| mean(&held_out.terms.iter().map(sum_of_term).collect::<Vec<_>>())),
        ));
    }
    metrics
}

/// Whether a metric is of what localisers tell.
fn told(metric: &str) -> bool {
    ["position_error_m", "heading_error_rad"].contains(&metric)
}

/// Share of the episodes in which a step was counted.
fn share(steps: &[u32]) -> f64 {
    steps.iter().filter(|count| **count > 0).count() as f64 / steps.len() as f64
}

/// `None` if no seed of any method has a value.
fn samples(
    plan: &Plan,
    protocol: &Protocol,
    records: &BTreeMap<String, CellRecord>,
    metric: &str,
    value: &Value,
) -> Option<Vec<Sample>> {
    let mut samples: Vec<Sample> = Vec::new();
    for method in methods(plan) {
        let of = records_of(method, records);
        if of.is_empty() {
            continue;
        }
        let held_out = of.iter().map(|record| record.protocols.get(&protocol.name));
        let measured: Vec<Option<f64>> =
            held_out.map(|of| of.map(value).filter(|value| value.is_finite())).collect();
        // Of who is not told its pose there is nothing to measure.
        if told(metric) && measured.iter().all(Option::is_none) {
            continue;
        }
        samples.push(Sample {
            method: method.label.clone(),
            learned: plan.learners.iter().any(|learner| learner.label == method.label),
            seeds: of.iter().map(|record| record.seed).collect(),
            measured,
            scores: Vec::new(),
        });
    }
    fill(&mut samples, higher_is_better(metric))?;
    Some(samples)
}

/// Scores from what was measured. `None` if nothing was.
pub(crate) fn fill(samples: &mut [Sample], higher_is_better: bool) -> Option<()> {
    let finite = samples.iter().flat_map(|sample| &sample.measured).flatten().copied();
    let worst = finite.reduce(if higher_is_better { f64::min } else { f64::max })?;
    for sample in samples {
        sample.scores = sample.measured.iter().map(|score| score.unwrap_or(worst)).collect();
    }
    Some(())
}
