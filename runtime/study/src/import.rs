//! Results of other programs: marl-eval's JSON, which BenchMARL writes too, and the statistics of a study over it.
//!
//! Runs count as seeds, and higher values as better. A run's value on a metric is the mean of its absolute metric
//! or, where it has none, of the evaluation with the largest `step_count`.

use std::collections::BTreeSet;

use crate::statistics::mean;
use crate::summarise::comparisons::{Difference, adjust, contrast};
use crate::summarise::scores::{Sample, fill};
use crate::summarise::statistic;
use crate::summary::{Pair, Statistic};

mod read;

pub use read::{ImportError, MAX_BYTES};
use read::{Run, Task};

/// One metric of one task.
#[derive(Clone, Debug, PartialEq)]
pub struct Results {
    pub environment: String,
    pub task: String,
    pub metric: String,
    /// By name.
    pub algorithms: Vec<Algorithm>,
    /// Every two of them, paired where both have runs of the same names. Holm's adjustment is over all pairs of the file.
    pub pairs: Vec<Pair>,
    /// Runs whose value is their absolute metric.
    pub absolute: usize,
    /// Some of these absolute metrics are the largest value of any evaluation episode, as BenchMARL writes it.
    pub largest: bool,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Algorithm {
    pub name: String,
    /// A run that lacks the metric, or whose value is not finite, is null in `per_seed` and counts as the worst
    /// value of any run of this task.
    pub statistic: Statistic,
    /// One value a run, with the worst in place of what is missing.
    pub scores: Vec<f64>,
    /// By run: `step_count` and the mean of each evaluation, ascending.
    pub curves: Vec<Vec<(f64, f64)>>,
}

/// Every metric of every task, in the order of their names. A metric without any finite value is left out.
///
/// # Errors
/// [`ImportError`], with the place in the file.
pub fn import(text: &str) -> Result<Vec<Results>, ImportError> {
    let tasks = read::tasks(text)?;
    let mut all: Vec<Results> = tasks.iter().flat_map(|task| results(task).collect::<Vec<_>>()).collect();
    adjust(all.iter_mut().flat_map(|it| &mut it.pairs).map(|pair| &mut pair.comparison).collect(), |_| true);
    Ok(all)
}

fn results(task: &Task) -> impl Iterator<Item = Results> {
    task.metrics().into_iter().filter_map(|metric| measure(task, metric))
}

fn measure(task: &Task, metric: &str) -> Option<Results> {
    let mut samples: Vec<Sample> = task
        .algorithms
        .iter()
        .map(|(name, runs)| Sample {
            method: name.clone(),
            learned: true,
            seeds: (0..runs.len() as u32).collect(),
            measured: runs.iter().map(|run| run.value(metric)).collect(),
            scores: Vec::new(),
        })
        .collect();
    fill(&mut samples, true)?;
    let names: Vec<BTreeSet<&str>> =
        task.algorithms.iter().map(|(_, runs)| runs.iter().map(|run| run.name.as_str()).collect()).collect();
    let place = format!("{}/{}", task.environment, task.name);
    let mut pairs = Vec::new();
    for (k, (a, of_a)) in samples.iter().zip(&names).enumerate() {
        for (b, of_b) in samples.iter().zip(&names).skip(k + 1) {
            let paired = of_a == of_b;
            let difference = if paired { Difference::paired(a, b) } else { Difference::independent(a, b) };
            let comparison = contrast((&place, metric), true, (a, b), difference);
            pairs.extend(comparison.map(|comparison| Pair { comparison, paired }));
        }
    }
    let algorithms = samples.into_iter().zip(&task.algorithms).filter_map(|(sample, (name, runs))| {
        let curves = runs.iter().map(|run| run.curve(metric)).collect();
        Some(Algorithm { name: name.clone(), statistic: statistic(&sample)?, scores: sample.scores, curves })
    });
    let runs = || task.algorithms.iter().flat_map(|(_, runs)| runs);
    Some(Results {
        environment: task.environment.clone(),
        task: task.name.clone(),
        metric: metric.to_string(),
        algorithms: algorithms.collect(),
        pairs,
        absolute: runs().filter(|run| run.absolute(metric).is_some()).count(),
        largest: runs().any(|run| run.is_largest(metric)),
    })
}

impl Task {
    fn metrics(&self) -> BTreeSet<&str> {
        self.algorithms.iter().flat_map(|(_, runs)| runs).flat_map(Run::metrics).collect()
    }
}

impl Run {
    fn metrics(&self) -> impl Iterator<Item = &str> {
        let of_steps = self.steps.iter().flat_map(|(_, metrics)| metrics.keys());
        self.absolute.keys().chain(of_steps).map(String::as_str)
    }

    fn absolute(&self, metric: &str) -> Option<&[f64]> {
        self.absolute.get(metric).map(Vec::as_slice).filter(|values| !values.is_empty())
    }

    fn value(&self, metric: &str) -> Option<f64> {
        let last = || self.steps.last()?.1.get(metric).map(Vec::as_slice);
        self.absolute(metric).or_else(last).map(mean).filter(|value| value.is_finite())
    }

    fn is_largest(&self, metric: &str) -> bool {
        let Some([absolute]) = self.absolute(metric) else { return false };
        let episodes: Vec<f64> =
            self.steps.iter().filter_map(|(_, metrics)| metrics.get(metric)).flatten().copied().collect();
        episodes.len() > 1 && episodes.iter().copied().fold(f64::MIN, f64::max) == *absolute
    }

    fn curve(&self, metric: &str) -> Vec<(f64, f64)> {
        let mean_of = |values: &Vec<f64>| Some(mean(values)).filter(|value| value.is_finite());
        let point = |(count, metrics): &(f64, read::Metrics)| Some((*count, mean_of(metrics.get(metric)?)?));
        self.steps.iter().filter_map(point).collect()
    }
}
