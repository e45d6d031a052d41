//! What went wrong, and how long everything took.

use minijinja::context;
use minijinja::value::Serde;
use serde::Serialize;

use super::{Content, Panel};
use crate::text::{Format, count, duration, plural};
use crate::view::View;

pub const PANEL: Panel = Panel {
    id: "failures",
    title: "Failures and time",
    template: include_str!("failures.html"),
    script: None,
    content,
};

#[derive(Serialize)]
struct Failed<'a> {
    method: &'a str,
    style: &'a str,
    seed: u32,
    step: u64,
    cause: &'a str,
    at: &'a str,
    link: Option<String>,
}

#[derive(Serialize)]
struct Time<'a> {
    method: &'a str,
    style: &'a str,
    seeds: usize,
    updates: String,
    rate: String,
    each: String,
}

fn content(view: &View) -> Option<Content> {
    let summary = view.input.summary;
    let failed: Vec<_> = summary
        .failures
        .iter()
        .map(|failure| Failed {
            method: &failure.algorithm,
            style: view.style(&failure.algorithm),
            seed: failure.seed,
            step: failure.step,
            cause: &failure.cause,
            at: &failure.at,
            link: view.place_link(&failure.at),
        })
        .collect();
    let times: Vec<_> = summary
        .training
        .iter()
        .map(|(method, training)| {
            let seconds = &training.seconds_per_seed;
            let seeds = seconds.len();
            let mean = seconds.iter().sum::<f64>() / seeds.max(1) as f64;
            let rate = training.updates_per_s_per_core;
            Time {
                method,
                style: view.style(method),
                seeds,
                updates: count(training.updates as f64),
                rate: Format { digits: 0, ..Format::number(rate) }.plain(rate),
                each: duration(mean),
            }
        })
        .collect();
    let cells = view.input.timings.len();
    let total: f64 = view.input.timings.values().map(|timing| timing.training_s + timing.evaluation_s).sum();
    let context = context! {
        failed => Serde(failed),
        times => Serde(times),
        seeds => plural(summary.seeds, "seed"),
        total => (cells > 0).then(|| format!("{} of one core for {}", duration(total), plural(cells, "cell"))),
    };
    Some(Content { context, data: None })
}
