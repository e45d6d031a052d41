//! Dead reckoning: where one is if nothing changes its motion.

use crate::pose::{PoseQ, Quaternion};

/// Estimates for true poses at rising times, s. The time is cut into stretches of `stretch_s`: the first two poses of each
/// are known and are their own estimates; the motion between them, in the camera's own axes, goes on to the stretch's end.
pub fn dead_reckoning(truth: &[(f64, PoseQ)], stretch_s: f64) -> Vec<PoseQ> {
    let mut estimates = Vec::with_capacity(truth.len());
    let mut rest = truth;
    while let [first, later @ ..] = rest {
        let length = 1 + later.iter().take_while(|(time_s, _)| time_s - first.0 < stretch_s).count();
        let (stretch, next) = rest.split_at(length);
        estimates.push(first.1);
        if let [first, second, later @ ..] = stretch {
            let motion = Motion::between(*first, *second);
            let known = (second.0, second.1);
            estimates.push(second.1);
            estimates.extend(later.iter().scan(known, |(time_s, pose), &(now_s, _)| {
                *pose = motion.goes_on(pose, now_s - *time_s);
                *time_s = now_s;
                Some(*pose)
            }));
        }
        rest = next;
    }
    estimates
}

/// How a camera moves in `time_s`, in its own axes.
struct Motion {
    way_m: [f64; 3],
    turn: Quaternion,
    time_s: f64,
}

impl Motion {
    fn between((from_s, from): (f64, PoseQ), (to_s, to): (f64, PoseQ)) -> Motion {
        let back = from.quaternion.inverse();
        let way: [f64; 3] = std::array::from_fn(|axis| to.position_m[axis] - from.position_m[axis]);
        let turn = back.after(to.quaternion);
        // Halfway through the turn is where the way points.
        let half = Quaternion::IDENTITY.slerp(turn, 0.5);
        Motion { way_m: half.inverse().after(back).rotate(way), turn, time_s: to_s - from_s }
    }

    fn goes_on(&self, pose: &PoseQ, time_s: f64) -> PoseQ {
        let share = time_s / self.time_s;
        let turned = |share: f64| pose.quaternion.after(Quaternion::IDENTITY.slerp(self.turn, share)).unit();
        let way = turned(share / 2.0).rotate(self.way_m);
        PoseQ {
            position_m: std::array::from_fn(|axis| pose.position_m[axis] + share * way[axis]),
            quaternion: turned(share),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::CameraConfig;
    use crate::pose::Pose;

    /// On a circle of radius 2 m, 0.3 rad/s, a tilted camera looking along it.
    fn circle(time: f64) -> (f64, PoseQ) {
        let camera = CameraConfig { tilt_rad: 0.2, ..CameraConfig::default() };
        let (sin, cos) = libm::sincos(0.3 * time);
        let heading_rad = 0.3 * time + std::f64::consts::FRAC_PI_2;
        (time, camera.pose(Pose { x_m: 2.0 * cos, y_m: 2.0 * sin, heading_rad }))
    }

    #[test]
    fn a_circle_driven_evenly_is_followed_whatever_the_times() {
        let times = [0.0, 0.1, 0.2, 0.25, 0.5, 1.1, 1.2, 2.9];
        let truth = times.map(circle);
        for (estimate, (time, truth)) in dead_reckoning(&truth, 10.0).iter().zip(truth) {
            let away = libm::hypot(
                estimate.position_m[0] - truth.position_m[0],
                estimate.position_m[1] - truth.position_m[1],
            );
            // An arc is a little longer than its chord where the step is longer than the first.
            assert!(away < 0.02, "{time}: {away}");
            assert!(estimate.quaternion.angle_rad(truth.quaternion) < 1e-9, "{time}");
        }
    }

    #[test]
    fn what_changes_is_noticed_with_the_next_stretch_only() {
        let stop = |time: f64| (time, circle(time.min(1.0)).1);
        let truth: Vec<(f64, PoseQ)> = (0..40).map(|step| stop(0.1 * f64::from(step))).collect();
        let estimates = dead_reckoning(&truth, 2.0);
        let away = |step: usize| (estimates[step].position_m[0] - truth[step].1.position_m[0]).abs();
        assert_eq!(estimates.len(), truth.len());
        assert!(away(9) < 1e-9 && away(19) > 0.2, "{} {}", away(9), away(19));
        assert!(away(20) < 1e-9 && away(39) < 1e-9);
    }
}
