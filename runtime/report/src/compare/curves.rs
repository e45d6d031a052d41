//! The learning curves of both studies in one chart.

use mpgx_study::record::Training;

use super::{Compared, labels, style};
use crate::band::{Estimate, Resamples};
use crate::grid::Grid;
use crate::lines::{Drawing, Line, Lines, lines};
use crate::text::Format;

/// Most points of a curve.
const POINTS: usize = 400;

type Column = fn(&Training) -> &[f64];

/// Distance and, where the rewards are the same, return; smoothed as in the report of a study.
pub fn figures(compared: &Compared) -> Vec<Lines> {
    let same_reward = compared.meetings.iter().any(|meeting| meeting.same_reward);
    let error: Column = |training| &training.error_m;
    let returns: Column = |training| &training.returns;
    let all = [
        ("curve-error", "Distance from the slots while training", error, Format::length as fn(f64) -> Format),
        ("curve-return", "Return while training", returns, Format::number),
    ];
    let shown = all.into_iter().take(if same_reward { 2 } else { 1 });
    shown
        .filter_map(|(id, title, column, format)| {
            let drawing = Drawing { id, title, x_name: "environment steps", format };
            figure(compared, &drawing, column)
        })
        .collect()
}

fn figure(compared: &Compared, drawing: &Drawing, column: Column) -> Option<Lines> {
    let trainings = |side: usize, label: &str| -> Vec<&Training> {
        let records = compared.sides.get(side).into_iter().flat_map(|side| side.study.records.values());
        let of = records.filter(|record| record.method == label && record.failure.is_none());
        of.filter_map(|record| record.training.as_ref()).collect()
    };
    let ends = compared.sides.iter().flat_map(|side| side.study.records.values());
    let last = *ends.filter_map(|record| record.training.as_ref()?.steps.last()).max()?;
    let horizon = compared.sides.iter().map(|side| side.study.plan.world.horizon).max()?;
    if last == 0 {
        return None;
    }
    let grid = Grid::new(last, horizon, 0.0, |_| POINTS);
    let window = grid.filters.first().map_or(1, |filter| filter.window);
    let mut names = Vec::new();
    for (n, label) in labels(&compared.sides, |plan| &plan.learners).into_iter().enumerate() {
        for (k, side) in compared.sides.iter().enumerate() {
            let of = trainings(k, label);
            if !of.is_empty() {
                names.push((
                    format!("{}: {label}", side.name),
                    style(2 * n + k),
                    points(&grid, window, &of, column),
                ));
            }
        }
    }
    let drawn: Vec<Line> =
        names.iter().map(|(label, style, points)| Line { label, style, points: points.clone() }).collect();
    let at: Vec<f64> = grid.steps().into_iter().map(|step| step as f64).collect();
    lines(drawing, &at, &drawn)
}

fn points(grid: &Grid, window: usize, trainings: &[&Training], column: Column) -> Vec<Option<Estimate>> {
    let resamples = Resamples::new(trainings.len());
    let of = |training: &&Training| grid.smooth(&grid.resample(&training.steps, column(training)), window);
    let seeds: Vec<Vec<Option<f64>>> = trainings.iter().map(of).collect();
    let at = |bin: usize| {
        let values: Vec<f64> = seeds.iter().filter_map(|values| values.get(bin).copied().flatten()).collect();
        resamples.estimate(&values)
    };
    (0..grid.bins).map(at).collect()
}
