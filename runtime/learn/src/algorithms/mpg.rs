//! Momentum Policy Gradient.

use crate::config::DeltaKind;

/// The value of the next states in MPG: the greater of the two target critics, less the mean of their
/// present difference and the last one (its momentum).
///
/// ```text
/// δ     = |q̂₁ − q̂₂|
/// Δ_adj = (δ + Δ_last) / 2
/// value = max(q̂₁, q̂₂) − Δ_adj          y = r + γ · value
/// Δ_last ← δ
/// ```
///
/// All slices: one entry a transition of the mini-batch; `q_hat`: Q̂_j(s′, u′) of both target critics.
/// `delta_last` is carried from update to update, entry by entry. With [`DeltaKind::Mean`], δ is the mean
/// of the differences over the mini-batch.
///
/// Source: the paper's Algorithm 1, lines 13 to 16.
pub fn bootstrap(q_hat: [&[f32]; 2], delta_last: &mut [f32], delta_kind: DeltaKind, value: &mut [f32]) {
    let differences = q_hat[0].iter().zip(q_hat[1]).map(|(q_hat_1, q_hat_2)| (q_hat_1 - q_hat_2).abs());
    let mean = differences.sum::<f32>() / q_hat[0].len() as f32;
    for (((q_hat_1, q_hat_2), delta_last), value) in q_hat[0].iter().zip(q_hat[1]).zip(delta_last).zip(value)
    {
        let delta = match delta_kind {
            DeltaKind::Element => (q_hat_1 - q_hat_2).abs(),
            DeltaKind::Mean => mean,
        };
        let delta_adj = 0.5 * (delta + *delta_last);
        *value = q_hat_1.max(*q_hat_2) - delta_adj;
        *delta_last = delta;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const Q_HAT: [&[f32]; 2] = [&[1.0, -2.0, 5.0], &[3.0, -2.5, 5.0]];

    #[test]
    fn by_hand() {
        let mut delta_last = [1.0, 0.0, 4.0];
        let mut value = [0.0; 3];
        bootstrap(Q_HAT, &mut delta_last, DeltaKind::Element, &mut value);
        // 3 − (2 + 1)/2, −2 − (0.5 + 0)/2, 5 − (0 + 4)/2
        assert_eq!(value, [1.5, -2.25, 3.0]);
        assert_eq!(delta_last, [2.0, 0.5, 0.0]);
    }

    #[test]
    fn the_mean_of_the_differences_by_hand() {
        let q_hat: [&[f32]; 2] = [&[1.0, -2.0], &[3.0, -2.5]];
        let mut delta_last = [0.25, 0.75];
        let mut value = [0.0; 2];
        bootstrap(q_hat, &mut delta_last, DeltaKind::Mean, &mut value);
        // δ = (2 + 0.5)/2 for both
        assert_eq!(value, [3.0 - 0.75, -2.0 - 1.0]);
        assert_eq!(delta_last, [1.25, 1.25]);
    }

    /// With one inner update and Δ_last forgotten at each step, MPG is the mean of the twins.
    #[test]
    fn without_momentum_it_is_the_mean() {
        let mut value = [0.0; 3];
        bootstrap(Q_HAT, &mut [0.0; 3], DeltaKind::Element, &mut value);
        assert_eq!(value, [2.0, -2.25, 5.0]);
    }

    /// With Δ_last the difference of the same pair, MPG is TD3.
    #[test]
    fn with_its_own_momentum_it_is_the_minimum() {
        let mut delta_last = [2.0, 0.5, 0.0];
        let (mut value, mut minimum) = ([0.0; 3], [0.0; 3]);
        bootstrap(Q_HAT, &mut delta_last, DeltaKind::Element, &mut value);
        super::super::td3::bootstrap(Q_HAT, &mut minimum);
        assert_eq!(value, minimum);
    }
}
