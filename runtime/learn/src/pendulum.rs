//! A task that everybody knows: Gymnasium's Pendulum-v1, a pole on a motor too weak to lift it at once.
//! Good learners reach a mean return of −150 or better.

use std::f64::consts::PI;

use mpgx_random::{Address, Purpose, Stream};

use crate::config::Config;
use crate::error::LearnError;
use crate::learner::Learner;
use crate::policy::Policy;
use crate::replay::Transition;

/// Steps of an episode; it has no other end.
pub const HORIZON: u32 = 200;
const DT: f64 = 0.05;
const GRAVITY: f64 = 10.0;
const LARGEST_SPEED: f64 = 8.0;
const LARGEST_TORQUE: f64 = 2.0;

/// A pole of length 1 and mass 1. Angle in radians, 0 upright, and its speed in radians a second.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pendulum {
    pub angle: f64,
    pub speed: f64,
}

impl Pendulum {
    /// Angle in ±π, speed in ±1.
    fn random(stream: &mut Stream) -> Self {
        let mut uniform = |bound: f64| bound * (2.0 * stream.uniform() - 1.0);
        Self { angle: uniform(PI), speed: uniform(1.0) }
    }

    /// cos and sin of the angle, and the speed.
    pub fn observe(&self) -> [f32; 3] {
        let (sin, cos) = libm::sincos(self.angle);
        [cos as f32, sin as f32, self.speed as f32]
    }

    /// One step with `action` in [−1, 1], a share of the largest torque; gives the reward, that of the state
    /// before.
    ///
    /// Source: `gymnasium/envs/classic_control/pendulum.py` of Gymnasium 1.
    pub fn step(&mut self, action: f64) -> f64 {
        let torque = LARGEST_TORQUE * action.clamp(-1.0, 1.0);
        let angle = (self.angle + PI).rem_euclid(2.0 * PI) - PI;
        let reward = -(angle * angle + 0.1 * self.speed * self.speed + 0.001 * torque * torque);
        let acceleration = 1.5 * GRAVITY * libm::sin(self.angle) + 3.0 * torque;
        self.speed = (self.speed + acceleration * DT).clamp(-LARGEST_SPEED, LARGEST_SPEED);
        self.angle += self.speed * DT;
        reward
    }
}

/// Trains for a number of episodes; the return of each, and the policy.
///
/// Errors as [`Learner::new`] and [`Learner::step`] do.
pub fn train(config: Config, episodes: u32, seed: u32) -> Result<(Vec<f64>, Policy), LearnError> {
    let mut learner = Learner::new(config, 3, 1, 0, seed)?;
    let mut returns = Vec::new();
    for episode in 0..episodes {
        let mut pendulum = Pendulum::random(&mut start(0, seed, episode));
        let mut total = 0.0;
        for step in 0..HORIZON {
            let done = f64::from(episode) + f64::from(step) / f64::from(HORIZON);
            learner.set_progress(done / f64::from(episodes));
            let (state, mut action) = (pendulum.observe(), [0.0]);
            learner.explore(&state, &mut action);
            let reward = pendulum.step(f64::from(action[0]));
            total += reward;
            let (next, reward) = (pendulum.observe(), reward as f32);
            learner.step([Transition {
                state: &state,
                action: &action,
                reward,
                next: &next,
                failure: false,
            }])?;
        }
        learner.end_episode();
        returns.push(total);
    }
    Ok((returns, learner.policy()))
}

/// The returns of a policy without noise over episodes that no training meets.
///
/// # Panics
///
/// If the policy is none of this task: 3 numbers in, 1 out.
pub fn evaluate(policy: &mut Policy, episodes: u32) -> Vec<f64> {
    let run = |episode| {
        let mut pendulum = Pendulum::random(&mut start(1, 0, episode));
        let mut step = |_| {
            let mut action = [0.0];
            policy.act(&pendulum.observe(), 1, &mut action);
            pendulum.step(f64::from(action[0]))
        };
        (0..HORIZON).map(&mut step).sum()
    };
    (0..episodes).map(run).collect()
}

/// Of training (protocol 0) or of held-out episodes (1).
fn start(protocol: u16, seed: u32, episode: u32) -> Stream {
    Address { master: 0, purpose: Purpose::Start, protocol, part: 0, seed, episode, step: 0 }.stream()
}

#[cfg(test)]
mod tests {
    use serde::Deserialize;

    use super::*;

    /// Made by `tests/fixtures/make_pendulum.py`.
    #[derive(Deserialize)]
    struct Rollout {
        angle: f64,
        speed: f64,
        actions: Vec<f64>,
        rewards: Vec<f64>,
        angles: Vec<f64>,
        speeds: Vec<f64>,
        observations: Vec<[f32; 3]>,
    }

    #[test]
    fn it_moves_and_pays_as_that_of_gymnasium() {
        let rollouts: Vec<Rollout> =
            serde_json::from_str(include_str!("../tests/fixtures/pendulum.json")).unwrap();
        assert_eq!(rollouts.len(), 3);
        for rollout in rollouts {
            let mut pendulum = Pendulum { angle: rollout.angle, speed: rollout.speed };
            for (k, action) in rollout.actions.iter().enumerate() {
                let reward = pendulum.step(*action);
                let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-9, "{a} is not {b} at step {k}");
                close(reward, rollout.rewards[k]);
                close(pendulum.angle, rollout.angles[k]);
                close(pendulum.speed, rollout.speeds[k]);
                for (a, b) in pendulum.observe().into_iter().zip(rollout.observations[k]) {
                    assert!((a - b).abs() < 1e-6, "{a} is not {b} at step {k}");
                }
            }
        }
    }
}
