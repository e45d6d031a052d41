//! Artificial potential fields.

use super::Controller;
use super::aims::{Aims, Target, asking, spacing, write};
use crate::episode::Episode;
use crate::maths::{Vec2, add, norm, scale, subtract};
use crate::outline::{Nearest, Outline};
use crate::task::Task;

/// The place attracts, whatever is nearer than `reach` repels:
///
/// u_i = attraction (place − p_i) + Σ_o repulsion (1/ρ − 1/reach) / ρ² ∇ρ
///
/// with the clearance ρ of the outlines, shortened to the highest speed without a turn (Khatib, "Real-time obstacle
/// avoidance for manipulators and mobile robots", Int. J. Robotics Research 5, 1986). Other agents repel as obstacles
/// do, but not from further away than the formation itself wants them.
pub(super) struct PotentialField {
    pub aims: Aims,
    /// 1/s.
    pub attraction: f64,
    /// m⁴/s.
    pub repulsion: f64,
    /// m.
    pub reach: f64,
}

/// Nearer than this, and inside, the repulsion grows no further, m.
const NEAREST_M: f64 = 1e-3;

impl PotentialField {
    /// What repels at the clearance `rho` (m) does so with this speed, m/s.
    fn repelled(&self, rho: f64, reach: f64) -> f64 {
        let rho = rho.max(NEAREST_M);
        if rho < reach { self.repulsion * (1.0 / rho - 1.0 / reach) / (rho * rho) } else { 0.0 }
    }

    fn velocity(&self, task: &Task, episode: &Episode, targets: &[Target], of: &Target) -> Vec2 {
        let Target { agent, place, .. } = *of;
        let here = episode.position(agent);
        let mut sum = scale(subtract(place, here), self.attraction);
        let mut repel = |outline: &Outline, from: Vec2, reach: f64| {
            let Nearest { distance, outward, .. } = outline.nearest(subtract(here, from));
            let speed = self.repelled(distance - task.model.radii[agent], reach);
            sum = add(sum, scale(outward, speed));
        };
        for &obstacle in task.obstacles.iter() {
            repel(&task.model.outlines[obstacle], episode.position(obstacle), self.reach);
        }
        for &other in task.everyone.iter().filter(|&&other| other != agent) {
            let apart =
                spacing(targets, of, other, episode) - task.model.radii[agent] - task.model.radii[other];
            repel(&task.model.outlines[other], episode.position(other), self.reach.min(apart));
        }
        let (low, high) = task.agents[agent].speed_mps;
        let fastest = low.abs().max(high.abs());
        let speed = norm(sum);
        if speed > fastest { scale(sum, fastest / speed) } else { sum }
    }
}

impl Controller for PotentialField {
    fn command(&mut self, task: &Task, episode: &Episode, action: &mut [f32]) {
        let targets = self.aims.targets(task, episode);
        for (of, action) in targets.iter().zip(action.chunks_exact_mut(2)) {
            let velocity = self.velocity(task, episode, &targets, of);
            write(task, of.agent, asking(task, episode, of.agent, velocity), action);
        }
    }
}
