//! A short-horizon model predictive controller.

use super::Controller;
use super::aims::{Aims, Target, spacing, write};
use super::oracle::best;
use super::search::{Search, grid, search};
use crate::episode::Episode;
use crate::maths::{Vec2, add, clamp_axes, distance, divide, norm, scale, subtract};
use crate::task::Task;

/// Steps ahead, at most.
pub(super) const MOST_STEPS: usize = 50;

/// Looks `ahead` steps ahead and takes the first step of the plan that costs least: the sum over the steps of the
/// distance from the place, and of `WEIGHT` times what is missing of the clearances (Mayne, Rawlings, Rao and Scokaert,
/// "Constrained model predictive control: stability and optimality", Automatica 36, 2000; constraints made soft).
///
/// Everybody else is taken to go on with the velocity of the last step, and places with that of their leader;
/// robots plan in turn, each knowing the plans of those before. The robot's own steps are those of the simulator, with
/// the limits of its body, speed and arena. A plan is one command, held for some of the steps, then straight to the place. The direct way
/// is taken if nothing is too near on it; otherwise commands of a grid are tried and the best improved by a pattern
/// search. With one step ahead, nothing near and a leader at rest this is oracle A.
pub(super) struct Predictive {
    pub aims: Aims,
    pub ahead: usize,
    /// What is kept beyond the safety distance, and from obstacles, m.
    pub margin: f64,
}

/// Metres of distance from the place that a missing metre of clearance is worth.
const WEIGHT: f64 = 100.0;
/// Commands on each axis of the grid.
const GRID: usize = 5;
/// Plans that are improved, for each time of holding.
const STARTS: usize = 1;
/// To this fineness, m/s.
const FINEST_MPS: f64 = 0.02;

impl Controller for Predictive {
    fn command(&mut self, task: &Task, episode: &Episode, action: &mut [f32]) {
        let targets = self.aims.targets(task, episode);
        let mut paths: Vec<Vec<Vec2>> =
            (0..task.agents.len()).map(|other| self.straight(task, episode, other)).collect();
        for (of, action) in targets.iter().zip(action.chunks_exact_mut(2)) {
            let outlook = self.outlook(task, episode, &targets, of, &paths);
            let (command, hold) = self.plan(&outlook);
            paths[of.agent] = outlook.path(command, hold);
            write(task, of.agent, command, action);
        }
    }
}

impl Predictive {
    /// Positions now and after each step, with the velocity of the last.
    fn straight(&self, task: &Task, episode: &Episode, agent: usize) -> Vec<Vec2> {
        let (from, way) = (episode.position(agent), scale(episode.agents.velocity[agent], task.dt_s));
        (0..=self.ahead).map(|k| add(from, scale(way, k as f64))).collect()
    }

    fn outlook<'a>(
        &self,
        task: &'a Task,
        episode: &'a Episode,
        targets: &[Target],
        of: &Target,
        paths: &'a [Vec<Vec2>],
    ) -> Outlook<'a> {
        let shift = of.about.map_or([0.0; 2], |leader| scale(episode.agents.velocity[leader], task.dt_s));
        let places = (0..=self.ahead).map(|k| add(of.place, scale(shift, k as f64))).collect();
        let radii = &task.model.radii;
        let others = task.everyone.iter().filter(|&&other| other != of.agent).map(|&other| {
            let apart = spacing(targets, of, other, episode) - radii[of.agent] - radii[other];
            (other, apart.min(task.safety_m + self.margin))
        });
        let near = task.obstacles.iter().map(|&obstacle| (obstacle, self.margin)).chain(others).collect();
        Outlook { task, episode, agent: of.agent, places, near, paths }
    }

    /// The first command of the best plan, m/s, and for how many steps it is held.
    fn plan(&self, outlook: &Outlook) -> (Vec2, usize) {
        let Outlook { task, episode, agent, .. } = *outlook;
        let direct = best(task, episode, agent, outlook.places[1]);
        if outlook.lack(&outlook.path(direct, 1)) == 0.0 {
            return (direct, 1);
        }
        let limits = task.agents[agent].speed_mps;
        let mut plans = Vec::new();
        for hold in [1, self.ahead.div_ceil(2), self.ahead] {
            let cost = |command| outlook.cost(command, hold);
            let starts = grid(limits, GRID).chain([direct]).map(|best| Search::new(cost, limits, best));
            plans.extend(search(starts.collect(), STARTS, FINEST_MPS).map(|it| (it.least, it.best, hold)));
        }
        let least = plans.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
        least.map_or((direct, 1), |(_, command, hold)| (command, hold))
    }
}

/// What one robot expects.
struct Outlook<'a> {
    task: &'a Task,
    episode: &'a Episode,
    agent: usize,
    /// Where it should be now and after each step.
    places: Vec<Vec2>,
    /// Everything that it could hit, and the clearance to keep from it, m.
    near: Vec<(usize, f64)>,
    /// Where everyone is now and after each step.
    paths: &'a [Vec<Vec2>],
}

impl Outlook<'_> {
    /// Where the robot is now and after each step, if it holds a command for some steps and then heads for its place.
    fn path(&self, command: Vec2, hold: usize) -> Vec<Vec2> {
        let (task, agent) = (self.task, &self.task.agents[self.agent]);
        let mut pose = self.episode.pose(self.agent);
        let mut before = self.episode.agents.command[self.agent];
        let mut path = vec![pose.position];
        for (k, place) in self.places.iter().enumerate().skip(1) {
            let straight = divide(subtract(*place, pose.position), task.dt_s);
            let straight = agent.body.command(pose.heading, straight);
            let wanted = clamp_axes(if k <= hold { command } else { straight }, agent.speed_mps);
            before = agent.body.limited(before, wanted);
            pose = agent.body.moved(pose, before, task.dt_s);
            pose.position = agent.inside(pose.position);
            path.push(pose.position);
        }
        path
    }

    /// What a path lacks of the clearances to keep, m, summed over its steps.
    fn lack(&self, path: &[Vec2]) -> f64 {
        let model = &self.task.model;
        let mut sum = 0.0;
        for &(other, keep) in &self.near {
            let outline = &model.outlines[other];
            let mut ways = path.iter().zip(&self.paths[other]).map(|(own, other)| subtract(*own, *other));
            let mut from = ways.next().unwrap_or_default();
            for to in ways {
                sum += (keep + model.radii[self.agent] - outline.distance(to)).max(0.0);
                if outline.crossing(from, to).is_some() {
                    sum += norm(subtract(to, from));
                }
                from = to;
            }
        }
        sum
    }

    fn cost(&self, command: Vec2, hold: usize) -> f64 {
        let path = self.path(command, hold);
        let astray: f64 =
            path.iter().zip(&self.places).skip(1).map(|(own, place)| distance(*own, *place)).sum();
        astray + WEIGHT * self.lack(&path)
    }
}
