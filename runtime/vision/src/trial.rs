//! A trial: a scene, how a robot moves in it, a camera's clock and the true poses that a motion capture system would tell.

use mpgx_random::Purpose;
use serde::{Deserialize, Serialize};

use crate::camera::CameraConfig;
use crate::cast::{Moving, Shot};
use crate::dataset::{Tags, Truth};
use crate::image::Frame;
use crate::light::TimeOfDay;
use crate::pose::PoseQ;
use crate::scattered::ScatterConfig;
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
    /// Robots are somewhere else in each picture, instead of on paths.
    pub scattered: Option<ScatterConfig>,
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
            scattered: None,
        }
    }
}

/// A trial that can be recorded, one frame at a time and in any order.
#[derive(Clone, Debug)]
pub struct Trial {
    pub scene: Scene,
    pub truth: Truth,
    pub tags: Tags,
    /// How many frames it has.
    pub frames: usize,
    course: Course,
    images_hz: f64,
    /// When the first image is taken: the camera's clock does not beat with the true poses'.
    first_s: f64,
}

/// How robots move.
#[derive(Clone, Debug)]
enum Course {
    /// The path of the robot with the camera, and those of the others.
    Paths(Path, Vec<Path>),
    /// Drawn for each picture, with so many others in this area.
    Scattered(ScatterConfig, TrajectoryConfig, usize),
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
        let path = |number| Path::new(&config.trajectory, key, number);
        let first_s = key.stream(Purpose::Path, Part::Clock, 0).uniform() / config.images_hz;
        let count = (config.duration_s * config.truth_hz) as usize + 1;
        let last_s = (count - 1) as f64 / config.truth_hz;
        let frames = ((last_s - first_s) * config.images_hz).max(0.0) as usize + 1;
        let (course, truth): (Course, Vec<(f64, PoseQ)>) = match config.scattered {
            None => {
                let (path, others) = (path(0)?, (1..=config.others as u64).map(path));
                let times = (0..count).map(|number| number as f64 / config.truth_hz);
                let truth = times.map(|time_s| (time_s, camera.pose(path.at(time_s).pose))).collect();
                (Course::Paths(path, others.collect::<Result<_, _>>()?), truth)
            }
            Some(scatter) => {
                scatter.check()?;
                let area = &config.trajectory;
                area.check()?;
                let pose = |frame: usize| {
                    let (robot, _) = scatter.robots(area, 0, key, frame as u64);
                    (first_s + frame as f64 / config.images_hz, camera.pose(robot.pose))
                };
                let truth = (0..frames).map(pose).collect();
                (Course::Scattered(scatter, area.clone(), config.others), truth)
            }
        };
        Ok(Trial {
            scene: Scene::new(world, camera, config.time_of_day, key)?,
            truth: Truth::of(truth),
            tags: Tags {
                lighting: config.time_of_day.name().into(),
                trajectory: match course {
                    Course::Paths(..) => config.trajectory.kind.name().into(),
                    Course::Scattered(..) => "scattered".into(),
                },
            },
            frames,
            course,
            images_hz: config.images_hz,
            first_s,
        })
    }

    /// Whether the robot drives, so that each frame follows the one before.
    pub fn drives(&self) -> bool {
        matches!(self.course, Course::Paths(..))
    }

    /// The number of the frame nearest to `later_s` after frame `number`, if there is one.
    pub fn later(&self, number: usize, later_s: f64) -> Option<usize> {
        let frame = number + (later_s * self.images_hz).round().max(1.0) as usize;
        (frame < self.frames).then_some(frame)
    }

    /// When frame `number` is taken: the middle of its exposure.
    pub fn time_s(&self, number: usize) -> f64 {
        self.first_s + number as f64 / self.images_hz
    }

    /// The true pose of frame `number`: between the two that were measured around it.
    pub fn pose(&self, number: usize) -> PoseQ {
        self.truth.nearest(self.time_s(number))
    }

    /// The robot with the camera and the others in frame `number`.
    pub fn robots(&self, number: usize) -> (Moving, Vec<Moving>) {
        let time_s = self.time_s(number);
        match &self.course {
            Course::Paths(path, others) => {
                (path.at(time_s), others.iter().map(|path| path.at(time_s)).collect())
            }
            Course::Scattered(scatter, area, others) => {
                scatter.robots(area, *others, self.scene.key, number as u64)
            }
        }
    }

    /// Frame `number`, rendered.
    pub fn frame(&self, number: usize) -> Frame {
        let (camera, robots) = self.robots(number);
        let time_s = self.time_s(number);
        let shot = Shot { camera, robots: &robots, time_s, number: number as u64 };
        Frame { image: self.scene.render(&shot), pose: self.pose(number), time_s }
    }

    /// All frames, rendered one after another.
    pub fn frames(&self) -> impl Iterator<Item = Frame> {
        (0..self.frames).map(|number| self.frame(number))
    }
}
