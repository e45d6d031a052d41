//! The summary of a study: what `study.json` holds. A contract that scripts rely on: new keys may come, none
//! changes its meaning.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Counts finished seeds, failed seeds and everything that was measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    pub scenario: String,
    /// Version of mpgx.
    pub version: String,
    pub numerics_version: u32,
    pub meaning_hash: String,
    /// Covers all that must be the same on every machine: Plan, records, statistics.
    pub study_hash: String,
    pub seeds: usize,
    pub failures: Vec<FailedSeed>,
    /// Protocol → method → metric → statistic. Metrics: `return`, `error_m`, `error_over_oracle`,
    /// `collision_episodes`, `late_collision_episodes`, `outside_episodes`, `reward/<term>`; where
    /// there are obstacles, `hit_episodes` and `late_hit_episodes`.
    pub protocols: BTreeMap<String, BTreeMap<String, BTreeMap<String, Statistic>>>,
    pub comparisons: Vec<Comparison>,
    /// By learner.
    pub training: BTreeMap<String, TrainingSummary>,
    pub expect: Vec<ClaimResult>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FailedSeed {
    pub algorithm: String,
    pub seed: u32,
    pub step: u64,
    pub cause: String,
    pub at: String,
}

/// One metric over seeds. Controllers have one value and no interval (`lo` and `hi` are null).
///
/// A seed that failed, or whose value is not finite, counts in every number but `per_seed` as the worst value
/// that any seed of any method reached on this metric under this protocol. A metric without any value is absent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Statistic {
    /// Interquartile mean.
    pub iqm: f64,
    /// 95 % interval of the IQM, stratified percentile bootstrap over seeds; null below 5 seeds.
    pub lo: Option<f64>,
    pub hi: Option<f64>,
    pub mean: f64,
    /// 95 % t interval of the mean; null below 2 seeds.
    pub mean_lo: Option<f64>,
    pub mean_hi: Option<f64>,
    /// Mean over the held-out episodes, one value a seed; null for a failed seed.
    pub per_seed: Vec<Option<f64>>,
}

/// Two methods on one metric. `difference` is a − b; null interval below 5 seeds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    pub protocol: String,
    pub metric: String,
    pub a: String,
    pub b: String,
    pub difference: f64,
    /// 95 % interval of the mean paired difference (same held-out episodes, same seeds), bootstrap over seeds.
    pub lo: Option<f64>,
    pub hi: Option<f64>,
    /// Chance that a random seed of a scores better than one of b; ties one half.
    pub probability_of_improvement: f64,
    /// 95 % interval of that chance, bootstrap over seeds; null below 5 seeds.
    pub probability_lo: Option<f64>,
    pub probability_hi: Option<f64>,
    /// Welch's test of equal means (against a controller, the t test of its one value); null below 5 seeds.
    pub p: Option<f64>,
    /// The same after Holm's adjustment over all comparisons of the study.
    pub p_holm: Option<f64>,
    /// `better`, `worse`, `no difference shown`, `exploratory` (5 to 9 seeds), `too few seeds`. Better or
    /// worse needs 10 seeds, an interval that excludes 0 and `p_holm` < 0.05.
    pub verdict: String,
}

/// A comparison that is not always paired.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pair {
    #[serde(flatten)]
    pub comparison: Comparison,
    /// Differences are taken seed by seed; otherwise the samples count as independent.
    pub paired: bool,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrainingSummary {
    /// Of all seeds together.
    pub updates: u64,
    /// While training; a cell has one core.
    pub updates_per_s_per_core: f64,
    /// Training only.
    pub seconds_per_seed: Vec<f64>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClaimResult {
    pub text: String,
    /// `file:line:column`.
    pub at: String,
    pub holds: bool,
    /// Why: the measured value and its interval.
    pub because: String,
}
