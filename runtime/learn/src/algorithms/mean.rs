//! The mean of the twins.

/// The value of the next states: the mean of the two target critics. Also what MPG is with one inner update
/// a step and `delta_reset`.
///
/// ```text
/// value = (q̂₁ + q̂₂) / 2          y = r + γ · value
/// ```
///
/// All slices: one entry a transition of the mini-batch; `q_hat`: Q̂_j(s′, u′) of both target critics.
pub fn bootstrap(q_hat: [&[f32]; 2], value: &mut [f32]) {
    for ((q_hat_1, q_hat_2), value) in q_hat[0].iter().zip(q_hat[1]).zip(value) {
        *value = 0.5 * (q_hat_1 + q_hat_2);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn by_hand() {
        let mut value = [0.0; 3];
        bootstrap([&[1.0, -2.0, 5.0], &[3.0, -2.5, 5.0]], &mut value);
        assert_eq!(value, [2.0, -2.25, 5.0]);
    }
}
