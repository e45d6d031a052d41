//! Many trials in one world, to learn from and to measure with.

use serde::{Deserialize, Serialize};

use crate::camera::CameraConfig;
use crate::light::TimeOfDay;
use crate::trajectory::{TrajectoryConfig, TrajectoryKind};
use crate::trial::{Trial, TrialConfig};
use crate::world::{ConfigError, TrialKey, WorldConfig, within};

/// A world and the trials in it: number n in the light and on the kind of path that n says, so that all are met equally often.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TrialsConfig {
    pub world: WorldConfig,
    pub camera: CameraConfig,
    /// Of every kind; the kind is given by the trial's number.
    pub trajectory: TrajectoryConfig,
    pub duration_s: f64,
    /// Images taken of a trial, evenly spread.
    pub images: usize,
    /// Trials of an epoch.
    pub trials: usize,
    /// How often a network learns from an epoch's images before new ones are made.
    pub passes: usize,
    /// Other robots in each trial.
    pub others: usize,
    pub master: u64,
}

impl Default for TrialsConfig {
    fn default() -> TrialsConfig {
        TrialsConfig {
            world: WorldConfig::default(),
            camera: CameraConfig { width_px: 64, height_px: 64, ..CameraConfig::default() },
            trajectory: TrajectoryConfig::default(),
            duration_s: 60.0,
            images: 100,
            trials: 36,
            passes: 2,
            others: 0,
            master: 1,
        }
    }
}

/// Whether a trial is trained on or kept to measure with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Split {
    Training,
    HeldOut,
}

impl TrialsConfig {
    pub fn check(&self) -> Result<(), ConfigError> {
        within("the images of a trial", self.images as f64, (1.0, 100_000.0), "1 to 100000")?;
        within("the trials of an epoch", self.trials as f64, (1.0, 100_000.0), "1 to 100000")?;
        within("the passes over an epoch", self.passes as f64, (1.0, 1000.0), "1 to 1000")?;
        self.trial(Split::Training, 0).map(drop)
    }

    /// A trial; those held out share none with those trained on.
    pub fn trial(&self, split: Split, number: u32) -> Result<Trial, ConfigError> {
        let kinds = TrajectoryKind::ALL;
        let at = number as usize;
        let config = TrialConfig {
            time_of_day: TimeOfDay::of_trial(number),
            trajectory: TrajectoryConfig { kind: kinds[at / 3 % 3], ..self.trajectory.clone() },
            duration_s: self.duration_s,
            others: self.others,
            ..TrialConfig::default()
        };
        let protocol = u16::from(split == Split::HeldOut);
        let key = TrialKey { master: self.master, protocol, seed: 0, episode: number };
        Trial::new(&self.world, &self.camera, &config, key)
    }

    /// The numbers of the frames that are taken of a trial.
    pub fn frames(&self, trial: &Trial) -> impl Iterator<Item = usize> + use<> {
        let (frames, images) = (trial.frames, self.images);
        (0..images.min(frames)).map(move |image| image * frames / images.min(frames))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nine_trials_have_every_lighting_with_every_kind_of_path_and_those_held_out_are_others() {
        let camera = CameraConfig { width_px: 8, height_px: 8, ..CameraConfig::default() };
        let config = TrialsConfig { camera, duration_s: 2.0, ..TrialsConfig::default() };
        let trials: Vec<Trial> = (0..9).map(|n| config.trial(Split::HeldOut, n).unwrap()).collect();
        assert!((1..9).all(|n| trials[..n].iter().all(|other| other.tags != trials[n].tags)));
        let learnt = config.trial(Split::Training, 2).unwrap();
        assert_eq!(learnt.tags, trials[2].tags);
        assert_ne!(learnt.pose(0), trials[2].pose(0));
    }

    #[test]
    fn frames_are_evenly_spread() {
        let config = TrialsConfig { duration_s: 2.0, images: 4, ..TrialsConfig::default() };
        let trial = config.trial(Split::Training, 0).unwrap();
        let frames: Vec<usize> = config.frames(&trial).collect();
        assert_eq!((frames[0], frames[1], frames.len()), (0, trial.frames / 4, 4));
        assert!(config.check().is_ok());
        assert!(TrialsConfig { images: 0, ..config }.check().is_err());
    }
}
