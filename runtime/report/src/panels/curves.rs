//! Learning curves: the interquartile mean over seeds with its bootstrap band, a tolerance band around it, and
//! every seed as a thin line.

use minijinja::value::Serde;
use minijinja::{Value, context};
use mpgx_study::record::Training;
use mpgx_study::statistics::tolerance;
use serde::Serialize;

use super::{Content, Panel};
use crate::band::{Estimate, FEWEST_SEEDS, Resamples};
use crate::grid::{Grid, WINDOW};
use crate::svg::{self, Axis, Chart};
use crate::text::{Format, count, escape};
use crate::view::{Entry, View};

pub const PANEL: Panel = Panel {
    id: "curves",
    title: "Learning",
    template: include_str!("curves.html"),
    script: Some(include_str!("../curves.js")),
    content,
};

/// Of all seeds, that the outer band is to hold, and how sure that is.
const SHARE: f64 = 0.9;
const CONFIDENCE: f64 = 0.95;

/// Rows of a table below a chart.
const TABLE_ROWS: usize = 12;

/// What is drawn against the steps of training.
struct Quantity {
    id: String,
    title: String,
    format: fn(f64) -> Format,
    /// Metric of the held-out evaluation whose oracle value is drawn as a level.
    metric: String,
    log: bool,
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

/// One method's curves of one quantity on the shared grid of steps.
#[derive(Serialize)]
struct Curves<'a> {
    label: &'a str,
    style: &'a str,
    seeds: Vec<Seed>,
    raw: Vec<Option<Point>>,
    smooth: Vec<Option<Point>>,
}

#[derive(Serialize)]
struct Seed {
    seed: u32,
    failed: bool,
    values: Vec<Option<f64>>,
}

/// Middle, low and high end of the band; low and high end of the tolerance interval.
type Point = [f64; 5];

/// A chart with all the forms its switches choose from.
#[derive(Serialize)]
struct Data<'a> {
    level: Option<f64>,
    id: &'a str,
    title: &'a str,
    unit: &'static str,
    factor: f64,
    methods: &'a [Curves<'a>],
    axes: Axes,
}

#[derive(Serialize)]
struct Axes {
    smooth: Axis,
    raw: Axis,
    smooth_log: Option<Axis>,
    raw_log: Option<Axis>,
}

#[derive(Serialize)]
struct Figure {
    id: String,
    title: String,
    unit: &'static str,
    log: bool,
    chart: Value,
    rows: Vec<Vec<String>>,
}

fn content(view: &View) -> Option<Content> {
    let trainings =
        || view.learners().flat_map(|method| method.records.iter().filter_map(|r| r.training.as_ref()));
    let last =
        trainings().filter_map(|training| training.steps.last()).max().copied().filter(|&last| last > 0)?;
    let grid = Grid::new(last, view.input.plan.world.horizon);
    let x = Axis { lo: 0.0, hi: last as f64, ..Axis::linear([0.0, last as f64], 5, Format::number) };
    let x = Axis {
        ticks: x.ticks.into_iter().map(|tick| svg::Tick { label: count(tick.value), ..tick }).collect(),
        ..x
    };
    let mut figures = Vec::new();
    let mut data = Vec::new();
    for quantity in quantities(view) {
        let methods: Vec<_> = view.learners().map(|method| curves(method, &quantity, &grid)).collect();
        let level = view.oracle().zip(view.main_protocol()).and_then(|(oracle, protocol)| {
            view.statistic(&protocol.name, oracle.label, &quantity.metric).map(|statistic| statistic.iqm)
        });
        let axes = Axes {
            smooth: axis(&methods, true, level, false, &quantity),
            raw: axis(&methods, false, level, false, &quantity),
            smooth_log: quantity.log.then(|| axis(&methods, true, level, true, &quantity)),
            raw_log: quantity.log.then(|| axis(&methods, false, level, true, &quantity)),
        };
        let shown = axes.smooth_log.as_ref().unwrap_or(&axes.smooth);
        let format = (quantity.format)(shown.lo.abs().max(shown.hi.abs()));
        let chart = Chart {
            id: &format!("curve-{}", quantity.id),
            title: &quantity.title,
            description: &describe(&methods, format),
            height: 250,
            x: &x,
            y: shown,
            area: &methods.iter().map(|curves| draw(curves, &grid, shown)).collect::<String>(),
            over: &level.map(|level| level_line(level, shown, format)).unwrap_or_default(),
        };
        figures.push(Figure {
            id: quantity.id.clone(),
            title: quantity.title.clone(),
            unit: format.unit,
            log: quantity.log,
            chart: Value::from_safe_string(chart.render()),
            rows: table(&methods, &grid, format),
        });
        let Format { unit, factor, .. } = format;
        let entry =
            Data { level, id: &quantity.id, title: &quantity.title, unit, factor, methods: &methods, axes };
        data.push(serde_json::to_value(entry).ok()?);
    }
    let legend: Vec<_> = view.learners().map(|method| (method.label, method.style.as_str())).collect();
    let context = context! {
        legend => Serde(legend),
        figures => Serde(figures),
        window => format!("{:.0} %", WINDOW * 100.0),
        tolerance => covered(view),
        oracle => view.oracle().map(|oracle| oracle.label),
        protocol => view.main_protocol().map(|protocol| protocol.name.as_str()),
    };
    let data = serde_json::json!({ "steps": grid.steps(), "window": grid.window, "charts": data });
    Some(Content { context, data: Some(data) })
}

/// What the outer bands hold, in words; nothing where there is none.
fn covered(view: &View) -> Option<String> {
    let finished = |method: &Entry| {
        let whole = method.records.iter().filter(|it| it.training.is_some() && it.failure.is_none());
        whole.count()
    };
    let fewest = view.learners().map(finished).filter(|n| *n >= FEWEST_SEEDS).min()?;
    let places: Vec<f64> = (0..fewest).map(|rank| rank as f64).collect();
    let share = (100.0 * tolerance(&places, SHARE, CONFIDENCE)?.share).floor();
    Some(format!("{share}\u{a0}%"))
}

fn quantities(view: &View) -> Vec<Quantity> {
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

fn curves<'v>(method: &'v Entry, quantity: &Quantity, grid: &Grid) -> Curves<'v> {
    let seeds: Vec<Seed> = method
        .records
        .iter()
        .filter_map(|record| {
            let training = record.training.as_ref()?;
            let values = grid.resample(&training.steps, &quantity.column.of(training));
            let values = values.into_iter().map(|value| value.map(short)).collect();
            Some(Seed { seed: record.seed, failed: record.failure.is_some(), values })
        })
        .collect();
    let finished: Vec<_> = seeds.iter().filter(|seed| !seed.failed).map(|seed| seed.values.clone()).collect();
    let smoothed: Vec<_> = finished.iter().map(|values| grid.smooth(values)).collect();
    let resamples = Resamples::new(finished.len());
    let band =
        |seeds: &[Vec<Option<f64>>]| (0..grid.bins).map(|bin| estimate(&resamples, seeds, bin)).collect();
    let (raw, smooth) = (band(&finished), band(&smoothed));
    Curves { label: method.label, style: &method.style, seeds, raw, smooth }
}

fn estimate(resamples: &Resamples, seeds: &[Vec<Option<f64>>], bin: usize) -> Option<Point> {
    let values: Vec<f64> = seeds.iter().filter_map(|values| values.get(bin).copied().flatten()).collect();
    let Estimate { mid, interval } = resamples.estimate(&values)?;
    let (lo, hi) = interval.unwrap_or((mid, mid));
    let outer = tolerance(&values, SHARE, CONFIDENCE).filter(|_| interval.is_some());
    let (low, high) = outer.map_or((mid, mid), |it| (it.lo, it.hi));
    Some([mid, lo, hi, low, high].map(short))
}

/// Six significant digits: more would only make the file longer.
fn short(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}

fn axis(methods: &[Curves], smooth: bool, level: Option<f64>, log: bool, quantity: &Quantity) -> Axis {
    let points = |curves: &Curves| if smooth { curves.smooth.clone() } else { curves.raw.clone() };
    let shown = methods.iter().flat_map(points).flatten().flatten().chain(level);
    if log {
        Axis::log(shown, quantity.format)
    } else {
        // The zero of a quantity that never changes its sign is worth seeing.
        Axis::linear(shown.chain([0.0]), 5, quantity.format)
    }
}

fn draw(curves: &Curves, grid: &Grid, y: &Axis) -> String {
    let at = |bin: usize, value: f64| (grid.place(bin), y.place(value));
    let trace = |values: &[Option<f64>]| {
        svg::line(values.iter().enumerate().map(|(bin, value)| value.map(|value| at(bin, value))))
    };
    let region = |ends: fn(&Point) -> (f64, f64)| {
        let points = curves.smooth.iter().enumerate().filter_map(|(bin, point)| {
            let (lo, hi) = ends(point.as_ref()?);
            Some((grid.place(bin), y.place(lo), y.place(hi)))
        });
        svg::region(&points.collect::<Vec<_>>())
    };
    let middle: Vec<_> = curves.smooth.iter().map(|point| point.map(|[mid, ..]| mid)).collect();
    let seeds: String = curves
        .seeds
        .iter()
        .map(|seed| {
            let class = if seed.failed { "seed failed" } else { "seed" };
            format!(r#"<path class="{class}" d="{}"/>"#, trace(&grid.smooth(&seed.values)))
        })
        .collect();
    format!(
        r#"<g class="{}"><path class="outer" d="{}"/>{seeds}<path class="band" d="{}"/><path class="mid" d="{}"/></g>"#,
        curves.style,
        region(|[_, _, _, low, high]| (*low, *high)),
        region(|[_, lo, hi, ..]| (*lo, *hi)),
        trace(&middle)
    )
}

fn level_line(level: f64, y: &Axis, format: Format) -> String {
    let top = y.top(level);
    let label = escape(&format!("oracle {}", format.at(level).full(level)));
    format!(
        r#"<line class="level" x1="0" x2="100%" y1="{top}" y2="{top}"/><text x="100%" y="{top}" dy="-.45em">{label}</text>"#
    )
}

/// First and last value of each method, in words.
fn describe(methods: &[Curves], format: Format) -> String {
    let words = methods.iter().filter_map(|curves| {
        let first = curves.smooth.iter().flatten().next()?;
        let last = curves.smooth.iter().flatten().last()?;
        Some(format!(
            "{} goes from {} to {}.",
            curves.label,
            format.at(first[0]).full(first[0]),
            format.at(last[0]).full(last[0])
        ))
    });
    let words: Vec<_> = words.collect();
    format!("Against environment steps of training. {}", words.join(" "))
}

fn table(methods: &[Curves], grid: &Grid, format: Format) -> Vec<Vec<String>> {
    let every = grid.bins.div_ceil(TABLE_ROWS);
    let steps = grid.steps();
    let row = |(bin, step): (usize, &u64)| {
        let cell = |curves: &Curves| match curves.smooth.get(bin).copied().flatten() {
            Some([mid, lo, hi, ..]) if lo < hi => {
                format!(
                    "{} [{}, {}]",
                    format.at(mid).plain(mid),
                    format.at(mid).plain(lo),
                    format.at(mid).plain(hi)
                )
            }
            Some([mid, ..]) => format.at(mid).plain(mid),
            None => String::new(),
        };
        [step.to_string()].into_iter().chain(methods.iter().map(cell)).collect()
    };
    steps
        .iter()
        .enumerate()
        .filter(|(bin, _)| (bin + 1) % every == 0 || bin + 1 == grid.bins)
        .map(row)
        .collect()
}
