//! Where the numbers come from: hashes, versions, machine, settings, the Plan.

use std::collections::BTreeMap;

use minijinja::context;
use minijinja::value::Serde;
use serde::Serialize;

use super::{Content, Panel};
use crate::Provenance;
use crate::origins::{Origin, origins};
use crate::view::View;

pub const PANEL: Panel = Panel {
    id: "provenance",
    title: "Provenance",
    template: include_str!("provenance.html"),
    script: None,
    fills: false,
    content,
};

#[derive(Serialize)]
struct SettingRow<'a> {
    name: &'a str,
    values: Vec<(String, Option<Origin>)>,
    /// Whether the methods differ in it.
    differs: bool,
}

fn content(view: &View) -> Option<Content> {
    let input = view.input;
    let summary = input.summary;
    let scenario = input.source.first().map_or(&input.plan.name, |(name, _)| name);
    let version = format!("{}, numerics version {}", summary.version, summary.numerics_version);
    let Provenance { command, cpu, threads, duration } = &input.provenance;
    // The last of each tells code from prose.
    let (first, count) = (input.plan.first_seed, input.plan.seeds);
    let seeds =
        if count == 1 { first.to_string() } else { format!("{first} to {}", first + count.max(1) - 1) };
    let facts = [
        ("Scenario", scenario, true),
        ("Command", command, true),
        ("Meaning hash", &summary.meaning_hash, true),
        ("Study hash", &summary.study_hash, true),
        ("mpgx", &version, false),
        ("Seeds", &seeds, false),
        ("Processor", cpu, false),
        ("Threads", threads, false),
        ("Duration", duration, false),
    ];
    let facts: Vec<_> = facts.into_iter().filter(|(_, value, _)| !value.is_empty()).collect();
    let labels: Vec<_> = view.learners().map(|method| (method.label, method.style.as_str())).collect();
    let context = context! {
        facts => Serde(facts),
        labels => Serde(labels),
        settings => Serde(settings(view)),
        plan => input.plan.to_ron(),
    };
    Some(Content { context, data: None })
}

/// Every setting of every learner, one row a name.
fn settings<'v>(view: &'v View) -> Vec<SettingRow<'v>> {
    let learners = &view.input.plan.learners;
    let origins = origins(view);
    let mut rows: BTreeMap<&str, Vec<(String, Option<Origin>)>> = BTreeMap::new();
    for (k, method) in learners.iter().enumerate() {
        for (name, setting) in &method.what.settings {
            let row = rows.entry(name).or_insert_with(|| vec![(String::new(), None); learners.len()]);
            if let Some(value) = row.get_mut(k) {
                let origin = origins.get(&(method.label.clone(), name.clone())).cloned();
                *value = (setting.to_string(), origin);
            }
        }
    }
    let differs = |values: &[(String, Option<Origin>)]| {
        values.iter().any(|value| values.first().map(|it| &it.0) != Some(&value.0))
    };
    rows.into_iter().map(|(name, values)| SettingRow { name, differs: differs(&values), values }).collect()
}
