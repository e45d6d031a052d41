//! What went wrong, and how long everything took.

use minijinja::context;
use minijinja::value::Serde;
use mpgx_study::record::Timing;
use serde::Serialize;

use super::{Content, Panel};
use crate::text::{Format, duration, plural};
use crate::view::{Entry, View};

pub const PANEL: Panel = Panel {
    id: "failures",
    title: "Failures and time",
    template: include_str!("failures.html"),
    script: None,
    fills: false,
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
    cells: usize,
    /// Training, mean of a cell; steps and updates a second.
    training: Option<[String; 3]>,
    /// Evaluation, mean of a cell.
    evaluation: String,
    /// Of both together.
    share: String,
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
    let times: Vec<_> = view.methods.iter().filter_map(|method| time(view, method)).collect();
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

fn time<'v>(view: &View<'v>, method: &'v Entry<'v>) -> Option<Time<'v>> {
    let input = view.input;
    let cells = || {
        let records = input.records.iter().filter(|(_, record)| record.method == method.label);
        records.filter_map(|(id, record)| Some((record, input.timings.get(id)?)))
    };
    let n = cells().count();
    let of = |pick: fn(&Timing) -> f64| cells().map(|(_, timing)| pick(timing)).sum::<f64>();
    let (training_s, evaluation_s) = (of(|it| it.training_s), of(|it| it.evaluation_s));
    let trained = || cells().filter_map(|(record, _)| record.training.as_ref());
    let steps: u64 = trained().filter_map(|training| training.steps.last()).sum();
    let updates: u64 = trained().map(|training| training.updates).sum();
    let rate = |count: u64| {
        let rate = count as f64 / training_s;
        Format { digits: 0, ..Format::number(rate) }.plain(rate)
    };
    let training = || [duration(training_s / n as f64), rate(steps), rate(updates)];
    let share = training_s / (training_s + evaluation_s).max(f64::MIN_POSITIVE);
    (n > 0).then(|| Time {
        method: method.label,
        style: &method.style,
        cells: n,
        training: (method.learned && training_s > 0.0).then(training),
        evaluation: duration(evaluation_s / n as f64),
        share: Format { digits: 0, ..Format::percent(share) }.plain(share),
    })
}
