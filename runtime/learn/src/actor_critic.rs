//! The networks of one learner and their update from one mini-batch.

use crate::adam::Adam;
use crate::algorithms::Algorithm;
use crate::bytes::{Reader, Writer};
use crate::config::{CriticPair, DeltaKind, Polyak};
use crate::error::LearnError;
use crate::kernels::{Rows, Simd};
use crate::network::{Activations, Gradients, Mlp};
use crate::policy::squash;
use crate::replay::Transition;

/// A mini-batch: one row, one entry a transition.
#[derive(Clone)]
pub(crate) struct Batch {
    pub(crate) state: Rows,
    pub(crate) state_action: Rows,
    pub(crate) next: Rows,
    pub(crate) reward: Vec<f32>,
    /// What the value of the next state is multiplied by: γ, or 0 where the episode is over.
    pub(crate) discount: Vec<f32>,
}

impl Batch {
    /// Room for `rows` transitions.
    pub(crate) fn new(rows: usize, state: usize, action: usize) -> Self {
        Self {
            state: Rows::new(rows, state),
            state_action: Rows::new(rows, state + action),
            next: Rows::new(rows, state),
            reward: vec![0.0; rows],
            discount: vec![0.0; rows],
        }
    }

    pub(crate) fn set(&mut self, row: usize, transition: Transition<'_>, discount: f32) {
        self.state.row_mut(row).copy_from_slice(transition.state);
        join(transition.state, transition.action, self.state_action.row_mut(row));
        self.next.row_mut(row).copy_from_slice(transition.next);
        self.reward[row] = transition.reward;
        self.discount[row] = discount;
    }
}

fn join(state: &[f32], action: &[f32], out: &mut [f32]) {
    let (first, last) = out.split_at_mut(state.len());
    first.copy_from_slice(state);
    last.copy_from_slice(action);
}

/// What an update does besides reading its mini-batch.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rule {
    pub(crate) algorithm: Algorithm,
    pub(crate) delta_kind: DeltaKind,
    pub(crate) critic_pair: CriticPair,
    pub(crate) polyak: Polyak,
    /// Step sizes now.
    pub(crate) actor_rate: f64,
    pub(crate) critic_rate: f64,
    pub(crate) tau: f64,
    /// Whether the actor and the targets change, too.
    pub(crate) delayed: bool,
}

/// What an update saw: means over the mini-batch.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Seen {
    /// Of both critics.
    pub(crate) critic_loss: f32,
    pub(crate) q: [f32; 2],
    /// |q̂₁ − q̂₂|
    pub(crate) gap: f32,
    /// max(q̂₁, q̂₂) − the value used
    pub(crate) delta_adj: f32,
    /// Where the actor changed.
    pub(crate) actor: Option<SeenActor>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct SeenActor {
    pub(crate) loss: f32,
    /// Share of action entries beyond ±0.99.
    pub(crate) saturation: f32,
}

impl Seen {
    /// Notes the target critics' values and what was made of them. All slices: one entry a row.
    pub(crate) fn values(&mut self, q_hat: [&[f32]; 2], value: &[f32]) {
        for ((q_hat_1, q_hat_2), used) in q_hat[0].iter().zip(q_hat[1]).zip(value) {
            self.gap += (q_hat_1 - q_hat_2).abs() / value.len() as f32;
            self.delta_adj += (q_hat_1.max(*q_hat_2) - used) / value.len() as f32;
        }
    }
}

/// Two critics with their targets, an actor, perhaps with one, and the optimisers' state.
pub(crate) struct ActorCritic {
    simd: Simd,
    pub(crate) actor: Mlp,
    pub(crate) target_actor: Option<Mlp>,
    pub(crate) critics: [Mlp; 2],
    pub(crate) targets: [Mlp; 2],
    pub(crate) actor_adam: Adam,
    pub(crate) critic_adams: [Adam; 2],
    /// Carried from update to update, one entry a row of the mini-batch.
    pub(crate) delta_last: Vec<f32>,
    work: Work,
}

/// Buffers of an update.
struct Work {
    actor_h: Activations,
    actor_d: Gradients,
    critic_h: Activations,
    critic_d: Gradients,
    /// State and an action of the policy.
    state_action: Rows,
    q_hat: [Vec<f32>; 2],
    value: Vec<f32>,
}

impl ActorCritic {
    /// For mini-batches of `rows`.
    pub(crate) fn new(
        simd: Simd,
        actor: Mlp,
        critics: [Mlp; 2],
        with_target_actor: bool,
        rows: usize,
    ) -> Self {
        let (actor_sizes, critic_sizes) = (actor.sizes(), critics[0].sizes());
        let column = || vec![0.0; rows];
        Self {
            simd,
            target_actor: with_target_actor.then(|| actor.clone()),
            targets: critics.clone(),
            actor_adam: Adam::new(&actor_sizes),
            critic_adams: [Adam::new(&critic_sizes), Adam::new(&critic_sizes)],
            delta_last: column(),
            work: Work {
                actor_h: Activations::new(&actor_sizes, rows),
                actor_d: Gradients::new(&actor_sizes, rows),
                critic_h: Activations::new(&critic_sizes, rows),
                critic_d: Gradients::new(&critic_sizes, rows),
                state_action: Rows::new(rows, critic_sizes[0]),
                q_hat: [column(), column()],
                value: column(),
            },
            actor,
            critics,
        }
    }

    /// One update. `noise` is added to the target actions: one entry for each entry of each row's action.
    pub(crate) fn update(&mut self, batch: &Batch, noise: &[f32], rule: &Rule) -> Seen {
        let mut seen = Seen::default();
        self.values(batch, noise, rule, &mut seen);
        self.critics(batch, rule, &mut seen);
        if rule.delayed {
            seen.actor = Some(self.actor(batch, rule));
            if rule.polyak == Polyak::Online {
                self.pull_critics_back(rule.tau as f32);
            }
        }
        seen
    }

    pub(crate) fn save(&self, writer: &mut Writer<'_>) {
        let adams = [&self.actor_adam, &self.critic_adams[0], &self.critic_adams[1]];
        adams.iter().for_each(|adam| writer.count(adam.t));
        let moments = adams.iter().flat_map(|adam| [&adam.m, &adam.v]);
        let targets = self.targets.iter().chain(&self.target_actor);
        for network in std::iter::once(&self.actor).chain(&self.critics).chain(targets).chain(moments) {
            writer.network(network);
        }
        writer.floats(&self.delta_last);
    }

    pub(crate) fn restore(&mut self, reader: &mut Reader<'_>) -> Result<(), LearnError> {
        let [first, second] = &mut self.critic_adams;
        let mut adams = [&mut self.actor_adam, first, second];
        for adam in &mut adams {
            adam.t = reader.count()?;
        }
        let moments = adams.into_iter().flat_map(|adam| [&mut adam.m, &mut adam.v]);
        let targets = self.targets.iter_mut().chain(&mut self.target_actor);
        for network in std::iter::once(&mut self.actor).chain(&mut self.critics).chain(targets).chain(moments)
        {
            reader.network(network)?;
        }
        reader.floats(&mut self.delta_last)
    }

    /// u′ = clip(π(s′) + noise, −1, 1), then the values of the next states from Q̂₁(s′, u′) and Q̂₂(s′, u′).
    fn values(&mut self, batch: &Batch, noise: &[f32], rule: &Rule, seen: &mut Seen) {
        let Work { actor_h, critic_h, state_action, q_hat, value, .. } = &mut self.work;
        let actor = self.target_actor.as_ref().unwrap_or(&self.actor);
        actor.forward(self.simd, &batch.next, actor_h);
        for (row, noise) in noise.chunks_exact(actor_h.output().features()).enumerate() {
            let (state, action) = state_action.row_mut(row).split_at_mut(batch.next.features());
            state.copy_from_slice(batch.next.row(row));
            squash(actor_h.output().row(row), action);
            for (u, noise) in action.iter_mut().zip(noise) {
                *u = (*u + noise).clamp(-1.0, 1.0);
            }
        }
        for (target, q_hat) in self.targets.iter().zip(q_hat.iter_mut()) {
            target.forward(self.simd, state_action, critic_h);
            for (row, q_hat) in q_hat.iter_mut().enumerate() {
                *q_hat = critic_h.output().row(row)[0];
            }
        }
        let q_hat = [q_hat[0].as_slice(), &q_hat[1]];
        rule.algorithm.bootstrap(q_hat, &mut self.delta_last, rule.delta_kind, value);
        seen.values(q_hat, value);
    }

    /// One step of Adam each on mean (Q_j − y)², y = r + γ · value, at (s, u) or (s′, u′), and
    /// Q̂_j ← τ Q_j + (1 − τ) Q̂_j if it is time.
    fn critics(&mut self, batch: &Batch, rule: &Rule, seen: &mut Seen) {
        let Work { critic_h: h, critic_d: d, state_action, value, .. } = &mut self.work;
        let rows = batch.reward.len();
        let input = match rule.critic_pair {
            CriticPair::Taken => &batch.state_action,
            CriticPair::Next => &*state_action,
        };
        let moves_targets = rule.delayed && rule.polyak == Polyak::Target;
        for j in 0..2 {
            let critic = &mut self.critics[j];
            critic.forward(self.simd, input, h);
            for (row, value) in value.iter().enumerate() {
                let q = h.output().row(row)[0];
                let y = batch.reward[row] + batch.discount[row] * value;
                d.output_mut().row_mut(row)[0] = 2.0 * (q - y) / rows as f32;
                seen.q[j] += q / rows as f32;
                seen.critic_loss += 0.5 * (q - y) * (q - y) / rows as f32;
            }
            let adam = &mut self.critic_adams[j];
            let step = adam.advance(rule.critic_rate, rule.tau);
            let target = moves_targets.then_some(&mut self.targets[j]);
            critic.descend(self.simd, (input, h), d, (adam, &step), target);
        }
    }

    /// One step of Adam on −mean Q₁(s, π(s)).
    fn actor(&mut self, batch: &Batch, rule: &Rule) -> SeenActor {
        let Work { actor_h, actor_d, critic_h, critic_d, state_action, .. } = &mut self.work;
        let (rows, state) = (batch.reward.len(), batch.state.features());
        let mut seen = SeenActor::default();
        self.actor.forward(self.simd, &batch.state, actor_h);
        let actions = actor_h.output().features();
        for row in 0..rows {
            let (first, u) = state_action.row_mut(row).split_at_mut(state);
            first.copy_from_slice(batch.state.row(row));
            squash(actor_h.output().row(row), u);
            let beyond = u.iter().filter(|u| u.abs() > 0.99).count();
            seen.saturation += beyond as f32 / (rows * actions) as f32;
        }
        let critic = &self.critics[0];
        critic.forward(self.simd, state_action, critic_h);
        for row in 0..rows {
            seen.loss -= critic_h.output().row(row)[0] / rows as f32;
            critic_d.output_mut().row_mut(row)[0] = -1.0 / rows as f32;
        }
        critic.backward(self.simd, state..state + actions, critic_h, critic_d);
        for row in 0..rows {
            let u = &state_action.row(row)[state..];
            for (k, (d, u)) in actor_d.output_mut().row_mut(row).iter_mut().zip(u).enumerate() {
                // The derivative of tanh at its value u is 1 − u².
                *d = critic_d.input.get(row, state + k) * (1.0 - u * u);
            }
        }
        let step = self.actor_adam.advance(rule.actor_rate, rule.tau);
        let adam = (&mut self.actor_adam, &step);
        self.actor.descend(self.simd, (&batch.state, actor_h), actor_d, adam, self.target_actor.as_mut());
        seen
    }

    /// Q_j ← τ Q_j + (1 − τ) Q̂_j.
    fn pull_critics_back(&mut self, tau: f32) {
        for (critic, target) in self.critics.iter_mut().zip(&self.targets) {
            for (layer, target) in critic.layers_mut().iter_mut().zip(target.layers()) {
                for (w, target) in layer.rows_mut().flatten().zip(target.rows().flatten()) {
                    *w = target + tau * (*w - target);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
