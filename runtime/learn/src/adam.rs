//! Adam's state and bias corrections; its arithmetic is fused into the weight gradient's kernel.

use crate::kernels::AdamStep;
use crate::network::Mlp;

pub(crate) const BETA_1: f64 = 0.9;
const BETA_2: f64 = 0.999;
const EPSILON: f64 = 1e-8;

/// Moments of the gradient of one network.
#[derive(Clone)]
pub(crate) struct Adam {
    pub(crate) m: Mlp,
    pub(crate) v: Mlp,
    /// Steps done.
    pub(crate) t: u64,
}

impl Adam {
    /// For a network of these sizes.
    pub(crate) fn new(sizes: &[usize]) -> Self {
        Self { m: Mlp::zeros(sizes), v: Mlp::zeros(sizes), t: 0 }
    }

    /// Counts one more step of size α = `rate` and gives its constants.
    pub(crate) fn advance(&mut self, rate: f64, tau: f64) -> AdamStep {
        self.t += 1;
        let correction_1 = 1.0 - libm::pow(BETA_1, self.t as f64);
        let correction_2 = libm::sqrt(1.0 - libm::pow(BETA_2, self.t as f64));
        AdamStep {
            beta_1: BETA_1 as f32,
            beta_2: BETA_2 as f32,
            rate: (rate * correction_2 / correction_1) as f32,
            epsilon: (EPSILON * correction_2) as f32,
            tau: tau as f32,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With a constant gradient the corrected moments are g and g², so every step is `rate` long.
    #[test]
    fn the_corrections_undo_the_start_from_zero() {
        let mut adam = Adam::new(&[1, 1]);
        let (mut m, mut v) = (0.0, 0.0);
        for _ in 0..50 {
            let step = adam.advance(1e-3, 0.0);
            let g = 0.7;
            m = BETA_1 * m + (1.0 - BETA_1) * g;
            v = BETA_2 * v + (1.0 - BETA_2) * g * g;
            let length = f64::from(step.rate) * m / (libm::sqrt(v) + f64::from(step.epsilon));
            assert!((length - 1e-3).abs() < 1e-9, "{length} at {}", adam.t);
        }
    }
}
