//! Learning curves: the interquartile mean over seeds with its bootstrap band, a tolerance band around it, and
//! every seed as a thin line.

use minijinja::value::Serde;
use minijinja::{Value, context};
use mpgx_study::statistics::tolerance;
use serde::Serialize;

use super::{Content, Panel};
use crate::band::FEWEST_SEEDS;
use crate::course::{
    CONFIDENCE, Curves, Packed, Point, Quantity, SHARE, Seed, curves, letters_a_bin, pace, quantities,
};
use crate::grid::Grid;
use crate::series::lttb;
use crate::svg::{self, Axis, Chart};
use crate::text::{Format, count, escape};
use crate::view::{Entry, View};

pub const PANEL: Panel = Panel {
    id: "curves",
    title: "Learning",
    template: include_str!("curves.html"),
    script: Some(include_str!("../script/curves.js")),
    fills: false,
    content,
};

/// Rows of a table below a chart.
const TABLE_ROWS: usize = 12;

/// Letters of all curves in the page.
const BUDGET: usize = 400_000;

/// Points of a drawn line: the middle and the bands, a seed.
const DRAWN: usize = 160;
const DRAWN_SEED: usize = 90;

/// What the script draws.
#[derive(Serialize)]
struct Data<'a> {
    id: &'a str,
    title: &'a str,
    unit: &'static str,
    factor: f64,
    log: bool,
    level: Option<f64>,
    methods: Vec<Packed<'a>>,
}

#[derive(Serialize)]
struct Figure {
    id: String,
    title: String,
    unit: &'static str,
    chart: Value,
    rows: Vec<Vec<String>>,
}

fn content(view: &View) -> Option<Content> {
    let grid = grid(view)?;
    let last = grid.last;
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
        let shown = &axis(&methods, level, &quantity);
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
            chart: Value::from_safe_string(chart.render()),
            rows: table(&methods, &grid, format),
        });
        let Format { unit, factor, .. } = format;
        let methods = methods.iter().map(Curves::packed).collect();
        let Quantity { id, title, log, .. } = &quantity;
        data.push(serde_json::to_value(Data { id, title, unit, factor, log: *log, level, methods }).ok()?);
    }
    let paces: Vec<_> = view.learners().map(|method| pace(view, method)).collect();
    let legend: Vec<_> = view.learners().map(|method| (method.label, method.style.as_str())).collect();
    let context = context! {
        legend => Serde(legend),
        figures => Serde(figures),
        filters => grid.filters.iter().map(|filter| filter.name).collect::<Vec<_>>(),
        timed => paces.iter().all(|pace| pace.is_timed()),
        tolerance => covered(view),
        oracle => view.oracle().map(|oracle| oracle.label),
        protocol => view.main_protocol().map(|protocol| protocol.name.as_str()),
    };
    let data = serde_json::json!({
        "steps": grid.steps(), "filters": grid.filters, "paces": paces, "charts": data
    });
    Some(Content { context, data: Some(data) })
}

/// The grid of all learners' curves; `None` if nothing was learned.
pub fn grid(view: &View) -> Option<Grid> {
    let trainings = || view.learners().flat_map(|it| &it.records).filter_map(|it| it.training.as_ref());
    let last = trainings().filter_map(|it| it.steps.last()).max().copied().filter(|&last| last > 0)?;
    let seeds = trainings().count();
    let episodes = trainings().map(|it| it.steps.len()).sum::<usize>() as f64 / seeds.max(1) as f64;
    let (quantities, methods) = (quantities(view).len(), view.learners().count());
    let letters = |filters: usize| letters_a_bin(seeds + 5 * filters * methods, quantities);
    let most = |filters| BUDGET / letters(filters).max(1);
    Some(Grid::new(last, view.input.plan.world.horizon, episodes, most))
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

fn axis(methods: &[Curves], level: Option<f64>, quantity: &Quantity) -> Axis {
    let shown = methods.iter().flat_map(shown).flatten().flatten().copied().chain(level);
    if quantity.log {
        Axis::log(shown, quantity.format)
    } else {
        // The zero of a quantity that never changes its sign is worth seeing.
        Axis::linear(shown.chain([0.0]), 5, quantity.format)
    }
}

/// The points of the filter that is shown.
fn shown<'a>(curves: &'a Curves) -> &'a [Option<Point>] {
    curves.bands.first().map(Vec::as_slice).unwrap_or_default()
}

fn draw(curves: &Curves, grid: &Grid, y: &Axis) -> String {
    let known = |values: &[Option<f64>]| -> Vec<(f64, f64)> {
        let values = values.iter().enumerate();
        values.filter_map(|(bin, value)| Some((grid.place(bin), y.place((*value)?)))).collect()
    };
    let window = grid.filters.first().map_or(1, |filter| filter.window);
    let seed = |seed: &Seed| {
        let points = known(&grid.smooth(&seed.values, window));
        let kept = lttb(&points, DRAWN_SEED).into_iter().map(|k| points.get(k).copied());
        let class = if seed.failed { "seed failed" } else { "seed" };
        format!(r#"<path class="{class}" d="{}"/>"#, svg::line(kept))
    };
    let points = shown(curves);
    let middle: Vec<_> = points.iter().map(|point| point.map(|[mid, ..]| mid)).collect();
    let middle = known(&middle);
    let kept = lttb(&middle, DRAWN);
    let whole: Vec<(usize, &Point)> =
        points.iter().enumerate().filter_map(|(bin, point)| Some((bin, point.as_ref()?))).collect();
    let region = |ends: fn(&Point) -> (f64, f64)| {
        let points = kept.iter().filter_map(|k| whole.get(*k)).map(|(bin, point)| {
            let (lo, hi) = ends(point);
            (grid.place(*bin), y.place(lo), y.place(hi))
        });
        svg::region(&points.collect::<Vec<_>>())
    };
    format!(
        r#"<g class="{}"><path class="outer" d="{}"/>{}<path class="band" d="{}"/><path class="mid" d="{}"/></g>"#,
        curves.style,
        region(|[_, _, _, low, high]| (*low, *high)),
        curves.seeds.iter().map(seed).collect::<String>(),
        region(|[_, lo, hi, ..]| (*lo, *hi)),
        svg::line(kept.iter().map(|k| middle.get(*k).copied()))
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
        let first = shown(curves).iter().flatten().next()?;
        let last = shown(curves).iter().flatten().last()?;
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
        let cell = |curves: &Curves| match shown(curves).get(bin).copied().flatten() {
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
