//! How far outputs are from what they should be, and how the parts are weighed against each other.

use burn::tensor::Tensor;
use serde::{Deserialize, Serialize};

use super::bins::{cross_entropy, means};
use super::pose_head::{Part, PoseHead};

/// How the losses of position, orientation and landmarks become one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
pub enum Weighting {
    /// Their weighted sum.
    Fixed { position: f64, orientation: f64, landmarks: f64 },
    /// Σ Lᵢ exp(−sᵢ) + sᵢ, with sᵢ learnt (Kendall and Cipolla 2017, after Kendall, Gal and Cipolla 2018).
    Learnt,
}

impl Default for Weighting {
    fn default() -> Weighting {
        Weighting::Fixed { position: 1.0, orientation: 1.0, landmarks: 0.3 }
    }
}

impl Weighting {
    /// What each part's loss is multiplied with; `log_variances` are the sᵢ.
    pub(crate) fn weights(&self, log_variances: &[f32]) -> [f64; 3] {
        match *self {
            Weighting::Fixed { position, orientation, landmarks } => [position, orientation, landmarks],
            Weighting::Learnt => {
                std::array::from_fn(|part| libm::exp(-log_variances.get(part).map_or(0.0, |&s| f64::from(s))))
            }
        }
    }

    /// The gradient of the whole loss after the sᵢ: 1 − Lᵢ exp(−sᵢ); 0 where nothing is learnt or a part has no outputs.
    pub(crate) fn gradient(&self, losses: &[f64; 3], log_variances: &[f32], head: &PoseHead) -> Vec<f32> {
        let weights = self.weights(log_variances);
        let slope = |part: usize| match self {
            Weighting::Learnt if !head.columns(Part::ALL[part]).is_empty() => {
                (1.0 - losses[part] * weights[part]) as f32
            }
            _ => 0.0,
        };
        (0..3).map(slope).collect()
    }
}

/// Of each part, `[1]`; nothing for a part without outputs.
pub(crate) type Parts = [Option<Tensor<1>>; 3];

/// What the cross entropy of distributions counts beside the error of their means.
const CROSS_ENTROPY: f64 = 0.6;

/// The mean absolute error of each part, and what is learnt from it, for what a network tells, `[batch, head.numbers()]`, and
/// targets `[batch, head.outputs()]`.
pub(crate) fn losses(told: &Tensor<2>, targets: &Tensor<2>, head: &PoseHead) -> (Parts, Parts) {
    let each = |values: &Tensor<2>| {
        Part::ALL.map(|part| {
            let columns = head.columns(part);
            (!columns.is_empty()).then(|| values.clone().slice_dim(1, columns).mean())
        })
    };
    if head.bins == 1 {
        let errors = each(&(told.clone() - targets.clone()).abs());
        return (errors.clone(), errors);
    }
    let errors = (means(told.clone(), head.bins) - targets.clone()).abs();
    let entropy = cross_entropy(told.clone(), targets.clone(), head.bins);
    (each(&errors), each(&(errors.clone() + entropy.mul_scalar(CROSS_ENTROPY))))
}

/// The weighted sum of losses, `[1]`.
pub(crate) fn total(losses: &Parts, weights: [f64; 3]) -> Option<Tensor<1>> {
    let weighted = losses.iter().zip(weights).filter_map(|(loss, weight)| {
        let loss = loss.clone()?;
        Some(loss.mul_scalar(weight))
    });
    weighted.reduce(|sum, loss| sum + loss)
}
