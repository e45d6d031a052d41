//! What a study recorded and learned, for other programs.

use mpgx_lang::plan::{Plan, World};
use mpgx_learn::{Activation, Policy};
use serde_json::{Map, Value, json};

use crate::folder::Study;
use crate::record::{CellRecord, Evaluation, Training};

/// Name and text of `training.csv` (a line an episode of training), `health.csv` (a line an entry of what learners
/// say of themselves) and `evaluation.csv` (a line a held-out episode). What was not measured is left empty.
pub fn csv(study: &Study) -> [(&'static str, String); 3] {
    [("training.csv", training(study)), ("health.csv", health(study)), ("evaluation.csv", evaluation(study))]
}

/// Every record whole, by cell; a number that is not finite is null.
pub fn json(study: &Study) -> Value {
    json!({ "scenario": study.plan.name, "cells": study.records })
}

/// A policy in the safetensors format: `layers.<k>.weight` `[outputs, inputs]` and `layers.<k>.bias`, both f32,
/// as PyTorch's `Linear` has them; the metadata tells the activations.
pub fn safetensors(policy: &Policy) -> Vec<u8> {
    let hidden = match policy.activation() {
        Activation::Relu => "relu",
        Activation::Tanh => "tanh",
    };
    let mut header = Map::new();
    header.insert("__metadata__".into(), json!({ "hidden": hidden, "output": "tanh", "action": "-1..1" }));
    let mut data: Vec<u8> = Vec::new();
    let mut add = |name: String, shape: Value, values: &mut dyn Iterator<Item = &f32>| {
        let begin = data.len();
        values.for_each(|value| data.extend(value.to_le_bytes()));
        let entry = json!({ "dtype": "F32", "shape": shape, "data_offsets": [begin, data.len()] });
        header.insert(name, entry);
    };
    for (k, (weights, biases)) in policy.layers().iter().enumerate() {
        let shape = json!([biases.len(), weights.first().map_or(0, Vec::len)]);
        add(format!("layers.{k}.weight"), shape, &mut weights.iter().flatten());
        add(format!("layers.{k}.bias"), json!([biases.len()]), &mut biases.iter());
    }
    // Data begins at a multiple of 8.
    let mut header = Value::Object(header).to_string().into_bytes();
    header.resize(header.len().next_multiple_of(8), b' ');
    [&(header.len() as u64).to_le_bytes(), header.as_slice(), &data].concat()
}

fn training(study: &Study) -> String {
    let terms = terms(&study.plan.world);
    let head = ["method", "seed", "episode", "steps", "return", "error_m", "ended"].map(String::from);
    let mut out = line(head.into_iter().chain(terms.iter().map(|name| format!("reward/{name}"))));
    for (record, training) in trained(study) {
        for (k, steps) in training.steps.iter().enumerate() {
            let own = [record.method.clone(), record.seed.to_string(), k.to_string(), steps.to_string()];
            let sums = training.terms.get(k);
            let terms = (0..terms.len()).map(|term| number(sums.and_then(|sums| sums.get(term))));
            let measured = [number(training.returns.get(k)), number(training.error_m.get(k))];
            out +=
                &line(own.into_iter().chain(measured).chain([ended(&study.plan, training, k)]).chain(terms));
        }
    }
    out
}

/// The name of what ended an episode of training.
fn ended(plan: &Plan, training: &Training, episode: usize) -> String {
    let past = training.stages.iter().filter(|stage| stage.episodes as usize <= episode).count();
    let world = plan.stages.get(past).map_or(&plan.world, |stage| &stage.world);
    match training.ended.get(episode).copied().flatten() {
        None => "horizon".into(),
        Some(end) => world.ends.get(usize::from(end)).map(|end| end.name.clone()).unwrap_or_default(),
    }
}

fn health(study: &Study) -> String {
    let mut names: Vec<&String> = trained(study).flat_map(|(_, it)| it.health.columns.keys()).collect();
    names.sort();
    names.dedup();
    let head = ["method", "seed", "updates"].map(String::from);
    let mut out = line(head.into_iter().chain(names.iter().map(|name| name.to_string())));
    for (record, training) in trained(study) {
        for (k, updates) in training.health.updates.iter().enumerate() {
            let own = [record.method.clone(), record.seed.to_string(), updates.to_string()];
            let of = |name: &&String| training.health.columns.get(*name).and_then(|column| column.get(k));
            let values = names.iter().map(|name| of(name).map(f32::to_string).unwrap_or_default());
            out += &line(own.into_iter().chain(values));
        }
    }
    out
}

fn evaluation(study: &Study) -> String {
    let world = |name: &str| {
        let protocol = study.plan.protocols.iter().find(|protocol| protocol.name == name);
        protocol.and_then(|protocol| protocol.world.as_deref()).unwrap_or(&study.plan.world)
    };
    let mut all: Vec<&str> = Vec::new();
    for name in study.plan.protocols.iter().flat_map(|protocol| terms(world(&protocol.name))) {
        if !all.contains(&name) {
            all.push(name);
        }
    }
    type Steps = (&'static str, fn(&Evaluation) -> &[u32]);
    const STEPS: [Steps; 5] = [
        ("collision_steps", |it| &it.collision_steps),
        ("late_collision_steps", |it| &it.late_collision_steps),
        ("outside_steps", |it| &it.outside_steps),
        ("hit_steps", |it| &it.hit_steps),
        ("late_hit_steps", |it| &it.late_hit_steps),
    ];
    let head = ["method", "seed", "evaluation", "episode", "return", "error_m"].into_iter();
    let head = head.chain(STEPS.iter().map(|(name, _)| *name)).map(String::from);
    let mut out = line(head.chain(all.iter().map(|name| format!("reward/{name}"))));
    for record in study.records.values() {
        for (protocol, held_out) in &record.protocols {
            let names = terms(world(protocol));
            for (k, sum) in held_out.returns.iter().enumerate() {
                let own = [record.method.clone(), record.seed.to_string(), protocol.clone(), k.to_string()];
                let measured = [number(Some(sum)), number(held_out.error_m.get(k))];
                let steps =
                    STEPS.iter().map(|(_, of)| of(held_out).get(k).map(u32::to_string).unwrap_or_default());
                let sums = held_out.terms.get(k);
                let place = |name: &&str| names.iter().position(|other| other == name);
                let terms = all.iter().map(|name| number(place(name).and_then(|term| sums?.get(term))));
                out += &line(own.into_iter().chain(measured).chain(steps).chain(terms));
            }
        }
    }
    out
}

fn trained(study: &Study) -> impl Iterator<Item = (&CellRecord, &Training)> {
    study.records.values().filter_map(|record| Some((record, record.training.as_ref()?)))
}

fn terms(world: &World) -> Vec<&str> {
    world.reward.iter().map(|term| term.name.as_str()).collect()
}

/// As few digits as give the same number back; nothing for what is not finite.
fn number(value: Option<&f64>) -> String {
    value.filter(|value| value.is_finite()).map(f64::to_string).unwrap_or_default()
}

fn line(cells: impl Iterator<Item = String>) -> String {
    let quoted = cells.map(|cell| {
        if cell.contains([',', '"', '\n', '\r']) {
            format!("\"{}\"", cell.replace('"', "\"\""))
        } else {
            cell
        }
    });
    quoted.collect::<Vec<_>>().join(",") + "\n"
}
