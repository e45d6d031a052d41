//! The learner from outside: it learns, its settings do what they say, and nothing is lost over a restore.
#![allow(clippy::unwrap_used)]

mod support;
#[path = "support/task.rs"]
mod task;

use std::collections::BTreeMap;

use mpgx_lang::plan::{Curve, Schedule};
use mpgx_learn::{
    Activation, Backend, Bound, Config, Count, CriticPair, Decay, DeltaKind, InnerBatch, LearnError, Learner,
    NoiseReading, Policy, Polyak, Transition, Varying,
};
use task::{ACTION, STATE, Task, learner, saved};

const STILL: Transition = Transition {
    state: &[0.0; STATE],
    action: &[0.0; ACTION],
    reward: 0.0,
    next: &[0.0; STATE],
    failure: false,
};

fn config(algorithm: &str) -> Config {
    Config::from_extern(&support::settings(algorithm, &[24, 17], 16)).unwrap()
}

fn health(learner: &mut Learner) -> BTreeMap<&'static str, f32> {
    learner.take_health().into_iter().collect()
}

#[test]
fn a_seed_names_a_run() {
    let run = |seed| {
        let mut learner = learner(&config("mpg"), seed);
        Task::new().steps(&mut learner, 60);
        saved(&learner)
    };
    assert!(run(0) == run(0));
    assert!(run(0) != run(1));
}

/// All switches away from their defaults, in turn with them; a small replay that drops transitions; dfdx.
fn variants() -> [Config; 6] {
    let switched = Config {
        inner: 3,
        delay_counter: Count::Step,
        inner_batch: InnerBatch::Shared,
        critic_pair: CriticPair::Next,
        polyak: Polyak::Online,
        warm_up: 30,
        train_clip: 0.5,
        explore_bound: Bound::Min,
        explore_every: Decay::Step,
        noise_reading: NoiseReading::Deviation,
        delta_reset: true,
        delta_kind: DeltaKind::Mean,
        target_actor: true,
        terminal_mask: true,
        rate_end: 0.1,
        ..config("mpg")
    };
    let scheduled = Config {
        gamma: linear(0.8, 0.99),
        actor_rate: linear(1e-3, 1e-5),
        explore_noise: linear(1.0, 0.1),
        ..config("mpg")
    };
    let dfdx = |config: &Config| Config { backend: Backend::Dfdx, ..config.clone() };
    let (plain, small) = (config("mpg"), Config { replay: 50, ..config("td3") });
    [dfdx(&plain), dfdx(&switched), plain, small, switched, scheduled]
}

#[test]
fn a_restored_run_goes_on_as_if_nothing_had_been() {
    for config in variants() {
        for pause in [5, 70] {
            let (mut whole, mut task) = (learner(&config, 3), Task::new());
            task.steps(&mut whole, pause / 2);
            let mut rows = Vec::new();
            whole.replay_rows(0, &mut rows);
            let first = whole.replay_pushed();
            task.steps(&mut whole, pause - pause / 2);
            whole.set_progress(0.4);
            whole.replay_rows(first, &mut rows);
            assert_eq!(rows.len() as u64, u64::from(pause) * whole.row_bytes() as u64);
            let state = saved(&whole);

            let mut resumed = learner(&config, 3);
            resumed.restore(&state).unwrap();
            let (first, second) = rows.split_at(first as usize * whole.row_bytes());
            resumed.restore_rows(first).unwrap();
            let early = resumed.step([STILL]);
            assert!(matches!(early, Err(LearnError::ReplayMissing { .. })), "{early:?}");
            resumed.restore_rows(second).unwrap();
            assert!(saved(&resumed) == state);

            let mut continued = [&mut whole, &mut resumed].map(|learner| {
                (0..40).for_each(|_| task_step(learner).unwrap());
                (saved(learner), learner.take_health(), learner.policy().to_bytes())
            });
            let [whole, resumed] = &mut continued;
            assert!(whole == resumed, "{config:?} paused at {pause}");
        }
    }
}

/// One step that depends on the learner only.
fn task_step(learner: &mut Learner) -> Result<(), LearnError> {
    let (state, mut action) = ([0.3, 1.0], [0.0]);
    learner.explore(&state, &mut action);
    let next = [0.3 + 0.1 * action[0], 1.0];
    learner.step([Transition {
        state: &state,
        action: &action,
        reward: -next[0].abs(),
        next: &next,
        failure: false,
    }])
}

/// Transitions that were dropped before they were saved are not needed again.
#[test]
fn a_log_with_gaps_restores() {
    let config = Config { replay: 20, ..config("mpg") };
    let mut whole = learner(&config, 0);
    Task::new().steps(&mut whole, 75);
    let (state, mut rows) = (saved(&whole), Vec::new());
    whole.replay_rows(0, &mut rows);
    assert_eq!(rows.len(), 75 * whole.row_bytes());
    let dropped = rows.chunks(whole.row_bytes()).map(|row| row.iter().all(|&byte| byte == 0));
    assert!(dropped.enumerate().all(|(n, dropped)| dropped == (n < 55)));
    let mut resumed = learner(&config, 0);
    resumed.restore(&state).unwrap();
    resumed.restore_rows(&rows).unwrap();
    assert_eq!(resumed.replay_len(), 20);
    for learner in [&mut whole, &mut resumed] {
        (0..10).for_each(|_| task_step(learner).unwrap());
    }
    assert!(saved(&whole) == saved(&resumed));
}

#[test]
fn a_foreign_state_is_refused_and_changes_nothing() {
    let mut target = learner(&config("mpg"), 0);
    Task::new().steps(&mut target, 30);
    let before = saved(&target);
    let wider = Config { hidden: vec![24, 18], ..config("mpg") };
    for foreign in [saved(&learner(&wider, 0)), before[..before.len() - 1].to_vec(), vec![]] {
        let expected = before.len();
        let error = LearnError::WrongSize { expected, found: foreign.len() };
        assert_eq!(target.restore(&foreign), Err(error));
    }
    assert_eq!(
        target.restore_rows(&[0; 3]),
        Err(LearnError::Damaged { reason: "its replay does not hold whole transitions" })
    );
    assert!(saved(&target) == before);
}

#[test]
fn what_is_not_finite_is_named() {
    let mut learner = learner(&config("mpg"), 0);
    let name = |result| match result {
        Err(LearnError::Diverged { quantity, .. }) => quantity,
        other => panic!("{other:?}"),
    };
    assert_eq!(name(learner.step([Transition { reward: f32::NAN, ..STILL }])), "the reward");
    assert_eq!(name(learner.step([Transition { next: &[f32::INFINITY, 0.0], ..STILL }])), "the next state");
    assert_eq!(learner.replay_len(), 0);
    for _ in 0..15 {
        learner.step([STILL]).unwrap();
    }
    let shot = Transition { reward: 1e30, ..STILL };
    let first = (0..100).map(|_| learner.step([shot])).find(Result::is_err);
    assert_eq!(name(first.unwrap()), "loss/critic");
    let error = learner.step([Transition { action: &[], ..STILL }]).unwrap_err();
    assert_eq!(error, LearnError::WrongLength { part: "action", expected: ACTION, found: 0 });
}

/// The two identities: forgotten at each step, Δ_last makes MPG the mean of the twins; TD3 is the minimum.
#[test]
fn the_adjustment_is_half_the_gap_without_momentum_and_all_of_it_in_td3() {
    let reset = Config { delta_reset: true, ..config("mpg") };
    for (config, share) in [(reset, 0.5), (config("mean"), 0.5), (config("td3"), 1.0)] {
        let mut learner = learner(&config, 0);
        Task::new().steps(&mut learner, 100);
        let health = health(&mut learner);
        let (gap, delta_adj) = (health["q/gap"], health["q/delta_adj"]);
        assert!(gap > 0.0 && (delta_adj / gap - share).abs() < 1e-4, "{gap} {delta_adj}");
    }
}

#[test]
fn noise_falls_to_its_floor() {
    let base = Config { explore_noise: 0.25.into(), explore_min: 0.04, explore_decay: 0.5, ..config("mpg") };
    let deviations = |config: &Config| {
        let mut learner = learner(config, 0);
        [(); 5].map(|()| {
            learner.explore(&[0.0; STATE], &mut [0.0; ACTION]);
            learner.explore(&[0.0; STATE], &mut [0.0; ACTION]);
            learner.end_episode();
            health(&mut learner)["noise/explore"]
        })
    };
    let close = |found: [f32; 5], expected: [f64; 5]| {
        assert!(found.iter().zip(expected).all(|(a, b)| (f64::from(*a) - b).abs() < 1e-6), "{found:?}");
    };
    close(deviations(&base), [0.25, 0.125, 0.0625, 0.04, 0.04].map(f64::sqrt));
    let deviation = Config { noise_reading: NoiseReading::Deviation, ..base.clone() };
    close(deviations(&deviation), [0.25, 0.125, 0.0625, 0.04, 0.04]);
    let step = Config { explore_every: Decay::Step, ..deviation.clone() };
    close(deviations(&step), [0.1875, 0.05125, 0.04, 0.04, 0.04]);
    let printed = Config { explore_bound: Bound::Min, ..deviation };
    close(deviations(&printed), [0.25, 0.04, 0.02, 0.01, 0.005]);
}

/// The warm-up counts actions; they are uniform, whatever the policy and the noise.
#[test]
fn the_first_actions_are_uniform() {
    let config = Config { warm_up: 1000, explore_noise: 0.0.into(), explore_min: 0.0, ..config("mpg") };
    let mut learner = learner(&config, 0);
    let (mut policy, mut action) = ([0.0], [0.0]);
    learner.act(&[0.5, 1.0], &mut policy);
    let mut quarters = [0; 4];
    for _ in 0..1000 {
        learner.explore(&[0.5, 1.0], &mut action);
        quarters[(2.0 * (action[0] + 1.0)) as usize] += 1;
    }
    assert!(quarters.iter().all(|count| (200..300).contains(count)), "{quarters:?}");
    assert!(learner.take_health().is_empty());
    learner.explore(&[0.5, 1.0], &mut action);
    assert_eq!(action, policy);
}

#[test]
fn exploration_is_the_policy_with_noise() {
    let quiet = Config { explore_noise: 0.0.into(), explore_min: 0.0, ..config("mpg") };
    let mut quiet = learner(&quiet, 0);
    let mut loud = learner(&config("mpg"), 0);
    let (mut pure, mut same, mut noisy) = ([0.0], [0.0], [0.0]);
    quiet.act(&[0.5, 1.0], &mut pure);
    quiet.explore(&[0.5, 1.0], &mut same);
    assert_eq!(pure, same);
    let mut beyond = 0;
    for _ in 0..100 {
        loud.explore(&[0.5, 1.0], &mut noisy);
        assert!(noisy[0].abs() <= 1.0);
        beyond += u32::from(noisy[0].abs() == 1.0);
    }
    // P(|N(0, 2)| > 1) is about 0.48.
    assert!((30..70).contains(&beyond), "{beyond}");
}

/// With networks that never change, what differs between updates is what was drawn.
#[test]
fn every_update_draws_its_own_noise_and_batch() {
    let frozen = Config { actor_rate: 0.0.into(), critic_rate: 0.0.into(), batch: 1, ..config("mpg") };
    let distinct = |config: &Config, metric: &str| {
        let mut learner = learner(config, 0);
        let mut values: Vec<f32> = (0..8)
            .map(|k| {
                let state = [if config.replay == 1 { 0.0 } else { k as f32 / 8.0 }, 1.0];
                learner.step([Transition { state: &state, next: &state, ..STILL }]).unwrap();
                health(&mut learner)[metric]
            })
            .collect();
        values.sort_by(f32::total_cmp);
        values.dedup();
        values.len()
    };
    let one_transition = Config { replay: 1, ..frozen.clone() };
    assert!(distinct(&one_transition, "q/gap") > 4);
    assert_eq!(distinct(&Config { train_noise: 0.0.into(), ..one_transition.clone() }, "q/gap"), 1);
    assert_eq!(distinct(&Config { train_clip: 0.0, ..one_transition }, "q/gap"), 1);
    assert!(distinct(&frozen, "q/q1") > 2);
}

#[test]
fn step_sizes_fall_with_progress() {
    let mut learner = learner(&Config { rate_end: 0.0, ..config("mpg") }, 0);
    let mut task = Task::new();
    let policies = [0.0, 1.0].map(|progress| {
        learner.set_progress(progress);
        task.steps(&mut learner, 30);
        let before = learner.policy().to_bytes();
        task.steps(&mut learner, 30);
        (before, learner.policy().to_bytes())
    });
    assert!(policies[0].0 != policies[0].1);
    assert!(policies[1].0 == policies[1].1);
}

fn linear(from: f64, to: f64) -> Varying {
    Varying::Scheduled(Schedule { curve: Curve::Linear, from, to, begin: 0.0, end: 1.0 })
}

/// A schedule that stays is the plain number, to the bit; one that moves counts from where it moves.
#[test]
fn schedules_go_by_progress() {
    type Set = fn(&mut Config, Varying);
    let settings: [(&str, f64, Set); 5] = [
        ("actor_rate", 1e-3, |config, value| config.actor_rate = value),
        ("critic_rate", 1e-2, |config, value| config.critic_rate = value),
        ("gamma", 0.99, |config, value| config.gamma = value),
        ("tau", 0.005, |config, value| config.tau = value),
        ("train_noise", 0.2, |config, value| config.train_noise = value),
    ];
    for (name, value, set) in settings {
        let run = |value: Varying, progress: f64| {
            let mut config = config("mpg");
            set(&mut config, value);
            let mut learner = learner(&config, 0);
            learner.set_progress(progress);
            Task::new().steps(&mut learner, 40);
            learner.policy().to_bytes()
        };
        let plain = run(value.into(), 0.5);
        assert!(run(linear(value, value), 0.5) == plain, "{name}");
        assert!(run(linear(value, 0.0), 0.0) == run(value.into(), 0.0), "{name}");
        assert!(run(linear(value, 0.0), 0.5) == run((0.5 * value).into(), 0.5), "{name}");
        assert!(run(linear(value, 0.0), 0.5) != plain, "{name}");
    }
}

#[test]
fn a_scheduled_noise_neither_decays_nor_has_a_floor() {
    let config =
        Config { explore_noise: linear(0.25, 0.0), explore_decay: 0.5, explore_min: 0.2, ..config("mpg") };
    let mut learner = learner(&config, 0);
    for (progress, variance) in [(0.0, 0.25f32), (0.2, 0.2), (0.6, 0.1), (1.0, 0.0)] {
        learner.set_progress(progress);
        learner.explore(&[0.0; STATE], &mut [0.0; ACTION]);
        learner.end_episode();
        let deviation = health(&mut learner)["noise/explore"];
        assert!((deviation - variance.sqrt()).abs() < 1e-6, "{deviation} at {progress}");
    }
}

/// Two robots with one policy: each has its own noise and its own transition; a step does one round of updates.
#[test]
fn several_act_in_one_step() {
    let config = Config { inner: 3, explore_every: Decay::Step, explore_decay: 0.5, ..config("mpg") };
    let mut learner = learner(&config, 0);
    let (states, mut actions) = ([0.5, 1.0, 0.5, 1.0], [0.0; 2 * ACTION]);
    let mut pure = [0.0; ACTION];
    learner.act(&states[..STATE], &mut pure);
    learner.explore(&states, &mut actions);
    assert!(actions[0] != actions[1] && actions[0] != pure[0]);
    learner.explore(&states, &mut actions);
    let mean = (2f32.sqrt() + 1.0) / 2.0;
    assert!((health(&mut learner)["noise/explore"] - mean).abs() < 1e-6);
    for step in 1..=10 {
        learner.step([STILL, Transition { reward: -1.0, ..STILL }]).unwrap();
        assert_eq!((learner.replay_pushed(), learner.replay_len()), (2 * step, 2 * step as usize));
        // The first mini-batch is there at step 8.
        assert_eq!(learner.updates(), 3 * step.saturating_sub(7));
    }
}

#[test]
fn failures_cut_the_value_only_where_asked() {
    let run = |terminal_mask, failures: bool| {
        let mut learner = learner(&Config { terminal_mask, ..config("mpg") }, 0);
        for k in 0..40 {
            let state = [k as f32 / 40.0, 1.0];
            let failure = failures && k % 3 == 0;
            learner
                .step([Transition { state: &state, action: &[0.1], reward: -1.0, next: &state, failure }])
                .unwrap();
        }
        learner.policy().to_bytes()
    };
    assert!(run(false, true) == run(false, false));
    assert!(run(true, false) == run(false, false));
    assert!(run(true, true) != run(true, false));
}

#[test]
fn updates_are_counted_as_the_settings_say() {
    let run = |config: Config| {
        let mut learner = learner(&config, 0);
        let before = learner.policy().to_bytes();
        Task::new().steps(&mut learner, 25);
        (learner.updates(), before != learner.policy().to_bytes())
    };
    // The first mini-batch is there at step 16.
    assert_eq!(run(config("mpg")), (10, true));
    assert_eq!(run(Config { inner: 3, ..config("mpg") }), (30, true));
    assert_eq!(run(Config { delay: 11, ..config("mpg") }), (10, false));
    assert_eq!(run(Config { delay_counter: Count::Step, ..config("mpg") }), (10, false));
    assert_eq!(run(Config { delay_counter: Count::Step, inner: 2, ..config("mpg") }), (20, true));
}

#[test]
fn the_inner_updates_share_a_batch_if_asked() {
    let run = |inner_batch| {
        let mut learner = learner(&Config { inner: 2, inner_batch, ..config("mpg") }, 0);
        Task::new().steps(&mut learner, 40);
        learner.policy().to_bytes()
    };
    assert!(run(InnerBatch::Fresh) != run(InnerBatch::Shared));
}

#[test]
fn a_policy_survives_its_bytes_and_refuses_others() {
    let mut learner = learner(&Config { activation: Activation::Tanh, ..config("mpg") }, 0);
    Task::new().steps(&mut learner, 40);
    let mut policy = learner.policy();
    let bytes = policy.to_bytes();
    let mut read = Policy::from_bytes(&bytes).unwrap();
    let states: Vec<f32> = (0..37 * STATE).map(|k| (k as f32 * 0.37).sin()).collect();
    let (mut together, mut again) = (vec![0.0; 37], vec![0.0; 37]);
    policy.act(&states, 37, &mut together);
    read.act(&states, 37, &mut again);
    assert_eq!(together, again);
    for (row, action) in together.iter().enumerate() {
        let (mut alone, mut acted) = ([0.0], [0.0]);
        policy.act(&states[row * STATE..][..STATE], 1, &mut alone);
        learner.act(&states[row * STATE..][..STATE], &mut acted);
        assert_eq!([alone[0].to_bits(), acted[0].to_bits()], [action.to_bits(); 2], "row {row}");
    }
    for len in 0..bytes.len() {
        assert!(Policy::from_bytes(&bytes[..len]).is_err(), "{len} bytes");
    }
    for count in 0..6 {
        let mut hostile = bytes.clone();
        hostile[8 * count + 7] = 0xff;
        assert!(Policy::from_bytes(&hostile).is_err(), "number {count}");
    }
}

#[test]
fn an_empty_state_or_action_is_refused() {
    assert_eq!(Learner::new(config("mpg"), 0, 1, 0, 0).err(), Some(LearnError::Empty { part: "state" }));
    assert_eq!(Learner::new(config("mpg"), 1, 0, 0, 0).err(), Some(LearnError::Empty { part: "action" }));
}
