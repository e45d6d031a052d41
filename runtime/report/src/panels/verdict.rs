//! Did it work, how sure are we, against what.

use minijinja::value::Serde;
use minijinja::{Value, context};
use mpgx_study::summary::Statistic;
use serde::Serialize;

use super::{Content, Panel};
use crate::svg::{Axis, Strip};
use crate::text::{Format, escape, list, plural};
use crate::view::{Entry, View};

pub const PANEL: Panel = Panel {
    id: "verdict",
    title: "Verdict",
    template: include_str!("verdict.html"),
    script: None,
    fills: false,
    content,
};

/// Seeds from which on differences are more than a hint.
const ENOUGH_SEEDS: usize = 10;

#[derive(Serialize)]
struct Figure {
    label: &'static str,
    value: String,
    unit: &'static str,
    interval: Option<String>,
    note: Option<String>,
    strip: Value,
}

#[derive(Serialize)]
struct Claim<'a> {
    text: &'a str,
    holds: bool,
    because: &'a str,
    link: Option<String>,
}

fn content(view: &View) -> Option<Content> {
    let summary = view.input.summary;
    let claims: Vec<_> = summary
        .expect
        .iter()
        .map(|claim| Claim {
            text: &claim.text,
            holds: claim.holds,
            because: &claim.because,
            link: view.place_link(&claim.at),
        })
        .collect();
    let context = context! {
        sentence => Value::from_safe_string(sentence(view)),
        setting => setting(view),
        badge => badge(summary.seeds),
        figures => Serde(figures(view)),
        oracle => view.oracle().is_some(),
        claims => Serde(claims),
        failures => summary.failures.len(),
        failed => plural(summary.failures.len(), "seed"),
    };
    Some(Content { context, data: None })
}

/// One sentence in plain words, as HTML.
fn sentence(view: &View) -> String {
    let Some((method, protocol)) = view.first().zip(view.main_protocol()) else {
        return "Nothing was learned in this study.".into();
    };
    let name = name(method);
    let of = |metric| view.statistic(&protocol.name, method.label, metric);
    let Some(error) = of("error_m") else {
        return format!("{name} has no finished seed: there is nothing to judge.");
    };
    let error = Format::length(error.iqm).full(error.iqm);
    let mut text = format!("{name} is <b>{error}</b> off its place on average");
    if let Some(ratio) = of("error_over_oracle") {
        text += &format!(", <b>{} times</b> the oracle’s error", Format::ratio().plain(ratio.iqm));
    }
    if let Some(share) = of("collision_episodes") {
        text += &match share.iqm {
            0.0 => ", without a collision".into(),
            share => {
                format!(", with collisions in <b>{}</b> of episodes", Format::percent(share).full(share))
            }
        };
    }
    text + &standing(view, &protocol.name, method) + "."
}

/// How the first learner stands against the others, by error.
fn standing(view: &View, protocol: &str, method: &Entry) -> String {
    let with = |verdict: &str| -> Vec<String> {
        view.input
            .summary
            .comparisons
            .iter()
            .filter(|c| c.protocol == protocol && c.metric == "error_m" && c.a == method.label)
            .filter(|c| c.verdict == verdict)
            .filter_map(|c| view.methods.iter().find(|other| other.label == c.b && other.style != "ref"))
            .map(name)
            .collect()
    };
    let said = [
        ("better", "closer than"),
        ("worse", "farther than"),
        ("no difference shown", "not shown to differ from"),
    ];
    said.iter()
        .map(|(verdict, words)| (words, with(verdict)))
        .filter(|(_, others)| !others.is_empty())
        .map(|(words, others)| format!("; {words} {}", list(&others)))
        .collect()
}

fn name(method: &Entry) -> String {
    format!(r#"<span class="name {}">{}</span>"#, method.style, escape(method.label))
}

fn setting(view: &View) -> String {
    let summary = view.input.summary;
    let Some(protocol) = view.main_protocol() else { return plural(summary.seeds, "seed") };
    format!(
        "{} of training, {} on “{}” for each final policy, no noise; 95\u{a0}% intervals over seeds.",
        plural(summary.seeds, "seed"),
        plural(protocol.episodes, "held-out episode"),
        protocol.name,
    )
}

fn badge(seeds: usize) -> Option<String> {
    let why = if seeds < 5 { "too few seeds to compare" } else { "exploratory" };
    (seeds < ENOUGH_SEEDS).then(|| format!("{}: {why}", plural(seeds, "seed")))
}

fn figures(view: &View) -> Vec<Figure> {
    let Some((method, protocol)) = view.first().zip(view.main_protocol()) else { return Vec::new() };
    let of = |metric| view.statistic(&protocol.name, method.label, metric);
    let figure = |label, metric: &'static str, format: fn(f64) -> Format, note: Option<String>| {
        let statistic = of(metric)?;
        let oracle = view
            .oracle()
            .and_then(|oracle| view.statistic(&protocol.name, oracle.label, metric))
            .map(|statistic| statistic.iqm);
        let format = format(statistic.iqm);
        Some(Figure {
            label,
            value: format.plain(statistic.iqm),
            unit: format.unit,
            interval: format.interval(statistic.lo, statistic.hi),
            note,
            strip: Value::from_safe_string(strip(statistic, &method.style, oracle)),
        })
    };
    let ratio = of("error_over_oracle").map(|ratio| {
        let interval = Format::ratio().interval(ratio.lo, ratio.hi).unwrap_or_default();
        format!("{}\u{202f}× the oracle’s {interval}", Format::ratio().plain(ratio.iqm))
    });
    let late = of("late_collision_episodes")
        .map(|share| format!("{} after step 40", Format::percent(share.iqm).full(share.iqm)));
    [
        figure("Distance from the slots", "error_m", Format::length, ratio),
        figure("Return", "return", Format::number, None),
        figure("Episodes with a collision", "collision_episodes", Format::percent, late),
    ]
    .into_iter()
    .flatten()
    .collect()
}

fn strip(statistic: &Statistic, style: &str, oracle: Option<f64>) -> String {
    let points: Vec<f64> = statistic.per_seed.iter().flatten().copied().collect();
    let interval = statistic.lo.zip(statistic.hi);
    let ends = interval.map_or([statistic.iqm; 2], |(lo, hi)| [lo, hi]);
    let shown = points.iter().copied().chain(ends).chain(oracle);
    let axis = Axis { ticks: Vec::new(), ..Axis::linear(shown, 2, Format::number) };
    Strip { axis: &axis, style, height: 24, points: &points, mid: statistic.iqm, interval, level: oracle }
        .render()
}
