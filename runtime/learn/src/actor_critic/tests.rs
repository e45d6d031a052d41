//! Whole updates: against PyTorch, and the same bits in every width.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::*;
use crate::autodiff;

/// Made by `tests/fixtures/make_update.py`.
#[derive(Deserialize)]
struct Fixture {
    state: usize,
    action: usize,
    hidden: Vec<usize>,
    actor_rate: f64,
    critic_rate: f64,
    tau: f64,
    actor: Vec<f32>,
    critics: [Vec<f32>; 2],
    batches: Vec<FixtureBatch>,
    runs: BTreeMap<String, Run>,
}

#[derive(Deserialize)]
struct FixtureBatch {
    state: Vec<f32>,
    action: Vec<f32>,
    reward: Vec<f32>,
    discount: Vec<f32>,
    next: Vec<f32>,
    noise: Vec<f32>,
}

#[derive(Deserialize)]
struct Run {
    algorithm: String,
    delay: usize,
    train_clip: f32,
    delta_kind: String,
    delta_reset: bool,
    target_actor: bool,
    losses: Vec<Loss>,
    after: BTreeMap<usize, Networks>,
}

#[derive(Deserialize)]
struct Loss {
    critic: f64,
    actor: Option<f64>,
}

#[derive(Deserialize)]
struct Networks {
    actor: Vec<f64>,
    target_actor: Option<Vec<f64>>,
    critics: [Vec<f64>; 2],
    targets: [Vec<f64>; 2],
}

impl Fixture {
    fn read() -> Self {
        serde_json::from_str(include_str!("../../tests/fixtures/update.json")).unwrap()
    }

    fn networks(&self, simd: Simd, rows: usize, with_target_actor: bool) -> ActorCritic {
        let network = |inputs: usize, outputs: usize, weights: &[f32]| {
            let mut network = Mlp::zeros(&[&[inputs], self.hidden.as_slice(), &[outputs]].concat());
            let values = network.layers_mut().iter_mut().flat_map(|layer| layer.rows_mut()).flatten();
            assert_eq!(values.zip(weights).map(|(to, from)| *to = *from).count(), weights.len());
            network
        };
        let critics = [0, 1].map(|j| network(self.state + self.action, 1, &self.critics[j]));
        ActorCritic::new(
            simd,
            network(self.state, self.action, &self.actor),
            critics,
            with_target_actor,
            rows,
        )
    }

    fn rule(&self, algorithm: &str, update: usize) -> Rule {
        Rule {
            algorithm: Algorithm::named(algorithm).unwrap(),
            delta_kind: DeltaKind::Element,
            critic_pair: CriticPair::Taken,
            polyak: Polyak::Target,
            actor_rate: self.actor_rate,
            critic_rate: self.critic_rate,
            tau: self.tau,
            delayed: update.is_multiple_of(2),
        }
    }

    fn rule_of(&self, run: &Run, update: usize) -> Rule {
        let delta_kind = if run.delta_kind == "mean" { DeltaKind::Mean } else { DeltaKind::Element };
        let delayed = update.is_multiple_of(run.delay);
        Rule { delta_kind, delayed, ..self.rule(&run.algorithm, update) }
    }

    /// A batch of any size out of the rows of all batches, from row `first` on.
    fn batch(&self, first: usize, rows: usize) -> (Batch, Vec<f32>) {
        let mut batch = Batch::new(rows, self.state, self.action);
        let mut noise = Vec::new();
        for row in 0..rows {
            let (from, k) = (&self.batches[(first + row) / 16 % self.batches.len()], (first + row) % 16);
            let part = |values: &[f32], width: usize| values[k * width..][..width].to_vec();
            let (state, action) = (part(&from.state, self.state), part(&from.action, self.action));
            let next = part(&from.next, self.state);
            let transition = Transition {
                state: &state,
                action: &action,
                reward: from.reward[k],
                next: &next,
                failure: false,
            };
            batch.set(row, transition, from.discount[k]);
            noise.extend(part(&from.noise, self.action));
        }
        (batch, noise)
    }
}

fn flat(network: &Mlp) -> Vec<f32> {
    network.layers().iter().flat_map(|layer| layer.rows().flatten()).copied().collect()
}

/// Every weight within 1e-4 of the greatest.
fn assert_close(network: &Mlp, expected: &[f64], what: &str) {
    let scale = expected.iter().fold(0.0f64, |scale, value| scale.max(value.abs()));
    let found = flat(network);
    assert_eq!(found.len(), expected.len());
    let far = found.iter().zip(expected).map(|(found, expected)| (f64::from(*found) - expected).abs());
    let worst = far.fold(0.0, f64::max) / scale;
    assert!(worst < 1e-4, "{what}: {worst}");
}

#[test]
fn ten_updates_are_those_of_pytorch() {
    are_those_of_pytorch(ActorCritic::update);
}

#[test]
fn ten_updates_by_automatic_differentiation_are_those_of_pytorch() {
    are_those_of_pytorch(autodiff::update);
}

fn are_those_of_pytorch(update: fn(&mut ActorCritic, &Batch, &[f32], &Rule) -> Seen) {
    let fixture = Fixture::read();
    for (name, run) in &fixture.runs {
        let mut networks = fixture.networks(Simd::best(), 16, run.target_actor);
        for (k, loss) in (1..).zip(&run.losses) {
            let (batch, mut noise) = fixture.batch(16 * (k - 1), 16);
            noise.iter_mut().for_each(|noise| *noise = noise.clamp(-run.train_clip, run.train_clip));
            if run.delta_reset {
                networks.delta_last.fill(0.0);
            }
            let seen = update(&mut networks, &batch, &noise, &fixture.rule_of(run, k));
            let relative = (f64::from(seen.critic_loss) / loss.critic - 1.0).abs();
            assert!(relative < 1e-4, "{name}, critics' loss {k}: {relative}");
            assert_eq!(seen.actor.is_some(), loss.actor.is_some());
            if let (Some(seen), Some(loss)) = (seen.actor, loss.actor) {
                assert!((f64::from(seen.loss) - loss).abs() < 1e-4, "{name}, actor's loss {k}");
            }
            let Some(after) = run.after.get(&k) else { continue };
            assert_close(&networks.actor, &after.actor, &format!("{name}, actor after {k}"));
            assert_eq!(networks.target_actor.is_some(), after.target_actor.is_some());
            for (network, expected) in networks.target_actor.iter().zip(&after.target_actor) {
                assert_close(network, expected, &format!("{name}, target actor after {k}"));
            }
            for j in 0..2 {
                assert_close(&networks.critics[j], &after.critics[j], &format!("{name}, critic after {k}"));
                assert_close(&networks.targets[j], &after.targets[j], &format!("{name}, target after {k}"));
            }
        }
    }
}

#[test]
fn every_width_gives_the_same_bits() {
    let fixture = Fixture::read();
    let names: Vec<_> = Simd::available().map(Simd::name).collect();
    eprintln!("compared: {}", names.join(", "));
    for rows in [1, 15, 16, 17, 100] {
        let results: Vec<_> = Simd::available()
            .map(|simd| {
                let mut networks = fixture.networks(simd, rows, false);
                let seen = [1, 2, 3, 4].map(|k| {
                    let (batch, noise) = fixture.batch(k * rows, rows);
                    networks.update(&batch, &noise, &fixture.rule("mpg", k))
                });
                (bytes(&networks), seen)
            })
            .collect();
        assert!(results.windows(2).all(|pair| pair[0] == pair[1]), "{rows} rows");
    }
}

/// Before the first delayed update the targets and the actor stay as they are.
#[test]
fn the_actor_and_the_targets_wait() {
    let fixture = Fixture::read();
    let mut networks = fixture.networks(Simd::best(), 16, false);
    let (batch, noise) = fixture.batch(0, 16);
    networks.update(&batch, &noise, &fixture.rule("mpg", 1));
    assert_eq!(flat(&networks.actor), fixture.actor);
    for j in 0..2 {
        assert_eq!(flat(&networks.targets[j]), fixture.critics[j]);
        assert_ne!(flat(&networks.critics[j]), fixture.critics[j]);
    }
}

/// A target actor gives the target actions and follows the actor as the target critics follow theirs.
#[test]
fn the_target_actor_follows_the_actor() {
    let fixture = Fixture::read();
    let mut networks = fixture.networks(Simd::best(), 16, true);
    let (batch, noise) = fixture.batch(0, 16);
    networks.update(&batch, &noise, &fixture.rule("mpg", 2));
    let target = flat(networks.target_actor.as_ref().unwrap());
    for ((target, new), old) in target.iter().zip(flat(&networks.actor)).zip(&fixture.actor) {
        assert!((target - (old + 0.05 * (new - old))).abs() < 1e-6, "{target} {new} {old}");
    }
    assert_ne!(target, fixture.actor);
    let with = networks.update(&batch, &noise, &fixture.rule("mpg", 1));
    networks = fixture.networks(Simd::best(), 16, false);
    networks.update(&batch, &noise, &fixture.rule("mpg", 2));
    let without = networks.update(&batch, &noise, &fixture.rule("mpg", 1));
    assert_ne!(with.gap, without.gap);
}

fn bytes(networks: &ActorCritic) -> Vec<u8> {
    let mut bytes = Vec::new();
    networks.save(&mut Writer(&mut bytes));
    bytes
}

/// As printed, lines 22 and 23 pull the online critics back to targets that never move.
#[test]
fn the_printed_polyak_pulls_the_critics_back() {
    let fixture = Fixture::read();
    let run = |polyak| {
        let mut networks = fixture.networks(Simd::best(), 16, false);
        let (batch, noise) = fixture.batch(0, 16);
        networks.update(&batch, &noise, &Rule { polyak, ..fixture.rule("mpg", 2) });
        networks
    };
    let (right, printed) = (run(Polyak::Target), run(Polyak::Online));
    assert_eq!(flat(&printed.actor), flat(&right.actor), "the actor is earlier");
    for j in 0..2 {
        let before = &fixture.critics[j];
        assert_eq!(&flat(&printed.targets[j]), before);
        for ((printed, new), old) in flat(&printed.critics[j]).iter().zip(flat(&right.critics[j])).zip(before)
        {
            assert!((printed - (old + 0.05 * (new - old))).abs() < 1e-6, "{printed} {new} {old}");
        }
    }
}

/// As printed, line 17 trains the critics at (s′, u′): they never see an action that was taken.
#[test]
fn the_printed_critic_loss_never_sees_the_action_taken() {
    let fixture = Fixture::read();
    let run = |critic_pair, first: f32| {
        let mut networks = fixture.networks(Simd::best(), 16, false);
        let (mut batch, noise) = fixture.batch(0, 16);
        for row in 0..16 {
            batch.state_action.row_mut(row)[fixture.state] = first;
        }
        networks.update(&batch, &noise, &Rule { critic_pair, ..fixture.rule("mpg", 2) });
        bytes(&networks)
    };
    assert!(run(CriticPair::Next, 0.9) == run(CriticPair::Next, -0.9));
    assert!(run(CriticPair::Taken, 0.9) != run(CriticPair::Taken, -0.9));
}

/// One Δ_last an entry of the mini-batch, carried to the next update.
#[test]
fn the_last_difference_is_carried() {
    let fixture = Fixture::read();
    let mut networks = fixture.networks(Simd::best(), 16, false);
    let (batch, noise) = fixture.batch(0, 16);
    let first = networks.update(&batch, &noise, &fixture.rule("mpg", 1));
    assert!((2.0 * first.delta_adj - first.gap).abs() < 1e-6, "Δ_last begins at 0");
    assert!(networks.delta_last.iter().all(|&delta| delta > 0.0));
    // The targets have not moved: the same batch meets its own difference, and MPG is TD3.
    let second = networks.update(&batch, &noise, &fixture.rule("mpg", 1));
    assert!((second.delta_adj - second.gap).abs() < 1e-6);
}
