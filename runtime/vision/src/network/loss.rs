//! How far outputs are from what they should be, and how the parts are weighed against each other.

use burn::tensor::Tensor;
use serde::{Deserialize, Serialize};

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

/// The mean absolute error of each part, each `[1]`, for outputs and targets `[batch, outputs]`; nothing for a part
/// without outputs.
pub(crate) fn losses(outputs: &Tensor<2>, targets: &Tensor<2>, head: &PoseHead) -> [Option<Tensor<1>>; 3] {
    let error = (outputs.clone() - targets.clone()).abs();
    Part::ALL.map(|part| {
        let columns = head.columns(part);
        (!columns.is_empty()).then(|| error.clone().slice_dim(1, columns).mean())
    })
}

/// The weighted sum of losses, `[1]`.
pub(crate) fn total(losses: &[Option<Tensor<1>>; 3], weights: [f64; 3]) -> Option<Tensor<1>> {
    let weighted = losses.iter().zip(weights).filter_map(|(loss, weight)| {
        let loss = loss.clone()?;
        Some(loss.mul_scalar(weight))
    });
    weighted.reduce(|sum, loss| sum + loss)
}
