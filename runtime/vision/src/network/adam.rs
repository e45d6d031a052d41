//! Adam (Kingma and Ba 2015) over plain numbers: one pass over the memory, and a state that is easily kept.

use super::tensors::Values;

const BETA_1: f32 = 0.9;
const BETA_2: f32 = 0.999;
const EPSILON: f32 = 1e-8;

/// Running means of gradients and of their squares.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Adam {
    /// Steps done.
    pub step: u64,
    pub mean: Values,
    pub square: Values,
}

impl Adam {
    /// For lists of these lengths.
    pub fn new(lengths: impl Iterator<Item = usize>) -> Adam {
        let mean: Values = lengths.map(|count| vec![0.0; count]).collect();
        Adam { step: 0, square: mean.clone(), mean }
    }

    /// Moves `values` against their gradients. A list without a gradient stays.
    pub fn update(&mut self, values: &mut Values, gradients: &Values, learning_rate: f64) {
        self.step += 1;
        let bias = |beta: f32| 1.0 - libm::pow(f64::from(beta), self.step as f64);
        let rate = (learning_rate * bias(BETA_2).sqrt() / bias(BETA_1)) as f32;
        // Kingma and Ba's ε is added to the corrected root.
        let epsilon = EPSILON * bias(BETA_2).sqrt() as f32;
        let moments = self.mean.iter_mut().zip(&mut self.square);
        for ((values, gradients), (means, squares)) in values.iter_mut().zip(gradients).zip(moments) {
            let numbers = values.iter_mut().zip(gradients).zip(means.iter_mut().zip(squares.iter_mut()));
            for ((value, &gradient), (mean, square)) in numbers {
                *mean = BETA_1 * *mean + (1.0 - BETA_1) * gradient;
                *square = BETA_2 * *square + (1.0 - BETA_2) * gradient * gradient;
                *value -= rate * *mean / (square.sqrt() + epsilon);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `torch.optim.Adam([1.0, -2.0], lr=0.1)` with gradients (0.5, −3), (0.1, 2), (−1, 0).
    #[test]
    fn three_steps_are_those_of_torch() {
        let mut adam = Adam::new([2, 1].into_iter());
        let mut values = vec![vec![1.0, -2.0], vec![7.0]];
        for gradient in [[0.5, -3.0], [0.1, 2.0], [-1.0, 0.0]] {
            adam.update(&mut values, &vec![gradient.to_vec(), Vec::new()], 0.1);
        }
        for (found, wanted) in values[0].iter().zip(TORCH) {
            assert!((found - wanted).abs() < 1e-6, "{values:?}");
        }
        assert_eq!(values[1], [7.0]);
    }

    const TORCH: [f32; 2] = [0.848_441_3, -1.874_376_4];
}
