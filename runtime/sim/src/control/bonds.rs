//! Control laws that are sums over the neighbours in a formation.

use super::aims::{asking, write};
use crate::episode::Episode;
use crate::error::SimError;
use crate::maths::{Vec2, add, subtract};
use crate::task::Task;

/// The edges of the formations of learned agents, each the first of its group.
pub(super) struct Bonds {
    pub edges: Vec<Edge>,
}

/// Two neighbours.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edge {
    pub formation: usize,
    /// Its number in the formation's graph.
    pub number: usize,
    pub ends: [usize; 2],
}

impl Bonds {
    /// # Errors
    /// If a learned agent has no neighbour.
    pub fn new(task: &Task, controller: &str) -> Result<Bonds, SimError> {
        let mut formations: Vec<usize> =
            task.learned.iter().filter_map(|&agent| task.formation_of(agent)).collect();
        formations.sort_unstable();
        formations.dedup();
        let edges: Vec<Edge> = formations
            .into_iter()
            .flat_map(|formation| {
                let neighbours = task.model.formations[formation].neighbours().enumerate();
                neighbours.map(move |(number, ends)| Edge { formation, number, ends })
            })
            .collect();
        let lone = |agent: &&usize| !edges.iter().any(|edge| edge.ends.contains(agent));
        match task.learned.iter().find(lone) {
            None => Ok(Bonds { edges }),
            Some(&agent) => Err(SimError::NoNeighbour {
                controller: controller.into(),
                agent: task.agents[agent].name.clone(),
                at: task.agents[agent].at.clone(),
            }),
        }
    }

    /// Fills the action with `velocity` of each learned agent, m/s, and what `pull` gives for its edges: the
    /// velocity of the first end; the second gets the opposite.
    pub fn command(
        &self,
        task: &Task,
        episode: &Episode,
        action: &mut [f32],
        velocity: impl Fn(usize) -> Vec2,
        mut pull: impl FnMut(&Edge) -> Vec2,
    ) {
        let mut sums: Vec<Vec2> = (0..task.agents()).map(velocity).collect();
        for edge in &self.edges {
            let [a, b] = edge.ends;
            let pull = pull(edge);
            sums[a] = add(sums[a], pull);
            sums[b] = subtract(sums[b], pull);
        }
        for (&agent, action) in task.learned.iter().zip(action.chunks_exact_mut(2)) {
            write(task, agent, asking(task, episode, agent, sums[agent]), action);
        }
    }
}
