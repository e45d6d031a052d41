//! Every algorithm learns a tiny task; the paper's listing as printed does not.
#![allow(clippy::unwrap_used)]

mod support;
#[allow(dead_code, reason = "other tests use the rest")]
#[path = "support/task.rs"]
mod task;

use mpgx_learn::{Bound, Config, Count, CriticPair, Decay, InnerBatch, Learner, NoiseReading, Polyak};
use task::{HORIZON, Task, learner};

const STEPS: u32 = 2500;

/// Tuned for the task.
fn config(algorithm: &str) -> Config {
    let config = Config::from_extern(&support::settings(algorithm, &[24, 17], 16)).unwrap();
    Config { gamma: 0.9.into(), rate_end: 0.02, explore_decay: 0.97, ..config }
}

/// The switches of the preset `literal`.
fn literal() -> Config {
    Config {
        polyak: Polyak::Online,
        inner: 2,
        delay_counter: Count::Step,
        inner_batch: InnerBatch::Shared,
        critic_pair: CriticPair::Next,
        explore_bound: Bound::Min,
        explore_every: Decay::Step,
        delta_reset: true,
        ..config("mpg")
    }
}

/// Mean distance from 0 in the second half of an episode of the policy, over several starts.
fn error(learner: &Learner) -> f32 {
    let mut policy = learner.policy();
    let mut total = 0.0;
    for start in [-0.9, -0.4, 0.1, 0.5, 0.8] {
        let (mut x, mut action) = (start, [0.0]);
        for step in 0..HORIZON {
            policy.act(&[x, 1.0], 1, &mut action);
            x = (x + 0.3f32 * action[0]).clamp(-1.0, 1.0);
            total += if step < HORIZON / 2 { 0.0 } else { f32::abs(x) };
        }
    }
    total / (5 * HORIZON / 2) as f32
}

/// Before and after.
fn errors(config: &Config, seed: u32) -> [f32; 2] {
    let mut learner = learner(config, seed);
    let mut task = Task::new();
    let before = error(&learner);
    for step in 0..STEPS {
        learner.set_progress(f64::from(step) / f64::from(STEPS));
        task.step(&mut learner).unwrap();
    }
    [before, error(&learner)]
}

#[test]
fn it_learns() {
    let td3_original = Config {
        critic_rate: 1e-3.into(),
        warm_up: 200,
        train_clip: 0.5,
        explore_noise: 0.1.into(),
        explore_min: 0.0,
        explore_decay: 1.0,
        noise_reading: NoiseReading::Deviation,
        target_actor: true,
        terminal_mask: true,
        ..config("td3_original")
    };
    let ddpg = Config { delay: 1, train_noise: 0.0.into(), target_actor: true, ..config("ddpg") };
    for config in [config("mpg"), config("td3"), config("mean"), td3_original, ddpg] {
        let [before, after] = errors(&config, 0);
        assert!(before > 0.3 && after < 0.03, "{config:?}: {before} to {after}");
    }
}

#[test]
fn the_literal_listing_does_not() {
    for seed in 0..3 {
        let [_, after] = errors(&literal(), seed);
        assert!(after > 0.3, "seed {seed}: {after}");
    }
}

#[test]
fn one_of_its_slips_is_enough() {
    let critic_loss = Config { critic_pair: CriticPair::Next, ..config("mpg") };
    let polyak = Config { polyak: Polyak::Online, ..config("mpg") };
    for slip in [critic_loss, polyak] {
        let [_, after] = errors(&slip, 0);
        assert!(after > 0.3, "{:?}, {:?}: {after}", slip.critic_pair, slip.polyak);
    }
}
