//! What answers are worth: each by itself, and those that follow each other together.

use serde::{Deserialize, Serialize};

/// Where a robot is, as a localiser tells it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Fix {
    /// x and y (m), heading (rad).
    pub pose: [f64; 3],
    /// What the errors of each are in proportion to. Of a network the variances of the distributions that it tells (m²,
    /// rad²); 1 where nothing is known of an answer by itself.
    pub spread: [f64; 3],
}

/// How wrong answers are in x, y and heading for their spread, and how alike one error is to the next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Reliability {
    /// Mean squares of the errors over their spreads.
    pub mean_square: [f64; 3],
    /// Of these ratios e and the next ones f, Σ e f / √(Σ e² Σ f²).
    pub correlation: [f64; 3],
}

/// A correlation of 1 would make all answers worth one; this one, 199 worth one.
const MOST_ALIKE: f64 = 0.99;

impl Reliability {
    /// Of runs of errors over their spreads, each in the order of time.
    pub fn of(runs: &[Vec<[f64; 3]>]) -> Reliability {
        let component = |k: usize| {
            let all = || runs.iter().flatten().map(|error| error[k]);
            let pairs = || runs.iter().flat_map(|run| run.iter().zip(run.iter().skip(1)));
            let mean_square = all().map(|error| error * error).sum::<f64>() / all().count().max(1) as f64;
            let sum = |of: fn(f64, f64) -> f64| pairs().map(|(e, f)| of(e[k], f[k])).sum::<f64>();
            let scale = (sum(|e, _| e * e) * sum(|_, f| f * f)).sqrt();
            (mean_square, if scale > 0.0 { sum(|e, f| e * f) / scale } else { 0.0 })
        };
        let components: [(f64, f64); 3] = std::array::from_fn(component);
        Reliability { mean_square: components.map(|it| it.0), correlation: components.map(|it| it.1) }
    }

    /// The variances of an answer with this spread: m², m², rad².
    pub fn variance(&self, spread: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|k| self.mean_square[k] * spread[k] * spread[k])
    }

    /// The variances that independent answers would have whose mean over a long time is as wrong: (1 + ρ) / (1 − ρ) times
    /// those of this one, for errors that are correlated by ρᵏ after k steps.
    pub fn lasting(&self, spread: [f64; 3]) -> [f64; 3] {
        let variance = self.variance(spread);
        std::array::from_fn(|k| {
            let alike = self.correlation[k].clamp(0.0, MOST_ALIKE);
            variance[k] * (1.0 + alike) / (1.0 - alike)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: of 1, 1, −2 and 3 the mean square is 15 / 4, that of the pairs (1, 1) and (−2, 3) −5 / √(5 · 10).
    #[test]
    fn errors_are_squared_and_compared_with_the_next_of_their_run() {
        let runs = [vec![[1.0, 0.0, 1.0], [1.0, 0.0, 1.0]], vec![[-2.0, 0.0, 1.0], [3.0, 0.0, 1.0]]];
        let found = Reliability::of(&runs);
        assert_eq!(found.mean_square, [3.75, 0.0, 1.0]);
        assert!((found.correlation[0] + 5.0 / 50.0_f64.sqrt()).abs() < 1e-12);
        assert_eq!(found.correlation[1..], [0.0, 1.0]);
        assert_eq!(found.lasting([1.0; 3])[..2], [3.75, 0.0]);
        assert!((found.lasting([1.0; 3])[2] - 199.0).abs() < 1e-9);
        assert_eq!(found.variance([2.0; 3]), [15.0, 0.0, 4.0]);
        assert_eq!(found.lasting([2.0, 0.0, 0.0]), [15.0, 0.0, 0.0]);
        assert_eq!(Reliability::of(&[]), Reliability::default());
    }

    /// The mean of n answers whose errors are eₖ₊₁ = ρ eₖ + √(1 − ρ²) nₖ, over many runs.
    #[test]
    fn means_of_correlated_answers_are_as_wrong_as_told() {
        use mpgx_random::{Address, Purpose};
        let (alike, steps, runs) = (0.8, 400, 500);
        let run = |episode: u32| -> Vec<[f64; 3]> {
            let purpose = Purpose::Localiser;
            let address = Address { master: 1, purpose, protocol: 0, part: 0, seed: 0, episode, step: 0 };
            let mut stream = address.stream();
            let first = stream.normal();
            let next = |error: &mut f64, _| {
                *error = alike * *error + (1.0_f64 - alike * alike).sqrt() * stream.normal();
                Some([*error; 3])
            };
            (0..steps).scan(first, next).collect()
        };
        let runs: Vec<_> = (0..runs).map(run).collect();
        let found = Reliability::of(&runs);
        assert!((found.correlation[0] - alike).abs() < 0.01, "{found:?}");
        let mean = |run: &Vec<[f64; 3]>| run.iter().map(|error| error[0]).sum::<f64>() / f64::from(steps);
        let of_means = runs.iter().map(|run| mean(run) * mean(run)).sum::<f64>() / runs.len() as f64;
        let ratio = of_means * f64::from(steps) / found.lasting([1.0; 3])[0];
        assert!((ratio - 1.0).abs() < 0.2, "{ratio}");
    }
}
