//! What the first critic said of an episode, against what followed.

use crate::kernels::Simd;
use crate::network::Mlp;
use crate::policy::Evaluation;
use crate::replay::{Replay, Transition};

/// Steps that are looked at, spread evenly over the first half of the episode.
const SAMPLES: usize = 16;

/// An episode that is over: the last `steps` times `members` transitions, those of a step side by side.
pub(crate) struct Hindsight<'a> {
    pub(crate) replay: &'a Replay,
    pub(crate) steps: usize,
    pub(crate) members: usize,
    pub(crate) gamma: f64,
    /// Whether nothing follows a failure.
    pub(crate) mask: bool,
}

impl Hindsight<'_> {
    /// Mean over sampled steps t of Q₁(s_t, u_t) − (Σ_k γᵏ r_{t+k} + γ^{T−t} Q₁(s_T, π(s_T))), where T is the end
    /// of the episode; in turn over the members. Nothing if the replay no longer holds all of it.
    pub(crate) fn estimate_minus_return(&self, simd: Simd, actor: &Mlp, critic: &Mlp) -> Option<f32> {
        let rows = self.steps * self.members;
        if rows == 0 || rows > self.replay.len() {
            return None;
        }
        let places: Vec<(usize, usize)> =
            (0..SAMPLES).map(|k| (k * self.steps / (2 * SAMPLES), k % self.members)).collect();
        let taken = places.iter().map(|&(step, member)| self.at(step, member));
        let estimates = values(simd, critic, taken.map(|it| [it.state, it.action]));

        let lasts = || (0..self.members.min(SAMPLES)).map(|member| self.at(self.steps - 1, member).next);
        let states: Vec<f32> = lasts().flatten().copied().collect();
        let mut actions = vec![0.0; lasts().len() * self.replay.action_len()];
        Evaluation::new(&actor.sizes()).act(simd, actor, &states, &mut actions);
        let actions = actions.chunks_exact(self.replay.action_len());
        let tails = values(simd, critic, lasts().zip(actions).map(|(state, action)| [state, action]));

        let off = estimates.iter().zip(places).map(|(estimate, (step, member))| {
            f64::from(*estimate) - self.return_from(step, member, f64::from(tails[member]))
        });
        Some((off.sum::<f64>() / SAMPLES as f64) as f32)
    }

    /// The discounted rewards of a member from a step on, and `tail` for what comes after the last.
    fn return_from(&self, step: usize, member: usize, tail: f64) -> f64 {
        let tail = if self.mask && self.at(self.steps - 1, member).failure { 0.0 } else { tail };
        let rewards = (step..self.steps).rev().map(|step| f64::from(self.at(step, member).reward));
        rewards.fold(tail, |total, reward| reward + self.gamma * total)
    }

    fn at(&self, step: usize, member: usize) -> Transition<'_> {
        self.replay.back((self.steps - step) * self.members - member)
    }
}

/// What a critic says of states and actions.
fn values<'a>(simd: Simd, critic: &Mlp, pairs: impl Iterator<Item = [&'a [f32]; 2]>) -> Vec<f32> {
    let inputs: Vec<f32> = pairs.flatten().flatten().copied().collect();
    let sizes = critic.sizes();
    let mut q = vec![0.0; inputs.len() / sizes[0]];
    Evaluation::new(&sizes).outputs(simd, critic, &inputs, &mut q);
    q
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two robots, three steps; the rewards of the second are 1, 2, 4, and what follows is worth 7.
    #[test]
    fn returns_are_those_worked_out_by_hand() {
        let mut replay = Replay::new(1, 1, 8);
        for k in 0..9u8 {
            let reward = [9.0, 9.0, 9.0, 50.0, 1.0, 60.0, 2.0, 70.0, 4.0][usize::from(k)];
            let state = [f32::from(k)];
            replay.push(Transition { state: &state, action: &[0.0], reward, next: &[0.0], failure: k == 8 });
        }
        let mut episode = Hindsight { replay: &replay, steps: 3, members: 2, gamma: 0.5, mask: false };
        assert_eq!(episode.at(0, 1).state, [4.0]);
        let total = |episode: &Hindsight, step| episode.return_from(step, 1, 7.0);
        assert_eq!(total(&episode, 0), 1.0 + 0.5 * (2.0 + 0.5 * (4.0 + 0.5 * 7.0)));
        assert_eq!(total(&episode, 2), 4.0 + 0.5 * 7.0);
        episode.mask = true;
        assert_eq!(total(&episode, 1), 2.0 + 0.5 * 4.0);
    }
    /// With Q(s, u) = s everywhere and γ = 0: the mean of sₜ − rₜ over the first half.
    #[test]
    fn the_estimate_is_that_of_the_first_critic() {
        let mut critic = Mlp::zeros(&[2, 1]);
        for row in critic.layers_mut()[0].rows_mut().take(1) {
            row[0] = 1.0;
        }
        let mut replay = Replay::new(1, 1, 100);
        for k in 0..64u8 {
            let state = [f32::from(k)];
            let (reward, next) = (2.0 * state[0], [0.0]);
            replay.push(Transition { state: &state, action: &[0.5], reward, next: &next, failure: false });
        }
        let episode = |steps| Hindsight { replay: &replay, steps, members: 1, gamma: 0.0, mask: false };
        let off = episode(64).estimate_minus_return(Simd::best(), &Mlp::zeros(&[1, 1]), &critic);
        // Steps 0, 2, 4, … 30.
        assert_eq!(off, Some(-15.0));
        assert_eq!(episode(65).estimate_minus_return(Simd::best(), &Mlp::zeros(&[1, 1]), &critic), None);
    }
}
