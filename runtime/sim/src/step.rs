//! Beginning an episode, looking at it, and stepping it.

use std::f64::consts::{PI, TAU};

use mpgx_lang::plan::Place;
use mpgx_random::Purpose;

use crate::episode::{Episode, EpisodeKey};
use crate::error::SimError;
use crate::maths::{Vec2, distance, divide, subtract, wrap};
use crate::program::{Draws, Program, Scene};
use crate::script::move_scripted;
use crate::task::Task;

/// What a step is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// Learned agents may leave their arena (an end may then stop the episode).
    Train,
    /// Learned agents are put back into their arena after each step.
    Evaluate,
}

/// What a step gave.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// Sum of the terms, less the costs of the ends that hold.
    pub reward: f64,
    /// The first end that holds, as its index in the Plan.
    pub ended: Option<u16>,
    /// Mean distance from the slots over the members of all formations, m; 0 without a formation.
    pub error_m: f64,
    /// Pairs of agents closer than the safety distance (65535 if more).
    pub collisions: u16,
    /// Whether an agent was outside its arena, before any was put back.
    pub outside: bool,
    /// Whether the horizon is reached.
    pub last: bool,
    /// Set if a number is not finite; the episode is then worth nothing.
    pub fault: Option<Box<Fault>>,
}

/// A number of the simulation that is not finite.
#[derive(Clone, Debug, PartialEq)]
pub struct Fault {
    /// ``reward term `gap` is NaN``.
    pub cause: String,
    /// The place in the scenario that is to blame.
    pub at: Place,
}

/// Starts that break a requirement are drawn again this often.
const MOST_ATTEMPTS: u64 = 10_000;

impl Task {
    /// Begins the episode of `key`; what was in `episode` is forgotten.
    ///
    /// Agents whose motion tells positions are placed first, then the others in order, again and again until
    /// all requirements hold. Then the states of the other motions are drawn.
    ///
    /// # Errors
    /// If 10,000 attempts break a requirement, or if a start is not finite.
    pub fn reset(&self, episode: &mut Episode, key: EpisodeKey) -> Result<(), SimError> {
        *episode = Episode { key, ..self.episode() };
        for script in self.scripts.iter().filter(|script| script.positions) {
            script.start(self, episode);
            self.check_start(episode, script.agent)?;
        }
        let mut attempt = 0;
        loop {
            for id in 0..self.agents.len() {
                self.place(episode, id, attempt)?;
            }
            let mut scene = Scene::new(&episode.agents, &self.shapes, 0.0);
            let Some(broken) = self.require.iter().position(|require| !require.eval(&mut scene)) else {
                break;
            };
            attempt += 1;
            if attempt == MOST_ATTEMPTS {
                return Err(self.rejected(broken));
            }
        }
        for script in self.scripts.iter().filter(|script| !script.positions) {
            script.start(self, episode);
        }
        self.refresh_slots(episode);
        Ok(())
    }

    /// Draws the start of one agent, and its heading if it has one.
    fn place(&self, episode: &mut Episode, id: usize, attempt: u64) -> Result<(), SimError> {
        let agent = &self.agents[id];
        let Some(start) = &agent.start else { return Ok(()) };
        let mut draws = Draws::new(episode.key.address(Purpose::Start, id, attempt));
        let scene = Scene::new(&episode.agents, &self.shapes, 0.0);
        episode.agents.position[id] = start.eval(&mut scene.random(&[], &mut draws));
        if agent.body.has_heading() {
            episode.agents.heading[id] = wrap(PI - TAU * draws.stream().uniform());
        }
        self.check_start(episode, id)
    }

    fn check_start(&self, episode: &mut Episode, id: usize) -> Result<(), SimError> {
        let (agent, position) = (&self.agents[id], episode.agents.position[id]);
        episode.agents.outside[id] = agent.is_outside(position);
        match position.iter().all(|x| x.is_finite()) {
            true => Ok(()),
            false => Err(SimError::StartNotFinite { agent: agent.name.clone(), at: agent.at.clone() }),
        }
    }

    /// Blames the last group that is drawn: it has to find room beside the others.
    fn rejected(&self, broken: usize) -> SimError {
        let last = self.agents.iter().rev().find(|agent| agent.start.is_some());
        SimError::StartsRejected {
            group: last.map(|agent| agent.group.clone()).unwrap_or_default(),
            requirement: broken + 1,
            attempts: MOST_ATTEMPTS,
            at: last.map(|agent| agent.at.clone()).unwrap_or_default(),
        }
    }

    /// Writes the learner's state, SI values in the Plan's order.
    ///
    /// # Panics
    /// If `out` is not of length [`Task::state_len`], or if the episode is of another task.
    pub fn observe(&self, episode: &Episode, out: &mut [f32]) {
        assert_eq!(out.len(), self.state_len(), "length of the state");
        let mut scene = Scene::new(&episode.agents, &self.shapes, self.time_s(episode));
        let mut next = 0;
        for observed in &self.observed {
            let [x, y] = observed.value.eval(&mut scene);
            out[next] = x as f32;
            next += 1;
            if matches!(observed.value, Program::Vector(_)) {
                out[next] = y as f32;
                next += 1;
            }
        }
    }

    /// One step of the world. `action` holds x and y of each learned agent's command; −1 to 1 stands for the
    /// limits of its speed, and what lies beyond is clipped. First the learned agents move, then the scripted
    /// ones; then terms, ends and measures are taken of the new state. Costs are charged for every end that holds.
    ///
    /// # Panics
    /// If `action` is not of length [`Task::action_len`], or if the episode is of another task.
    pub fn step(&self, episode: &mut Episode, action: &[f32], mode: Mode) -> Step {
        assert_eq!(action.len(), self.action_len(), "length of the action");
        episode.before.copy_from_slice(&episode.agents.position);
        for (&id, command) in self.learned.iter().zip(action.chunks_exact(2)) {
            let agent = &self.agents[id];
            let command = [command[0], command[1]].map(|u| agent.command(u));
            let pose = agent.body.moved(episode.pose(id), command, self.dt_s);
            episode.set_pose(id, pose);
        }
        move_scripted(self, episode);
        episode.step += 1;
        let outside = self.settle(episode, mode);
        self.refresh_slots(episode);
        self.judge(episode, outside)
    }

    /// Tells who is outside, puts learned agents back in evaluation, and takes velocities.
    fn settle(&self, episode: &mut Episode, mode: Mode) -> bool {
        let agents = &mut episode.agents;
        for (id, agent) in self.agents.iter().enumerate() {
            agents.outside[id] = agent.is_outside(agents.position[id]);
        }
        if mode == Mode::Evaluate {
            for &id in &self.learned {
                agents.position[id] = self.agents[id].inside(agents.position[id]);
            }
        }
        for (id, before) in episode.before.iter().enumerate() {
            agents.velocity[id] = divide(subtract(agents.position[id], *before), self.dt_s);
        }
        agents.outside.contains(&true)
    }

    fn judge(&self, episode: &mut Episode, outside: bool) -> Step {
        let mut scene = Scene::new(&episode.agents, &self.shapes, self.time_s(episode));
        let mut reward = 0.0;
        for (value, term) in episode.terms.iter_mut().zip(&self.terms) {
            *value = term.value.eval(&mut scene);
            reward += *value;
        }
        let mut ended = None;
        for (k, end) in self.ends.iter().enumerate() {
            if end.when.eval(&mut scene) {
                ended = ended.or(Some(k as u16));
                reward -= end.cost.as_ref().map_or(0.0, |cost| cost.eval(&mut scene));
            }
        }
        Step {
            reward,
            ended,
            error_m: self.error_m(episode),
            collisions: self.collisions(episode),
            outside,
            last: episode.step >= self.horizon,
            fault: self.fault(episode, reward),
        }
    }

    fn error_m(&self, episode: &Episode) -> f64 {
        let mut slots = episode.slots.iter();
        let mut sum = 0.0;
        for shape in &self.shapes {
            let members = &episode.agents.position[shape.first..];
            sum += members
                .iter()
                .zip(slots.by_ref().take(shape.displacements.len()))
                .map(|(p, f)| distance(*p, *f))
                .sum::<f64>();
        }
        sum / episode.slots.len().max(1) as f64
    }

    fn collisions(&self, episode: &Episode) -> u16 {
        let positions = &episode.agents.position;
        let mut count = 0u16;
        for (i, p) in positions.iter().enumerate() {
            for q in &positions[i + 1..] {
                count = count.saturating_add(u16::from(distance(*p, *q) < self.safety_m));
            }
        }
        count
    }

    /// The first number that is not finite, causes before effects.
    fn fault(&self, episode: &Episode, reward: f64) -> Option<Box<Fault>> {
        let finite = |v: &Vec2| v.iter().all(|x| x.is_finite());
        if reward.is_finite() && episode.agents.position.iter().all(finite) {
            return None;
        }
        let fault = |cause, at: &Place| Some(Box::new(Fault { cause, at: at.clone() }));
        for (agent, position) in self.agents.iter().zip(&episode.agents.position) {
            if !finite(position) {
                return fault(format!("the position of {} is {position:?}", agent.name), &agent.at);
            }
        }
        for (term, value) in self.terms.iter().zip(&episode.terms) {
            if !value.is_finite() {
                return fault(format!("reward term `{}` is {value}", term.name), &term.at);
            }
        }
        let mut scene = Scene::new(&episode.agents, &self.shapes, self.time_s(episode));
        for end in &self.ends {
            let cost = end.cost.as_ref().map_or(0.0, |cost| cost.eval(&mut scene));
            if !cost.is_finite() {
                return fault(format!("the cost of end `{}` is {cost}", end.name), &end.at);
            }
        }
        fault(format!("the reward is {reward}"), &Place::default())
    }

    pub(crate) fn refresh_slots(&self, episode: &mut Episode) {
        let mut scene = Scene::new(&episode.agents, &self.shapes, self.time_s(episode));
        let mut slots = episode.slots.iter_mut();
        for (k, shape) in self.shapes.iter().enumerate() {
            for (member, slot) in slots.by_ref().take(shape.displacements.len()).enumerate() {
                *slot = scene.slot(k, shape.first + member);
            }
        }
    }

    fn time_s(&self, episode: &Episode) -> f64 {
        episode.step as f64 * self.dt_s
    }
}

#[cfg(test)]
mod tests;
