//! What the learners say of themselves while they train: the two critics, their gap, the noise.

use minijinja::value::Serde;
use minijinja::{Value, context};
use mpgx_study::record::Health;
use serde::Serialize;

use super::{Content, Panel};
use crate::series::{lttb, pack};
use crate::svg::{self, Axis, Chart, Tick};
use crate::text::{Format, count};
use crate::view::{Entry, View};

pub const PANEL: Panel = Panel {
    id: "health",
    title: "Critics",
    template: include_str!("health.html"),
    script: Some(include_str!("../script/health.js")),
    fills: false,
    content,
};

/// Entries of the log that are kept.
const POINTS: usize = 1000;
/// Points of a drawn line.
const DRAWN: usize = 80;
/// Letters of all series in the page.
const BUDGET: usize = 200_000;

/// What is known of the metrics, in the order of the page; others follow under their own names.
const KNOWN: &[(&str, &str)] = &[
    ("q/q1", "First critic"),
    ("q/q2", "Second critic"),
    ("q/gap", "Gap of the critics"),
    ("q/delta_adj", "Momentum adjustment"),
    ("q/estimate_minus_return", "First critic less the return that followed"),
    ("noise/explore", "Exploration noise"),
    ("loss/critic", "Critic loss"),
    ("loss/actor", "Actor loss"),
    ("grad/critic", "Gradient of the critics"),
    ("grad/actor", "Gradient of the actor"),
    ("action/saturation", "Saturated actions"),
];

#[derive(Serialize)]
struct Figure {
    title: String,
    metric: String,
    chart: Value,
    last: Vec<(String, String, String)>,
    id: String,
    #[serde(skip)]
    data: serde_json::Value,
}

/// Updates and values of one seed.
type Line = Vec<(f64, f64)>;

/// The kept entries of the log, the same for all learners and metrics.
struct Entries {
    updates: Vec<u64>,
    every: usize,
}

impl Entries {
    /// Of the longest log, as many as there is room for.
    fn new(view: &View, metrics: usize) -> Entries {
        let longest = healths(view).map(|health| &health.updates).max_by_key(|updates| updates.len());
        let all = longest.map(Vec::as_slice).unwrap_or_default();
        let room = BUDGET / (4 * metrics * healths(view).count()).max(1);
        let every = all.len().div_ceil(room.clamp(20, POINTS)).max(1);
        Entries { updates: all.iter().copied().step_by(every).collect(), every }
    }

    fn packed(&self, column: &[f32]) -> String {
        pack(column.iter().step_by(self.every).map(|value| Some(f64::from(*value))))
    }
}

fn content(view: &View) -> Option<Content> {
    let known = KNOWN.iter().map(|(metric, title)| (metric.to_string(), title.to_string()));
    let mut others: Vec<&str> =
        healths(view).flat_map(|health| health.columns.keys()).map(String::as_str).collect();
    others.sort_unstable();
    others.dedup();
    others.retain(|metric| KNOWN.iter().all(|(known, _)| known != metric));
    let others = others.into_iter().map(|metric| (metric.to_string(), metric.to_string()));
    let metrics: Vec<_> = known.chain(others).collect();
    let entries = Entries::new(view, metrics.len());
    let figures: Vec<_> =
        metrics.into_iter().filter_map(|(metric, title)| figure(view, metric, title, &entries)).collect();
    let charts: Vec<_> = figures.iter().map(|figure| &figure.data).collect();
    let data = serde_json::json!({ "updates": entries.updates, "charts": charts });
    let legend: Vec<_> = view.learners().map(|method| (method.label, method.style.as_str())).collect();
    let context = context! { legend => Serde(legend), figures => Serde(&figures) };
    (!figures.is_empty()).then_some(Content { context, data: Some(data) })
}

fn healths<'v>(view: &'v View) -> impl Iterator<Item = &'v Health> {
    view.learners()
        .flat_map(|method| &method.records)
        .filter_map(|record| record.training.as_ref().map(|training| &training.health))
}

fn lines(method: &Entry, metric: &str) -> Vec<Line> {
    let line = |health: &Health| {
        let column = health.columns.get(metric)?;
        let pairs =
            health.updates.iter().zip(column).map(|(&updates, &value)| (updates as f64, f64::from(value)));
        Some(pairs.filter(|(_, value)| value.is_finite()).collect())
    };
    method
        .records
        .iter()
        .filter_map(|record| line(&record.training.as_ref()?.health))
        .filter(|line: &Line| !line.is_empty())
        .collect()
}

/// Mean over the seeds, entry by entry, as far as all go.
fn mean(lines: &[Line]) -> Line {
    let length = lines.iter().map(Vec::len).min().unwrap_or(0);
    let at = |k: usize| {
        let values: Vec<(f64, f64)> = lines.iter().filter_map(|line| line.get(k)).copied().collect();
        let x = values.first()?.0;
        Some((x, values.iter().map(|(_, value)| value).sum::<f64>() / values.len() as f64))
    };
    (0..length).filter_map(at).collect()
}

fn figure(view: &View, metric: String, title: String, entries: &Entries) -> Option<Figure> {
    let all: Vec<(&Entry, Vec<Line>)> = view
        .learners()
        .map(|method| (method, lines(method, &metric)))
        .filter(|(_, lines)| !lines.is_empty())
        .collect();
    let points = || all.iter().flat_map(|(_, lines)| lines.iter().flatten());
    let last = points().map(|(updates, _)| *updates).fold(0.0, f64::max);
    if last == 0.0 {
        return None;
    }
    let x = Axis::linear([0.0, last], 3, Format::number);
    let ticks = x.ticks.into_iter().map(|tick| Tick { label: count(tick.value), ..tick }).collect();
    let x = Axis { hi: last, ticks, ..x };
    let y = Axis::linear(points().map(|(_, value)| *value), 5, Format::number);
    let draw = |line: &Line| {
        let points: Vec<_> = line.iter().map(|&(a, b)| (x.place(a), y.place(b))).collect();
        svg::line(lttb(&points, DRAWN).into_iter().map(|k| points.get(k).copied()))
    };
    let area: String = all
        .iter()
        .map(|(method, lines)| {
            let seeds: String =
                lines.iter().map(|line| format!(r#"<path class="seed" d="{}"/>"#, draw(line))).collect();
            let mid = draw(&mean(lines));
            format!(r#"<g class="{}">{seeds}<path class="mid" d="{mid}"/></g>"#, method.style)
        })
        .collect();
    let last: Vec<_> = all
        .iter()
        .filter_map(|(method, lines)| {
            let value = mean(lines).last()?.1;
            Some((method.label.to_string(), method.style.clone(), Format::number(value).plain(value)))
        })
        .collect();
    let words: Vec<_> = last.iter().map(|(label, _, value)| format!("{label} ends at {value}")).collect();
    let id = format!("health-{}", metric.replace(|c: char| !c.is_ascii_alphanumeric(), "-"));
    let packed = |(method, _): &(&Entry, Vec<Line>)| {
        let seeds = method.records.iter().filter_map(|record| {
            let column = record.training.as_ref()?.health.columns.get(&metric)?;
            let values = entries.packed(column);
            Some(serde_json::json!({ "seed": record.seed, "failed": record.failure.is_some(), "values": values }))
        });
        serde_json::json!({ "label": method.label, "style": method.style, "seeds": seeds.collect::<Vec<_>>() })
    };
    let methods: Vec<_> = all.iter().map(packed).collect();
    let data = serde_json::json!({ "id": id, "title": title, "methods": methods });
    let chart = Chart {
        id: &id,
        title: &title,
        description: &format!("{metric} against updates; mean over seeds: {}.", words.join(", ")),
        height: 150,
        x: &x,
        y: &y,
        area: &area,
        over: "",
    };
    let chart = Value::from_safe_string(chart.render());
    Some(Figure { title, metric, chart, last, id, data })
}
