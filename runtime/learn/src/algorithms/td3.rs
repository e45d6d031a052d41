//! Twin Delayed DDPG.

/// The value of the next states in TD3: the lesser of the two target critics.
///
/// ```text
/// value = min(q̂₁, q̂₂)          y = r + γ · value
/// ```
///
/// All slices: one entry a transition of the mini-batch; `q_hat`: Q̂_j(s′, u′) of both target critics.
///
/// Source: Fujimoto, van Hoof and Meger, Addressing Function Approximation Error in Actor-Critic Methods,
/// ICML 2018, Algorithm 1.
pub fn bootstrap(q_hat: [&[f32]; 2], value: &mut [f32]) {
    for ((q_hat_1, q_hat_2), value) in q_hat[0].iter().zip(q_hat[1]).zip(value) {
        *value = q_hat_1.min(*q_hat_2);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn by_hand() {
        let mut value = [0.0; 3];
        bootstrap([&[1.0, -2.0, 5.0], &[3.0, -2.5, 5.0]], &mut value);
        assert_eq!(value, [1.0, -2.5, 5.0]);
    }
}
