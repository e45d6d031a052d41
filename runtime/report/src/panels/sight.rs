//! Robots that do not know their poses: how good what they are told is, and what that costs.

use std::collections::BTreeSet;
use std::fmt::Write;

use minijinja::value::Serde;
use minijinja::{Value, context};
use mpgx_lang::plan::{Extern, Localised, Protocol, Setting, World};
use mpgx_study::record::{Evaluation, LocalisationTable, LocaliserRecord, Told};
use serde::Serialize;

use super::{Content, Panel};
use crate::band::Estimate;
use crate::lines::{Drawing, Line, Lines, lines};
use crate::text::{Format, count};
use crate::view::View;

pub const PANEL: Panel = Panel {
    id: "sight",
    title: "What robots see",
    template: include_str!("sight.html"),
    script: None,
    fills: false,
    content,
};

#[derive(Serialize)]
struct Network<'a> {
    name: &'a str,
    about: String,
    rows: Vec<Row>,
    /// Of x and y.
    ranges: [String; 2],
    /// Correlations of the errors of x, y and heading with the next ones.
    alike: [String; 3],
    charts: Vec<Lines>,
}

#[derive(Serialize)]
struct Row {
    name: String,
    /// Whether it is a part of the row above.
    part: bool,
    cells: Vec<String>,
}

/// A method under a protocol in which poses are told, or one of the same world in which they are known.
#[derive(Serialize)]
struct Cost<'a> {
    method: &'a str,
    style: &'a str,
    cells: Vec<String>,
}

fn content(view: &View) -> Option<Content> {
    let networks: Vec<_> = view.input.localisers.values().map(network).collect();
    let protocols = &view.input.plan.protocols;
    let budget: Vec<_> = protocols.iter().flat_map(|protocol| costs(view, protocol)).collect();
    if networks.is_empty() && budget.is_empty() {
        return None;
    }
    let odometry: BTreeSet<String> =
        seeing(view).flat_map(|(_, protocol)| odometries(view.world(protocol))).collect();
    let context = context! {
        networks => Serde(networks),
        budget => Serde(budget),
        odometry => odometry.into_iter().collect::<Vec<_>>().join("; "),
        told => told(view),
    };
    Some(Content { context, data: None })
}

/// The protocols in which poses are told.
fn seeing<'v>(view: &'v View) -> impl Iterator<Item = (usize, &'v Protocol)> {
    let protocols = view.input.plan.protocols.iter().enumerate();
    protocols.filter(|(_, protocol)| !view.world(protocol).localised.is_empty())
}

fn network(record: &LocaliserRecord) -> Network<'_> {
    let mut rows = Vec::new();
    let mut add = |name: &str, table: &LocalisationTable| {
        rows.push(row(name, false, &table.all));
        for (name, part) in table.by_lighting.iter().chain(&table.by_trajectory) {
            rows.push(row(name, true, part));
        }
    };
    add("network", &record.network);
    let all = |table: &LocalisationTable| LocalisationTable {
        by_lighting: Default::default(),
        by_trajectory: Default::default(),
        ..table.clone()
    };
    add("retrieval", &all(&record.retrieval));
    add("dead reckoning", &all(&record.reckoning));
    let ranges = &record.network.all.ranges;
    let range = |axis: usize| {
        let format = Format { unit: "m", factor: 1.0, digits: 2 };
        format!("{} to {}", format.plain(ranges.low[axis]), format.full(ranges.high[axis]))
    };
    Network {
        name: &record.name,
        about: format!(
            "{} parameters, {} pictures learnt from",
            count(three(record.parameters as f64)),
            count(three(record.images as f64))
        ),
        rows,
        ranges: [range(0), range(1)],
        alike: record.reliability.correlation.map(|correlation| format!("{correlation:.2}")),
        charts: [distribution(record), course(record)].into_iter().flatten().collect(),
    }
}

/// With three digits.
fn three(value: f64) -> f64 {
    let size = libm::pow(10.0, libm::floor(libm::log10(value.max(1.0))) - 2.0);
    (value / size).round() * size
}

fn row(name: &str, part: bool, found: &mpgx_vision::measure::Localisation) -> Row {
    let percent = |value: &Option<f64>| value.map_or_else(String::new, |value| format!("{value:.2}"));
    let mut cells: Vec<String> = found.percent.iter().map(percent).collect();
    cells.push(format!("{:.0}", 1000.0 * found.translation.median()));
    cells.push(format!("{:.2}", found.rotation.median().to_degrees()));
    cells.push(format!("{:.1}", 100.0 * found.recall_5cm_5deg));
    Row { name: name.into(), part, cells }
}

/// Places of a distribution's lines.
const PLACES: usize = 51;

/// How many answers are at most so far off.
fn distribution(record: &LocaliserRecord) -> Option<Lines> {
    let known = [
        ("network", "m0", &record.network),
        ("retrieval", "m1", &record.retrieval),
        ("dead reckoning", "m2", &record.reckoning),
    ];
    let most = record.network.all.translation.quantile(0.99).max(0.05);
    let at: Vec<f64> = (0..PLACES).map(|k| 1000.0 * most * k as f64 / (PLACES - 1) as f64).collect();
    let drawn = known.map(|(label, style, table)| Line {
        label,
        style,
        points: at.iter().map(|mm| single(table.all.translation.share_within(mm / 1000.0))).collect(),
    });
    let drawing = Drawing {
        id: &format!("sight-{}-cdf", record.name),
        title: "Answers that are at most so far off",
        x_name: "distance from the true place, mm",
        format: Format::percent,
    };
    lines(&drawing, &at, &drawn)
}

/// How the network was trained.
fn course(record: &LocaliserRecord) -> Option<Lines> {
    let at: Vec<f64> = record.steps.iter().map(|step| *step as f64).collect();
    let parts = [("position", "m0"), ("orientation", "m1"), ("distances to landmarks", "m2")];
    let drawn: Vec<Line> = parts
        .iter()
        .enumerate()
        .map(|(part, &(label, style))| Line {
            label,
            style,
            points: record.errors_percent.iter().map(|errors| single(errors[part] / 100.0)).collect(),
        })
        .collect();
    let drawing = Drawing {
        id: &format!("sight-{}-course", record.name),
        title: "Mean error while it learns, of the range",
        x_name: "steps of training",
        format: Format::percent,
    };
    lines(&drawing, &at, &drawn)
}

fn single(mid: f64) -> Option<Estimate> {
    Some(Estimate { mid, interval: None })
}

fn costs<'v>(view: &'v View, protocol: &'v Protocol) -> Vec<Cost<'v>> {
    let world = view.world(protocol);
    let knows = world.localised.is_empty();
    if knows && !seeing(view).any(|(_, other)| knowing(view, view.world(other)) == Some(protocol)) {
        return Vec::new();
    }
    let knowing = knowing(view, world);
    let cost = |method: &'v crate::view::Entry| {
        let of =
            |protocol: &str, metric: &str| view.statistic(protocol, method.label, metric).map(|it| it.iqm);
        let told = |metric: &str| if knows { Some(None) } else { of(&protocol.name, metric).map(Some) };
        let (place, heading) = (told("position_error_m")?, told("heading_error_rad")?);
        let distance = of(&protocol.name, "error_m")?;
        let known = knowing.and_then(|knowing| of(&knowing.name, "error_m"));
        let millimetres = |metres: f64| format!("{:.0}", 1000.0 * metres);
        Some(Cost {
            method: method.label,
            style: &method.style,
            cells: vec![
                protocol.name.clone(),
                ways(view, world),
                place.map(millimetres).unwrap_or_default(),
                heading.map(|heading| format!("{:.2}", heading.to_degrees())).unwrap_or_default(),
                millimetres(distance),
                known.map(|known| format!("{:.2}", distance / known)).unwrap_or_default(),
            ],
        })
    };
    view.methods.iter().filter_map(cost).collect()
}

/// How the poses of a world are known.
fn ways(view: &View, world: &World) -> String {
    let way = |localised: &Localised| {
        let localiser = view.input.plan.localisers.get(localised.via)?;
        let sees = if localiser.what.name == "noisy" { "true pose with noise" } else { "sees" };
        let joined = if localised.odometry { ", with odometry" } else { "" };
        Some(format!("{sees} ({}){joined}", localiser.name))
    };
    let ways: BTreeSet<String> = world.localised.iter().filter_map(way).collect();
    if ways.is_empty() { "knows".to_owned() } else { ways.into_iter().collect::<Vec<_>>().join("; ") }
}

/// How wrong what is counted is, of the groups that count.
fn odometries(world: &World) -> impl Iterator<Item = String> {
    let joined = world.localised.iter().filter(|localised| localised.odometry);
    let groups = joined.filter_map(|localised| world.groups.get(localised.group));
    groups.filter_map(|group| {
        let odometry = group.odometry.as_ref()?;
        Some(format!(
            "{}: slip {} %, bias {} %",
            group.name,
            share(odometry, "slip")?,
            share(odometry, "bias")?
        ))
    })
}

/// A setting, in percent.
fn share(what: &Extern, name: &str) -> Option<f64> {
    match what.settings.get(name)? {
        Setting::Number(value) => Some((1e4 * value).round() / 100.0),
        _ => None,
    }
}

/// The protocol of the same world in which everybody knows its pose.
fn knowing<'v>(view: &'v View, world: &World) -> Option<&'v Protocol> {
    let known = World { localised: Vec::new(), ..world.clone() };
    view.input.plan.protocols.iter().find(|protocol| *view.world(protocol) == known)
}

/// The first learner's first recorded episode in which poses are told.
fn told(view: &View) -> Option<Value> {
    let (_, protocol) = seeing(view).next()?;
    let method = view.first()?;
    let (seed, evaluation) = method.evaluations(&protocol.name).next()?;
    let Evaluation { trajectories, told: Some(told), .. } = evaluation else { return None };
    let agents = view.world(protocol).agents();
    let picture = picture(&trajectories.first()?.agents, told, agents, &method.style)?;
    let caption = format!("{}, seed {seed}, first held-out episode of “{}”", method.label, protocol.name);
    Some(context! { caption, picture => Value::from_safe_string(picture) })
}

fn picture(truth: &[[f32; 3]], told: &Told, agents: usize, style: &str) -> Option<String> {
    let poses = told.poses.first()?;
    let places = || {
        let frames = poses.chunks(told.agents.len().max(1)).zip(truth.chunks(agents.max(1)));
        frames.flat_map(|(told_now, now)| {
            let true_now = told.agents.iter().filter_map(|&agent| now.get(agent as usize));
            told_now
                .iter()
                .zip(true_now)
                .enumerate()
                .map(|(k, (told, now))| (k, [told[0], told[1]], [now[0], now[1]]))
        })
    };
    let all = places().flat_map(|(_, told, now)| [told, now]).filter(|p| p.iter().all(|x| x.is_finite()));
    let [x0, x1, y0, y1] = all.fold([f32::MAX, f32::MIN, f32::MAX, f32::MIN], |[x0, x1, y0, y1], [x, y]| {
        [x0.min(x), x1.max(x), y0.min(y), y1.max(y)]
    });
    let side = (x1 - x0).max(y1 - y0).max(0.1);
    let (margin, scale) = (0.03 * side, 1000.0 / (1.06 * side));
    let place = |[x, y]: [f32; 2]| ((x - x0 + margin) * scale, (y1 - y + margin) * scale);
    let mut body = String::new();
    for k in 0..told.agents.len() {
        let way = places().filter(|(other, ..)| *other == k).map(|(.., now)| place(now));
        let way: Vec<String> = way.map(|(x, y)| format!("{x:.0},{y:.0}")).collect();
        let _ = write!(body, r#"<polyline class="trail {style}" points="{}"/>"#, way.join(" "));
    }
    for (_, told, now) in places().filter(|(_, told, _)| told.iter().all(|x| x.is_finite())) {
        let ((x, y), (tx, ty)) = (place(told), place(now));
        let _ = write!(
            body,
            r#"<path class="off" d="M{tx:.0} {ty:.0}L{x:.0} {y:.0}"/><circle class="seen {style}" cx="{x:.0}" cy="{y:.0}" r="4"/>"#
        );
    }
    let (width, height) = ((x1 - x0 + 2.0 * margin) * scale, (y1 - y0 + 2.0 * margin) * scale);
    Some(format!(
        r#"<svg class="still" role="img" aria-label="Where the robots were and where they took themselves to be" viewBox="0 0 {width:.0} {height:.0}">{body}</svg>"#
    ))
}
