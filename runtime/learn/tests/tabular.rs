//! The paper's theorem, tried: MPG's update of two tables on random MDPs, with the target rule of the deep learner.

use mpgx_learn::DeltaKind;
use mpgx_learn::algorithms::mpg;
use mpgx_random::{Address, Purpose, Stream};

const STATES: usize = 8;
const ACTIONS: usize = 3;
const GAMMA: f64 = 0.9;
const UPDATES: u64 = 1_000_000;

type Table = [[f64; ACTIONS]; STATES];

/// A finite MDP: chances of the next state, and mean rewards in 0 .. 1, to which noise is added.
struct Mdp {
    chances: [[[f64; STATES]; ACTIONS]; STATES],
    reward: Table,
}

/// (s, a), the reward and the next state.
type Sample = ((usize, usize), f64, usize);

fn stream(part: u16, mdp: u32) -> Stream {
    Address { master: 4, purpose: Purpose::Replay, protocol: 0, part, seed: mdp, episode: 0, step: 0 }
        .stream()
}

/// The first index whose value is the greatest.
fn argmax(values: &[f64]) -> usize {
    (1..values.len()).fold(0, |best, a| if values[a] > values[best] { a } else { best })
}

fn greatest_difference(left: &Table, right: &Table) -> f64 {
    let pairs = left.iter().flatten().zip(right.iter().flatten());
    pairs.fold(0.0, |greatest, (left, right)| f64::max(greatest, (left - right).abs()))
}

impl Mdp {
    fn random(number: u32) -> Self {
        let mut stream = stream(0, number);
        let mut mdp = Self { chances: [[[0.0; STATES]; ACTIONS]; STATES], reward: [[0.0; ACTIONS]; STATES] };
        for (chances, reward) in mdp.chances.iter_mut().flatten().zip(mdp.reward.iter_mut().flatten()) {
            // Cubed, so that each action leads to few states.
            *chances = std::array::from_fn(|_| stream.uniform().powi(3));
            let sum: f64 = chances.iter().sum();
            chances.iter_mut().for_each(|chance| *chance /= sum);
            *reward = stream.uniform();
        }
        mdp
    }

    /// Q* by value iteration: its error is below γⁿ / (1 − γ) after n rounds.
    fn optimum(&self) -> Table {
        let mut q = Table::default();
        for _ in 0..300 {
            let value = q.map(|actions| actions[argmax(&actions)]);
            q = std::array::from_fn(|s| {
                std::array::from_fn(|a| {
                    let next: f64 = self.chances[s][a].iter().zip(value).map(|(p, v)| p * v).sum();
                    self.reward[s][a] + GAMMA * next
                })
            });
        }
        q
    }

    /// Every pair with the same chance.
    fn sample(&self, stream: &mut Stream) -> Sample {
        let (s, a) = (stream.below(STATES as u64) as usize, stream.below(ACTIONS as u64) as usize);
        let mut left = stream.uniform();
        let next = self.chances[s][a].iter().position(|chance| {
            left -= chance;
            left < 0.0
        });
        ((s, a), self.reward[s][a] + stream.uniform() - 0.5, next.unwrap_or(STATES - 1))
    }

    /// Two tables that begin at random and are both pulled towards what `target` makes of them and of a
    /// sample, at the rate 1 / (1 + n)^0.7 at the n-th visit of a pair.
    fn learn(&self, number: u32, mut target: impl FnMut(&[Table; 2], Sample) -> f64) -> [Table; 2] {
        let (mut start, mut samples) = (stream(1, number), stream(2, number));
        let mut q = [0, 1].map(|_| Table::default().map(|row| row.map(|_| 20.0 * start.uniform() - 10.0)));
        let mut visits = [[0u32; ACTIONS]; STATES];
        for _ in 0..UPDATES {
            let sample = self.sample(&mut samples);
            let (s, a) = sample.0;
            visits[s][a] += 1;
            let alpha = f64::from(1 + visits[s][a]).powf(-0.7);
            let y = target(&q, sample);
            for q in &mut q {
                q[s][a] += alpha * (y - q[s][a]);
            }
        }
        q
    }
}

/// y = r + γ (max(Q, Q′) − Δ_adj) at the pair that `place` picks, with Δ_last from update to update.
fn momentum(place: impl Fn(&[Table; 2], Sample) -> (usize, usize)) -> impl FnMut(&[Table; 2], Sample) -> f64 {
    let mut delta_last = [0.0];
    move |q, sample| {
        let (s, a) = place(q, sample);
        let [q_1, q_2] = [q[0][s][a] as f32, q[1][s][a] as f32];
        let mut value = [0.0];
        mpg::bootstrap([&[q_1], &[q_2]], &mut delta_last, DeltaKind::Element, &mut value);
        sample.1 + GAMMA * f64::from(value[0])
    }
}

/// With the greedy action of the next state, MPG finds Q*, as Q-learning does.
#[test]
fn mpg_converges_to_the_optimum() {
    for number in 0..3 {
        let mdp = Mdp::random(number);
        let optimum = mdp.optimum();
        let q_learning = mdp.learn(number, |q, (_, r, next)| r + GAMMA * q[0][next][argmax(&q[0][next])]);
        let mpg = mdp.learn(number, momentum(|q, (_, _, next)| (next, argmax(&q[0][next]))));
        for q in &mpg {
            let error = greatest_difference(q, &optimum);
            assert!(error < 0.15, "MDP {number}: {error}");
            let apart = greatest_difference(q, &q_learning[0]);
            assert!(apart < 0.05, "MDP {number}: {apart} from Q-learning");
        }
        eprintln!(
            "MDP {number}: MPG {:.3}, Q-learning {:.3}",
            greatest_difference(&mpg[0], &optimum),
            greatest_difference(&q_learning[0], &optimum)
        );
    }
}

/// With Q(s_t, a_t), as the proof prints the target, every pair repeats its own reward for ever: r / (1 − γ).
#[test]
fn the_printed_target_does_not() {
    for number in 0..3 {
        let mdp = Mdp::random(number);
        let printed = mdp.learn(number, momentum(|_, (pair, ..)| pair));
        let repeated = mdp.reward.map(|actions| actions.map(|r| r / (1.0 - GAMMA)));
        let error = greatest_difference(&printed[0], &mdp.optimum());
        assert!(error > 2.0, "MDP {number}: {error}");
        let apart = greatest_difference(&printed[0], &repeated);
        assert!(apart < 0.5, "MDP {number}: {apart}");
        eprintln!("MDP {number}: {error:.3} from Q*, {apart:.3} from r / (1 - γ)");
    }
}
