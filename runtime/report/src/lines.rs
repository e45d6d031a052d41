//! Learning curves over one abscissa: interquartile means with their bands, and a table below.

use minijinja::Value;
use serde::Serialize;

use crate::band::Estimate;
use crate::series::pack;
use crate::svg::{self, Axis, Chart, Tick};
use crate::text::{Format, count};

/// Rows of the table.
const TABLE_ROWS: usize = 12;

/// One line; `None` where it has no value.
pub struct Line<'a> {
    pub label: &'a str,
    pub style: &'a str,
    pub points: Vec<Option<Estimate>>,
}

/// What `lines.html` shows.
#[derive(Serialize)]
pub struct Lines {
    id: String,
    title: String,
    unit: &'static str,
    x_name: &'static str,
    chart: Value,
    legend: Vec<(String, String)>,
    rows: Vec<Vec<String>>,
    /// For the script of the page.
    #[serde(skip)]
    pub data: serde_json::Value,
}

/// What is drawn.
pub struct Drawing<'a> {
    pub id: &'a str,
    pub title: &'a str,
    pub x_name: &'static str,
    pub format: fn(f64) -> Format,
}

/// `at` ascends, one place for each point of a line. `None` if there are less than two places.
pub fn lines(drawing: &Drawing, at: &[f64], lines: &[Line]) -> Option<Lines> {
    let (first, last) = (*at.first()?, *at.last()?);
    let shown = lines.iter().flat_map(|line| &line.points).flatten().flat_map(|it| {
        let (lo, hi) = it.interval.unwrap_or((it.mid, it.mid));
        [lo, it.mid, hi]
    });
    let x = Axis { lo: first, hi: last, ..Axis::linear([first, last], 5, Format::number) };
    let ticks = x.ticks.into_iter().filter(|tick| (first..=last).contains(&tick.value));
    let x = Axis { ticks: ticks.map(|tick| Tick { label: count(tick.value), ..tick }).collect(), ..x };
    let y = Axis::linear(shown, 5, drawing.format);
    let format = (drawing.format)(y.lo.abs().max(y.hi.abs()));
    let words = lines.iter().filter_map(|line| {
        let (first, last) = (line.points.iter().flatten().next()?, line.points.iter().flatten().last()?);
        Some(format!("{} goes from {} to {}.", line.label, format.plain(first.mid), format.plain(last.mid)))
    });
    let chart = Chart {
        id: drawing.id,
        title: drawing.title,
        description: &words.collect::<Vec<_>>().join(" "),
        height: 250,
        x: &x,
        y: &y,
        area: &lines.iter().map(|line| draw(line, at, &x, &y)).collect::<String>(),
        over: "",
    };
    let every = at.len().div_ceil(TABLE_ROWS);
    let picked = at.iter().enumerate().filter(|(k, _)| (k + 1) % every == 0 || k + 1 == at.len());
    let cell = |line: &Line, k: usize| match line.points.get(k).copied().flatten() {
        Some(Estimate { mid, interval: Some((lo, hi)) }) => {
            format!("{} [{}, {}]", format.plain(mid), format.plain(lo), format.plain(hi))
        }
        Some(Estimate { mid, interval: None }) => format.plain(mid),
        None => String::new(),
    };
    let rows = picked
        .map(|(k, at)| [at.to_string()].into_iter().chain(lines.iter().map(|line| cell(line, k))).collect());
    (first < last).then(|| Lines {
        data: serde_json::json!({
            "id": drawing.id, "title": drawing.title, "name": drawing.x_name, "across": 1, "unit": format.unit,
            "factor": format.factor, "steps": false, "middle": "interquartile mean",
            "samples": lines.iter().map(|line| packed(line, at)).collect::<Vec<_>>(),
        }),
        id: drawing.id.to_string(),
        title: drawing.title.to_string(),
        unit: format.unit,
        x_name: drawing.x_name,
        chart: Value::from_safe_string(chart.render()),
        legend: lines.iter().map(|line| (line.label.to_string(), line.style.to_string())).collect(),
        rows: rows.collect(),
    })
}

fn packed(line: &Line, at: &[f64]) -> serde_json::Value {
    let end = |pick: fn((f64, f64)) -> f64| {
        pack(line.points.iter().map(|it| it.map(|it| it.interval.map_or(it.mid, pick))))
    };
    serde_json::json!({
        "label": line.label, "style": line.style,
        "x": pack(at.iter().copied().map(Some)),
        "mid": pack(line.points.iter().map(|it| it.map(|it| it.mid))),
        "lo": end(|it| it.0), "hi": end(|it| it.1),
    })
}

fn draw(line: &Line, at: &[f64], x: &Axis, y: &Axis) -> String {
    let known = || at.iter().zip(&line.points).filter_map(|(at, it)| Some((x.place(*at), (*it)?)));
    let region: Vec<_> =
        known().filter_map(|(at, it)| it.interval.map(|(lo, hi)| (at, y.place(lo), y.place(hi)))).collect();
    format!(
        r#"<g class="{}"><path class="band" d="{}"/><path class="mid" d="{}"/></g>"#,
        line.style,
        svg::region(&region),
        svg::line(known().map(|(at, it)| Some((at, y.place(it.mid)))))
    )
}
