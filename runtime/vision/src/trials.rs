//! Many trials in one world, to learn from and to measure with.

use serde::{Deserialize, Serialize};

use crate::camera::CameraConfig;
use crate::light::TimeOfDay;
use crate::scattered::ScatterConfig;
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
    /// If set, half of the training trials show robots somewhere else in each image, and so does a kind of its own of those
    /// held out.
    pub scattered: Option<ScatterConfig>,
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
            scattered: None,
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
        let at = number as usize / 3;
        let (kind, scattered) = match (split, self.scattered) {
            (Split::Training, scattered) => (at % 3, scattered.filter(|_| number % 2 == 1)),
            (Split::HeldOut, None) => (at % 3, None),
            (Split::HeldOut, scattered) => (at % 4 % 3, scattered.filter(|_| at % 4 == 3)),
        };
        let config = TrialConfig {
            time_of_day: TimeOfDay::of_trial(number),
            trajectory: TrajectoryConfig { kind: kinds[kind], ..self.trajectory.clone() },
            duration_s: self.duration_s,
            others: self.others,
            scattered,
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

    /// Of 18 training trials each lighting and kind of path is met equally often, and half are scattered; of 12 held-out ones
    /// a quarter.
    #[test]
    fn scattered_trials_are_half_of_those_to_learn_from_and_a_kind_of_their_own() {
        let camera = CameraConfig { width_px: 8, height_px: 8, ..CameraConfig::default() };
        let scattered = Some(ScatterConfig { speed_mps: 0.7, turn_radps: 3.0 });
        let config =
            TrialsConfig { camera, scattered, duration_s: 1.0, others: 1, ..TrialsConfig::default() };
        let tags = |split, number| config.trial(split, number).unwrap().tags;
        let held_out: Vec<_> = (0..12).map(|number| tags(Split::HeldOut, number)).collect();
        assert!((1..12).all(|n| held_out[..n].iter().all(|other| *other != held_out[n])));
        let count =
            |kind: &str| (0..18).filter(|&number| tags(Split::Training, number).trajectory == kind).count();
        assert_eq!(["regular", "random", "whirlpool", "scattered"].map(count), [3, 3, 3, 9]);
        let trial = config.trial(Split::Training, 1).unwrap();
        assert!(!trial.drives());
        let poses: Vec<_> = (0..trial.frames).map(|frame| trial.frame(frame).pose).collect();
        let away = |k: usize| poses[k].position_m[0] - poses[k - 1].position_m[0];
        assert!((1..poses.len()).any(|k| away(k).abs() > 1.0));
        assert_eq!((trial.later(0, 0.1), trial.later(trial.frames - 1, 0.01)), (Some(3), None));
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
