//! Obstacles: who has hit them, and whom they stop.

use crate::episode::Episode;
use crate::maths::{add, scale, subtract};
use crate::outline::Outline;
use crate::program::clearance;
use crate::task::Task;

/// What is left between an outline and an agent that it stops, so that rounding does not put it inside, m.
const GAP_M: f64 = 1e-9;
/// An agent between several obstacles is put back this often, at most.
const MOST_ROUNDS: usize = 16;

impl Task {
    /// Pairs of an agent and an obstacle that it is in and may not be in.
    pub(super) fn hits(&self, episode: &Episode) -> u16 {
        let mut count = 0u16;
        for &(agent, obstacle) in &self.barred {
            let inside = clearance(&self.model, &episode.agents.position, agent, obstacle) < 0.0;
            count = count.saturating_add(u16::from(inside));
        }
        count
    }

    /// Puts agents that have moved into an obstacle that stops them, or through it, at its outline. One that
    /// finds no room between several stays where it was.
    pub(super) fn stop(&self, episode: &mut Episode) {
        for (agent, obstacles) in &self.stopped {
            let settled = (0..MOST_ROUNDS).any(|round| {
                let free = !self.turn_back(episode, *agent, obstacles, round > 0);
                free && !self.push_out(episode, *agent, obstacles)
            });
            if !settled {
                episode.agents.position[*agent] = episode.before[*agent];
            }
        }
    }

    /// Puts an agent that has passed an outline where it first met one; tells whether it has. Only segments
    /// count once it was put elsewhere: the way out of the others may lead to their far side.
    fn turn_back(&self, episode: &mut Episode, agent: usize, obstacles: &[usize], put: bool) -> bool {
        let (position, before) = (&episode.agents.position, &episode.before);
        let crossings = obstacles.iter().filter_map(|&obstacle| {
            let from = subtract(before[agent], before[obstacle]);
            let to = subtract(position[agent], position[obstacle]);
            let outline = &self.model.outlines[obstacle];
            let solid = !matches!(outline, Outline::Segment(_));
            let crossing = outline.crossing(from, to)?;
            (!solid || !put && outline.distance(to) >= 0.0).then_some((obstacle, crossing))
        });
        let first = crossings.min_by(|(_, a), (_, b)| a.share.total_cmp(&b.share));
        let Some((obstacle, crossing)) = first else { return false };
        let at = add(episode.agents.position[obstacle], crossing.point);
        episode.agents.position[agent] = add(at, scale(crossing.back, self.model.radii[agent] + GAP_M));
        true
    }

    /// Puts an agent that is inside obstacles at the nearest point of their outlines; tells whether it was.
    fn push_out(&self, episode: &mut Episode, agent: usize, obstacles: &[usize]) -> bool {
        let mut inside = false;
        for &obstacle in obstacles {
            let position = &mut episode.agents.position;
            if clearance(&self.model, position, agent, obstacle) < 0.0 {
                let away = subtract(position[agent], position[obstacle]);
                let nearest = self.model.outlines[obstacle].nearest(away);
                let at = add(position[obstacle], nearest.point);
                position[agent] = add(at, scale(nearest.outward, self.model.radii[agent] + GAP_M));
                inside = true;
            }
        }
        inside
    }
}

#[cfg(test)]
mod tests;
