//! Noise on actions.

use mpgx_random::Stream;

use crate::config::{Bound, Config, Decay, NoiseReading};
use crate::varying::Varying;

/// The standard deviation that a noise setting means.
pub(crate) fn deviation(setting: f64, reading: NoiseReading) -> f32 {
    match reading {
        NoiseReading::Variance => libm::sqrt(setting) as f32,
        NoiseReading::Deviation => setting as f32,
    }
}

/// Fills `noise` with normal numbers of this deviation, clipped to ±`clip`.
pub(crate) fn fill(noise: &mut [f32], stream: &mut Stream, deviation: f32, clip: f32) {
    for value in noise {
        *value = (deviation * stream.normal() as f32).clamp(-clip, clip);
    }
}

/// The exploration noise of one run: falls by a factor down to a floor, or follows a schedule.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Exploration {
    /// In the unit of the setting; of a schedule, 0.
    pub(crate) level: f64,
}

impl Exploration {
    pub(crate) fn new(config: &Config) -> Self {
        let level = match config.explore_noise {
            Varying::Constant(level) => level,
            Varying::Scheduled(_) => 0.0,
        };
        Self { level }
    }

    /// v ← max(λ v, v_min), or min, if the time that has passed is the one that counts.
    pub(crate) fn decay(&mut self, passed: Decay, config: &Config) {
        if passed == config.explore_every {
            let decayed = config.explore_decay * self.level;
            self.level = match config.explore_bound {
                Bound::Max => decayed.max(config.explore_min),
                Bound::Min => decayed.min(config.explore_min),
            };
        }
    }

    /// When the share `done` of training is over.
    pub(crate) fn deviation(&self, config: &Config, done: f64) -> f32 {
        let level = match config.explore_noise {
            Varying::Constant(_) => self.level,
            Varying::Scheduled(_) => config.explore_noise.at(done),
        };
        deviation(level, config.noise_reading)
    }
}

#[cfg(test)]
mod tests {
    use mpgx_random::{Address, Purpose};

    use super::*;

    #[test]
    fn target_noise_is_normal_up_to_its_clip() {
        let purpose = Purpose::TargetNoise;
        let address = Address { master: 0, purpose, protocol: 0, part: 0, seed: 0, episode: 0, step: 0 };
        let (mut free, mut clipped) = ([0.0; 1000], [0.0; 1000]);
        fill(&mut free, &mut address.stream(), 0.2, 1e9);
        fill(&mut clipped, &mut address.stream(), 0.2, 0.3);
        let deviation = (free.iter().map(|noise| noise * noise).sum::<f32>() / 1000.0).sqrt();
        assert!((deviation - 0.2).abs() < 0.01, "{deviation}");
        assert_eq!(clipped, free.map(|noise| noise.clamp(-0.3, 0.3)));
        // P(|N(0, 0.2)| > 0.3) is 0.134.
        let beyond = free.iter().filter(|noise| noise.abs() > 0.3).count();
        assert!((100..170).contains(&beyond), "{beyond}");
    }
}
