//! Where learned agents should be.

use super::arrange::arrange;
use crate::episode::Episode;
use crate::error::SimError;
use crate::maths::{Vec2, distance};
use crate::program::Constraint;
use crate::task::Task;

/// Which place each learned agent steers to: its own in the first formation of its group. Where that tells
/// distances, not places, it is the place in the arrangement nearest to how all stand now.
pub(super) struct Aims {
    aims: Vec<Aim>,
    /// The formations among them that tell distances.
    distances: Vec<usize>,
}

struct Aim {
    agent: usize,
    /// The agent that the formation is about.
    about: Option<usize>,
    /// Entry of [`Episode::slots`], if the formation has them.
    slot: Option<usize>,
}

/// A learned agent and where it should be now.
#[derive(Clone, Copy, Debug)]
pub(super) struct Target {
    pub agent: usize,
    /// m.
    pub place: Vec2,
    /// The agent that its formation is about.
    pub about: Option<usize>,
}

impl Aims {
    /// # Errors
    /// If a learned agent is in no formation.
    pub fn new(task: &Task, controller: &str) -> Result<Aims, SimError> {
        let mut found = Aims { aims: Vec::new(), distances: Vec::new() };
        for &agent in &task.learned {
            let Some(formation) = task.formation_of(agent) else {
                return Err(SimError::NoSlot {
                    controller: controller.into(),
                    agent: task.agents[agent].name.clone(),
                    at: task.agents[agent].at.clone(),
                });
            };
            let it = &task.model.formations[formation];
            if matches!(it.constraint, Constraint::Distances { .. }) && !found.distances.contains(&formation)
            {
                found.distances.push(formation);
            }
            found.aims.push(Aim { agent, about: it.about, slot: task.slot_of(formation, agent) });
        }
        Ok(found)
    }

    /// One for each learned agent, in order.
    pub fn targets(&self, task: &Task, episode: &Episode) -> Vec<Target> {
        let mut arranged = match self.distances.is_empty() {
            true => Vec::new(),
            false => episode.agents.position.clone(),
        };
        for &formation in &self.distances {
            arrange(task, episode, formation, &mut arranged);
        }
        let target = |&Aim { agent, about, slot }: &Aim| {
            let place = slot.map_or_else(|| arranged[agent], |slot| episode.slots[slot]);
            Target { agent, place, about }
        };
        self.aims.iter().map(target).collect()
    }

    /// Fills the action with the command, m/s, that `command` gives for each learned agent and its place in `seen`.
    pub fn command(
        &self,
        task: &Task,
        seen: &Episode,
        action: &mut [f32],
        command: impl Fn(usize, Vec2) -> Vec2,
    ) {
        for (target, action) in self.targets(task, seen).iter().zip(action.chunks_exact_mut(2)) {
            write(task, target.agent, command(target.agent, target.place), action);
        }
    }
}

/// The action of one agent for a command, m/s.
pub(super) fn write(task: &Task, agent: usize, command: Vec2, action: &mut [f32]) {
    action.copy_from_slice(&command.map(|v| task.agents[agent].action(v)));
}

/// The command that asks for a velocity of an agent, m/s.
pub(super) fn asking(task: &Task, episode: &Episode, agent: usize, velocity: Vec2) -> Vec2 {
    task.agents[agent].body.command(episode.heading(agent), velocity)
}

/// How far apart the formation itself wants `of` and another agent, m: infinitely far if it does not tell.
/// No controller that keeps clear of others may ask for more.
pub(super) fn spacing(targets: &[Target], of: &Target, other: usize, episode: &Episode) -> f64 {
    if of.about == Some(other) {
        return distance(of.place, episode.position(other));
    }
    let other = targets.iter().find(|target| target.agent == other);
    other.map_or(f64::INFINITY, |other| distance(of.place, other.place))
}
