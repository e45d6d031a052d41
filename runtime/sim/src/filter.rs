//! Safety filters: what stands between whoever steers a robot and its wheels.

mod half_planes;

use mpgx_lang::plan::{Extern, Place};

use crate::batch::{Scratch, Tile};
use crate::episode::Episode;
use crate::error::SimError;
use crate::lanes::{at, put};
use crate::maths::{Vec2, dot, greater, subtract};
use crate::outline::Nearest;
use crate::settings::{Settings, list};
use crate::task::Task;
use half_planes::{HalfPlane, nearest_within};

/// The names of all filters.
pub const FILTERS: &[&str] = &["barrier"];

/// The settings that a filter reads; `None` if there is no such filter.
pub fn filter_settings(name: &str) -> Option<&'static [&'static str]> {
    (name == "barrier").then_some(&["margin", "share"])
}

/// A barrier in discrete time: no step may use up more than a share of the clearance h that there is,
///
/// h(x_k+1) ≥ (1 − share) h(x_k)
///
/// (Agrawal and Sreenath, "Discrete control barrier functions for safety-critical control of discrete systems", RSS
/// 2017), for every other agent (h is the distance of the outlines beyond the safety distance and `margin`) and every
/// obstacle that the agent may not be in (beyond `margin`). With the direction n away from the other, |x + v dt − x_o|
/// is at least its part along n, so that each barrier is a half-plane of velocities. Of those that lie in all of them
/// the one nearest to what was asked is taken. Two that are both filtered do half of it each (Wang, Ames and Egerstedt,
/// "Safety barrier certificates for collisions-free multirobot systems", IEEE T-RO 33, 2017); of other agents the worst
/// is assumed that their limits allow, of obstacles that they go on as they do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Barrier {
    margin_m: f64,
    share: f64,
}

/// A learned agent with a filter.
#[derive(Clone, Debug)]
pub(crate) struct Guard {
    /// Its number among the learned agents, and among all.
    pub learner: usize,
    pub agent: usize,
    pub barrier: Barrier,
    /// Those that it may not be in.
    pub obstacles: Vec<usize>,
}

impl Barrier {
    /// # Errors
    /// If there is no such filter, or if its settings are wrong.
    pub fn new(what: &Extern, at: &Place) -> Result<Barrier, SimError> {
        let Some(known) = filter_settings(&what.name) else {
            let (kind, name, known) = ("filter", what.name.clone(), list(FILTERS));
            return Err(SimError::Unknown { kind, name, known, at: at.clone() });
        };
        let settings = Settings::new(what, known, at)?;
        let share = settings.positive("share", false)?;
        if share > 1.0 {
            let what = "share of a barrier".into();
            return Err(SimError::OutOfRange { what, value: share, must: "at most 1", at: at.clone() });
        }
        Ok(Barrier { margin_m: settings.positive("margin", true)?, share })
    }
}

impl Task {
    /// Changes what the filtered agents are asked, as little as their barriers demand.
    pub(crate) fn guard(&self, episode: &mut Episode) {
        for guard in &self.guards {
            let asked = episode.asked[guard.learner];
            let mut planes = Vec::new();
            let mut holds = true;
            for plane in self.barriers(guard, episode) {
                holds &= plane.holds(asked);
                if plane.can_fail(self.agents[guard.agent].speed_mps) {
                    planes.push(plane);
                }
            }
            if !holds {
                episode.asked[guard.learner] =
                    nearest_within(asked, &planes, self.agents[guard.agent].speed_mps);
            }
        }
    }

    /// [`Task::guard`], each lane by itself.
    pub(crate) fn guard_lanes(&self, tile: &mut Tile, scratch: &mut Scratch, used: usize) {
        if self.guards.is_empty() {
            return;
        }
        let episode = &mut scratch.episode;
        for lane in 0..used {
            for id in 0..self.agents.len() {
                episode.agents.position[id] = at(&tile.agents.position[id], lane);
                episode.agents.velocity[id] = at(&tile.agents.velocity[id], lane);
                episode.agents.heading[id] = tile.agents.heading[id][lane];
            }
            for (asked, all) in episode.asked.iter_mut().zip(&tile.asked) {
                *asked = at(all, lane);
            }
            self.guard(episode);
            for (asked, all) in episode.asked.iter().zip(&mut tile.asked) {
                put(all, lane, *asked);
            }
        }
    }

    /// The commands that each barrier of an agent allows.
    fn barriers<'a>(
        &'a self,
        guard: &'a Guard,
        episode: &'a Episode,
    ) -> impl Iterator<Item = HalfPlane> + 'a {
        let Guard { agent, barrier, .. } = *guard;
        let apart = move |other: usize| {
            let away = subtract(episode.position(agent), episode.position(other));
            let Nearest { distance, outward, .. } = self.model.outlines[other].nearest(away);
            (distance - self.model.radii[agent] - barrier.margin_m, outward)
        };
        let others = self.everyone.iter().filter(move |&&other| other != agent).map(move |&other| {
            let (distance, outward) = apart(other);
            let spare = (distance - self.safety_m) / self.dt_s;
            let least = match self.agents[other].filter.is_some() {
                true => -barrier.share * spare / 2.0,
                false => fastest_along(outward, self.agents[other].speed_mps) - barrier.share * spare,
            };
            (outward, least)
        });
        let obstacles = guard.obstacles.iter().map(move |&obstacle| {
            let (distance, outward) = apart(obstacle);
            let approach = dot(outward, episode.agents.velocity[obstacle]);
            (outward, approach - barrier.share * distance / self.dt_s)
        });
        let (body, heading) = (&self.agents[agent].body, episode.heading(agent));
        others
            .chain(obstacles)
            .map(move |(outward, least)| HalfPlane { inward: body.command(heading, outward), least })
    }
}

/// The most that a velocity within limits on each axis has along a direction, m/s.
fn fastest_along(direction: Vec2, (low, high): (f64, f64)) -> f64 {
    direction.iter().map(|part| greater(part * low, part * high)).sum()
}

#[cfg(test)]
mod tests;
