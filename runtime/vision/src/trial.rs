//! A trial: a scene, a path through it, a camera's clock and the true poses that a motion capture system would tell.

use mpgx_random::Purpose;
use serde::{Deserialize, Serialize};

use crate::camera::CameraConfig;
use crate::cast::{Moving, Shot};
use crate::dataset::{Tags, Truth};
use crate::image::Frame;
use crate::light::TimeOfDay;
use crate::pose::PoseQ;
use crate::trajectory::{Path, TrajectoryConfig};
use crate::world::{ConfigError, Part, Scene, TrialKey, WorldConfig, within};

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TrialConfig {
    pub time_of_day: TimeOfDay,
    pub trajectory: TrajectoryConfig,
    pub duration_s: f64,
    pub images_hz: f64,
    pub truth_hz: f64,
    /// Robots that drive about on paths of their own.
    pub others: usize,
}

impl Default for TrialConfig {
    fn default() -> TrialConfig {
        TrialConfig {
            time_of_day: TimeOfDay::default(),
            trajectory: TrajectoryConfig::default(),
            duration_s: 30.0,
            images_hz: 30.0,
            truth_hz: 360.0,
            others: 0,
        }
    }
}

/// A trial that can be recorded, one frame at a time and in any order.
#[derive(Clone, Debug)]
pub struct Trial {
    pub scene: Scene,
    pub path: Path,
    /// Of the other robots.
    pub others: Vec<Path>,
    pub truth: Truth,
    pub tags: Tags,
    /// How many frames it has.
    pub frames: usize,
    images_hz: f64,
    /// When the first image is taken: the camera's clock does not beat with the true poses'.
    first_s: f64,
}

impl Trial {
    /// A pure function of its arguments.
    pub fn new(
        world: &WorldConfig,
        camera: &CameraConfig,
        config: &TrialConfig,
        key: TrialKey,
    ) -> Result<Trial, ConfigError> {
        within("the duration of a trial", config.duration_s, (0.1, 36_000.0), "0.1 s to 10 h")?;
        within("the rate of images", config.images_hz, (0.1, 1000.0), "0.1 to 1000 Hz")?;
        within(
            "the rate of true poses",
            config.truth_hz,
            (config.images_hz, 10_000.0),
            "at least that of images, at most 10 kHz",
        )?;
        within("the number of other robots", config.others as f64, (0.0, 1000.0), "at most 1000")?;
        let path = Path::new(&config.trajectory, key, 0)?;
        let others = 1..=config.others as u64;
        let others =
            others.map(|number| Path::new(&config.trajectory, key, number)).collect::<Result<_, _>>()?;
        let count = (config.duration_s * config.truth_hz) as usize + 1;
        let times = (0..count).map(|number| number as f64 / config.truth_hz);
        let truth = Truth::of(times.map(|time_s| (time_s, camera.pose(path.at(time_s).pose))).collect());
        let first_s = key.stream(Purpose::Path, Part::Clock, 0).uniform() / config.images_hz;
        let last_s = (count - 1) as f64 / config.truth_hz;
        Ok(Trial {
            scene: Scene::new(world, camera, config.time_of_day, key)?,
            path,
            others,
            truth,
            tags: Tags {
                lighting: config.time_of_day.name().into(),
                trajectory: config.trajectory.kind.name().into(),
            },
            frames: ((last_s - first_s) * config.images_hz).max(0.0) as usize + 1,
            images_hz: config.images_hz,
            first_s,
        })
    }

    /// When frame `number` is taken: the middle of its exposure.
    pub fn time_s(&self, number: usize) -> f64 {
        self.first_s + number as f64 / self.images_hz
    }

    /// The true pose of frame `number`: between the two that were measured around it.
    pub fn pose(&self, number: usize) -> PoseQ {
        self.truth.nearest(self.time_s(number))
    }

    /// Frame `number`, rendered.
    pub fn frame(&self, number: usize) -> Frame {
        let time_s = self.time_s(number);
        let robots: Vec<Moving> = self.others.iter().map(|path| path.at(time_s)).collect();
        let shot = Shot { camera: self.path.at(time_s), robots: &robots, time_s, number: number as u64 };
        Frame { image: self.scene.render(&shot), pose: self.pose(number), time_s }
    }

    /// All frames, rendered one after another.
    pub fn frames(&self) -> impl Iterator<Item = Frame> {
        (0..self.frames).map(|number| self.frame(number))
    }
}
