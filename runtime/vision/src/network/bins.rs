//! Outputs told as distributions: a softmax over bins of −1.1 to 1.1, whose mean is the output (integral regression: Sun et al.,
//! ECCV 2018). Learnt by the error of the mean and by the cross entropy with a Gaussian around the target that is one bin wide:
//! an image may then look like two places, instead of like the place between them.

use burn::tensor::activation::{log_softmax, softmax};
use burn::tensor::{Device, Tensor, TensorData};

/// Of the outermost bins; outputs end at 1.
const REACH: f32 = 1.1;

fn centre(bin: usize, bins: usize) -> f32 {
    REACH * (2.0 * bin as f32 / (bins - 1) as f32 - 1.0)
}

/// `[1, 1, bins]`.
fn centres(bins: usize, device: &Device) -> Tensor<3> {
    let centres: Vec<f32> = (0..bins).map(|bin| centre(bin, bins)).collect();
    Tensor::from_data(TensorData::new(centres, [1, 1, bins]), device)
}

/// The means, `[batch, outputs]`, of distributions given by `[batch, outputs · bins]` logits.
pub(crate) fn means(logits: Tensor<2>, bins: usize) -> Tensor<2> {
    let [batch, count] = logits.dims();
    let centres = centres(bins, &logits.device());
    let shares = softmax(logits.reshape([batch, count / bins, bins]), 2);
    (shares * centres).sum_dim(2).reshape([batch, count / bins])
}

/// The cross entropy, `[batch, outputs]`, of these distributions with Gaussians around the targets, `[batch, outputs]`.
pub(crate) fn cross_entropy(logits: Tensor<2>, targets: Tensor<2>, bins: usize) -> Tensor<2> {
    let [batch, outputs] = targets.dims();
    let width = centre(1, bins) - centre(0, bins);
    let away = centres(bins, &logits.device()) - targets.reshape([batch, outputs, 1]);
    let wanted = softmax((away.clone() * away).mul_scalar(-0.5 / (width * width)), 2);
    let told = log_softmax(logits.reshape([batch, outputs, bins]), 2);
    (wanted * told).sum_dim(2).reshape([batch, outputs]).neg()
}

/// The mean and the variance of each distribution, of plain numbers.
pub(crate) fn moments_of(logits: &[f32], bins: usize) -> Vec<[f32; 2]> {
    let moments = |logits: &[f32]| {
        let most = logits.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        let shares: Vec<f32> = logits.iter().map(|logit| libm::expf(logit - most)).collect();
        let sum: f32 = shares.iter().sum();
        let average = |of: &dyn Fn(f32) -> f32| {
            shares.iter().enumerate().map(|(bin, share)| share * of(centre(bin, bins))).sum::<f32>() / sum
        };
        let mean = average(&|value| value);
        [mean, average(&|value| (value - mean) * (value - mean))]
    };
    logits.chunks(bins).map(moments).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::network::tensors::numbers;

    fn tensor<const D: usize>(values: &[f32], shape: [usize; D]) -> Tensor<D> {
        Tensor::from_data(TensorData::new(values.to_vec(), shape), &Device::flex())
    }

    /// By hand, with bins at −1.1, 0 and 1.1: all on the first; half on each end; shares 1/6, 2/6 and 3/6.
    #[test]
    fn an_output_is_the_mean_of_its_distribution() {
        let (two, three) = (2f32.ln(), 3f32.ln());
        let logits = [50.0, 0.0, 0.0, 20.0, -20.0, 20.0, 0.0, two, three];
        let wanted = [-1.1, 0.0, 1.1 / 3.0];
        let told = numbers(means(tensor(&logits, [1, 9]), 3));
        let moments = moments_of(&logits, 3);
        for (found, wanted) in
            told.into_iter().chain(moments.iter().map(|it| it[0])).zip(wanted.iter().cycle())
        {
            assert!((found - wanted).abs() < 1e-6, "{found} {wanted}");
        }
        let variances = [0.0, 1.21, 1.21 * (4.0 / 6.0 - 1.0 / 9.0)];
        for (moment, wanted) in moments.iter().zip(variances) {
            assert!((moment[1] - wanted).abs() < 1e-6, "{moment:?} {wanted}");
        }
    }

    /// By hand: a target on the middle bin has shares e^(−1/2) : 1 : e^(−1/2), and all bins are told alike.
    #[test]
    fn the_cross_entropy_is_least_where_the_distribution_is_the_wanted_one() {
        let of =
            |logits: [f32; 3]| numbers(cross_entropy(tensor(&logits, [1, 3]), tensor(&[0.0], [1, 1]), 3))[0];
        assert!((of([0.0; 3]) - 3f32.ln()).abs() < 1e-6);
        let least = of([-0.5, 0.0, -0.5]);
        for worse in [[-0.6, 0.0, -0.5], [-0.4, 0.0, -0.4], [-0.5, 0.1, -0.6]] {
            assert!(of(worse) > least, "{worse:?}");
        }
    }
}
