//! The oracles: each learned agent takes the one step that brings it closest to its slot.
//!
//! Oracle A knows where the leader is now; for a leader that moves at random nothing can do better on
//! average. Oracle B also knows where scripted agents will be after the step.
//!
//! For a body that moves as commanded the best step is exact: the way to the slot in one time step, clipped on
//! each axis. For a unicycle, or where the acceleration is limited, the step itself is tried out. If the dead-beat
//! command, corrected a few times by what it misses, reaches the slot, it is the best. If not, pattern searches from the best commands of a grid find the one
//! whose step ends closest, to better than 1e-4 m.

use super::Controller;
use super::aims::Aims;
use super::search::{CLOSE_M, GRID, Search, grid, search};
use crate::episode::Episode;
use crate::maths::{Vec2, add, clamp_axes, divide, norm, subtract};
use crate::script::move_scripted;
use crate::task::Task;

/// Oracle A.
pub(super) struct Oracle {
    aims: Aims,
}

/// Oracle B.
pub(super) struct Clairvoyant {
    aims: Aims,
}

impl Oracle {
    pub fn new(aims: Aims) -> Self {
        Oracle { aims }
    }
}

impl Clairvoyant {
    pub fn new(aims: Aims) -> Self {
        Clairvoyant { aims }
    }
}

impl Controller for Oracle {
    fn command(&mut self, task: &Task, episode: &Episode, action: &mut [f32]) {
        self.aims.command(task, episode, action, |agent, slot| best(task, episode, agent, slot));
    }
}

impl Controller for Clairvoyant {
    /// Steps the scripted agents of a copy, the learned ones standing still.
    fn command(&mut self, task: &Task, episode: &Episode, action: &mut [f32]) {
        let mut ahead = episode.clone();
        move_scripted(task, &mut ahead);
        ahead.step += 1;
        task.refresh_slots(&mut ahead);
        self.aims.command(task, &ahead, action, |agent, slot| best(task, episode, agent, slot));
    }
}

/// The pattern search ends when its steps would move the agent less than this, m.
const FINEST_M: f64 = 5e-5;
/// Searches, from the best commands of the grid: where the limits of the wheels bind, there are several
/// commands that are better than all around them.
const STARTS: usize = 5;
/// Corrections of the dead-beat command.
const CORRECTIONS: usize = 4;

/// The command within the agent's limits whose step ends closest to `slot`, m/s.
pub(super) fn best(task: &Task, episode: &Episode, agent: usize, slot: Vec2) -> Vec2 {
    let (body, limits) = (&task.agents[agent].body, task.agents[agent].speed_mps);
    let (pose, before) = (episode.pose(agent), episode.agents.command[agent]);
    let towards = |way| body.command(pose.heading, divide(way, task.dt_s));
    let mut command = clamp_axes(towards(subtract(slot, pose.position)), limits);
    if body.goes_anywhere() && body.limited(before, command) == command {
        return command;
    }
    let step = |command| body.moved(pose, body.limited(before, command), task.dt_s);
    let missing = |command| subtract(slot, step(command).position);
    for _ in 0..CORRECTIONS {
        let rest = missing(command);
        if norm(rest) < CLOSE_M {
            return command;
        }
        command = clamp_axes(add(command, towards(rest)), limits);
    }
    let miss = |command| norm(missing(command));
    let starts = grid(limits, GRID).chain([command]).map(|best| Search::new(miss, limits, best)).collect();
    search(starts, STARTS, FINEST_M / task.dt_s).map_or(command, |found| found.best)
}
