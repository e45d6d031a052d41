//! A Task: a World of the Plan, checked and compiled.

mod build;

use mpgx_lang::plan::{Area, Place};

use crate::body::Body;
use crate::episode::{Episode, EpisodeKey};
use crate::maths::{Vec2, clamp};
use crate::program::{Agents, Number, Program, Shape, Truth, Vector};
use crate::script::Script;

/// A World, ready to run. It never changes; what changes is an [`Episode`].
#[derive(Clone, Debug)]
pub struct Task {
    pub(crate) dt_s: f64,
    pub(crate) horizon: usize,
    pub(crate) safety_m: f64,
    pub(crate) agents: Vec<Agent>,
    /// The agents that the policy commands, in the order of the action.
    pub(crate) learned: Vec<usize>,
    pub(crate) scripts: Vec<Script>,
    pub(crate) shapes: Vec<Shape>,
    pub(crate) require: Vec<Truth>,
    pub(crate) observed: Vec<Observed>,
    pub(crate) terms: Vec<Term>,
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
    /// `None`: its motion places it.
    pub start: Option<Vector>,
}

/// One number or vector of the learner's state.
#[derive(Clone, Debug)]
pub(crate) struct Observed {
    name: String,
    pub value: Program,
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
    /// Length of the learner's state.
    pub fn state_len(&self) -> usize {
        self.observed.iter().map(Observed::len).sum()
    }

    /// Length of the action: two for each learned agent.
    pub fn action_len(&self) -> usize {
        2 * self.learned.len()
    }

    /// Steps in an episode.
    pub fn horizon(&self) -> usize {
        self.horizon
    }

    /// Number of agents.
    pub fn agents(&self) -> usize {
        self.agents.len()
    }

    /// Number of reward terms.
    pub fn term_count(&self) -> usize {
        self.terms.len()
    }

    /// Number of slots of all formations.
    pub fn slot_count(&self) -> usize {
        self.shapes.iter().map(|shape| shape.displacements.len()).sum()
    }

    /// What each entry of the state is, as written: `F[i] - p[i] (follower[2]) x`.
    pub fn observation_names(&self) -> Vec<String> {
        let mut names = Vec::new();
        for observed in &self.observed {
            match observed.value {
                Program::Vector(_) => {
                    names.extend(["x", "y"].map(|axis| format!("{} {axis}", observed.name)))
                }
                _ => names.push(observed.name.clone()),
            }
        }
        names
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
        Episode {
            key: EpisodeKey::default(),
            step: 0,
            agents: Agents::new(self.agents.len()),
            before: vec![[0.0; 2]; self.agents.len()],
            fresh: memory.clone(),
            memory,
            outputs: vec![[0.0; 2]; self.scripts.len()],
            slots: vec![[0.0; 2]; self.slot_count()],
            terms: vec![0.0; self.terms.len()],
        }
    }

    /// The position in [`Episode::slots`] of the first formation's slot of an agent.
    pub(crate) fn slot_of(&self, agent: usize) -> Option<usize> {
        let mut before = 0;
        for shape in &self.shapes {
            if let Some(member) = agent.checked_sub(shape.first)
                && member < shape.displacements.len()
            {
                return Some(before + member);
            }
            before += shape.displacements.len();
        }
        None
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

impl Observed {
    fn len(&self) -> usize {
        if matches!(self.value, Program::Vector(_)) { 2 } else { 1 }
    }
}

#[cfg(test)]
mod tests;
