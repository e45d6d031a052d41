//! The update of the networks by automatic differentiation, with dfdx: the setting `backend = dfdx`.
//!
//! It says the same as [`ActorCritic::update`] without its kernels, and is the place to try another loss:
//! write it down, and the gradients follow. The networks, their optimisers and what is saved are the same;
//! only the rounding differs.

use dfdx::prelude::*;

use crate::actor_critic::{ActorCritic, Batch, Rule, Seen, SeenActor};
use crate::adam::Adam;
use crate::config::{CriticPair, Polyak};
use crate::kernels::{Activation, Rows};
use crate::network::Mlp;

/// `[rows][features]`; with a tape, what is computed from it can be differentiated.
type Matrix<T = NoneTape> = Tensor<(usize, usize), f32, Cpu, T>;
type Vector<T = NoneTape> = Tensor<(usize,), f32, Cpu, T>;
type Slopes = dfdx::tensor::Gradients<f32, Cpu>;

/// One update of `networks`. `noise` is added to the target actions: one entry for each entry of each row's
/// action.
pub(crate) fn update(networks: &mut ActorCritic, batch: &Batch, noise: &[f32], rule: &Rule) -> Seen {
    // On as many threads as there are, a product would wait for, or even begin, the work of other cells.
    gemm_common::gemm::set_threading_threshold(usize::MAX);
    let device = Cpu::default();
    let (s, s_next) = (matrix(&device, &batch.state), matrix(&device, &batch.next));
    let su = matrix(&device, &batch.state_action);
    let (r, discount) = (column(&device, &batch.reward), column(&device, &batch.discount));
    let mut seen = Seen::default();

    // u′ = clip(π(s′) + noise, −1, 1);  y = r + γ · value(Q̂₁(s′, u′), Q̂₂(s′, u′))
    let actor = Network::new(&device, networks.target_actor.as_ref().unwrap_or(&networks.actor));
    let u_next = actor.forward(s_next.clone()).tanh();
    let noise = device.tensor_from_vec(noise.to_vec(), *u_next.shape());
    let su_next = (s_next, (u_next + noise).clamp(-1.0, 1.0)).concat_along(Axis::<1>);
    let [q_hat_1, q_hat_2] = networks
        .targets
        .each_ref()
        .map(|q_hat| Network::new(&device, q_hat).forward(su_next.clone()).as_vec());
    let mut value = vec![0.0; batch.reward.len()];
    rule.algorithm.bootstrap([&q_hat_1, &q_hat_2], &mut networks.delta_last, rule.delta_kind, &mut value);
    seen.values([&q_hat_1, &q_hat_2], &value);
    let y = r + discount * column(&device, &value);

    // One step of Adam each on mean (Q_j(s, u) − y)², or at (s′, u′), as the paper prints
    let pair = match rule.critic_pair {
        CriticPair::Taken => su,
        CriticPair::Next => su_next,
    };
    for j in 0..2 {
        let critic = Network::new(&device, &networks.critics[j]);
        let q = critic.forward(pair.leaky_trace());
        seen.q[j] = mean(&q.as_vec());
        let loss = (q - y.clone()).square().mean();
        seen.critic_loss += 0.5 * loss.array();
        let slopes = loss.backward();
        let adam = &mut networks.critic_adams[j];
        descend(&mut networks.critics[j], adam, &critic, &slopes, rule.critic_rate);
    }
    if !rule.delayed {
        return seen;
    }

    // One step of Adam on −mean Q₁(s, π(s))
    let (actor, critic) =
        (Network::new(&device, &networks.actor), Network::new(&device, &networks.critics[0]));
    let u = actor.forward(s.leaky_trace()).tanh();
    let beyond = u.as_vec().into_iter().map(|u| f32::from(u8::from(u.abs() > 0.99)));
    let saturation = mean(&beyond.collect::<Vec<_>>());
    let loss = -critic.forward((s.leaky_trace(), u).concat_along(Axis::<1>)).mean();
    seen.actor = Some(SeenActor { loss: loss.array(), saturation });
    let slopes = loss.backward();
    descend(&mut networks.actor, &mut networks.actor_adam, &actor, &slopes, rule.actor_rate);

    // Q̂_j ← τ Q_j + (1 − τ) Q̂_j, or into Q_j, as the paper prints; a target actor follows alike
    let tau = rule.tau as f32;
    for (target, online) in networks.targets.iter_mut().zip(&mut networks.critics) {
        let mixed = mix(online, target, tau);
        match rule.polyak {
            Polyak::Target => *target = mixed,
            Polyak::Online => *online = mixed,
        }
    }
    if let Some(target) = &mut networks.target_actor {
        *target = mix(&networks.actor, target, tau);
    }
    seen
}

/// Weights as tensors: of each layer `[inputs][outputs]`, and the biases.
struct Network {
    layers: Vec<(Matrix, Vector)>,
    activation: Activation,
}

impl Network {
    fn new(device: &Cpu, network: &Mlp) -> Self {
        let layers = network.layers().iter().map(|layer| {
            let (inputs, outputs) = (layer.inputs(), layer.outputs());
            let mut weights: Vec<f32> = layer.rows().flatten().copied().collect();
            let bias = weights.split_off(inputs * outputs);
            (device.tensor_from_vec(weights, (inputs, outputs)), device.tensor_from_vec(bias, (outputs,)))
        });
        Self { layers: layers.collect(), activation: network.activation() }
    }

    /// x: `[rows][inputs]`; the last layer is linear.
    fn forward<T: Tape<f32, Cpu> + Merge<T>>(&self, x: Matrix<T>) -> Matrix<T> {
        let (rows, last) = (x.shape().0, self.layers.len() - 1);
        self.layers.iter().enumerate().fold(x, |h, (l, (weights, bias))| {
            let bias = bias.retaped::<T>().broadcast_like::<_, Axis<0>>(&(rows, bias.shape().0));
            let z = h.matmul(weights.clone()) + bias;
            match self.activation {
                _ if l == last => z,
                Activation::Relu => z.relu(),
                Activation::Tanh => z.tanh(),
            }
        })
    }
}

/// One step of Adam down the gradient of the loss with respect to `network`, which `traced` stands for.
fn descend(network: &mut Mlp, adam: &mut Adam, traced: &Network, slopes: &Slopes, rate: f64) {
    let step = adam.advance(rate, 0.0);
    let moments = adam.m.layers_mut().iter_mut().zip(adam.v.layers_mut());
    for ((layer, (m, v)), (weights, bias)) in network.layers_mut().iter_mut().zip(moments).zip(&traced.layers)
    {
        let gradient = [slopes.get(weights).as_vec(), slopes.get(bias).as_vec()].concat();
        let gradient = gradient.chunks(layer.outputs());
        for (((w, m), v), gradient) in layer.rows_mut().zip(m.rows_mut()).zip(v.rows_mut()).zip(gradient) {
            for (((w, m), v), g) in w.iter_mut().zip(m).zip(v).zip(gradient) {
                *m = normal(step.beta_1 * *m + (1.0 - step.beta_1) * g);
                *v = normal(step.beta_2 * *v + (1.0 - step.beta_2) * g * g);
                *w -= step.rate * *m / (v.sqrt() + step.epsilon);
            }
        }
    }
}

/// 0 for what is smaller than a normal number.
fn normal(x: f32) -> f32 {
    if x.abs() < f32::MIN_POSITIVE { 0.0 } else { x }
}

/// τ online + (1 − τ) target
fn mix(online: &Mlp, target: &Mlp, tau: f32) -> Mlp {
    let mut mixed = target.clone();
    for (mixed, online) in mixed.layers_mut().iter_mut().zip(online.layers()) {
        for (mixed, online) in mixed.rows_mut().zip(online.rows()) {
            for (mixed, online) in mixed.iter_mut().zip(online) {
                *mixed = tau * online + (1.0 - tau) * *mixed;
            }
        }
    }
    mixed
}

fn matrix(device: &Cpu, rows: &Rows) -> Matrix {
    let values = (0..rows.rows()).flat_map(|row| rows.row(row)).copied().collect::<Vec<_>>();
    device.tensor_from_vec(values, (rows.rows(), rows.features()))
}

fn column(device: &Cpu, values: &[f32]) -> Matrix {
    device.tensor_from_vec(values.to_vec(), (values.len(), 1))
}

fn mean(values: &[f32]) -> f32 {
    values.iter().sum::<f32>() / values.len() as f32
}

#[cfg(test)]
mod tests;
