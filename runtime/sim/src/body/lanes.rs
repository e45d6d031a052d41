//! Bodies of environments side by side.

use super::{Body, Kinematics, Pose, Unicycle};
use crate::lanes::{Lanes, Plane, at, by_axis, each, map, map2, put, sincos, wrapped};
use crate::maths::clamp;

impl Body {
    /// [`Body::limited`] in each lane.
    pub fn limited_lanes(&self, before: &Plane, command: &Plane) -> Plane {
        if self.change_mps == f64::INFINITY {
            return *command;
        }
        each(command, |lane, command| self.limited(at(before, lane), command))
    }

    /// [`Body::moved`] in each lane, in place.
    pub fn move_lanes(&self, position: &mut Plane, heading: &mut Lanes, command: &Plane, dt_s: f64) {
        match &self.kinematics {
            Kinematics::Point => *position = by_axis(position, command, |p, v| p + v * dt_s),
            Kinematics::Unicycle(unicycle) => unicycle.move_lanes(position, heading, command),
            Kinematics::Steered(_) | Kinematics::Holonomic { .. } => {
                for (lane, heading) in heading.iter_mut().enumerate() {
                    let pose = Pose { position: at(position, lane), heading: *heading };
                    let pose = self.moved(pose, at(command, lane), dt_s);
                    put(position, lane, pose.position);
                    *heading = pose.heading;
                }
            }
        }
    }
}

impl Unicycle {
    /// As [`Unicycle::moved`], operation by operation.
    fn move_lanes(&self, position: &mut Plane, heading: &mut Lanes, command: &Plane) {
        let (sin, cos) = sincos(heading);
        let mut ahead = [cos, sin];
        let ((slow, fast), (right, left)) = (self.drive_mps, self.turn_radps);
        for _ in 0..self.inner {
            let v = map2(
                &map2(&ahead[0], &command[0], |cos, x| cos * x),
                &map2(&ahead[1], &command[1], |sin, y| sin * y),
                |a, b| clamp(a + b, slow, fast),
            );
            let half = map2(
                &map2(&ahead[1], &command[0], |sin, x| -sin * x),
                &map2(&ahead[0], &command[1], |cos, y| cos * y),
                |a, b| clamp((a + b) / self.hand_m, right, left) * self.inner_s / 2.0,
            );
            let (sin, cos) = sincos(&half);
            let sinc = map2(&sin, &half, |sin, half| if half == 0.0 { 1.0 } else { sin / half });
            let middle = turned(&ahead, &sin, &cos);
            let after = turned(&middle, &sin, &cos);
            let way = map2(&v, &sinc, |v, sinc| v * self.inner_s * sinc);
            for axis in 0..2 {
                let axle = map2(&middle[axis], &way, |middle, way| middle * way);
                let hand = map2(&after[axis], &ahead[axis], |after, ahead| (after - ahead) * self.hand_m);
                position[axis] = map2(&position[axis], &map2(&axle, &hand, |a, b| a + b), |p, way| p + way);
            }
            *heading = map2(heading, &map(&half, |half| 2.0 * half), |a, b| a + b);
            ahead = after;
        }
        *heading = wrapped(heading);
    }
}

/// Directions turned by angles whose sines and cosines are known.
#[inline(always)]
fn turned(a: &Plane, sin: &Lanes, cos: &Lanes) -> Plane {
    let product = |a: &Lanes, b: &Lanes| map2(a, b, |a, b| a * b);
    [
        map2(&product(&a[0], cos), &product(&a[1], sin), |a, b| a - b),
        map2(&product(&a[0], sin), &product(&a[1], cos), |a, b| a + b),
    ]
}
