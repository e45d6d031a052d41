//! Deep Deterministic Policy Gradient.

/// The value of the next states in DDPG: the one target critic. The second critic of the shared loop is
/// trained, too, but nothing is learned from it.
///
/// ```text
/// value = q̂₁          y = r + γ · value
/// ```
///
/// All slices: one entry a transition of the mini-batch; `q_hat_1`: Q̂₁(s′, u′).
///
/// Source: Lillicrap et al., Continuous control with deep reinforcement learning, ICLR 2016, Algorithm 1.
pub fn bootstrap(q_hat_1: &[f32], value: &mut [f32]) {
    value.copy_from_slice(q_hat_1);
}

#[cfg(test)]
mod tests {
    use super::super::Algorithm;
    use crate::config::DeltaKind;

    #[test]
    fn by_hand() {
        let mut value = [0.0; 3];
        let q_hat: [&[f32]; 2] = [&[1.0, -2.0, 5.0], &[3.0, -2.5, 5.0]];
        Algorithm::Ddpg.bootstrap(q_hat, &mut [1.0; 3], DeltaKind::Element, &mut value);
        assert_eq!(value, [1.0, -2.0, 5.0]);
    }
}
