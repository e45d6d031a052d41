//! The loop that all algorithms share: explore, store, update.

use mpgx_random::{Address, Purpose, Stream};

use crate::actor_critic::{ActorCritic, Batch, Rule, Seen};
use crate::autodiff;
use crate::bytes::{Reader, Writer};
use crate::config::{Backend, Config, Count, Decay, InnerBatch};
use crate::error::LearnError;
use crate::health::Health;
use crate::hindsight::Hindsight;
use crate::kernels::Simd;
use crate::network::Mlp;
use crate::noise::{self, Exploration};
use crate::policy::{Evaluation, Policy};
use crate::probe::{PROBE_EVERY, Probe};
use crate::replay::{Replay, Transition};
use crate::varying::Varying;

/// One learner in the middle of its training.
///
/// The trainer asks [`Learner::explore`] for an action, steps the environment and hands the transition (of
/// robots that share the policy, one each) to [`Learner::step`]; it tells the end of each episode and how far training is. Everything is a function of
/// the configuration, the seed and what was handed over: all random numbers are addressed by the number of
/// the step or of the update.
pub struct Learner {
    config: Config,
    randomness: Randomness,
    simd: Simd,
    networks: ActorCritic,
    replay: Replay,
    /// Transitions that a restored learner needs before it goes on.
    replay_needed: u64,
    exploration: Exploration,
    /// Actions explored, and updates done.
    explored: u64,
    updates: u64,
    /// Share of the training budget that is spent.
    progress: f64,
    health: Health,
    /// Of the critics and the actor.
    probes: [Probe; 3],
    evaluation: Evaluation,
    batch: Batch,
    noise: Vec<f32>,
}

/// The addresses of one learner's random numbers.
#[derive(Clone, Copy)]
struct Randomness {
    master: u64,
    seed: u32,
}

impl Randomness {
    fn stream(self, purpose: Purpose, part: u16, step: u64) -> Stream {
        let Self { master, seed } = self;
        Address { master, purpose, protocol: 0, part, seed, episode: 0, step }.stream()
    }
}

impl Learner {
    /// A learner for states and actions of these lengths. `seed` draws its weights, mini-batches and noise.
    pub fn new(
        config: Config,
        state: usize,
        action: usize,
        master: u64,
        seed: u32,
    ) -> Result<Self, LearnError> {
        let simd = Simd::best();
        for (part, len) in [("state", state), ("action", action)] {
            if len == 0 {
                return Err(LearnError::Empty { part });
            }
        }
        let randomness = Randomness { master, seed };
        let sizes = |inputs, outputs| [&[inputs][..], &config.hidden, &[outputs]].concat();
        let network = |part, sizes: &[usize]| {
            let mut stream = randomness.stream(Purpose::Weights, part, 0);
            Mlp::random(sizes, &mut stream).with(config.activation)
        };
        let (actor_sizes, critic_sizes) = (sizes(state, action), sizes(state + action, 1));
        let critics = [network(1, &critic_sizes), network(2, &critic_sizes)];
        let actor = network(0, &actor_sizes);
        let networks = ActorCritic::new(simd, actor, critics, config.target_actor, config.batch);
        let [first, second] = &networks.critic_adams;
        Ok(Self {
            probes: [first, second, &networks.actor_adam].map(Probe::new),
            networks,
            replay: Replay::new(state, action, config.replay),
            replay_needed: 0,
            exploration: Exploration::new(&config),
            explored: 0,
            updates: 0,
            progress: 0.0,
            health: Health::new(),
            evaluation: Evaluation::new(&actor_sizes),
            batch: Batch::new(config.batch, state, action),
            noise: vec![0.0; config.batch * action],
            config,
            randomness,
            simd,
        })
    }

    /// u = clip(π(s) + N(0, v), −1, 1) for one state, or for several that are acted on in one step of the world,
    /// `[rows][state]` to `[rows][action]`, each with its own noise. Uniform in [−1, 1] during the warm-up.
    ///
    /// # Panics
    ///
    /// If a slice has another length.
    pub fn explore(&mut self, states: &[f32], actions: &mut [f32]) {
        self.act(states, actions);
        let deviation = self.exploration.deviation(&self.config, self.progress);
        let warming_up = self.explored < self.config.warm_up;
        for action in actions.chunks_exact_mut(self.replay.action_len()) {
            let mut stream = self.randomness.stream(Purpose::Exploration, 0, self.explored);
            for u in action {
                *u = match warming_up {
                    true => (2.0 * stream.uniform() - 1.0) as f32,
                    false => (*u + deviation * stream.normal() as f32).clamp(-1.0, 1.0),
                };
            }
            self.explored += 1;
        }
        if !warming_up {
            self.health.explored(deviation);
        }
        self.exploration.decay(Decay::Step, &self.config);
    }

    /// u = π(s) for each state, `[rows][state]` to `[rows][action]`.
    ///
    /// # Panics
    ///
    /// If a slice has another length.
    pub fn act(&mut self, states: &[f32], actions: &mut [f32]) {
        let rows = states.len() / self.replay.state_len();
        let expected = (rows * self.replay.state_len(), rows * self.replay.action_len());
        assert_eq!((states.len(), actions.len()), expected, "states and actions of {rows} rows");
        self.evaluation.act(self.simd, &self.networks.actor, states, actions);
    }

    /// Stores the transitions of one step of the world and, once there are enough for a mini-batch, does the
    /// updates of a step.
    ///
    /// Errors if a transition has other lengths or is not finite, if a loss is not finite, or if a restored
    /// learner lacks transitions.
    pub fn step<'a>(
        &mut self,
        transitions: impl IntoIterator<Item = Transition<'a>>,
    ) -> Result<(), LearnError> {
        if self.replay.pushed() < self.replay_needed {
            let (expected, found) = (self.replay_needed, self.replay.pushed());
            return Err(LearnError::ReplayMissing { expected, found });
        }
        for transition in transitions {
            self.check(&transition)?;
            self.replay.push(transition);
        }
        if self.replay.len() < self.config.batch {
            return Ok(());
        }
        if self.config.delta_reset {
            self.networks.delta_last.fill(0.0);
        }
        for inner in 1..=self.config.inner {
            self.updates += 1;
            if inner == 1 || self.config.inner_batch == InnerBatch::Fresh {
                self.draw();
            }
            self.update(inner)?;
        }
        Ok(())
    }

    fn check(&self, transition: &Transition<'_>) -> Result<(), LearnError> {
        let Transition { state, action, reward, next, .. } = *transition;
        let (state_len, action_len) = (self.replay.state_len(), self.replay.action_len());
        for (part, quantity, values, expected) in [
            ("state", "the state", state, state_len),
            ("action", "the action", action, action_len),
            ("reward", "the reward", &[reward], 1),
            ("next state", "the next state", next, state_len),
        ] {
            if values.len() != expected {
                return Err(LearnError::WrongLength { part, expected, found: values.len() });
            }
            self.finite(quantity, values)?;
        }
        Ok(())
    }

    fn finite(&self, quantity: &'static str, values: &[f32]) -> Result<(), LearnError> {
        match values.iter().find(|value| !value.is_finite()) {
            Some(&value) => Err(LearnError::Diverged { quantity, value, update: self.updates }),
            None => Ok(()),
        }
    }

    /// A fresh mini-batch, with replacement.
    fn draw(&mut self) {
        let mut stream = self.randomness.stream(Purpose::Replay, 0, self.updates);
        let gamma = self.config.gamma.at(self.progress) as f32;
        for row in 0..self.config.batch {
            let transition = self.replay.get(stream.below(self.replay.len() as u64) as usize);
            let over = self.config.terminal_mask && transition.failure;
            self.batch.set(row, transition, if over { 0.0 } else { gamma });
        }
    }

    /// Update number `inner` of this step.
    fn update(&mut self, inner: u64) -> Result<(), LearnError> {
        let config = &self.config;
        let deviation = noise::deviation(config.train_noise.at(self.progress), config.noise_reading);
        let mut stream = self.randomness.stream(Purpose::TargetNoise, 0, self.updates);
        noise::fill(&mut self.noise, &mut stream, deviation, config.train_clip as f32);
        let counted = match config.delay_counter {
            Count::Run => self.updates,
            Count::Step => inner,
        };
        let rule = Rule {
            algorithm: config.algorithm,
            delta_kind: config.delta_kind,
            critic_pair: config.critic_pair,
            polyak: config.polyak,
            actor_rate: self.rate(config.actor_rate),
            critic_rate: self.rate(config.critic_rate),
            tau: config.tau.at(self.progress),
            delayed: counted.is_multiple_of(config.delay),
        };
        let (look_at_critics, look_at_actor) = self.looks(rule.delayed);
        self.begin_looks(look_at_critics, look_at_actor);
        let seen = match self.config.backend {
            Backend::Native => self.networks.update(&self.batch, &self.noise, &rule),
            Backend::Dfdx => autodiff::update(&mut self.networks, &self.batch, &self.noise, &rule),
        };
        self.health.updated(&seen);
        self.end_looks(look_at_critics, look_at_actor);
        self.judge(&seen)
    }

    /// Whether the gradients of the critics and of the actor are looked at in this update: those of the critics
    /// every [`PROBE_EVERY`] updates, that of the actor where it changes next.
    fn looks(&self, delayed: bool) -> (bool, bool) {
        let since = self.updates % PROBE_EVERY;
        (since == 0, delayed && since < self.config.delay)
    }

    fn begin_looks(&mut self, critics: bool, actor: bool) {
        let [first, second, third] = &mut self.probes;
        if critics {
            first.begin(&self.networks.critic_adams[0]);
            second.begin(&self.networks.critic_adams[1]);
        }
        if actor {
            third.begin(&self.networks.actor_adam);
        }
    }

    fn end_looks(&mut self, critics: bool, actor: bool) {
        let [first, second, third] = &self.probes;
        if critics {
            let [a, b] = &self.networks.critic_adams;
            self.health.critic_gradients([first.norm(a), second.norm(b)]);
        }
        if actor {
            self.health.actor_gradient(third.norm(&self.networks.actor_adam));
        }
    }

    /// A step size now.
    fn rate(&self, rate: Varying) -> f64 {
        match rate {
            Varying::Constant(rate) => (1.0 - (1.0 - self.config.rate_end) * self.progress) * rate,
            Varying::Scheduled(_) => rate.at(self.progress),
        }
    }

    fn judge(&self, seen: &Seen) -> Result<(), LearnError> {
        self.finite("loss/critic", &[seen.critic_loss])?;
        self.finite("loss/actor", seen.actor.map(|actor| actor.loss).as_slice())
    }

    /// Compares what the first critic says of the episode that has just ended, of so many steps and robots that
    /// share the policy, with the return that followed: `q/estimate_minus_return`. Nothing is compared if the
    /// replay no longer holds the whole episode.
    pub fn look_back(&mut self, steps: usize, members: usize) {
        let gamma = self.config.gamma.at(self.progress);
        let episode =
            Hindsight { replay: &self.replay, steps, members, gamma, mask: self.config.terminal_mask };
        let (actor, critic) = (&self.networks.actor, &self.networks.critics[0]);
        if let Some(off) = episode.estimate_minus_return(self.simd, actor, critic) {
            self.health.looked_back(off);
        }
    }

    /// Tells that an episode is over.
    pub fn end_episode(&mut self) {
        self.exploration.decay(Decay::Episode, &self.config);
    }

    /// Tells which share of the training budget is spent, 0 to 1; step sizes and schedules go by it.
    pub fn set_progress(&mut self, fraction: f64) {
        self.progress = fraction.clamp(0.0, 1.0);
    }

    pub fn config(&self) -> &Config {
        &self.config
    }

    /// Updates done.
    pub fn updates(&self) -> u64 {
        self.updates
    }

    /// Transitions kept.
    pub fn replay_len(&self) -> usize {
        self.replay.len()
    }

    /// Transitions ever stored.
    pub fn replay_pushed(&self) -> u64 {
        self.replay.pushed()
    }

    /// Means since last asked: `loss/critic` (of both), `q/q1`, `q/q2`, `q/gap` (|q̂₁ − q̂₂|), `q/delta_adj`
    /// (max(q̂₁, q̂₂) less the value used), `loss/actor`, `action/saturation` (share of the policy's action
    /// entries beyond ±0.99), `noise/explore` (standard deviation), `grad/critic` and `grad/actor` (‖∇‖₂, of both
    /// critics the mean, looked at every 250 updates), `q/estimate_minus_return` (of [`Learner::look_back`]). What
    /// did not occur is left out.
    pub fn take_health(&mut self) -> Vec<(&'static str, f32)> {
        self.health.take()
    }

    /// The policy as it is now.
    pub fn policy(&self) -> Policy {
        Policy::new(self.simd, self.networks.actor.clone())
    }

    /// Appends everything but the stored transitions.
    pub fn save(&self, out: &mut Vec<u8>) {
        let mut writer = Writer(out);
        for count in [self.explored, self.updates, self.replay.pushed()] {
            writer.count(count);
        }
        writer.real(self.exploration.level);
        writer.real(self.progress);
        self.health.save(&mut writer);
        self.networks.save(&mut writer);
    }

    /// Takes back what [`Learner::save`] gave, into a learner made with the same arguments. The transitions
    /// must follow through [`Learner::restore_rows`].
    ///
    /// Errors if the size is not that of this learner's state; then nothing has changed.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), LearnError> {
        let mut own = Vec::new();
        self.save(&mut own);
        let (expected, found) = (own.len(), bytes.len());
        if expected != found {
            return Err(LearnError::WrongSize { expected, found });
        }
        let mut reader = Reader(bytes);
        for count in [&mut self.explored, &mut self.updates, &mut self.replay_needed] {
            *count = reader.count()?;
        }
        self.exploration.level = reader.real()?;
        self.progress = reader.real()?;
        self.health.restore(&mut reader)?;
        self.networks.restore(&mut reader)?;
        self.replay.clear();
        Ok(())
    }

    /// Appends the transitions stored from number `from` on, oldest first, [`Learner::row_bytes`] each. One
    /// that has been dropped meanwhile is given as zeros, so number n of a log always begins at n times that.
    pub fn replay_rows(&self, from: u64, out: &mut Vec<u8>) {
        self.replay.write(from, out);
    }

    /// Stores transitions that [`Learner::replay_rows`] gave: all of them in order, in as many calls as wanted.
    ///
    /// Errors, without storing any, if these are not whole transitions.
    pub fn restore_rows(&mut self, bytes: &[u8]) -> Result<(), LearnError> {
        self.replay.read(bytes)
    }

    /// Bytes of a stored transition.
    pub fn row_bytes(&self) -> usize {
        self.replay.row_bytes()
    }
}
