//! Poses drawn one by one, for what paths rarely show: turning on the spot, and robots right before the camera.

use mpgx_random::{Purpose, Stream};
use serde::{Deserialize, Serialize};

use crate::cast::Moving;
use crate::pose::Pose;
use crate::trajectory::TrajectoryConfig;
use crate::world::{ConfigError, Part, TrialKey, within};

/// Of other robots, one half are near the camera's: between these distances, m. One that is nearer hides no view.
const NEAR_M: [f64; 2] = [0.25, 1.0];

/// How fast robots are: each drives forwards or backwards and turns, each evenly up to its limit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScatterConfig {
    pub speed_mps: f64,
    pub turn_radps: f64,
}

impl ScatterConfig {
    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        within("the speed of scattered robots", self.speed_mps, (0.0, 10.0), "0 to 10 m/s")?;
        within("the turning of scattered robots", self.turn_radps, (0.0, 100.0), "0 to 100 rad/s")
    }

    /// The robot with the camera, anywhere in the area that paths fill, and the others, for picture `number` of a trial.
    pub(crate) fn robots(
        &self,
        area: &TrajectoryConfig,
        others: usize,
        key: TrialKey,
        number: u64,
    ) -> (Moving, Vec<Moving>) {
        let mut stream = key.stream(Purpose::Path, Part::Scatter, number);
        let camera = self.anywhere(area, &mut stream);
        let other = |_| {
            let robot = self.anywhere(area, &mut stream);
            let near = stream.uniform() < 0.5;
            let [low, high] = NEAR_M;
            let away = low + (high - low) * stream.uniform();
            let (sin, cos) = libm::sincos(std::f64::consts::TAU * stream.uniform());
            let Pose { x_m, y_m, .. } = camera.pose;
            let beside = Pose { x_m: x_m + away * cos, y_m: y_m + away * sin, ..robot.pose };
            if near { Moving { pose: beside, ..robot } } else { robot }
        };
        let others = (0..others).map(other).collect();
        (camera, others)
    }

    fn anywhere(&self, area: &TrajectoryConfig, stream: &mut Stream) -> Moving {
        let mut even = |half: f64| half * (2.0 * stream.uniform() - 1.0);
        let [x_m, y_m] = area.middle_m;
        let pose = Pose {
            x_m: x_m + even(area.half_x_m),
            y_m: y_m + even(area.half_y_m),
            heading_rad: even(std::f64::consts::PI),
        };
        let (speed, turn_radps) = (even(self.speed_mps), even(self.turn_radps));
        let (sin, cos) = libm::sincos(pose.heading_rad);
        Moving { pose, velocity_mps: [speed * cos, speed * sin], turn_radps }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poses_fill_the_area_and_half_of_the_others_are_near() {
        let area = TrajectoryConfig { middle_m: [1.0, -0.5], ..TrajectoryConfig::default() };
        let config = ScatterConfig { speed_mps: 0.7, turn_radps: 3.0 };
        let drawn: Vec<(Moving, Vec<Moving>)> =
            (0..1000).map(|number| config.robots(&area, 2, TrialKey::default(), number)).collect();
        let share = |of: &dyn Fn(&Moving) -> bool| {
            drawn.iter().filter(|(camera, _)| of(camera)).count() as f64 / drawn.len() as f64
        };
        let inside = |it: &Moving| {
            (it.pose.x_m - 1.0).abs() <= 1.8
                && (it.pose.y_m + 0.5).abs() <= 1.6
                && libm::hypot(it.velocity_mps[0], it.velocity_mps[1]) <= 0.7
                && it.turn_radps.abs() <= 3.0
        };
        assert_eq!(share(&inside), 1.0);
        for half in [
            share(&|it| it.pose.x_m > 1.0),
            share(&|it| it.pose.heading_rad > 0.0),
            share(&|it| it.turn_radps.abs() > 1.5),
        ] {
            assert!((half - 0.5).abs() < 0.06, "{half}");
        }
        let away = |camera: &Moving, other: &Moving| {
            libm::hypot(other.pose.x_m - camera.pose.x_m, other.pose.y_m - camera.pose.y_m)
        };
        let pairs = drawn.iter().flat_map(|(camera, others)| others.iter().map(|it| away(camera, it)));
        let near = pairs.clone().filter(|away| (0.25..1.0).contains(away)).count();
        // Beside those that are meant to be near, some of the others are by chance.
        assert!((1000..1500).contains(&near), "{near}");
        assert_eq!(drawn[7], config.robots(&area, 2, TrialKey::default(), 7));
    }
}
