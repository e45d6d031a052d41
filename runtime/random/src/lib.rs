//! Random numbers by address.
//!
//! A draw depends on what it is for, never on what was drawn before it by somebody else: an [`Address`]
//! names a [`Stream`], and the same address gives the same stream on every machine, in every thread, after
//! every resume. The algorithm under study is no part of an address, so all methods meet the same leaders.

use rand_chacha::ChaCha8Rng;
use rand_core::{Rng, SeedableRng};

/// What a stream is for. The numbers are part of `numerics_version`: never reuse one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u32)]
pub enum Purpose {
    /// Initial weights of the networks.
    Weights = 1,
    /// Which transitions a mini-batch holds.
    Replay = 2,
    /// Noise on the actions while training.
    Exploration = 3,
    /// Noise on the target actions.
    TargetNoise = 4,
    /// Where agents start (step: the attempt).
    Start = 5,
    /// What motions draw (step 0: their start states).
    Motion = 6,
    /// Resampling of statistics.
    Bootstrap = 7,
    /// Parameters that are drawn for each episode (part: which).
    Parameter = 8,
    /// Noise on observations (part: the member that observes).
    Sensor = 9,
    /// What a room to look at is made of (part: which detail).
    Scene = 10,
    /// The path that a camera is driven along.
    Path = 11,
    /// Noise of a camera (step: the frame).
    Camera = 12,
    /// Changes made to images for training (step: the image).
    Augment = 13,
    /// Noise on the poses that robots are told (part: the agent).
    Localiser = 14,
    /// What wheels count wrongly (part: the agent; step 0: the biases of the episode).
    Odometry = 15,
}

/// The name of a stream. Training episodes have `protocol` 0, held-out episodes of protocol k have k + 1
/// and `seed` 0, so they are the same for every trained seed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Address {
    pub master: u64,
    pub purpose: Purpose,
    pub protocol: u16,
    /// Tells streams of one purpose and step apart: an agent, a network.
    pub part: u16,
    pub seed: u32,
    pub episode: u32,
    pub step: u64,
}

/// A deterministic stream of random numbers.
#[derive(Clone, Debug)]
pub struct Stream {
    source: ChaCha8Rng,
    spare: Option<f64>,
}

impl Address {
    /// The stream of this address: ChaCha8 with the address itself as the key.
    pub fn stream(&self) -> Stream {
        let mut key = [0; 32];
        key[0..8].copy_from_slice(&self.master.to_le_bytes());
        key[8..12].copy_from_slice(&(self.purpose as u32).to_le_bytes());
        key[12..14].copy_from_slice(&self.protocol.to_le_bytes());
        key[14..16].copy_from_slice(&self.part.to_le_bytes());
        key[16..20].copy_from_slice(&self.seed.to_le_bytes());
        key[20..24].copy_from_slice(&self.episode.to_le_bytes());
        key[24..32].copy_from_slice(&self.step.to_le_bytes());
        Stream { source: ChaCha8Rng::from_seed(key), spare: None }
    }
}

impl Stream {
    /// A multiple of 2⁻⁵³ in [0, 1).
    pub fn uniform(&mut self) -> f64 {
        (self.source.next_u64() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// A whole number in 0..n, every one with the same chance (Lemire's method, without bias).
    pub fn below(&mut self, n: u64) -> u64 {
        loop {
            let product = u128::from(self.source.next_u64()) * u128::from(n);
            let low = product as u64;
            if low >= n || low >= n.wrapping_neg() % n {
                return (product >> 64) as u64;
            }
        }
    }

    /// A standard normal number (Box and Muller; transcendental functions from `libm`).
    pub fn normal(&mut self) -> f64 {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        let radius = libm::sqrt(-2.0 * libm::log(1.0 - self.uniform()));
        let (sin, cos) = libm::sincos(2.0 * std::f64::consts::PI * self.uniform());
        self.spare = Some(radius * sin);
        radius * cos
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HERE: Address =
        Address { master: 1, purpose: Purpose::Motion, protocol: 0, part: 0, seed: 2, episode: 3, step: 4 };

    #[test]
    fn an_address_names_one_stream() {
        let draw = |address: Address| address.stream().uniform();
        assert_eq!(draw(HERE), draw(HERE));
        for other in [
            Address { master: 2, ..HERE },
            Address { purpose: Purpose::Start, ..HERE },
            Address { protocol: 1, ..HERE },
            Address { part: 1, ..HERE },
            Address { seed: 3, ..HERE },
            Address { episode: 4, ..HERE },
            Address { step: 5, ..HERE },
        ] {
            assert_ne!(draw(HERE), draw(other), "{other:?}");
        }
    }

    /// The bits that every result stands on; a change of them is a new `numerics_version`.
    #[test]
    fn the_first_draws_are_fixed() {
        let mut stream = HERE.stream();
        let drawn = [stream.uniform().to_bits(), stream.normal().to_bits(), stream.normal().to_bits()];
        assert_eq!(drawn, [4605275161153091819, 4608793252177108483, 13829831504728400825]);
        assert_eq!(stream.below(1000), 648);
    }

    #[test]
    fn moments_are_those_of_the_distributions() {
        let mut stream = HERE.stream();
        let n = 100_000;
        let normals: Vec<f64> = (0..n).map(|_| stream.normal()).collect();
        let mean = normals.iter().sum::<f64>() / n as f64;
        let variance = normals.iter().map(|x| x * x).sum::<f64>() / n as f64;
        assert!(mean.abs() < 0.01, "{mean}");
        assert!((variance - 1.0).abs() < 0.02, "{variance}");
        let mut seen = [0u32; 7];
        for _ in 0..70_000 {
            seen[stream.below(7) as usize] += 1;
        }
        assert!(seen.iter().all(|&count| (9_600..10_400).contains(&count)), "{seen:?}");
    }
}
