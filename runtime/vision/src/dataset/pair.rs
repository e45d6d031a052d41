//! Images and poses are measured by different clocks: the pose of an image lies between two that were measured.

use super::error::DatasetError;
use crate::pose::{PoseQ, Quaternion};

/// True poses in the order of their times.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    samples: Vec<(f64, PoseQ)>,
}

impl Truth {
    /// Of poses whose times rise.
    pub(crate) fn of(samples: Vec<(f64, PoseQ)>) -> Truth {
        Truth { samples }
    }

    /// Times, s, and poses.
    pub fn samples(&self) -> &[(f64, PoseQ)] {
        &self.samples
    }

    /// The pose at a time: position on the line, rotation by slerp between the measurements before and after. Fails
    /// before the first, after the last, and where they are more than `gap_s` apart.
    pub fn at(&self, time_s: f64, gap_s: f64) -> Result<PoseQ, DatasetError> {
        let lost = |why: String| Err(DatasetError::NoPose { time_s, why });
        let next = self.samples.partition_point(|&(time, _)| time <= time_s);
        let Some(&(t0, before)) = next.checked_sub(1).and_then(|last| self.samples.get(last)) else {
            return lost("the poses begin later".into());
        };
        if t0 == time_s {
            return Ok(before);
        }
        let Some(&(t1, after)) = self.samples.get(next) else {
            return lost(format!("the poses end at {t0} s"));
        };
        if t1 - t0 > gap_s {
            return lost(format!("none was measured from {t0} s to {t1} s"));
        }
        Ok(before.between(&after, (time_s - t0) / (t1 - t0)))
    }

    /// [`at`](Truth::at) whatever the gap, the first or last pose outside.
    pub(crate) fn nearest(&self, time_s: f64) -> PoseQ {
        let edge = || {
            let later = self.samples.iter().find(|&&(time, _)| time >= time_s);
            later.or(self.samples.last()).map(|&(_, pose)| pose)
        };
        let pose = self.at(time_s, f64::INFINITY).ok().or_else(edge);
        pose.unwrap_or(PoseQ { position_m: [0.0; 3], quaternion: Quaternion::IDENTITY })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::CameraConfig;
    use crate::pose::Pose;

    fn turning() -> Truth {
        let pose =
            |time: f64| CameraConfig::default().pose(Pose { x_m: 2.0 * time, y_m: 0.0, heading_rad: time });
        Truth::of([0.0, 0.5, 2.0].map(|time| (time, pose(time))).to_vec())
    }

    #[test]
    fn poses_are_found_between_the_measured_ones() {
        let pose = turning().at(0.125, 1.0).unwrap().planar();
        assert!((pose.x_m - 0.25).abs() < 1e-12 && (pose.heading_rad - 0.125).abs() < 1e-12, "{pose:?}");
        assert_eq!(turning().at(0.5, 1.0).unwrap(), turning().samples()[1].1);
        assert_eq!(turning().at(2.0, 1.0).unwrap(), turning().samples()[2].1);
    }

    #[test]
    fn where_nothing_was_measured_no_pose_is_made_up() {
        let why = |time: f64| turning().at(time, 1.0).unwrap_err().to_string();
        assert_eq!(why(-0.1), "no pose is known for -0.1 s: the poses begin later");
        assert_eq!(why(2.1), "no pose is known for 2.1 s: the poses end at 2 s");
        assert_eq!(why(1.0), "no pose is known for 1 s: none was measured from 0.5 s to 2 s");
    }
}
