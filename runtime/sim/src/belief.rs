//! Robots that do not know their poses: they act on what they are told.

use crate::body::Pose;
use crate::episode::Episode;
use crate::maths::{add, rotate, scale, subtract};
use crate::step::{Mode, Step};
use crate::task::Task;

impl Task {
    /// Where a robot stands: x and y of the middle of its axle (of bodies without one, its position), m, and
    /// its heading, rad.
    pub fn stand(&self, episode: &Episode, agent: usize) -> [f64; 3] {
        let Pose { position, heading } = episode.pose(agent);
        let [x, y] = subtract(position, self.hand(agent, heading));
        [x, y, heading]
    }

    /// Whether a robot has a heading; those without one are told 0.
    pub fn has_heading(&self, agent: usize) -> bool {
        self.agents[agent].body.has_heading()
    }

    /// Makes `belief` the episode as it looks to those who know only what they are told of the poses of some agents
    /// (as [`Task::stand`] gives them); all else is true. What is observed late was believed when it was new, so
    /// `belief` must have followed the same episode from its start.
    pub fn believe(&self, belief: &mut Episode, truth: &Episode, told: &[(usize, [f64; 3])]) {
        let late = std::mem::take(&mut belief.late);
        belief.clone_from(truth);
        if truth.step > 0 {
            belief.late = late;
        }
        for &(agent, [x, y, heading]) in told {
            let heading = if self.has_heading(agent) { heading } else { 0.0 };
            let position = add([x, y], self.hand(agent, heading));
            belief.set_pose(agent, Pose { position, heading });
        }
        self.refresh_slots(belief);
        match truth.step {
            0 => self.remember_start(belief),
            _ => self.remember(belief),
        }
    }

    /// [`Task::step`] for robots that act on a belief: who is wrong about its heading drives that much off the
    /// direction it is told, because wheels know no axes of the world.
    ///
    /// # Panics
    /// As [`Task::step`].
    pub fn step_believing(
        &self,
        episode: &mut Episode,
        belief: &Episode,
        action: &[f32],
        mode: Mode,
    ) -> Step {
        self.ask(episode, action);
        for (asked, &agent) in episode.asked.iter_mut().zip(&self.learned) {
            if self.agents[agent].body.turns_commands() {
                *asked = rotate(*asked, episode.agents.heading[agent] - belief.agents.heading[agent]);
            }
        }
        self.advance(episode, mode)
    }

    /// From the axle to the position.
    fn hand(&self, agent: usize, heading: f64) -> [f64; 2] {
        let (sin, cos) = libm::sincos(heading);
        scale([cos, sin], self.agents[agent].body.hand_m())
    }
}

#[cfg(test)]
mod tests;
