//! What is seen and commanded, entry by entry, and how much work the learning is.

use super::eval::{Eval, Who};
use super::formations::agent_name;
use super::scene::Scene;
use crate::plan::{Each, IndexSet, Method, Setting, World};

/// Sizes of a study, known before anything is spent.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sizes {
    /// Entries of the learner's state, in order: what is observed, and how many numbers that are.
    pub state: Vec<(String, usize)>,
    /// What each part of the action commands; two entries each.
    pub action: Vec<String>,
    pub learners: Vec<Work>,
}

/// The work of one learner for one seed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Work {
    pub label: String,
    /// Steps of the environment, at most.
    pub steps: f64,
    /// Mini-batches learned from, at most.
    pub updates: f64,
    /// Weights and biases of the actor and of one critic; 0 if the learner has no `hidden` layers.
    pub actor: f64,
    pub critic: f64,
}

/// Members of a set that are counted one by one, at most.
const COUNTED: usize = 10_000;

impl Sizes {
    pub fn state_len(&self) -> usize {
        self.state.iter().map(|(_, entries)| entries).sum()
    }

    pub fn action_len(&self) -> usize {
        2 * self.action.len()
    }
}

pub fn sizes(scene: &Scene) -> Sizes {
    let (plan, world) = (scene.plan, scene.world);
    let state = world.observe.iter().map(|it| {
        let members = it.over.as_ref().map_or(1, |over| members(scene, over));
        (it.text.clone(), members * if it.vector { 2 } else { 1 })
    });
    // A shared policy commands one member.
    let action = match &world.shared {
        Some(shared) => {
            vec![world.groups.get(shared.group).map_or(String::new(), |group| group.name.clone())]
        }
        None => world.learned().into_iter().map(|agent| agent_name(world, agent)).collect(),
    };
    let mut sizes = Sizes { state: state.collect(), action, ..Sizes::default() };
    let (seen, told) = (sizes.state_len(), sizes.action_len());
    sizes.learners = plan.learners.iter().map(|learner| work(world, learner, seen, told)).collect();
    sizes
}

/// Members of a set that are kept by a filter of who is who.
fn members(scene: &Scene, over: &Each) -> usize {
    let all: usize = Eval::new(scene).members(&over.set).iter().map(|(_, count)| count).sum();
    let (Some(filter), Some(agents)) = (&over.filter, agents(scene, &over.set)) else { return all };
    let kept = |agent: &usize| {
        let group = scene.group_of(*agent).into_iter().collect();
        let mut eval = Eval::new(scene).bind(over.var.id, Who { groups: group, agent: Some(*agent) });
        if let Some(shared) = &scene.world.shared {
            // All members see equally many; the first stands for them.
            let first = scene.world.first_of(shared.group);
            eval = eval.bind(shared.var.id, Who { groups: vec![shared.group], agent: Some(first) });
        }
        eval.truth(filter).can_hold
    };
    agents.into_iter().take(COUNTED).filter(kept).count()
}

fn agents(scene: &Scene, set: &IndexSet) -> Option<Vec<usize>> {
    let world = scene.world;
    let of = |keep: &dyn Fn(usize) -> bool| {
        let groups = (0..world.groups.len()).filter(|group| keep(*group));
        let range = |group: usize| {
            let first = world.first_of(group);
            first..first + world.groups.get(group).map_or(0, |group| group.size)
        };
        groups.flat_map(range).collect::<Vec<usize>>()
    };
    let solid = |group: usize| world.groups.get(group).is_some_and(|group| group.solid.is_some());
    Some(match set {
        IndexSet::All => of(&|group| !solid(group)),
        IndexSet::Obstacles => of(&solid),
        IndexSet::Group(group) => of(&|other| other == *group),
        _ => return None,
    })
}

fn work(world: &World, learner: &Method, state: usize, action: usize) -> Work {
    let setting = |name: &str| match learner.what.settings.get(name) {
        Some(Setting::Number(value)) => Some(*value),
        _ => None,
    };
    let by_episodes = setting("episodes").map_or(f64::INFINITY, |episodes| episodes * world.horizon as f64);
    let steps = setting("steps").unwrap_or(f64::INFINITY).min(by_episodes);
    let (actor, critic) = match learner.what.settings.get("hidden") {
        Some(Setting::List(hidden)) => (weights(state, hidden, action), weights(state + action, hidden, 1)),
        _ => (0.0, 0.0),
    };
    let updates = steps * setting("inner").unwrap_or(1.0);
    Work { label: learner.label.clone(), steps, updates, actor, critic }
}

/// Weights and biases of a network of fully connected layers.
fn weights(inputs: usize, hidden: &[f64], outputs: usize) -> f64 {
    let mut total = 0.0;
    let mut width = inputs as f64;
    for next in hidden.iter().copied().chain([outputs as f64]) {
        total += (width + 1.0) * next;
        width = next;
    }
    total
}

#[cfg(test)]
mod tests {
    use super::weights;

    #[test]
    fn weights_of_the_papers_networks() {
        assert_eq!(weights(2, &[400.0, 300.0], 2), 1200.0 + 120_300.0 + 602.0);
        assert_eq!(weights(3, &[], 1), 4.0);
    }
}
