//! The course of training on one grid of steps: every seed, and what the seeds of a method have in common.

use mpgx_lang::plan::Setting;
use mpgx_study::record::Training;
use mpgx_study::statistics::{critical_value, tolerance};
use serde::Serialize;

use crate::band::{Estimate, Resamples};
use crate::grid::Grid;
use crate::series::pack;
use crate::text::Format;
use crate::view::{Entry, View};

/// Of all seeds, that the outer band is to hold, and how sure that is.
pub const SHARE: f64 = 0.9;
pub const CONFIDENCE: f64 = 0.95;

/// What is drawn against the course of training.
pub struct Quantity {
    pub id: String,
    pub title: String,
    pub format: fn(f64) -> Format,
    /// Metric of the held-out evaluation whose oracle value is drawn as a level.
    pub metric: String,
    pub log: bool,
    column: Column,
}

/// A column of the record of training.
enum Column {
    Error,
    Returns,
    /// Of a reward term.
    Term(usize),
}

impl Column {
    /// One value an episode.
    fn of(&self, training: &Training) -> Vec<f64> {
        match self {
            Column::Error => training.error_m.clone(),
            Column::Returns => training.returns.clone(),
            Column::Term(k) => {
                training.terms.iter().map(|terms| terms.get(*k).copied().unwrap_or(f64::NAN)).collect()
            }
        }
    }
}

/// Distance, return and each reward term.
pub fn quantities(view: &View) -> Vec<Quantity> {
    let mut quantities = vec![
        Quantity {
            id: "error".into(),
            title: "Distance from the slots".into(),
            format: Format::length,
            metric: "error_m".into(),
            log: true,
            column: Column::Error,
        },
        Quantity {
            id: "return".into(),
            title: "Return".into(),
            format: Format::number,
            metric: "return".into(),
            log: false,
            column: Column::Returns,
        },
    ];
    let terms = &view.input.plan.world.reward;
    quantities.extend(terms.iter().enumerate().map(|(k, term)| Quantity {
        id: format!("term-{k}"),
        title: format!("Reward term “{}”", term.name),
        format: Format::number,
        metric: format!("reward/{}", term.name),
        log: false,
        column: Column::Term(k),
    }));
    quantities
}

/// Middle, low and high end of the band; low and high end of the tolerance interval.
pub type Point = [f64; 5];

/// One method's curves of one quantity.
pub struct Curves<'a> {
    pub label: &'a str,
    pub style: &'a str,
    pub seeds: Vec<Seed>,
    /// For each filter of the grid.
    pub bands: Vec<Vec<Option<Point>>>,
}

pub struct Seed {
    pub seed: u32,
    pub failed: bool,
    /// Not filtered.
    pub values: Vec<Option<f64>>,
}

pub fn curves<'v>(method: &'v Entry, quantity: &Quantity, grid: &Grid) -> Curves<'v> {
    let seeds: Vec<Seed> = method
        .records
        .iter()
        .filter_map(|record| {
            let training = record.training.as_ref()?;
            let values = grid.resample(&training.steps, &quantity.column.of(training));
            Some(Seed { seed: record.seed, failed: record.failure.is_some(), values })
        })
        .collect();
    let finished: Vec<_> = seeds.iter().filter(|seed| !seed.failed).collect();
    let resamples = Resamples::new(finished.len());
    let band = |filter: &crate::grid::Filter| {
        let smooth: Vec<_> = finished.iter().map(|seed| grid.smooth(&seed.values, filter.window)).collect();
        (0..grid.bins).map(|bin| estimate(&resamples, &smooth, bin)).collect()
    };
    let bands = grid.filters.iter().map(band).collect();
    Curves { label: method.label, style: &method.style, seeds, bands }
}

fn estimate(resamples: &Resamples, seeds: &[Vec<Option<f64>>], bin: usize) -> Option<Point> {
    let values: Vec<f64> = seeds.iter().filter_map(|values| values.get(bin).copied().flatten()).collect();
    let Estimate { mid, interval } = resamples.estimate(&values)?;
    let (lo, hi) = interval.unwrap_or((mid, mid));
    let outer = tolerance(&values, SHARE, CONFIDENCE).filter(|_| interval.is_some());
    let (low, high) = outer.map_or((mid, mid), |it| (it.lo, it.hi));
    Some([mid, lo, hi, low, high])
}

/// The same for the script of the page.
#[derive(Serialize)]
pub struct Packed<'a> {
    label: &'a str,
    style: &'a str,
    seeds: Vec<PackedSeed>,
    /// For each filter: middle, low and high end, outer low and high end.
    bands: Vec<[String; 5]>,
}

#[derive(Serialize)]
struct PackedSeed {
    seed: u32,
    failed: bool,
    values: String,
}

impl Curves<'_> {
    pub fn packed(&self) -> Packed<'_> {
        let seeds = self.seeds.iter().map(|seed| PackedSeed {
            seed: seed.seed,
            failed: seed.failed,
            values: pack(seed.values.iter().copied()),
        });
        let column = |band: &[Option<Point>], k: usize| {
            pack(band.iter().map(|point| point.and_then(|point| point.get(k).copied())))
        };
        let bands = self.bands.iter().map(|band| [0, 1, 2, 3, 4].map(|k| column(band, k)));
        Packed { label: self.label, style: self.style, seeds: seeds.collect(), bands: bands.collect() }
    }
}

/// Letters that so many series of each quantity take for each bin.
pub fn letters_a_bin(series: usize, quantities: usize) -> usize {
    4 * quantities * series
}

/// How the steps of a method become updates and seconds, for the axis of its curves.
#[derive(Serialize)]
pub struct Pace {
    /// The first step with an update.
    warm_up: f64,
    /// A step after that, mean over seeds.
    updates: f64,
    /// A step, mean over seeds; `None` if not known.
    seconds: Option<f64>,
    /// Half the width of a 95 % interval of a mean over this method's seeds, in standard errors.
    t: Option<f64>,
}

impl Pace {
    pub fn is_timed(&self) -> bool {
        self.seconds.is_some()
    }
}

pub fn pace(view: &View, method: &Entry) -> Pace {
    let learners = &view.input.plan.learners;
    let settings = learners.iter().find(|it| it.label == method.label).map(|it| &it.what.settings);
    let warm_up = match settings.and_then(|settings| settings.get("warm_up")) {
        Some(Setting::Number(steps)) => *steps,
        _ => 0.0,
    };
    let whole: Vec<&Training> = method.records.iter().filter_map(|it| it.training.as_ref()).collect();
    let steps: f64 = whole.iter().filter_map(|it| it.steps.last()).map(|steps| *steps as f64).sum();
    let updates: f64 = whole.iter().map(|it| it.updates as f64).sum();
    let after = steps - warm_up * whole.len() as f64;
    let cells = view.input.records.iter().filter(|(_, it)| it.method == method.label);
    let seconds: f64 =
        cells.filter_map(|(id, _)| view.input.timings.get(id)).map(|timing| timing.training_s).sum();
    let finished = method.records.iter().filter(|it| it.training.is_some() && it.failure.is_none()).count();
    Pace {
        warm_up,
        updates: if after > 0.0 { updates / after } else { 0.0 },
        seconds: (seconds > 0.0 && steps > 0.0).then(|| seconds / steps),
        t: (finished > 1).then(|| critical_value(0.95, finished as f64 - 1.0)).filter(|t| t.is_finite()),
    }
}
