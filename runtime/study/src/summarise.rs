//! From records to the summary of a study.

use std::collections::{BTreeMap, BTreeSet};

use mpgx_lang::plan::{Method, Plan};

use crate::record::{CellRecord, Timing};
use crate::statistics::{bootstrap, iqm, mean, t_interval};
use crate::summary::{FailedSeed, Statistic, Summary, TrainingSummary};

mod claims;
pub(crate) mod comparisons;
pub(crate) mod scores;
mod words;

use scores::{Sample, Scores};

/// Of every interval and test, unless a claim names its own.
const CONFIDENCE: f64 = 0.95;
/// Seeds below which there are numbers but no interval and no comparison.
const FEWEST_SEEDS: usize = 5;
/// Seeds below which a comparison is exploratory.
const ENOUGH_SEEDS: usize = 10;

/// The statistics of a study, from records alone. `records` and `timings` go by the cell's id.
///
/// A seed that failed counts as the worst score (see [`Statistic`]). `version`, `numerics_version` and the
/// hashes are left empty for the caller, who knows them.
pub fn summarise(
    plan: &Plan,
    records: &BTreeMap<String, CellRecord>,
    timings: &BTreeMap<String, Timing>,
) -> Summary {
    let scores = Scores::measure(plan, records);
    Summary {
        scenario: plan.name.clone(),
        version: String::new(),
        numerics_version: 0,
        meaning_hash: String::new(),
        study_hash: String::new(),
        seeds: trained_seeds(plan, records),
        failures: failures(plan, records),
        protocols: statistics(plan, &scores),
        comparisons: comparisons::compare(plan, &scores),
        training: plan.learners.iter().filter_map(|learner| training(learner, records, timings)).collect(),
        expect: plan.claims.iter().map(|claim| claims::decide(claim, &scores)).collect(),
    }
}

fn methods(plan: &Plan) -> impl Iterator<Item = &Method> {
    plan.learners.iter().chain(&plan.controllers)
}

/// The records of a method, by seed.
fn records_of<'a>(method: &Method, records: &'a BTreeMap<String, CellRecord>) -> Vec<&'a CellRecord> {
    let mut of: Vec<&CellRecord> = records.values().filter(|record| record.method == method.label).collect();
    of.sort_by_key(|record| record.seed);
    of
}

fn trained_seeds(plan: &Plan, records: &BTreeMap<String, CellRecord>) -> usize {
    let learned = plan.learners.iter().flat_map(|learner| records_of(learner, records));
    learned.map(|record| record.seed).collect::<BTreeSet<u32>>().len()
}

fn failures(plan: &Plan, records: &BTreeMap<String, CellRecord>) -> Vec<FailedSeed> {
    let all = methods(plan).flat_map(|method| records_of(method, records));
    let failed = all.filter_map(|record| Some((record, record.failure.as_ref()?)));
    failed
        .map(|(record, failure)| FailedSeed {
            algorithm: record.method.clone(),
            seed: record.seed,
            step: failure.step,
            cause: failure.cause.clone(),
            at: failure.at.clone(),
        })
        .collect()
}

/// Protocol → method → metric → statistic.
fn statistics(
    plan: &Plan,
    scores: &Scores,
) -> BTreeMap<String, BTreeMap<String, BTreeMap<String, Statistic>>> {
    let mut protocols: BTreeMap<String, BTreeMap<String, BTreeMap<String, Statistic>>> =
        plan.protocols.iter().map(|protocol| (protocol.name.clone(), BTreeMap::new())).collect();
    for (protocol, metric, sample) in scores.iter() {
        if let (Some(methods), Some(statistic)) = (protocols.get_mut(protocol), statistic(sample)) {
            methods.entry(sample.method.clone()).or_default().insert(metric.to_string(), statistic);
        }
    }
    protocols
}

/// `None` where sums overflow.
pub(crate) fn statistic(sample: &Sample) -> Option<Statistic> {
    let x = &sample.scores;
    let of_iqm = if x.len() < FEWEST_SEEDS { None } else { bootstrap(x, CONFIDENCE, iqm) };
    let of_mean = t_interval(x, CONFIDENCE);
    let statistic = Statistic {
        iqm: iqm(x),
        lo: of_iqm.map(|interval| interval.lo),
        hi: of_iqm.map(|interval| interval.hi),
        mean: mean(x),
        mean_lo: of_mean.map(|interval| interval.lo),
        mean_hi: of_mean.map(|interval| interval.hi),
        per_seed: sample.measured.clone(),
    };
    (statistic.iqm.is_finite() && statistic.mean.is_finite()).then_some(statistic)
}

/// `None` if no time was measured.
fn training(
    learner: &Method,
    records: &BTreeMap<String, CellRecord>,
    timings: &BTreeMap<String, Timing>,
) -> Option<(String, TrainingSummary)> {
    let mut cells: Vec<(&CellRecord, f64)> = records
        .iter()
        .filter(|(_, record)| record.method == learner.label)
        .filter_map(|(id, record)| Some((record, timings.get(id)?.training_s)))
        .filter(|(_, seconds)| seconds.is_finite() && *seconds > 0.0)
        .collect();
    cells.sort_by_key(|(record, _)| record.seed);
    let updates = cells.iter().filter_map(|(record, _)| Some(record.training.as_ref()?.updates)).sum::<u64>();
    let seconds_per_seed: Vec<f64> = cells.iter().map(|(_, seconds)| *seconds).collect();
    let updates_per_s_per_core = updates as f64 / seconds_per_seed.iter().sum::<f64>();
    updates_per_s_per_core.is_finite().then(|| {
        (learner.label.clone(), TrainingSummary { updates, updates_per_s_per_core, seconds_per_seed })
    })
}
