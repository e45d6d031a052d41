//! Where a robot stands and where a camera looks.
//!
//! The world's x and y lie on the floor, z points up. A camera's x points right, y down and z forward, as in TUM RGB-D
//! and 7-Scenes; a [`PoseQ`] takes its coordinates to the world's.

use serde::{Deserialize, Serialize};

/// Of a robot on the floor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    pub x_m: f64,
    pub y_m: f64,
    /// Anticlockwise from x.
    pub heading_rad: f64,
}

/// A rotation. q and −q are the same one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Quaternion {
    pub w: f64,
    pub x: f64,
    pub y: f64,
    pub z: f64,
}

/// Of a camera in space.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseQ {
    pub position_m: [f64; 3],
    /// Of length 1, from the camera's coordinates to the world's.
    pub quaternion: Quaternion,
}

impl Quaternion {
    pub const IDENTITY: Quaternion = Quaternion { w: 1.0, x: 0.0, y: 0.0, z: 0.0 };

    /// The rotation of a matrix (rows) whose columns are of length 1 and at right angles; of length 1 and with w ≥ 0.
    /// Shepperd's method: it divides by the largest of the four.
    pub fn from_matrix(m: &[[f64; 3]; 3]) -> Quaternion {
        let trace = m[0][0] + m[1][1] + m[2][2];
        let largest = trace.max(m[0][0]).max(m[1][1]).max(m[2][2]);
        let [w, x, y, z] = if trace == largest {
            [1.0 + trace, m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]]
        } else if m[0][0] == largest {
            [m[2][1] - m[1][2], 1.0 + 2.0 * m[0][0] - trace, m[0][1] + m[1][0], m[0][2] + m[2][0]]
        } else if m[1][1] == largest {
            [m[0][2] - m[2][0], m[0][1] + m[1][0], 1.0 + 2.0 * m[1][1] - trace, m[1][2] + m[2][1]]
        } else {
            [m[1][0] - m[0][1], m[0][2] + m[2][0], m[1][2] + m[2][1], 1.0 + 2.0 * m[2][2] - trace]
        };
        let unit = Quaternion { w, x, y, z }.unit();
        if unit.w < 0.0 { unit.negated() } else { unit }
    }

    /// The rotation as a matrix (rows).
    pub fn matrix(self) -> [[f64; 3]; 3] {
        let Quaternion { w, x, y, z } = self;
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    }

    pub fn rotate(self, v: [f64; 3]) -> [f64; 3] {
        self.matrix().map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
    }

    /// First `other`, then `self`.
    pub fn after(self, other: Quaternion) -> Quaternion {
        let (a, b) = (self, other);
        Quaternion {
            w: a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z,
            x: a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
            y: a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
            z: a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w,
        }
    }

    /// The rotation back, of a quaternion of length 1.
    pub fn inverse(self) -> Quaternion {
        Quaternion { w: self.w, x: -self.x, y: -self.y, z: -self.z }
    }

    pub fn dot(self, other: Quaternion) -> f64 {
        self.w * other.w + self.x * other.x + self.y * other.y + self.z * other.z
    }

    pub fn negated(self) -> Quaternion {
        self.scaled(-1.0)
    }

    /// Of length 1; the identity for a quaternion of zeros.
    pub fn unit(self) -> Quaternion {
        let length = self.dot(self).sqrt();
        if length > 0.0 { self.scaled(1.0 / length) } else { Quaternion::IDENTITY }
    }

    /// The angle between two rotations in 0..=π, 2·acos|⟨q, q̂⟩|, for quaternions of length 1. Computed from sum and
    /// difference, so that small angles keep their digits.
    pub fn angle_rad(self, other: Quaternion) -> f64 {
        let near = if self.dot(other) < 0.0 { other.negated() } else { other };
        let (sum, difference) = (self.plus(near), self.plus(near.negated()));
        4.0 * libm::atan2(difference.dot(difference).sqrt(), sum.dot(sum).sqrt())
    }

    /// From `self` (0) to `other` (1) along the shorter arc with constant speed (Shoemake 1985).
    pub fn slerp(self, other: Quaternion, share: f64) -> Quaternion {
        let near = if self.dot(other) < 0.0 { other.negated() } else { other };
        let half_angle = self.angle_rad(near) / 2.0;
        let sin = libm::sin(half_angle);
        if sin < 1e-9 {
            return self.scaled(1.0 - share).plus(near.scaled(share)).unit();
        }
        let first = libm::sin((1.0 - share) * half_angle) / sin;
        let second = libm::sin(share * half_angle) / sin;
        self.scaled(first).plus(near.scaled(second)).unit()
    }

    fn scaled(self, by: f64) -> Quaternion {
        Quaternion { w: self.w * by, x: self.x * by, y: self.y * by, z: self.z * by }
    }

    fn plus(self, other: Quaternion) -> Quaternion {
        Quaternion { w: self.w + other.w, x: self.x + other.x, y: self.y + other.y, z: self.z + other.z }
    }
}

impl PoseQ {
    /// Between two poses: the position on the line, the rotation by slerp.
    pub fn between(&self, other: &PoseQ, share: f64) -> PoseQ {
        let position =
            |axis: usize| self.position_m[axis] + share * (other.position_m[axis] - self.position_m[axis]);
        PoseQ {
            position_m: [position(0), position(1), position(2)],
            quaternion: self.quaternion.slerp(other.quaternion, share),
        }
    }

    /// The robot below the camera: it heads where the camera looks, seen from above.
    pub fn planar(&self) -> Pose {
        let [x_m, y_m, _] = self.position_m;
        let forward = self.quaternion.rotate([0.0, 0.0, 1.0]);
        Pose { x_m, y_m, heading_rad: libm::atan2(forward[1], forward[0]) }
    }
}
