//! Strip plots: methods below each other on one axis, every seed as a point.

use minijinja::Value;
use serde::Serialize;

use crate::svg::{Axis, Strip, strip_axis};
use crate::text::Format;

/// One method's row.
pub struct Spread<'a> {
    pub label: String,
    pub style: &'a str,
    pub points: Vec<f64>,
    pub mid: f64,
    pub interval: Option<(f64, f64)>,
}

/// What `strips.html` shows.
#[derive(Serialize)]
pub struct Strips<'a> {
    pub title: &'a str,
    unit: &'static str,
    better: &'static str,
    rows: Vec<(String, Value)>,
    axis: Value,
    /// Method, middle, ends of the interval, every seed.
    table: Vec<[String; 5]>,
}

/// `level`: a value to compare with. `None`: there is no row.
pub fn strips<'a>(
    (title, better): (&'a str, &'static str),
    spreads: &[Spread],
    level: Option<f64>,
    format: fn(f64) -> Format,
) -> Option<Strips<'a>> {
    let ends = |spread: &Spread| spread.interval.map_or([spread.mid; 2], |(lo, hi)| [lo, hi]);
    let shown = spreads.iter().flat_map(|it| it.points.iter().copied().chain(ends(it)).chain([it.mid]));
    let axis = Axis::linear(shown, 6, format);
    let row = |spread: &Spread| {
        let Spread { label, style, points, mid, interval } = spread;
        let strip = Strip { axis: &axis, style, height: 34, points, mid: *mid, interval: *interval, level };
        (label.clone(), Value::from_safe_string(strip.render()))
    };
    let format = format(axis.lo.abs().max(axis.hi.abs()));
    let told = |spread: &Spread| {
        let plain = |value: f64| format.at(value).plain(value);
        let seeds: Vec<String> = spread.points.iter().map(|value| plain(*value)).collect();
        let (lo, hi) = spread.interval.map(|(lo, hi)| (plain(lo), plain(hi))).unwrap_or_default();
        [spread.label.clone(), plain(spread.mid), lo, hi, seeds.join(" ")]
    };
    let labels = Value::from_safe_string(strip_axis(&axis));
    let rows: Vec<_> = spreads.iter().map(row).collect();
    (!rows.is_empty()).then_some(Strips {
        title,
        unit: format.unit,
        better,
        rows,
        axis: labels,
        table: spreads.iter().map(told).collect(),
    })
}
