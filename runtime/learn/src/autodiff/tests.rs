//! Both backends, update by update.

use mpgx_random::{Address, Purpose, Stream};

use super::*;
use crate::algorithms::Algorithm;
use crate::config::{CriticPair, DeltaKind, Polyak};
use crate::kernels::Simd;
use crate::replay::Transition;

const STATE: usize = 5;
const ACTION: usize = 3;
const ROWS: usize = 17;
const UPDATES: usize = 10;

fn stream(part: u16) -> Stream {
    Address { master: 9, purpose: Purpose::Weights, protocol: 0, part, seed: 0, episode: 0, step: 0 }.stream()
}

fn networks(target_actor: bool, activation: Activation) -> ActorCritic {
    let mlp =
        |part, inputs, outputs| Mlp::random(&[inputs, 40, 23, outputs], &mut stream(part)).with(activation);
    let critics = [mlp(0, STATE + ACTION, 1), mlp(1, STATE + ACTION, 1)];
    ActorCritic::new(Simd::best(), mlp(2, STATE, ACTION), critics, target_actor, ROWS)
}

/// The mini-batch of that update, and its noise.
fn batch(update: usize) -> (Batch, Vec<f32>) {
    let mut stream = stream(10 + update as u16);
    let mut numbers = |len: usize| (0..len).map(|_| stream.normal() as f32).collect::<Vec<_>>();
    let mut batch = Batch::new(ROWS, STATE, ACTION);
    for row in 0..ROWS {
        let (state, next, reward) = (numbers(STATE), numbers(STATE), numbers(1)[0]);
        let action: Vec<f32> = numbers(ACTION).into_iter().map(f32::tanh).collect();
        let transition = Transition { state: &state, action: &action, reward, next: &next, failure: false };
        batch.set(row, transition, if row % 5 == 0 { 0.0 } else { 0.95 });
    }
    (batch, numbers(ROWS * ACTION).into_iter().map(|noise| 0.4 * noise).collect())
}

fn rule(algorithm: Algorithm, printed: bool, update: usize) -> Rule {
    let (delta_kind, critic_pair, polyak) = match printed {
        false => (DeltaKind::Element, CriticPair::Taken, Polyak::Target),
        true => (DeltaKind::Mean, CriticPair::Next, Polyak::Online),
    };
    let delayed = update.is_multiple_of(2);
    Rule {
        algorithm,
        delta_kind,
        critic_pair,
        polyak,
        actor_rate: 1e-3,
        critic_rate: 1e-2,
        tau: 0.05,
        delayed,
    }
}

fn flat(network: &Mlp) -> Vec<f32> {
    network.layers().iter().flat_map(|layer| layer.rows().flatten()).copied().collect()
}

/// Every entry within 1e-4 of the greatest.
fn assert_close(found: &[f32], expected: &[f32], what: &str) {
    let scale = expected.iter().fold(0.0f32, |scale, value| scale.max(value.abs()));
    assert_eq!(found.len(), expected.len());
    let far = found.iter().zip(expected).map(|(found, expected)| (found - expected).abs());
    let worst = far.fold(0.0, f32::max);
    assert!(worst <= 1e-4 * scale, "{what}: {worst} of {scale}");
}

#[test]
fn ten_updates_are_those_of_the_kernels() {
    use Algorithm::{Ddpg, Mean, Mpg, Td3};
    for (algorithm, target_actor, printed, activation) in [
        (Mpg, false, false, Activation::Relu),
        (Mpg, false, true, Activation::Tanh),
        (Td3, false, false, Activation::Relu),
        (Td3, true, false, Activation::Tanh),
        (Mean, false, false, Activation::Tanh),
        (Ddpg, true, true, Activation::Relu),
    ] {
        let [mut native, mut ours] = [(); 2].map(|()| networks(target_actor, activation));
        for k in 1..=UPDATES {
            let what = format!("{algorithm:?}, target actor {target_actor}, printed {printed}, update {k}");
            let ((batch, noise), rule) = (batch(k), rule(algorithm, printed, k));
            let expected = native.update(&batch, &noise, &rule);
            let seen = update(&mut ours, &batch, &noise, &rule);
            let numbers = |seen: &Seen| [seen.critic_loss, seen.q[0], seen.q[1], seen.gap, seen.delta_adj];
            assert_close(&numbers(&seen), &numbers(&expected), &what);
            let actor = |seen: &Seen| seen.actor.map(|actor| [1.0, actor.loss, actor.saturation]);
            assert_close(
                actor(&seen).as_slice().as_flattened(),
                actor(&expected).as_slice().as_flattened(),
                &what,
            );
            assert_close(&ours.delta_last, &native.delta_last, &what);
            for (ours, native) in every(&ours).zip(every(&native)) {
                assert_close(&flat(ours), &flat(native), &what);
            }
        }
    }
}

/// Whatever an update may change.
fn every(networks: &ActorCritic) -> impl Iterator<Item = &Mlp> {
    let ActorCritic { actor, target_actor, critics, targets, actor_adam, critic_adams, .. } = networks;
    let moments = critic_adams.iter().chain([actor_adam]).flat_map(|adam| [&adam.m, &adam.v]);
    critics.iter().chain(targets).chain([actor]).chain(target_actor).chain(moments)
}

/// Twice the same, to the bit, in a pool of several threads, too.
#[test]
fn the_bits_depend_on_no_thread() {
    let run = || {
        let mut networks = networks(true, Activation::Relu);
        for k in 1..=4 {
            let (batch, noise) = batch(k);
            update(&mut networks, &batch, &noise, &rule(Algorithm::Mpg, false, k));
        }
        every(&networks).map(flat).collect::<Vec<_>>()
    };
    let alone = run();
    assert!(std::thread::spawn(run).join().unwrap() == alone);
}
