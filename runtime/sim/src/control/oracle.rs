//! The oracles: each learned agent takes the one step that brings it closest to its slot.
//!
//! Oracle A knows where the leader is now; for a leader that moves at random nothing can do better on
//! average. Oracle B also knows where scripted agents will be after the step.
//!
//! For a body that moves as commanded the best step is exact: the way to the slot in one time step, clipped on
//! each axis. For a unicycle, or where the acceleration is limited, the step itself is tried out. If the dead-beat command, corrected a few times by what it misses,
//! reaches the slot, it is the best. If not, pattern searches from the best commands of a grid find the one
//! whose step ends closest, to better than 1e-4 m.

use super::{Aims, Controller};
use crate::episode::Episode;
use crate::maths::{Vec2, add, clamp_axes, divide, norm, rotate, subtract};
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
const FINEST_M: f64 = 5e-5;
/// Commands on each axis of the grid.
const GRID: usize = 5;
/// Searches, from the best commands of the grid: where the limits of the wheels bind, there are several
/// commands that are better than all around them.
const STARTS: usize = 5;
/// The pattern turns by this many rad each time, so that no direction is left out: the limits of the wheels
/// make ridges that run anywhere.
const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;
/// The pattern shrinks after so many failures.
const PATIENCE: usize = 2;
/// Corrections of the dead-beat command.
const CORRECTIONS: usize = 4;

/// The velocity command within the agent's limits whose step ends closest to `slot`, m/s.
fn best(task: &Task, episode: &Episode, agent: usize, slot: Vec2) -> Vec2 {
    let (body, limits) = (&task.agents[agent].body, task.agents[agent].speed_mps);
    let (pose, before) = (episode.pose(agent), episode.agents.command[agent]);
    let mut command = clamp_axes(divide(subtract(slot, pose.position), task.dt_s), limits);
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
        command = clamp_axes(add(command, divide(rest, task.dt_s)), limits);
    }
    let miss = |command| norm(missing(command));
    let mut starts: Vec<Search<_>> =
        grid(limits).chain([command]).map(|best| Search { miss, limits, best, least: miss(best) }).collect();
    starts.sort_by(|a, b| a.least.total_cmp(&b.least));
    starts.truncate(STARTS);
    for search in &mut starts {
        search.run(FINEST_M / task.dt_s);
    }
    starts.iter().min_by(|a, b| a.least.total_cmp(&b.least)).map_or(command, |search| search.best)
}

/// Commands spread evenly between the limits.
fn grid((low, high): (f64, f64)) -> impl Iterator<Item = Vec2> {
    let along = move |k: usize| low + (high - low) * (k as f64 / (GRID - 1) as f64);
    (0..GRID * GRID).map(move |k| [along(k / GRID), along(k % GRID)])
}

/// A search for the command that misses least.
struct Search<F> {
    /// How far from the slot the step of a command ends, m.
    miss: F,
    limits: (f64, f64),
    /// The best command so far, and how far it misses.
    best: Vec2,
    least: f64,
}

impl<F: Fn(Vec2) -> f64> Search<F> {
    /// Tries a command; tells whether it is better.
    fn offer(&mut self, command: Vec2) -> bool {
        let miss = (self.miss)(command);
        let better = miss < self.least;
        if better {
            (self.best, self.least) = (command, miss);
        }
        better
    }

    /// Tries patterns of four commands around the best that become smaller, down to `finest` m/s.
    fn run(&mut self, finest: f64) {
        let (mut turn, mut failures) = (0.0, 0);
        let mut reach = (self.limits.1 - self.limits.0) / (GRID - 1) as f64;
        while reach > finest && self.least > CLOSE_M {
            turn += GOLDEN_ANGLE;
            let centre = self.best;
            let [x, y] = rotate([reach, 0.0], turn);
            let mut better = false;
            for step in [[x, y], [-y, x], [-x, -y], [y, -x]] {
                better |= self.offer(clamp_axes(add(centre, step), self.limits));
            }
            failures = if better { 0 } else { failures + 1 };
            if failures == PATIENCE {
                (reach, failures) = (reach / 2.0, 0);
            }
        }
    }
}
