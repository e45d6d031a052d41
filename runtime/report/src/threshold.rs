//! How soon each learner comes near its slots: steps until the filtered distance falls below a threshold.

use mpgx_study::statistics::quantile;
use serde::Serialize;

use crate::course::{Curves, curves, quantities};
use crate::grid::Grid;
use crate::text::count;
use crate::view::View;

/// Shares of the way from where training begins to the best end of any learner.
const SHARES: [f64; 3] = [0.5, 0.8, 0.95];

/// What the comparison shows.
#[derive(Serialize)]
pub struct Thresholds {
    unit: &'static str,
    levels: Vec<String>,
    rows: Vec<Row>,
}

#[derive(Serialize)]
struct Row {
    label: String,
    style: String,
    /// For each level: the median of the seeds, then how many reach it.
    cells: Vec<(String, String)>,
}

/// `None` if no learner gets anywhere.
pub fn thresholds(view: &View, grid: &Grid) -> Option<Thresholds> {
    let all = quantities(view);
    let distance = all.first()?;
    let methods: Vec<Curves> = view.learners().map(|method| curves(method, distance, grid)).collect();
    let middle = |curves: &Curves, last: bool| {
        let mut known = curves.bands.first()?.iter().flatten().map(|point| point[0]);
        if last { known.next_back() } else { known.next() }
    };
    let begin = methods.iter().filter_map(|curves| middle(curves, false)).reduce(f64::max)?;
    let best = methods.iter().filter_map(|curves| middle(curves, true)).reduce(f64::min)?;
    if best >= begin {
        return None;
    }
    let levels = SHARES.map(|share| begin - share * (begin - best));
    let format = (distance.format)(begin);
    let rows = methods.iter().map(|curves| Row {
        label: curves.label.into(),
        style: curves.style.into(),
        cells: levels.iter().map(|level| reached(curves, grid, *level)).collect(),
    });
    Some(Thresholds {
        unit: format.unit,
        levels: levels.iter().map(|level| format.at(*level).plain(*level)).collect(),
        rows: rows.collect(),
    })
}

/// Seeds that fail or never get there count as later than all others.
fn reached(curves: &Curves, grid: &Grid, level: f64) -> (String, String) {
    let window = grid.filters.first().map_or(1, |filter| filter.window);
    let steps = grid.steps();
    let first = |values: &[Option<f64>]| {
        let smooth = grid.smooth(values, window);
        let bin = smooth.iter().position(|value| value.is_some_and(|value| value <= level))?;
        steps.get(bin).map(|steps| *steps as f64)
    };
    let reached = |seed: &crate::course::Seed| first(&seed.values).filter(|_| !seed.failed);
    let mut each: Vec<f64> = curves.seeds.iter().map(|it| reached(it).unwrap_or(f64::MAX)).collect();
    each.sort_unstable_by(f64::total_cmp);
    let seeds = each.iter().filter(|steps| **steps < f64::MAX).count();
    let median = quantile(&each, 0.5).filter(|median| *median < 1e18);
    (median.map_or_else(|| "–".into(), |median| count(median.round())), format!("{seeds} of {}", each.len()))
}
