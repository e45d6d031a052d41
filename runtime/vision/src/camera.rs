//! The camera: a pinhole at a fixed height and tilt above its robot.

use serde::{Deserialize, Serialize};

use crate::pose::{Pose, PoseQ, Quaternion};
use crate::world::{ConfigError, within};

/// Where the camera sits on the robot and what it makes of the light.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CameraConfig {
    pub width_px: usize,
    pub height_px: usize,
    /// Above the floor.
    pub height_m: f64,
    /// Positive looks down.
    pub tilt_rad: f64,
    /// Horizontal field of view; pixels are square.
    pub fov_rad: f64,
    /// How long light falls on the sensor for one image: what moves meanwhile blurs.
    pub exposure_s: f64,
    /// Rays through each pixel, spread over its area and over the exposure.
    pub samples: usize,
    /// 0 keeps one gain for a whole trial; 1 brings every image to the same mean.
    pub auto_exposure: f64,
    /// Standard deviation of the noise at a value of 1 in linear light; it falls with the root of the light.
    pub shot_noise: f64,
    /// Standard deviation of the noise in the dark.
    pub read_noise: f64,
}

impl Default for CameraConfig {
    fn default() -> CameraConfig {
        CameraConfig {
            width_px: 96,
            height_px: 96,
            height_m: 0.4,
            tilt_rad: 0.0,
            fov_rad: 1.22,
            exposure_s: 0.015,
            samples: 4,
            auto_exposure: 0.7,
            shot_noise: 0.025,
            read_noise: 0.004,
        }
    }
}

impl CameraConfig {
    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        for (what, pixels) in
            [("the width of images", self.width_px), ("the height of images", self.height_px)]
        {
            within(what, pixels as f64, (1.0, 4096.0), "1 to 4096 pixels")?;
        }
        within("the camera's height", self.height_m, (0.01, 10.0), "0.01 to 10 m")?;
        within("the camera's tilt", self.tilt_rad, (-1.5, 1.5), "-1.5 to 1.5 rad")?;
        within("the camera's field of view", self.fov_rad, (0.05, 3.0), "0.05 to 3 rad")?;
        within("the exposure", self.exposure_s, (0.0, 1.0), "0 to 1 s")?;
        within("the number of rays through a pixel", self.samples as f64, (1.0, 256.0), "1 to 256")?;
        within("the share of automatic exposure", self.auto_exposure, (0.0, 1.0), "0 to 1")?;
        within("the shot noise", self.shot_noise, (0.0, 1.0), "0 to 1")?;
        within("the read noise", self.read_noise, (0.0, 1.0), "0 to 1")
    }

    /// The pose of the camera on a robot.
    pub fn pose(&self, robot: Pose) -> PoseQ {
        let (sin, cos) = libm::sincos(robot.heading_rad);
        let (sin_tilt, cos_tilt) = libm::sincos(self.tilt_rad);
        // Columns: right, down, forward.
        let matrix = [
            [sin, -cos * sin_tilt, cos * cos_tilt],
            [-cos, -sin * sin_tilt, sin * cos_tilt],
            [0.0, -cos_tilt, -sin_tilt],
        ];
        PoseQ {
            position_m: [robot.x_m, robot.y_m, self.height_m],
            quaternion: Quaternion::from_matrix(&matrix),
        }
    }

    /// The focal length in pixels.
    pub fn focal_px(&self) -> f64 {
        self.width_px as f64 / 2.0 / libm::tan(self.fov_rad / 2.0)
    }

    /// Where a point of the world is seen by a camera at `pose`, in pixels from the top left corner; nothing behind the
    /// camera. Points beside the image have coordinates outside of it.
    pub fn project(&self, pose: &PoseQ, point_m: [f64; 3]) -> Option<[f64; 2]> {
        let rotation = pose.quaternion.matrix();
        let away: [f64; 3] = std::array::from_fn(|axis| point_m[axis] - pose.position_m[axis]);
        let along = |axis: usize| (0..3).map(|row| rotation[row][axis] * away[row]).sum::<f64>();
        let [right, down, forward] = [along(0), along(1), along(2)];
        (forward > 1e-6).then(|| {
            let focal = self.focal_px();
            [
                self.width_px as f64 / 2.0 + focal * right / forward,
                self.height_px as f64 / 2.0 + focal * down / forward,
            ]
        })
    }
}
