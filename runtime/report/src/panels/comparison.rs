//! All methods side by side on each protocol: numbers, differences, every seed as a point.

use minijinja::context;
use minijinja::value::Serde;
use mpgx_lang::plan::Protocol;
use mpgx_study::summary::{Comparison, Statistic};
use serde::Serialize;

use super::curves::grid;
use super::{Content, Panel};
use crate::profile::{Profile, Sample, profile};
use crate::strips::{Spread, Strips, strips};
use crate::text::{Format, plural};
use crate::threshold::thresholds;
use crate::view::{Entry, View};

pub const PANEL: Panel = Panel {
    id: "comparison",
    title: "Comparison",
    template: include_str!("comparison.html"),
    script: Some(include_str!("../script/samples.js")),
    fills: false,
    content,
};

#[derive(Serialize)]
struct Part<'a> {
    name: &'a str,
    episodes: usize,
    error_unit: &'static str,
    rows: Vec<Row<'a>>,
    strips: Vec<Strips<'a>>,
    profile: Option<Profile>,
}

#[derive(Serialize)]
struct Row<'a> {
    label: &'a str,
    style: &'a str,
    cells: Vec<Option<Cell>>,
    difference: Option<Cell>,
    chance: Option<Cell>,
    verdict: &'a str,
    failed: Option<String>,
}

#[derive(Serialize)]
struct Cell {
    value: String,
    interval: Option<String>,
}

fn content(view: &View) -> Option<Content> {
    let first = view.first()?;
    let protocols = view.input.plan.protocols.iter().enumerate();
    let parts: Vec<_> =
        protocols.filter_map(|(k, protocol)| part(view, protocol, first, &format!("profile-{k}"))).collect();
    let context = context! {
        first => first.label,
        style => first.style.as_str(),
        parts => Serde(&parts),
        soon => Serde(grid(view).and_then(|grid| thresholds(view, &grid))),
    };
    let profiles: Vec<_> = parts.iter().filter_map(|part| part.profile.as_ref()).map(|it| &it.data).collect();
    let data = serde_json::json!({ "charts": profiles });
    (!parts.is_empty()).then_some(Content { context, data: Some(data) })
}

fn part<'v>(view: &'v View, protocol: &'v Protocol, first: &Entry, id: &str) -> Option<Part<'v>> {
    let measured = view.input.summary.protocols.get(&protocol.name)?;
    let largest = |metric: &str| {
        let values = measured.values().filter_map(|metrics| metrics.get(metric));
        values.map(|statistic| statistic.iqm.abs()).fold(0.0, f64::max)
    };
    let error = Format::length(largest("error_m"));
    let returns = Format::number(largest("return"));
    let columns = [("error_m", error), ("error_over_oracle", Format::ratio()), ("return", returns)];
    let shares = ["collision_episodes", "outside_episodes"].map(|metric| (metric, Format::percent(0.01)));
    let rows = view.methods.iter().map(|method| {
        let of = |metric: &str| view.statistic(&protocol.name, method.label, metric);
        let against = view.input.summary.comparisons.iter().find(|comparison| {
            comparison.protocol == protocol.name
                && comparison.metric == "error_m"
                && comparison.a == first.label
                && comparison.b == method.label
        });
        let failed = method.records.iter().filter(|record| record.failure.is_some()).count();
        Row {
            label: method.label,
            style: &method.style,
            cells: columns
                .iter()
                .chain(&shares)
                .map(|(metric, format)| of(metric).map(|statistic| cell(statistic, *format)))
                .collect(),
            difference: against.map(|comparison| difference(comparison, error)),
            chance: against.map(chance),
            verdict: against.map_or("", |comparison| &comparison.verdict),
            failed: (failed > 0).then(|| plural(failed, "seed")),
        }
    });
    Some(Part {
        name: &protocol.name,
        episodes: protocol.episodes,
        error_unit: error.unit,
        rows: rows.collect(),
        strips: [
            plot(view, protocol, "error_m", ("Distance from the slots", "less is better"), Format::length),
            plot(view, protocol, "return", ("Return", "more is better"), Format::number),
        ]
        .into_iter()
        .flatten()
        .collect(),
        profile: distances(view, protocol, id),
    })
}

fn cell(statistic: &Statistic, format: Format) -> Cell {
    Cell { value: format.plain(statistic.iqm), interval: format.interval(statistic.lo, statistic.hi) }
}

fn difference(comparison: &Comparison, format: Format) -> Cell {
    let plain = format.plain(comparison.difference);
    let plus = if comparison.difference > 0.0 { "+" } else { "" };
    Cell { value: format!("{plus}{plain}"), interval: format.interval(comparison.lo, comparison.hi) }
}

fn chance(comparison: &Comparison) -> Cell {
    let format = Format { digits: 0, ..Format::percent(1.0) };
    Cell {
        value: format.plain(comparison.probability_of_improvement),
        interval: format.interval(comparison.probability_lo, comparison.probability_hi),
    }
}

fn plot<'v>(
    view: &'v View,
    protocol: &Protocol,
    metric: &str,
    words: (&'static str, &'static str),
    format: fn(f64) -> Format,
) -> Option<Strips<'v>> {
    let of = |method: &Entry| view.statistic(&protocol.name, method.label, metric);
    let spread = |method: &'v Entry| {
        let statistic = of(method)?;
        // A controller has one value; the mark stands for it.
        let points = statistic.per_seed.iter().flatten().copied().filter(|_| method.learned);
        Some(Spread {
            label: method.label.to_string(),
            style: &method.style,
            points: points.collect(),
            mid: statistic.iqm,
            interval: statistic.lo.zip(statistic.hi),
        })
    };
    let spreads: Vec<_> = view.methods.iter().filter_map(spread).collect();
    let level = view.oracle().and_then(of).map(|statistic| statistic.iqm);
    strips(words, &spreads, level, format)
}

/// Of the distance, over the seeds of each method; a failed seed counts as the worst (see [`Statistic`]).
fn distances<'v>(view: &'v View, protocol: &Protocol, id: &str) -> Option<Profile> {
    let of = |method: &Entry| view.statistic(&protocol.name, method.label, "error_m");
    let measured = view.methods.iter().filter_map(of).flat_map(|statistic| &statistic.per_seed);
    let worst = measured.flatten().copied().reduce(f64::max)?;
    let sample = |method: &'v Entry| {
        let per_seed = &of(method)?.per_seed;
        let scores = per_seed.iter().map(|value| value.unwrap_or(worst)).collect();
        Some(Sample { label: method.label, style: &method.style, scores })
    };
    let samples: Vec<_> = view.methods.iter().filter_map(sample).collect();
    profile(id, "a distance", &samples, false, Format::length)
}
