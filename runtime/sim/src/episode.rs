//! An episode: all that changes while a world runs.

use mpgx_random::{Address, Purpose};

use crate::body::Pose;
use crate::maths::Vec2;
use crate::program::Agents;

/// Which episode: the same key gives the same starts and the same leaders, whoever controls the followers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EpisodeKey {
    /// Of the study.
    pub master: u64,
    /// 0 for training, k + 1 for protocol k.
    pub protocol: u16,
    /// Of the training run; 0 for evaluation.
    pub seed: u32,
    pub episode: u32,
}

impl EpisodeKey {
    /// Where the random numbers of one agent and step (or attempt) lie.
    pub(crate) fn address(self, purpose: Purpose, agent: usize, step: u64) -> Address {
        let EpisodeKey { master, protocol, seed, episode } = self;
        Address { master, purpose, protocol, part: agent as u16, seed, episode, step }
    }
}

/// The state of a running episode, made by [`Task::episode`](crate::Task::episode) for that task alone.
#[derive(Clone, Debug, PartialEq)]
pub struct Episode {
    pub(crate) key: EpisodeKey,
    /// Steps done.
    pub(crate) step: usize,
    pub(crate) agents: Agents,
    /// The parameters that are drawn for each episode, in the Plan's order.
    pub(crate) params: Vec<f64>,
    /// What the learned agents are commanded in this step, m/s.
    pub(crate) asked: Vec<Vec2>,
    /// Where the agents were before the step.
    pub(crate) before: Vec<Vec2>,
    /// The states of all motions, numbers in x.
    pub(crate) memory: Vec<Vec2>,
    /// Their next values, while they change.
    pub(crate) fresh: Vec<Vec2>,
    /// What the motions told in this step.
    pub(crate) outputs: Vec<Vec2>,
    pub(crate) slots: Vec<Vec2>,
    pub(crate) terms: Vec<f64>,
    pub(crate) rewards: Vec<f64>,
    /// Values that will be observed late.
    pub(crate) late: Vec<f64>,
}

impl Episode {
    /// Each reward term in the last step, in the Plan's order; if members are rewarded for themselves, its mean.
    pub fn terms(&self) -> &[f64] {
        &self.terms
    }

    /// The reward of each member in the last step: the costs of ends are charged to all. One, that of the team,
    /// if the policy is not shared.
    pub fn member_rewards(&self) -> &[f64] {
        &self.rewards
    }

    /// Position of an agent or obstacle, m; of a unicycle, its hand point.
    pub fn position(&self, agent: usize) -> [f64; 2] {
        self.agents.position[agent]
    }

    /// Heading of an agent, rad in (−π, π]; 0 for bodies without one.
    pub fn heading(&self, agent: usize) -> f64 {
        self.agents.heading[agent]
    }

    /// Where each member of each formation of places belongs now, in order, m.
    pub fn slots(&self) -> &[[f64; 2]] {
        &self.slots
    }

    /// Steps done.
    pub fn time_steps(&self) -> usize {
        self.step
    }

    pub(crate) fn pose(&self, agent: usize) -> Pose {
        Pose { position: self.agents.position[agent], heading: self.agents.heading[agent] }
    }

    pub(crate) fn set_pose(&mut self, agent: usize, pose: Pose) {
        self.agents.position[agent] = pose.position;
        self.agents.heading[agent] = pose.heading;
    }
}
