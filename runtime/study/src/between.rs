//! Two studies against each other: their learners, on each evaluation that both have.

use std::collections::BTreeSet;

use mpgx_lang::diff::diff;
use mpgx_lang::plan::{Plan, Protocol, World};
use serde::Serialize;
use serde_json::Value;

use crate::folder::Study;
use crate::summarise::comparisons::{COMPARED, Difference, adjust, contrast};
use crate::summarise::scores::{Sample, Scores, fill, higher_is_better};
use crate::summary::Pair;

/// An evaluation of both studies.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Meeting {
    pub protocol: String,
    /// Leaders, obstacles, starts and numbers drawn are the same in both.
    pub same_episodes: bool,
    /// Returns are sums of the same reward over as many steps; otherwise they are not compared.
    pub same_reward: bool,
    /// `a` is of the first study, `b` of the second. Paired by seed if both have the same episodes and seeds.
    pub pairs: Vec<Pair>,
}

/// Compares learners of the same label or, where there are none, the first of each study.
///
/// Holm's adjustment is over all pairs of the result. A seed that failed counts as the worst of both studies.
pub fn between(a: &Study, b: &Study) -> Vec<Meeting> {
    let scores = [a, b].map(|study| Scores::measure(&study.plan, &study.records));
    let labels = labels(&a.plan, &b.plan);
    let mut meetings = Vec::new();
    for (number, protocol) in a.plan.protocols.iter().enumerate() {
        let Some(place) = b.plan.protocols.iter().position(|other| other.name == protocol.name) else {
            continue;
        };
        let Some(other) = b.plan.protocols.get(place) else { continue };
        let same_episodes = number == place && same_episodes((&a.plan, protocol), (&b.plan, other));
        let same_reward = same_reward((&a.plan, protocol), (&b.plan, other));
        let mut pairs = Vec::new();
        for metric in COMPARED.into_iter().filter(|metric| *metric != "return" || same_reward) {
            for (of_a, of_b) in &labels {
                let sample = |scores: &Scores, label| scores.get(&protocol.name, metric, label).cloned();
                let [first, second] = &scores;
                let (Some(x), Some(y)) = (sample(first, of_a), sample(second, of_b)) else { continue };
                pairs.extend(pair((&protocol.name, metric), [x, y], same_episodes));
            }
        }
        meetings.push(Meeting { protocol: protocol.name.clone(), same_episodes, same_reward, pairs });
    }
    let all = meetings.iter_mut().flat_map(|meeting| &mut meeting.pairs);
    adjust(all.map(|pair| &mut pair.comparison).collect(), higher_is_better);
    meetings
}

fn pair(place: (&str, &str), mut samples: [Sample; 2], same_episodes: bool) -> Option<Pair> {
    fill(&mut samples, higher_is_better(place.1))?;
    let [a, b] = &samples;
    let paired = same_episodes && a.seeds == b.seeds;
    let difference = if paired { Difference::paired(a, b) } else { Difference::independent(a, b) };
    let comparison = contrast(place, higher_is_better(place.1), (a, b), difference)?;
    Some(Pair { comparison, paired })
}

/// Learners to compare: of the first study, of the second.
fn labels<'a>(a: &'a Plan, b: &'a Plan) -> Vec<(&'a str, &'a str)> {
    let of = |plan: &'a Plan| plan.learners.iter().map(|learner| learner.label.as_str());
    let common: Vec<_> =
        of(a).filter(|label| of(b).any(|other| other == *label)).map(|it| (it, it)).collect();
    if common.is_empty() { of(a).zip(of(b)).take(1).collect() } else { common }
}

type Place<'a> = (&'a Plan, &'a Protocol);

fn same_episodes(a: Place, b: Place) -> bool {
    let setting = |(plan, protocol): Place| {
        let world = protocol.world.as_deref().unwrap_or(&plan.world);
        alone(plan, World { observe: vec![], reward: vec![], ends: vec![], shared: None, ..world.clone() })
    };
    let names = |plan: &Plan| plan.world.groups.iter().map(|group| group.name.clone()).collect::<Vec<_>>();
    let (x, y) = (setting(a), setting(b));
    a.1.episodes == b.1.episodes && names(&x) == names(&y) && changes(&x, &y).is_empty()
}

fn same_reward(a: Place, b: Place) -> bool {
    let world =
        |(plan, protocol): Place| alone(plan, protocol.world.as_deref().unwrap_or(&plan.world).clone());
    let counts = |change: &String| {
        let first = change.split(' ').next().unwrap_or_default();
        ["reward", "end", "horizon", "dt"].contains(&first)
    };
    let (x, y) = (world(a), world(b));
    let of = |plan: &Plan| {
        let World { reward, ends, .. } = plan.world.clone();
        used(plan, &World { reward, ends, ..World::default() })
    };
    of(&x) == of(&y) && !changes(&x, &y).iter().any(counts)
}

/// A Plan of this world only.
fn alone(plan: &Plan, world: World) -> Plan {
    let mut alone = Plan { world, name: String::new(), doc: String::new(), ..plan.clone() };
    alone.first_seed = 0;
    alone.seeds = 0;
    alone.learners.clear();
    alone.controllers.clear();
    alone.protocols.clear();
    alone.claims.clear();
    alone.stages.clear();
    alone.variants.clear();
    alone.tests.clear();
    alone
}

/// What differs between two worlds; parameters only where they are used.
fn changes(a: &Plan, b: &Plan) -> Vec<String> {
    let names: BTreeSet<String> = [a, b]
        .iter()
        .flat_map(|plan| used(plan, &plan.world))
        .map(|(name, _)| format!("param {name}"))
        .collect();
    let told = diff(a, b).into_iter().map(|change| change.what);
    told.filter(|what| !what.starts_with("param ") || names.contains(what)).collect()
}

/// Names and values (as bits) of the parameters that a world refers to.
fn used(plan: &Plan, world: &World) -> BTreeSet<(String, u64)> {
    let mut ids = BTreeSet::new();
    collect(&serde_json::to_value(world).unwrap_or_default(), &mut ids);
    let of = |id: u64| plan.params.get(usize::try_from(id).ok()?);
    ids.into_iter().filter_map(of).map(|param| (param.name.clone(), param.value.to_bits())).collect()
}

fn collect(value: &Value, ids: &mut BTreeSet<u64>) {
    match value {
        Value::Object(fields) => {
            for (name, value) in fields {
                match value.as_u64() {
                    Some(id) if name == "Param" || name == "param" => _ = ids.insert(id),
                    _ => collect(value, ids),
                }
            }
        }
        Value::Array(values) => values.iter().for_each(|value| collect(value, ids)),
        _ => {}
    }
}
