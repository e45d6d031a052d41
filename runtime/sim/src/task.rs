//! A Task: a World of the Plan, checked and compiled.

mod build;
mod formation;

use std::ops::Range;
use std::sync::Arc;

use mpgx_lang::plan::{Area, Place};

use crate::body::Body;
use crate::episode::{Episode, EpisodeKey};
use crate::filter::{Barrier, Guard};
use crate::maths::{Vec2, clamp};
use crate::observe::Observed;
use crate::program::{Agents, Formation, Model, Number, Scene, Truth, Vector};
use crate::script::Script;

/// A World, ready to run. It never changes; what changes is an [`Episode`].
#[derive(Clone, Debug)]
pub struct Task {
    pub(crate) dt_s: f64,
    pub(crate) horizon: usize,
    pub(crate) safety_m: f64,
    /// Agents and obstacles.
    pub(crate) agents: Vec<Agent>,
    /// Those that are no obstacles.
    pub(crate) everyone: Arc<[usize]>,
    pub(crate) obstacles: Arc<[usize]>,
    /// Agents that are stopped, and by which obstacles.
    pub(crate) stopped: Vec<(usize, Vec<usize>)>,
    /// Pairs of an agent and an obstacle that it may not be in: one that stops it, or that stops nobody.
    pub(crate) barred: Vec<(usize, usize)>,
    /// The agents that the policy commands, in the order of the action.
    pub(crate) learned: Vec<usize>,
    /// The agents and obstacles whose velocity nothing commands.
    pub(crate) uncommanded: Vec<usize>,
    /// The learned agents with a filter.
    pub(crate) guards: Vec<Guard>,
    pub(crate) scripts: Vec<Script>,
    pub(crate) model: Model,
    pub(crate) randomised: Vec<Randomised>,
    pub(crate) require: Vec<Truth>,
    /// The members of a shared policy.
    pub(crate) shared: Option<Range<usize>>,
    pub(crate) observed: Vec<Observed>,
    pub(crate) state_len: usize,
    /// Whether an observation is noisy.
    pub(crate) noisy: bool,
    pub(crate) terms: Vec<Term>,
    /// Whether each member is rewarded for itself.
    pub(crate) rewarded: bool,
    pub(crate) ends: Vec<End>,
}

/// What never changes of an agent.
#[derive(Clone, Debug)]
pub(crate) struct Agent {
    /// `leader`, `follower[2]`.
    pub name: String,
    pub group: String,
    pub at: Place,
    pub body: Body,
    pub arena: Option<Area>,
    /// Of the velocity command on each axis.
    pub speed_mps: (f64, f64),
    pub filter: Option<Barrier>,
    /// `None`: its motion places it.
    pub start: Option<Vector>,
}

/// A parameter that is drawn for each episode.
#[derive(Clone, Debug)]
pub(crate) struct Randomised {
    pub name: String,
    pub at: Place,
    pub value: Number,
}

#[derive(Clone, Debug)]
pub(crate) struct Term {
    pub name: String,
    pub at: Place,
    pub value: Number,
}

#[derive(Clone, Debug)]
pub(crate) struct End {
    pub name: String,
    pub at: Place,
    pub when: Truth,
    pub cost: Option<Number>,
}

impl Task {
    /// Length of the learner's state; with a shared policy, of the state of each member.
    pub fn state_len(&self) -> usize {
        self.state_len
    }

    /// How many members share one policy. `None`: one policy commands all learned agents.
    pub fn shared(&self) -> Option<usize> {
        self.shared.as_ref().map(Range::len)
    }

    /// Length of the action: two for each learned agent.
    pub fn action_len(&self) -> usize {
        2 * self.learned.len()
    }

    /// Steps in an episode.
    pub fn horizon(&self) -> usize {
        self.horizon
    }

    /// Number of agents and obstacles.
    pub fn agents(&self) -> usize {
        self.agents.len()
    }

    /// Number of reward terms.
    pub fn term_count(&self) -> usize {
        self.terms.len()
    }

    /// Number of places of all formations.
    pub fn slot_count(&self) -> usize {
        self.model.formations.iter().map(Formation::places).sum()
    }

    /// What each entry of the action is: `follower[2] velocity x`.
    pub fn action_names(&self) -> Vec<String> {
        let axes =
            |&agent: &usize| ["x", "y"].map(|axis| format!("{} velocity {axis}", self.agents[agent].name));
        self.learned.iter().flat_map(axes).collect()
    }

    /// Buffers for an episode of this task; [`Task::reset`] begins one.
    pub fn episode(&self) -> Episode {
        let memory = vec![[0.0; 2]; self.scripts.iter().map(Script::memory).sum()];
        let late = self.observed.iter().map(Observed::late).sum::<usize>() * self.members();
        Episode {
            key: EpisodeKey::default(),
            step: 0,
            agents: Agents::new(self.agents.len()),
            params: vec![f64::NAN; self.randomised.len()],
            asked: vec![[0.0; 2]; self.learned.len()],
            before: vec![[0.0; 2]; self.agents.len()],
            fresh: memory.clone(),
            memory,
            outputs: vec![[0.0; 2]; self.scripts.len()],
            slots: vec![[0.0; 2]; self.slot_count()],
            terms: vec![0.0; self.terms.len()],
            rewards: vec![0.0; self.members()],
            late: vec![0.0; late],
        }
    }

    /// What observes and is rewarded: the members of a shared policy, or the one learner.
    pub(crate) fn members(&self) -> usize {
        self.shared().unwrap_or(1)
    }

    pub(crate) fn scene<'a>(&'a self, episode: &'a Episode) -> Scene<'a> {
        Scene::new(&self.model, &episode.agents, &episode.params, self.time_s(episode))
    }

    /// Makes the first index variable stand for a member of a shared policy.
    pub(crate) fn bind(&self, scene: &mut Scene, member: usize) {
        if let Some(members) = &self.shared {
            scene.bind(members.start + member);
        }
    }

    pub(crate) fn time_s(&self, episode: &Episode) -> f64 {
        episode.step as f64 * self.dt_s
    }

    /// The first formation that an agent is a member of.
    pub(crate) fn formation_of(&self, agent: usize) -> Option<usize> {
        self.model.formations.iter().position(|formation| formation.has(agent))
    }

    /// The position in [`Episode::slots`] of a member's slot, if its formation is one of places.
    pub(crate) fn slot_of(&self, formation: usize, agent: usize) -> Option<usize> {
        let it = self.model.formations.get(formation)?;
        let before: usize = self.model.formations.iter().take(formation).map(Formation::places).sum();
        (it.places() > 0).then(|| before + agent - it.first)
    }
}

impl Agent {
    /// The velocity on one axis that an action of −1 to 1 commands, m/s.
    pub fn command(&self, action: f32) -> f64 {
        let (low, high) = self.speed_mps;
        let share = clamp(f64::from(action), -1.0, 1.0);
        clamp((low + high) / 2.0 + share * ((high - low) / 2.0), low, high)
    }

    /// The action for a velocity on one axis, clipped to the limits.
    pub fn action(&self, velocity: f64) -> f32 {
        let (low, high) = self.speed_mps;
        let half = (high - low) / 2.0;
        if half == 0.0 { 0.0 } else { clamp((velocity - (low + high) / 2.0) / half, -1.0, 1.0) as f32 }
    }

    /// The nearest position inside its arena.
    pub fn inside(&self, [x, y]: Vec2) -> Vec2 {
        match self.arena {
            None => [x, y],
            Some(arena) => [clamp(x, arena.x_m.0, arena.x_m.1), clamp(y, arena.y_m.0, arena.y_m.1)],
        }
    }

    pub fn is_outside(&self, [x, y]: Vec2) -> bool {
        self.arena
            .is_some_and(|arena| x < arena.x_m.0 || x > arena.x_m.1 || y < arena.y_m.0 || y > arena.y_m.1)
    }
}

#[cfg(test)]
mod tests;
