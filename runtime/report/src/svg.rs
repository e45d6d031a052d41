//! Charts as SVG that stand complete without a script.
//!
//! Places along both axes are percentages and lines live in a stretched 1000 × 1000 area, so a chart fills
//! any width while its text keeps its size. Colours, dashes and markers are classes of the style sheet.

use std::fmt::Write;

use serde::Serialize;

use crate::text::{Format, escape};

/// Side of the stretched area that lines are drawn in.
const AREA: f64 = 1000.0;

/// From values to places.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Axis {
    pub lo: f64,
    pub hi: f64,
    pub log: bool,
    pub ticks: Vec<Tick>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Tick {
    pub value: f64,
    pub label: String,
}

impl Axis {
    /// Covers all finite values with a little room, in about `count` round steps.
    pub fn linear(
        values: impl IntoIterator<Item = f64>,
        count: usize,
        format: impl Fn(f64) -> Format,
    ) -> Axis {
        let (lo, hi) = range(values);
        let (lo, hi) = match (lo, hi) {
            (0.0, 0.0) => (0.0, 1.0),
            (lo, hi) if hi - lo < 1e-9 * hi.abs() => (lo - 0.5 * hi.abs(), hi + 0.5 * hi.abs()),
            (lo, hi) => {
                let room = 0.04 * (hi - lo);
                (if lo == 0.0 { lo } else { lo - room }, if hi == 0.0 { hi } else { hi + room })
            }
        };
        let format = format(lo.abs().max(hi.abs()));
        let ticks = ticks((lo, hi), count, format);
        Axis { lo, hi, log: false, ticks }
    }

    /// Covers all positive values; ticks at round parts of each power of ten.
    pub fn log(values: impl IntoIterator<Item = f64>, format: impl Fn(f64) -> Format) -> Axis {
        let (lo, hi) = range(values.into_iter().filter(|value| *value > 0.0));
        let (lo, hi) = if lo > 0.0 { (lo / 1.15, hi * 1.15) } else { (0.1, 1.0) };
        let factor = format(hi).factor;
        let format = |value: f64| Format { factor, ..format(value) };
        let (first, last) =
            (libm::floor(libm::log10(lo * factor)) as i32, libm::ceil(libm::log10(hi * factor)) as i32);
        let mantissas: &[f64] = match hi / lo {
            ..10.0 => &[1.0, 2.0, 3.0, 4.0, 5.0, 7.0],
            ..1000.0 => &[1.0, 2.0, 5.0],
            _ => &[1.0],
        };
        let ticks = (first..=last)
            .flat_map(|power| mantissas.iter().map(move |mantissa| mantissa * libm::exp10(f64::from(power))))
            .map(|shown| (shown, shown / factor))
            .filter(|(_, value)| (lo..=hi).contains(value))
            .map(|(shown, value)| {
                let digits = (-libm::floor(libm::log10(shown) + 1e-9)).max(0.0) as usize;
                Tick { value, label: Format { digits, ..format(value) }.plain(value) }
            })
            .collect();
        Axis { lo, hi, log: true, ticks }
    }

    /// From 0 at the low end to 1 at the high end; values beyond lie outside.
    pub fn place(&self, value: f64) -> f64 {
        let map = |x: f64| if self.log { libm::log(x.max(1e-300)) } else { x };
        (map(value) - map(self.lo)) / (map(self.hi) - map(self.lo))
    }

    /// A place as percent from the left, kept on the page.
    pub fn left(&self, value: f64) -> String {
        percent(self.place(value).clamp(-0.02, 1.02))
    }

    /// A place as percent from the top.
    pub fn top(&self, value: f64) -> String {
        percent(1.0 - self.place(value).clamp(-0.02, 1.02))
    }
}

/// Ticks from `lo` to `hi` in about `count` steps that are round in the unit that is shown.
pub fn ticks((lo, hi): (f64, f64), count: usize, format: Format) -> Vec<Tick> {
    let step = round_step((hi - lo) * format.factor / count as f64) / format.factor;
    let digits = (-libm::floor(libm::log10(step * format.factor) + 1e-9)).max(0.0) as usize;
    let format = Format { digits, ..format };
    let first = (lo / step).ceil() as i64;
    let last = (hi / step).floor() as i64;
    let ticks = (first..=last.min(first + 50)).map(|k| k as f64 * step);
    ticks.map(|value| Tick { value, label: format.plain(value) }).collect()
}

/// The least and greatest value that is not absurd; (0, 1) if there is none.
fn range(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    let sane = values.into_iter().filter(|value| value.abs() < 1e60);
    let (lo, hi) = sane.fold((f64::MAX, f64::MIN), |(lo, hi), value| (lo.min(value), hi.max(value)));
    if lo <= hi { (lo, hi) } else { (0.0, 1.0) }
}

/// 1, 2 or 5 times a power of ten, not below `step`.
pub fn round_step(step: f64) -> f64 {
    let power = libm::exp10(libm::floor(libm::log10(step)));
    [1.0, 2.0, 5.0, 10.0].into_iter().map(|m| m * power).find(|s| *s >= step * 0.999).unwrap_or(power * 10.0)
}

pub fn percent(share: f64) -> String {
    format!("{:.2}%", share * 100.0)
}

/// A line through points in the area; `None` lifts the pen.
pub fn line(points: impl IntoIterator<Item = Option<(f64, f64)>>) -> String {
    let mut path = String::new();
    let mut pen: Option<(i64, i64)> = None;
    for point in points {
        let Some((x, y)) = point.map(|(x, y)| (area(x), area(1.0 - y))) else {
            pen = None;
            continue;
        };
        // Writing to a String cannot fail.
        let _ = match pen {
            None => write!(path, "M{x} {y}"),
            Some((px, py)) => write!(path, "l{} {}", x - px, y - py),
        };
        pen = Some((x, y));
    }
    path
}

/// The region between two lines over the same abscissae.
pub fn region(points: &[(f64, f64, f64)]) -> String {
    let upper = points.iter().map(|&(x, _, hi)| Some((x, hi)));
    let lower = points.iter().rev().map(|&(x, lo, _)| Some((x, lo)));
    let path = line(upper.chain(lower));
    if path.is_empty() { path } else { path + "z" }
}

/// Places far outside are kept near, so that numbers stay short.
fn area(share: f64) -> i64 {
    (share.clamp(-2.0, 3.0) * AREA).round() as i64
}

/// A chart with axes. `area` is drawn stretched and clipped, `over` in percent on top of it.
pub struct Chart<'a> {
    pub id: &'a str,
    pub title: &'a str,
    pub description: &'a str,
    pub height: u32,
    pub x: &'a Axis,
    pub y: &'a Axis,
    pub area: &'a str,
    pub over: &'a str,
}

impl Chart<'_> {
    pub fn render(&self) -> String {
        let Chart { id, height, area, over, .. } = self;
        let (title, description) = (escape(self.title), escape(self.description));
        let (x, y) = (x_ticks(self.x), y_ticks(self.y));
        format!(
            r#"<svg class="chart" role="img" aria-labelledby="{id}-t {id}-d" width="100%" height="{height}">
<title id="{id}-t">{title}</title><desc id="{id}-d">{description}</desc>
<g class="y">{y}</g><g class="x">{x}</g>
<svg class="area" viewBox="0 0 {AREA} {AREA}" preserveAspectRatio="none" width="100%" height="100%">{area}</svg>
<g class="over">{over}</g></svg>"#
        )
    }
}

fn y_ticks(axis: &Axis) -> String {
    let tick = |tick: &Tick| {
        let (top, label) = (axis.top(tick.value), &tick.label);
        format!(
            r#"<line x1="0" x2="100%" y1="{top}" y2="{top}"/><text x="0" dx="-8" y="{top}" dy=".32em">{label}</text>"#
        )
    };
    axis.ticks.iter().map(tick).collect()
}

fn x_ticks(axis: &Axis) -> String {
    let tick = |tick: &Tick| {
        let (left, label) = (axis.left(tick.value), &tick.label);
        format!(r#"<text x="{left}" y="100%" dy="1.5em">{label}</text>"#)
    };
    axis.ticks.iter().map(tick).collect()
}

/// One row of a strip plot: every seed as a mark, the interval as a bar, the middle as a diamond.
pub struct Strip<'a> {
    pub axis: &'a Axis,
    pub style: &'a str,
    pub height: u32,
    pub points: &'a [f64],
    pub mid: f64,
    pub interval: Option<(f64, f64)>,
    /// A value to compare with, as a dashed line.
    pub level: Option<f64>,
}

impl Strip<'_> {
    pub fn render(&self) -> String {
        let Strip { axis, style, height, .. } = self;
        let mut body = String::new();
        for tick in &axis.ticks {
            let left = axis.left(tick.value);
            let _ = write!(body, r#"<line class="grid" x1="{left}" x2="{left}" y1="0" y2="100%"/>"#);
        }
        if let Some(level) = self.level {
            let left = axis.left(level);
            let _ = write!(body, r#"<line class="level" x1="{left}" x2="{left}" y1="0" y2="100%"/>"#);
        }
        if let Some((lo, hi)) = self.interval {
            let (lo, hi) = (axis.left(lo), axis.left(hi));
            let _ = write!(body, r#"<line class="interval" x1="{lo}" x2="{hi}" y1="50%" y2="50%"/>"#);
        }
        for &point in self.points {
            let _ = write!(body, r#"<circle cx="{}" cy="50%" r="3.5"/>"#, axis.left(point));
        }
        // A diamond that keeps its shape: an area of no width, moved by percent.
        let _ = write!(
            body,
            r#"<svg class="mark" x="{}" y="50%"><path d="M0-6l5 6-5 6-5-6z"/></svg>"#,
            axis.left(self.mid)
        );
        format!(
            r#"<svg class="strip {style}" aria-hidden="true" width="100%" height="{height}">{body}</svg>"#
        )
    }
}

/// Labels below the rows of a strip plot.
pub fn strip_axis(axis: &Axis) -> String {
    format!(r#"<svg class="chart ticks" aria-hidden="true" width="100%" height="1">{}</svg>"#, x_ticks(axis))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_in_the_unit_shown() {
        let axis = Axis::linear([0.0, 0.103], 5, Format::length);
        let labels: Vec<_> = axis.ticks.iter().map(|tick| tick.label.as_str()).collect();
        assert_eq!(labels, ["0", "50", "100"]);
        let axis = Axis::linear([-0.31, 0.12], 4, Format::number);
        let labels: Vec<_> = axis.ticks.iter().map(|tick| tick.label.as_str()).collect();
        assert_eq!(labels, ["\u{2212}0.2", "0.0"]);
        let axis = Axis::log([0.012, 0.9], Format::length);
        let labels: Vec<_> = axis.ticks.iter().map(|tick| tick.label.as_str()).collect();
        assert_eq!(labels, ["0.02", "0.05", "0.1", "0.2", "0.5", "1"]);
    }

    #[test]
    fn any_values_give_a_finite_axis() {
        for values in
            [vec![], vec![f64::NAN], vec![f64::INFINITY, 3.0], vec![0.0], vec![5.0, 5.0], vec![-1e300]]
        {
            for axis in
                [Axis::linear(values.clone(), 5, Format::number), Axis::log(values.clone(), Format::length)]
            {
                assert!(axis.lo < axis.hi && axis.place(1.0).is_finite(), "{values:?} gives {axis:?}");
                assert!(axis.ticks.len() < 60, "{values:?}");
            }
        }
    }

    #[test]
    fn a_line_breaks_where_a_value_is_missing() {
        let path = line([Some((0.0, 0.0)), Some((0.5, 1.0)), None, Some((1.0, 0.25))]);
        assert_eq!(path, "M0 1000l500 -1000M1000 750");
        assert_eq!(region(&[(0.0, 0.1, 0.2), (1.0, 0.3, 0.4)]), "M0 800l1000 -200l0 100l-1000 200z");
        assert_eq!(region(&[]), "");
    }
}
