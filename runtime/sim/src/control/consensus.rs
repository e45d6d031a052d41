//! Linear consensus on a formation of places.

use super::Controller;
use super::bonds::Bonds;
use crate::episode::Episode;
use crate::error::SimError;
use crate::maths::{Vec2, scale, subtract};
use crate::task::Task;

/// Neighbours agree on where the formation is:
///
/// u_i = −gain Σ_j ((p_i − p_j) − (d_i − d_j)) + v_leader
///
/// with the displacements d of the places; the leader is a node of the graph, which pins its neighbours to it
/// (Ren and Beard, "Distributed Consensus in Multi-vehicle Cooperative Control", Springer 2008, chapters 2 and 3).
/// With a leader at rest the error x of the followers obeys ẋ = −gain L x, where L is the Laplacian without the
/// leader's row and column.
pub(super) struct Consensus {
    bonds: Bonds,
    /// 1/s.
    gain: f64,
    /// Whether the leader's velocity is added.
    feedforward: bool,
}

impl Consensus {
    /// # Errors
    /// If the formation of a learned agent tells no places.
    pub fn new(task: &Task, bonds: Bonds, gain: f64, feedforward: bool) -> Result<Self, SimError> {
        match task.learned.iter().find(|&&agent| place(task, agent).is_none()) {
            None => Ok(Consensus { bonds, gain, feedforward }),
            Some(&agent) => Err(SimError::NoSlot {
                controller: "consensus".into(),
                agent: task.agents[agent].name.clone(),
                at: task.agents[agent].at.clone(),
            }),
        }
    }
}

impl Controller for Consensus {
    fn command(&mut self, task: &Task, episode: &Episode, action: &mut [f32]) {
        let leader = |agent| task.model.formations[task.formation_of(agent)?].about;
        let velocity = |agent| match leader(agent) {
            Some(leader) if self.feedforward => episode.agents.velocity[leader],
            _ => [0.0; 2],
        };
        // (p_i − p_j) − (d_i − d_j) is the difference of the ways from the places.
        let astray = |agent: usize| -> Vec2 {
            let slot = place(task, agent).map(|slot| episode.slots[slot]);
            slot.map_or([0.0; 2], |slot| subtract(episode.position(agent), slot))
        };
        let pull = |ends: [usize; 2]| scale(subtract(astray(ends[0]), astray(ends[1])), -self.gain);
        self.bonds.command(task, episode, action, velocity, |edge| pull(edge.ends));
    }
}

/// The entry of [`Episode::slots`] of an agent.
fn place(task: &Task, agent: usize) -> Option<usize> {
    task.slot_of(task.formation_of(agent)?, agent)
}
