//! What a learner says of itself: means since they were last asked for.

use crate::actor_critic::Seen;
use crate::bytes::{Reader, Writer};
use crate::error::LearnError;

/// Metrics of every update, of updates that change the actor, and of explored steps.
const UPDATE: [&str; 5] = ["loss/critic", "q/q1", "q/q2", "q/gap", "q/delta_adj"];
const ACTOR: [&str; 2] = ["loss/actor", "action/saturation"];
const STEP: [&str; 1] = ["noise/explore"];
/// Of the updates whose gradients are looked at, and of episodes.
const CRITIC_GRADIENT: [&str; 1] = ["grad/critic"];
const ACTOR_GRADIENT: [&str; 1] = ["grad/actor"];
const EPISODE: [&str; 1] = ["q/estimate_minus_return"];

/// Sums of several metrics over a number of occasions.
#[derive(Clone, Debug, PartialEq)]
struct Sums<const N: usize> {
    count: u64,
    sums: [f64; N],
}

impl<const N: usize> Sums<N> {
    const fn new() -> Self {
        Self { count: 0, sums: [0.0; N] }
    }

    fn add(&mut self, values: [f32; N]) {
        self.count += 1;
        for (sum, value) in self.sums.iter_mut().zip(values) {
            *sum += f64::from(value);
        }
    }

    /// Nothing if there was no occasion.
    fn take(&mut self, names: [&'static str; N]) -> impl Iterator<Item = (&'static str, f32)> {
        let Self { count, sums } = std::mem::replace(self, Self::new());
        let means = names.into_iter().zip(sums).map(move |(name, sum)| (name, (sum / count as f64) as f32));
        means.filter(move |_| count > 0)
    }

    fn save(&self, writer: &mut Writer<'_>) {
        writer.count(self.count);
        self.sums.iter().for_each(|&sum| writer.real(sum));
    }

    fn restore(&mut self, reader: &mut Reader<'_>) -> Result<(), LearnError> {
        self.count = reader.count()?;
        self.sums.iter_mut().try_for_each(|sum| {
            *sum = reader.real()?;
            Ok(())
        })
    }
}

pub(crate) struct Health {
    update: Sums<5>,
    actor: Sums<2>,
    step: Sums<1>,
    critic_gradient: Sums<1>,
    actor_gradient: Sums<1>,
    episode: Sums<1>,
}

impl Health {
    pub(crate) fn new() -> Self {
        Self {
            update: Sums::new(),
            actor: Sums::new(),
            step: Sums::new(),
            critic_gradient: Sums::new(),
            actor_gradient: Sums::new(),
            episode: Sums::new(),
        }
    }

    /// Of a step explored with noise of this standard deviation.
    pub(crate) fn explored(&mut self, deviation: f32) {
        self.step.add([deviation]);
    }

    pub(crate) fn updated(&mut self, seen: &Seen) {
        self.update.add([seen.critic_loss, seen.q[0], seen.q[1], seen.gap, seen.delta_adj]);
        if let Some(actor) = seen.actor {
            self.actor.add([actor.loss, actor.saturation]);
        }
    }

    /// Of the gradients of both critics, and of the actor's.
    pub(crate) fn critic_gradients(&mut self, norms: [f32; 2]) {
        self.critic_gradient.add([(norms[0] + norms[1]) / 2.0]);
    }

    pub(crate) fn actor_gradient(&mut self, norm: f32) {
        self.actor_gradient.add([norm]);
    }

    pub(crate) fn looked_back(&mut self, estimate_minus_return: f32) {
        self.episode.add([estimate_minus_return]);
    }

    pub(crate) fn take(&mut self) -> Vec<(&'static str, f32)> {
        let updates = self.update.take(UPDATE).chain(self.actor.take(ACTOR)).chain(self.step.take(STEP));
        let gradients =
            self.critic_gradient.take(CRITIC_GRADIENT).chain(self.actor_gradient.take(ACTOR_GRADIENT));
        updates.chain(gradients).chain(self.episode.take(EPISODE)).collect()
    }

    pub(crate) fn save(&self, writer: &mut Writer<'_>) {
        self.update.save(writer);
        self.actor.save(writer);
        for one in [&self.step, &self.critic_gradient, &self.actor_gradient, &self.episode] {
            one.save(writer);
        }
    }

    pub(crate) fn restore(&mut self, reader: &mut Reader<'_>) -> Result<(), LearnError> {
        self.update.restore(reader)?;
        self.actor.restore(reader)?;
        for one in [&mut self.step, &mut self.critic_gradient, &mut self.actor_gradient, &mut self.episode] {
            one.restore(reader)?;
        }
        Ok(())
    }
}
