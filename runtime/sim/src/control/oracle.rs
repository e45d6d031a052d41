//! The oracles: each learned agent takes the one step that brings it closest to its slot.
//!
//! Oracle A knows where the leader is now; for a leader that moves at random nothing can do better on
//! average. Oracle B also knows where scripted agents will be after the step.
//!
//! For a point the best step is exact: the way to the slot in one time step, clipped on each axis. For a
//! unicycle the step itself is tried out: a grid over all commands and the dead-beat command, corrected by what
//! it misses, give a beginning; a pattern search with halving steps then finds the command whose step ends
//! closest, to about 1e-4 m.

use super::{Aims, Controller};
use crate::body::Body;
use crate::episode::Episode;
use crate::maths::{Vec2, add, clamp_axes, distance, divide, subtract};
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
        self.aims.command(task, episode.slots(), action, |agent, slot| best(task, episode, agent, slot));
    }
}

impl Controller for Clairvoyant {
    /// Steps the scripted agents of a copy, the learned ones standing still.
    fn command(&mut self, task: &Task, episode: &Episode, action: &mut [f32]) {
        let mut ahead = episode.clone();
        move_scripted(task, &mut ahead);
        ahead.step += 1;
        task.refresh_slots(&mut ahead);
        self.aims.command(task, ahead.slots(), action, |agent, slot| best(task, episode, agent, slot));
    }
}

/// Good enough, m.
const CLOSE_M: f64 = 1e-6;
/// The pattern search ends when its steps would move the agent less than this, m.
const FINEST_M: f64 = 1e-5;
/// Commands on each axis of the grid.
const GRID: usize = 5;
/// Corrections of the dead-beat command.
const CORRECTIONS: usize = 4;

/// The velocity command within the agent's limits whose step ends closest to `slot`, m/s.
fn best(task: &Task, episode: &Episode, agent: usize, slot: Vec2) -> Vec2 {
    let (body, limits) = (&task.agents[agent].body, task.agents[agent].speed_mps);
    let pose = episode.pose(agent);
    let dead_beat = clamp_axes(divide(subtract(slot, pose.position), task.dt_s), limits);
    if *body == Body::Point {
        return dead_beat;
    }
    let after = |command| body.moved(pose, command, task.dt_s).position;
    let mut search =
        Search { miss: |command| distance(after(command), slot), best: dead_beat, least: f64::INFINITY };
    search.offer(dead_beat);
    let mut corrected = dead_beat;
    for _ in 0..CORRECTIONS {
        let missing = divide(subtract(slot, after(corrected)), task.dt_s);
        corrected = clamp_axes(add(corrected, missing), limits);
        search.offer(corrected);
    }
    let (low, high) = limits;
    let along = |k: usize| low + (high - low) * (k as f64 / (GRID - 1) as f64);
    for k in 0..GRID * GRID {
        search.offer([along(k / GRID), along(k % GRID)]);
    }
    let mut reach = (high - low) / 2.0;
    while reach * task.dt_s > FINEST_M {
        if !search.look_around(reach, limits) {
            reach /= 2.0;
        }
    }
    search.best
}

/// The best command so far.
struct Search<F> {
    /// How far from the slot the step of a command ends, m.
    miss: F,
    best: Vec2,
    least: f64,
}

impl<F: Fn(Vec2) -> f64> Search<F> {
    /// Tries a command, unless the best is good enough; tells whether it is better.
    fn offer(&mut self, command: Vec2) -> bool {
        if self.least < CLOSE_M {
            return false;
        }
        let miss = (self.miss)(command);
        let better = miss < self.least;
        if better {
            (self.best, self.least) = (command, miss);
        }
        better
    }

    /// Tries the eight commands around the best; tells whether one is better.
    fn look_around(&mut self, reach: f64, limits: (f64, f64)) -> bool {
        let centre = self.best;
        let mut better = false;
        for (x, y) in [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1)] {
            let step = [f64::from(x) * reach, f64::from(y) * reach];
            better |= self.offer(clamp_axes(add(centre, step), limits));
        }
        better
    }
}
