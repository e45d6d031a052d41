//! What the outputs of a network mean: x, y, orientation and distances to landmarks, all between about −1 and 1.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use super::bins::moments_of;
use crate::pose::{PoseQ, Quaternion};
use crate::reliability::Fix;

/// How an orientation is written as numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Orientation {
    /// Sine and cosine of the heading: continuous all around.
    #[default]
    Heading,
    /// w, x, y and z with w ≥ 0, as in the paper: it jumps where w is 0.
    Quaternion,
}

/// The parts of the outputs; a loss weighs them against each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    Position,
    Orientation,
    Landmarks,
}

impl Part {
    pub const ALL: [Part; 3] = [Part::Position, Part::Orientation, Part::Landmarks];
}

/// How many bins there may be.
pub(crate) const BINS: std::ops::RangeInclusive<usize> = 1..=256;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PoseHead {
    pub orientation: Orientation,
    /// Of the distribution that tells an output; 1 for none: the network then tells the output itself, as in the paper.
    pub bins: usize,
    /// What −1 and 1 stand for.
    pub x_m: [f64; 2],
    pub y_m: [f64; 2],
    /// The camera of a robot that stands at 0 and heads along x: its height and tilt.
    pub mount: PoseQ,
    /// Where the landmarks stand.
    pub landmarks_m: Vec<[f64; 2]>,
}

/// Distributions may be told with more confidence than numbers can hold.
const LEAST_SPREAD: f64 = 1e-9;

/// What a network tells of an image.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// Of the camera.
    pub pose: PoseQ,
    /// Variances of the distributions that tell x and y (m²) and the heading (rad²), if there are any.
    pub variance: Option<[f64; 3]>,
    /// Distance to each landmark, seen from above.
    pub landmarks_m: Vec<f64>,
}

impl Estimate {
    /// Of the robot below the camera. Errors were found to grow with the variances that come with them, not with their roots.
    pub fn fix(&self) -> Fix {
        let pose = self.pose.planar();
        let spread = self.variance.unwrap_or([1.0; 3]).map(|variance| variance.max(LEAST_SPREAD));
        Fix { pose: [pose.x_m, pose.y_m, pose.heading_rad], spread }
    }
}

impl PoseHead {
    /// For poses like these; nothing for none.
    pub fn of(
        poses: &[PoseQ],
        landmarks_m: &[[f64; 2]],
        orientation: Orientation,
        bins: usize,
    ) -> Option<PoseHead> {
        let first = poses.first()?;
        let range = |axis: usize| {
            let values = poses.iter().map(|pose| pose.position_m[axis]);
            let low = values.clone().fold(f64::INFINITY, f64::min);
            let high = values.fold(f64::NEG_INFINITY, f64::max);
            // A range of nothing could not be divided by.
            if high - low > 1e-6 { [low, high] } else { [low - 0.5, low + 0.5] }
        };
        let heights = poses.iter().map(|pose| pose.position_m[2]).sum::<f64>();
        let back = about_z(-first.planar().heading_rad);
        Some(PoseHead {
            orientation,
            bins,
            x_m: range(0),
            y_m: range(1),
            mount: PoseQ {
                position_m: [0.0, 0.0, heights / poses.len() as f64],
                quaternion: back.after(first.quaternion),
            },
            landmarks_m: landmarks_m.to_vec(),
        })
    }

    /// How many numbers a network tells for them.
    pub fn numbers(&self) -> usize {
        self.outputs() * self.bins
    }

    /// How many outputs there are.
    pub fn outputs(&self) -> usize {
        self.columns(Part::Landmarks).end
    }

    /// Which of the outputs are a part's.
    pub fn columns(&self, part: Part) -> std::ops::Range<usize> {
        let turned = match self.orientation {
            Orientation::Heading => 4,
            Orientation::Quaternion => 6,
        };
        match part {
            Part::Position => 0..2,
            Part::Orientation => 2..turned,
            Part::Landmarks => turned..turned + self.landmarks_m.len(),
        }
    }

    /// What a network should tell of an image from `pose`.
    pub fn encode(&self, pose: &PoseQ) -> Vec<f32> {
        let [x, y, _] = pose.position_m;
        let mut outputs = vec![shrunk(x, self.x_m), shrunk(y, self.y_m)];
        match self.orientation {
            Orientation::Heading => {
                let (sin, cos) = libm::sincos(pose.planar().heading_rad);
                outputs.extend([sin, cos]);
            }
            Orientation::Quaternion => {
                let q = pose.quaternion.unit();
                let Quaternion { w, x, y, z } = if q.w < 0.0 { q.negated() } else { q };
                outputs.extend([w, x, y, z]);
            }
        }
        let away = |&[to_x, to_y]: &[f64; 2]| shrunk(libm::hypot(to_x - x, to_y - y), self.reach_m());
        outputs.extend(self.landmarks_m.iter().map(away));
        outputs.into_iter().map(|value| value as f32).collect()
    }

    /// What a network's numbers say; missing ones count as 0.
    pub fn decode(&self, numbers: &[f32]) -> Estimate {
        let moments = match self.bins {
            1 => numbers.iter().map(|&number| [number, 0.0]).collect(),
            bins => moments_of(numbers, bins),
        };
        let moment = |column: usize, which: usize| moments.get(column).map_or(0.0, |it| f64::from(it[which]));
        let output = |column: usize| moment(column, 0);
        let quaternion = match self.orientation {
            Orientation::Heading => about_z(libm::atan2(output(2), output(3))).after(self.mount.quaternion),
            Orientation::Quaternion => {
                Quaternion { w: output(2), x: output(3), y: output(4), z: output(5) }.unit()
            }
        };
        let position_m = [grown(output(0), self.x_m), grown(output(1), self.y_m), self.mount.position_m[2]];
        let distance = |column: usize| grown(output(column), self.reach_m());
        let square = |[low, high]: [f64; 2]| (high - low) * (high - low) / 4.0;
        Estimate {
            pose: PoseQ { position_m, quaternion },
            variance: (self.bins > 1).then(|| {
                [moment(0, 1) * square(self.x_m), moment(1, 1) * square(self.y_m), self.of_heading(&moments)]
            }),
            landmarks_m: self.columns(Part::Landmarks).map(distance).collect(),
        }
    }

    /// The variance of the heading, rad², to first order in those of the outputs, and that of no idea at most.
    fn of_heading(&self, moments: &[[f32; 2]]) -> f64 {
        // Of a turn by δ each output changes by its slope times δ.
        let [a, b, c, d] = std::array::from_fn(|k| moments.get(2 + k).map_or(0.0, |it| f64::from(it[0])));
        let slopes = match self.orientation {
            Orientation::Heading => [b, -a, 0.0, 0.0],
            Orientation::Quaternion => [-d / 2.0, -c / 2.0, b / 2.0, a / 2.0],
        };
        let length = slopes.iter().map(|slope| slope * slope).sum::<f64>();
        let variances = moments.iter().skip(2).map(|it| f64::from(it[1]));
        let spread =
            slopes.iter().zip(variances).map(|(slope, variance)| slope * slope * variance).sum::<f64>();
        // Of a heading anywhere.
        let most = PI * PI / 3.0;
        if length > 0.0 { (spread / (length * length)).min(most) } else { most }
    }

    /// Whether all its numbers are of use.
    pub(crate) fn is_sound(&self) -> bool {
        let rises = |[low, high]: [f64; 2]| low.is_finite() && high.is_finite() && high > low;
        let q = self.mount.quaternion;
        rises(self.x_m)
            && rises(self.y_m)
            && (q.dot(q) - 1.0).abs() < 1e-6
            && self.mount.position_m.iter().all(|value| value.is_finite())
            && self.landmarks_m.iter().flatten().all(|value| value.is_finite())
            && self.landmarks_m.len() <= 1024
            && BINS.contains(&self.bins)
    }

    /// Distances from nothing to the diagonal of the range.
    fn reach_m(&self) -> [f64; 2] {
        [0.0, libm::hypot(self.x_m[1] - self.x_m[0], self.y_m[1] - self.y_m[0])]
    }
}

fn shrunk(value: f64, [low, high]: [f64; 2]) -> f64 {
    2.0 * (value - low) / (high - low) - 1.0
}

fn grown(value: f64, [low, high]: [f64; 2]) -> f64 {
    low + (value + 1.0) / 2.0 * (high - low)
}

fn about_z(angle_rad: f64) -> Quaternion {
    let (sin, cos) = libm::sincos(angle_rad / 2.0);
    Quaternion { w: cos, x: 0.0, y: 0.0, z: sin }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::CameraConfig;
    use crate::pose::Pose;

    fn poses() -> Vec<PoseQ> {
        let camera = CameraConfig { tilt_rad: 0.3, ..CameraConfig::default() };
        let pose = |i: i32| {
            let turn = f64::from(i);
            camera.pose(Pose {
                x_m: libm::sin(turn),
                y_m: 2.0 * libm::cos(1.3 * turn),
                heading_rad: 0.7 * turn,
            })
        };
        (0..40).map(pose).collect()
    }

    #[test]
    fn what_is_encoded_is_decoded() {
        for orientation in [Orientation::Heading, Orientation::Quaternion] {
            let head = PoseHead::of(&poses(), &[[1.0, -1.0], [0.0, 3.0]], orientation, 1).unwrap();
            assert!(head.is_sound());
            for pose in poses() {
                let outputs = head.encode(&pose);
                assert_eq!(outputs.len(), head.outputs());
                assert!(
                    outputs[..head.columns(Part::Landmarks).start].iter().all(|value| value.abs() <= 1.0)
                );
                let Estimate { pose: found, landmarks_m, variance } = head.decode(&outputs);
                assert_eq!(variance, None);
                assert!(found.quaternion.angle_rad(pose.quaternion) < 1e-6, "{orientation:?}");
                for axis in 0..3 {
                    assert!((found.position_m[axis] - pose.position_m[axis]).abs() < 1e-6);
                }
                let away = libm::hypot(pose.position_m[0] - 1.0, pose.position_m[1] + 1.0);
                assert!((landmarks_m[0] - away).abs() < 1e-5, "{landmarks_m:?} {away}");
            }
        }
    }

    /// Logits of narrow Gaussians around what an image means: the variances are theirs, and of the heading that of the turn
    /// by which the outputs are off.
    #[test]
    fn variances_are_those_of_the_distributions_told() {
        for (orientation, of_heading) in [(Orientation::Heading, 1.0_f64), (Orientation::Quaternion, 4.0)] {
            let bins = 64;
            let head = PoseHead::of(&poses(), &[[1.0, -1.0]], orientation, bins).unwrap();
            let (deviation, width) = (0.1_f64, 2.2 / (bins - 1) as f64);
            for pose in poses().into_iter().take(9) {
                let logits: Vec<f32> = head
                    .encode(&pose)
                    .into_iter()
                    .flat_map(|mean| {
                        let away = move |bin| (-1.1 + width * f64::from(bin) - f64::from(mean)) / deviation;
                        (0..bins as i32).map(move |bin| (-0.5 * away(bin) * away(bin)) as f32)
                    })
                    .collect();
                let told = head.decode(&logits);
                let half = |[low, high]: [f64; 2]| (high - low) / 2.0;
                let wanted = [half(head.x_m), half(head.y_m), of_heading.sqrt()];
                for (found, wanted) in told.variance.unwrap().into_iter().zip(wanted) {
                    let ratio = found / (deviation * wanted).powi(2);
                    assert!((0.6..1.05).contains(&ratio), "{orientation:?} {ratio}");
                }
                let Fix { pose: fix, spread } = told.fix();
                assert_eq!((fix[2], spread), (told.pose.planar().heading_rad, told.variance.unwrap()));
            }
        }
    }

    /// Equal logits for everything: a heading anywhere, never a sure one.
    #[test]
    fn who_has_no_idea_of_the_heading_says_so() {
        for orientation in [Orientation::Heading, Orientation::Quaternion] {
            let head = PoseHead::of(&poses(), &[], orientation, 8).unwrap();
            let told = head.decode(&vec![0.0; head.numbers()]);
            assert!((told.variance.unwrap()[2] - PI * PI / 3.0).abs() < 1e-9, "{orientation:?}");
        }
    }

    /// By hand: of −1..3 m, 0 m is a quarter of the way, so −0.5; heading 90° is (1, 0).
    #[test]
    fn outputs_are_between_minus_one_and_one() {
        let camera = CameraConfig::default();
        let at = |x_m: f64, y_m: f64, heading_rad: f64| camera.pose(Pose { x_m, y_m, heading_rad });
        let head =
            PoseHead::of(&[at(-1.0, 0.0, 0.0), at(3.0, 3.0, 1.0)], &[[0.0, 5.5]], Orientation::Heading, 1);
        let outputs = head.unwrap().encode(&at(0.0, 3.0, PI / 2.0));
        for (found, wanted) in outputs.iter().zip([-0.5, 1.0, 1.0, 0.0, 0.0]) {
            assert!((found - wanted).abs() < 1e-6, "{outputs:?}");
        }
        assert_eq!(PoseHead::of(&[], &[], Orientation::Heading, 1), None);
    }
}
