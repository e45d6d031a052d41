//! All methods side by side on each protocol: numbers, differences, every seed as a point.

use minijinja::value::Serde;
use minijinja::{Value, context};
use mpgx_lang::plan::Protocol;
use mpgx_study::summary::{Comparison, Statistic};
use serde::Serialize;

use super::{Content, Panel};
use crate::svg::{Axis, Strip, strip_axis};
use crate::text::{Format, plural};
use crate::view::{Entry, View};

pub const PANEL: Panel = Panel {
    id: "comparison",
    title: "Comparison",
    template: include_str!("comparison.html"),
    script: None,
    content,
};

#[derive(Serialize)]
struct Part<'a> {
    name: &'a str,
    episodes: usize,
    error_unit: &'static str,
    rows: Vec<Row<'a>>,
    strips: Vec<Plot<'a>>,
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

#[derive(Serialize)]
struct Plot<'a> {
    title: &'static str,
    unit: &'static str,
    better: &'static str,
    rows: Vec<(&'a str, Value)>,
    axis: Value,
}

fn content(view: &View) -> Option<Content> {
    let first = view.first()?;
    let parts: Vec<_> =
        view.input.plan.protocols.iter().filter_map(|protocol| part(view, protocol, first)).collect();
    let context = context! { first => first.label, style => first.style.as_str(), parts => Serde(&parts) };
    (!parts.is_empty()).then_some(Content { context, data: None })
}

fn part<'v>(view: &'v View, protocol: &'v Protocol, first: &Entry) -> Option<Part<'v>> {
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
            plot(view, protocol, "error_m", "Distance from the slots", "less is better", Format::length),
            plot(view, protocol, "return", "Return", "more is better", Format::number),
        ]
        .into_iter()
        .flatten()
        .collect(),
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
    title: &'static str,
    better: &'static str,
    format: fn(f64) -> Format,
) -> Option<Plot<'v>> {
    let of = |method: &Entry| view.statistic(&protocol.name, method.label, metric);
    let shown = view.methods.iter().filter_map(of).flat_map(|statistic| {
        let ends = [statistic.lo, statistic.hi, Some(statistic.iqm)];
        statistic.per_seed.iter().copied().chain(ends).flatten()
    });
    let axis = Axis::linear(shown, 6, format);
    let level = view.oracle().and_then(of).map(|statistic| statistic.iqm);
    let rows: Vec<_> = view
        .methods
        .iter()
        .filter_map(|method| {
            let statistic = of(method)?;
            // A controller has one value; the mark stands for it.
            let points: Vec<f64> =
                statistic.per_seed.iter().flatten().copied().filter(|_| method.learned).collect();
            let interval = statistic.lo.zip(statistic.hi);
            let mid = statistic.iqm;
            let strip = Strip {
                axis: &axis,
                style: &method.style,
                height: 34,
                points: &points,
                mid,
                interval,
                level,
            };
            Some((method.label, Value::from_safe_string(strip.render())))
        })
        .collect();
    let unit = format(axis.lo.abs().max(axis.hi.abs())).unit;
    let labels = Value::from_safe_string(strip_axis(&axis));
    (!rows.is_empty()).then_some(Plot { title, unit, better, rows, axis: labels })
}
