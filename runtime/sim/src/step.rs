//! Beginning an episode, looking at it, and stepping it.

use std::f64::consts::{PI, TAU};

use mpgx_lang::plan::Place;
use mpgx_random::Purpose;

mod lanes;
mod stop;

use crate::episode::{Episode, EpisodeKey};
use crate::error::SimError;
use crate::maths::{Vec2, distance, divide, subtract, wrap};
use crate::program::{Draws, Scene};
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
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Step {
    /// Sum of the terms, less the costs of the ends that hold; if members are rewarded for themselves, the mean.
    pub reward: f64,
    /// The first end that holds, as its index in the Plan.
    pub ended: Option<u16>,
    /// Mean over all formations of the distances from the places and of what the distances of neighbours differ
    /// from those prescribed, m; 0 without a formation.
    pub error_m: f64,
    /// Pairs of agents whose outlines are closer than the safety distance (65535 if more).
    pub collisions: u16,
    /// Pairs of an agent and an obstacle that it was in, before any was put back (65535 if more): of an obstacle that
    /// stops some agents only those, of others all.
    pub hits: u16,
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
    /// First parameters are drawn. Agents whose motion tells positions are placed first, then the others in order, again and again until
    /// all requirements hold. Then the states of the other motions are drawn.
    ///
    /// # Errors
    /// If 10,000 attempts break a requirement, or if a start or a drawn parameter is not finite.
    pub fn reset(&self, episode: &mut Episode, key: EpisodeKey) -> Result<(), SimError> {
        *episode = Episode { key, ..self.episode() };
        self.draw_params(episode)?;
        for script in self.scripts.iter().filter(|script| script.positions) {
            script.start(self, episode);
            self.check_start(episode, script.agent)?;
        }
        let mut attempt = 0;
        loop {
            for id in 0..self.agents.len() {
                self.place(episode, id, attempt)?;
            }
            let mut scene = self.scene(episode);
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
        self.remember_start(episode);
        Ok(())
    }

    fn draw_params(&self, episode: &mut Episode) -> Result<(), SimError> {
        for (k, drawn) in self.randomised.iter().enumerate() {
            let mut draws = Draws::new(episode.key.address(Purpose::Parameter, k, 0));
            let value = drawn.value.eval(&mut self.scene(episode).random(&[], &mut draws));
            if !value.is_finite() {
                let (param, at) = (drawn.name.clone(), drawn.at.clone());
                return Err(SimError::DrawnNotFinite { param, value, at });
            }
            episode.params[k] = value;
        }
        Ok(())
    }

    /// Draws the start of one agent, and its heading if it has one.
    fn place(&self, episode: &mut Episode, id: usize, attempt: u64) -> Result<(), SimError> {
        let agent = &self.agents[id];
        let Some(start) = &agent.start else { return Ok(()) };
        let mut draws = Draws::new(episode.key.address(Purpose::Start, id, attempt));
        episode.agents.position[id] = start.eval(&mut self.scene(episode).random(&[], &mut draws));
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

    /// One step of the world. `action` holds x and y of each learned agent's command; −1 to 1 stands for the
    /// limits of its speed, and what lies beyond is clipped. First the learned agents move, then the scripted
    /// ones; obstacles stop those they should; then terms, ends and measures are taken of the new state. Costs
    /// are charged for every end that holds.
    ///
    /// # Panics
    /// If `action` is not of length [`Task::action_len`], or if the episode is of another task.
    pub fn step(&self, episode: &mut Episode, action: &[f32], mode: Mode) -> Step {
        self.ask(episode, action);
        self.advance(episode, mode)
    }

    /// Turns an action into velocities asked for.
    pub(crate) fn ask(&self, episode: &mut Episode, action: &[f32]) {
        assert_eq!(action.len(), self.action_len(), "length of the action");
        for (k, (&id, action)) in self.learned.iter().zip(action.chunks_exact(2)).enumerate() {
            episode.asked[k] = [action[0], action[1]].map(|u| self.agents[id].command(u));
        }
    }

    /// A step in which the learned agents do what is in `episode.asked`.
    pub(crate) fn advance(&self, episode: &mut Episode, mode: Mode) -> Step {
        episode.before.copy_from_slice(&episode.agents.position);
        episode.agents.last_command.copy_from_slice(&episode.agents.command);
        self.guard(episode);
        for (k, &id) in self.learned.iter().enumerate() {
            self.drive(episode, id, episode.asked[k]);
        }
        move_scripted(self, episode);
        episode.step += 1;
        let hits = self.hits(episode);
        self.stop(episode);
        self.settle(episode, mode);
        self.refresh_slots(episode);
        self.remember(episode);
        Step { hits, ..self.judge(episode) }
    }

    /// Moves an agent as commanded, within the limits of its acceleration.
    pub(crate) fn drive(&self, episode: &mut Episode, id: usize, command: Vec2) {
        let body = &self.agents[id].body;
        let command = body.limited(episode.agents.command[id], command);
        episode.agents.command[id] = command;
        episode.set_pose(id, body.moved(episode.pose(id), command, self.dt_s));
    }

    /// Tells who is outside, puts learned agents back in evaluation, and takes velocities.
    fn settle(&self, episode: &mut Episode, mode: Mode) {
        let agents = &mut episode.agents;
        for (id, agent) in self.agents.iter().enumerate() {
            agents.outside[id] = agent.is_outside(agents.position[id]);
        }
        if mode == Mode::Evaluate {
            for &id in &self.learned {
                agents.position[id] = self.agents[id].inside(agents.position[id]);
            }
        }
        let places = agents.position.iter().zip(&episode.before);
        for ((place, velocity), course) in places.zip(&mut agents.velocity).zip(&mut agents.course) {
            *velocity = divide(subtract(*place.0, *place.1), self.dt_s);
            if *velocity != [0.0; 2] {
                *course = *velocity;
            }
        }
        for &id in &self.uncommanded {
            agents.command[id] = agents.velocity[id];
        }
        if episode.step == 1 {
            agents.last_command.copy_from_slice(&agents.command);
        }
    }

    /// Takes terms, ends and measures of the present state; hits were before it.
    pub(crate) fn judge(&self, episode: &mut Episode) -> Step {
        let mut terms = std::mem::take(&mut episode.terms);
        let mut rewards = std::mem::take(&mut episode.rewards);
        let mut scene = self.scene(episode);
        let mut reward = self.reward(&mut scene, &mut terms, &mut rewards);
        let mut ended = None;
        for (k, end) in self.ends.iter().enumerate() {
            if end.when.eval(&mut scene) {
                ended = ended.or(Some(k as u16));
                let cost = end.cost.as_ref().map_or(0.0, |cost| cost.eval(&mut scene));
                reward -= cost;
                rewards.iter_mut().for_each(|reward| *reward -= cost);
            }
        }
        (episode.terms, episode.rewards) = (terms, rewards);
        Step {
            reward,
            ended,
            error_m: self.error_m(episode),
            collisions: self.collisions(episode),
            hits: 0,
            outside: episode.agents.outside.contains(&true),
            last: episode.step >= self.horizon,
            fault: self.fault(episode, reward),
        }
    }

    /// Writes the terms (of the team) and the reward of each member, before costs; gives that of the team.
    fn reward(&self, scene: &mut Scene, terms: &mut [f64], rewards: &mut [f64]) -> f64 {
        if !self.rewarded {
            let mut reward = 0.0;
            for (value, term) in terms.iter_mut().zip(&self.terms) {
                *value = term.value.eval(scene);
                reward += *value;
            }
            rewards.fill(reward);
            return reward;
        }
        terms.fill(0.0);
        for (member, reward) in rewards.iter_mut().enumerate() {
            self.bind(scene, member);
            *reward = 0.0;
            for (sum, term) in terms.iter_mut().zip(&self.terms) {
                let value = term.value.eval(scene);
                *reward += value;
                *sum += value;
            }
        }
        terms.iter_mut().for_each(|sum| *sum /= rewards.len() as f64);
        rewards.iter().sum::<f64>() / rewards.len() as f64
    }

    fn collisions(&self, episode: &Episode) -> u16 {
        let (position, radii) = (&episode.agents.position, &self.model.radii);
        let mut count = 0u16;
        for (k, &i) in self.everyone.iter().enumerate() {
            for &j in &self.everyone[k + 1..] {
                let clearance = distance(position[i], position[j]) - radii[j] - radii[i];
                count = count.saturating_add(u16::from(clearance < self.safety_m));
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
        let mut scene = self.scene(episode);
        for end in &self.ends {
            let cost = end.cost.as_ref().map_or(0.0, |cost| cost.eval(&mut scene));
            if !cost.is_finite() {
                return fault(format!("the cost of end `{}` is {cost}", end.name), &end.at);
            }
        }
        fault(format!("the reward is {reward}"), &Place::default())
    }
}

#[cfg(test)]
mod tests;
