//! How far estimated poses are from the true ones.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::dataset::Tags;
use crate::pose::{PoseQ, Quaternion};

/// The components of the paper's table; q1 to q4 are w, x, y and z.
pub const COMPONENTS: [&str; 6] = ["x", "y", "q1", "q2", "q3", "q4"];

/// Between which values each component lies: what its error is a percentage of.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ranges {
    pub low: [f64; 6],
    pub high: [f64; 6],
}

/// The errors of a set of estimates.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Localisation {
    pub count: usize,
    /// What `percent` is taken of.
    pub ranges: Ranges,
    /// Mean of the absolute error, % of the range, of each of [`COMPONENTS`]; nothing where the range is empty.
    pub percent: [Option<f64>; 6],
    pub translation: Cdf,
    /// Angles, rad.
    pub rotation: Cdf,
    /// The share of estimates within 5 cm and 5° at once.
    pub recall_5cm_5deg: f64,
}

/// A frame's true pose and what was told of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    pub tags: Tags,
    pub truth: PoseQ,
    pub estimate: PoseQ,
}

/// The paper's table, overall and for each lighting and kind of path.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evaluation {
    pub all: Localisation,
    pub by_lighting: BTreeMap<String, Localisation>,
    pub by_trajectory: BTreeMap<String, Localisation>,
}

/// Errors in rising order: their empirical distribution.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cdf {
    errors: Vec<f64>,
}

impl Ranges {
    /// From the least to the greatest value in some poses, of quaternions with w ≥ 0; nothing for none.
    pub fn of<'a>(poses: impl IntoIterator<Item = &'a PoseQ>) -> Option<Ranges> {
        let mut values = poses.into_iter().map(|pose| components(pose, upper(pose.quaternion)));
        let first = values.next()?;
        let grow = |ranges: Ranges, value: [f64; 6]| Ranges {
            low: std::array::from_fn(|i| ranges.low[i].min(value[i])),
            high: std::array::from_fn(|i| ranges.high[i].max(value[i])),
        };
        Some(values.fold(Ranges { low: first, high: first }, grow))
    }
}

/// The errors of pairs of true and estimated poses; nothing for none, or if an estimate is not finite. Estimated
/// quaternions are brought to length 1, and to the sign that is nearer to the truth. Translation counts in space, rotation
/// is 2·acos|⟨q, q̂⟩|.
pub fn measure(pairs: &[(PoseQ, PoseQ)], ranges: &Ranges) -> Option<Localisation> {
    let errors: Vec<([f64; 6], f64, f64)> = pairs.iter().map(error).collect();
    let finite = |(parts, ..): &([f64; 6], f64, f64)| parts.iter().all(|part| part.is_finite());
    if errors.is_empty() || !errors.iter().all(finite) {
        return None;
    }
    let count = errors.len() as f64;
    let percent = |component: usize| {
        let range = ranges.high[component] - ranges.low[component];
        let mean = errors.iter().map(|(parts, ..)| parts[component]).sum::<f64>() / count;
        (range > 1e-9).then(|| 100.0 * mean / range)
    };
    let close =
        |(_, away_m, angle_rad): &&([f64; 6], f64, f64)| *away_m <= 0.05 && *angle_rad <= 5f64.to_radians();
    Some(Localisation {
        count: errors.len(),
        ranges: *ranges,
        percent: std::array::from_fn(percent),
        translation: Cdf::of(errors.iter().map(|&(_, away_m, _)| away_m)),
        rotation: Cdf::of(errors.iter().map(|&(.., angle_rad)| angle_rad)),
        recall_5cm_5deg: errors.iter().filter(close).count() as f64 / count,
    })
}

/// The errors of answers, in percent of the ranges of all true poses among them; nothing for none, or if an estimate is
/// not finite.
pub fn evaluate(answers: &[Answer]) -> Option<Evaluation> {
    let ranges = Ranges::of(answers.iter().map(|answer| &answer.truth))?;
    let pairs: Vec<(PoseQ, PoseQ)> = answers.iter().map(|answer| (answer.truth, answer.estimate)).collect();
    let grouped = |name: fn(&Tags) -> &String| {
        let named = answers.iter().map(|answer| (name(&answer.tags).clone(), answer.truth, answer.estimate));
        let groups = measure_groups(named, &ranges).into_iter();
        groups.filter_map(|(name, found)| Some((name, found?))).collect()
    };
    Some(Evaluation {
        all: measure(&pairs, &ranges)?,
        by_lighting: grouped(|tags| &tags.lighting),
        by_trajectory: grouped(|tags| &tags.trajectory),
    })
}

/// [`measure`] for each group, as a lighting or a kind of trajectory, against the same ranges.
pub fn measure_groups<Group: Ord>(
    answers: impl IntoIterator<Item = (Group, PoseQ, PoseQ)>,
    ranges: &Ranges,
) -> BTreeMap<Group, Option<Localisation>> {
    let mut groups: BTreeMap<Group, Vec<(PoseQ, PoseQ)>> = BTreeMap::new();
    for (group, truth, estimate) in answers {
        groups.entry(group).or_default().push((truth, estimate));
    }
    groups.into_iter().map(|(group, pairs)| (group, measure(&pairs, ranges))).collect()
}

impl Cdf {
    fn of(errors: impl Iterator<Item = f64>) -> Cdf {
        let mut errors: Vec<f64> = errors.collect();
        errors.sort_by(f64::total_cmp);
        Cdf { errors }
    }

    /// In rising order.
    pub fn errors(&self) -> &[f64] {
        &self.errors
    }

    /// The error that a share of the estimates, 0..=1, does not exceed: linear between order statistics, as NumPy's default.
    pub fn quantile(&self, share: f64) -> f64 {
        let Some(last) = self.errors.len().checked_sub(1) else { return f64::NAN };
        let place = share.clamp(0.0, 1.0) * last as f64;
        let below = place as usize;
        let (a, b) = (self.errors[below], self.errors[(below + 1).min(last)]);
        a + (b - a) * (place - below as f64)
    }

    pub fn median(&self) -> f64 {
        self.quantile(0.5)
    }

    /// The share of estimates whose error is at most this.
    pub fn share_within(&self, error: f64) -> f64 {
        self.errors.partition_point(|&found| found <= error) as f64 / self.errors.len() as f64
    }
}

/// Absolute errors of the components, distance in m, angle in rad.
fn error((truth, estimate): &(PoseQ, PoseQ)) -> ([f64; 6], f64, f64) {
    let true_q = upper(truth.quaternion);
    let q = estimate.quaternion.unit();
    let q = if q.dot(true_q) < 0.0 { q.negated() } else { q };
    let (wanted, found) = (components(truth, true_q), components(estimate, q));
    let away: [f64; 3] = std::array::from_fn(|axis| estimate.position_m[axis] - truth.position_m[axis]);
    let away_m = away.iter().map(|x| x * x).sum::<f64>().sqrt();
    (std::array::from_fn(|i| (found[i] - wanted[i]).abs()), away_m, true_q.angle_rad(q))
}

fn components(pose: &PoseQ, q: Quaternion) -> [f64; 6] {
    [pose.position_m[0], pose.position_m[1], q.w, q.x, q.y, q.z]
}

/// Of length 1, with w ≥ 0.
fn upper(q: Quaternion) -> Quaternion {
    let q = q.unit();
    if q.w < 0.0 { q.negated() } else { q }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pose(x: f64, y: f64, angle: f64) -> PoseQ {
        let (sin, cos) = libm::sincos(angle / 2.0);
        PoseQ { position_m: [x, y, 0.4], quaternion: Quaternion { w: cos, x: 0.0, y: 0.0, z: sin } }
    }

    /// Worked by hand: x of 0..4, one estimate off by 0.04, one by 0.08: 1 % and 2 %, 1.5 % in the mean.
    #[test]
    fn percentages_are_of_the_stated_range() {
        let truths = [pose(0.0, 0.0, 0.0), pose(4.0, 2.0, 3.0)];
        let ranges = Ranges::of(&truths).unwrap();
        assert_eq!((ranges.low[0], ranges.high[0], ranges.high[1]), (0.0, 4.0, 2.0));
        let pairs = [(truths[0], pose(0.04, 0.0, 0.1)), (truths[1], pose(4.08, 2.0, 3.0))];
        let found = measure(&pairs, &ranges).unwrap();
        assert!((found.percent[0].unwrap() - 1.5).abs() < 1e-12, "{found:?}");
        assert_eq!(found.percent[1], Some(0.0));
        // No turn about x: no range to take a percentage of.
        assert_eq!(found.percent[3], None);
        assert!((found.rotation.errors()[1] - 0.1).abs() < 1e-12);
        assert!((found.translation.median() - 0.06).abs() < 1e-12);
    }

    #[test]
    fn recall_asks_for_both() {
        let ranges = Ranges::of(&[pose(0.0, 0.0, 0.0), pose(1.0, 1.0, 1.0)]).unwrap();
        let degrees = |angle: f64| angle.to_radians();
        let estimates = [(0.04, 4.0), (0.06, 4.0), (0.04, 6.0), (0.03, -4.9)];
        let pairs = estimates.map(|(x, angle)| (pose(0.0, 0.0, 0.0), pose(x, 0.0, degrees(angle))));
        let found = measure(&pairs, &ranges).unwrap();
        assert_eq!(found.recall_5cm_5deg, 0.5);
        assert_eq!(found.translation.share_within(0.05), 0.75);
        assert_eq!(found.rotation.share_within(degrees(4.95)), 0.75);
    }

    #[test]
    fn a_quaternion_and_its_negative_are_one_rotation() {
        let truth = pose(0.0, 0.0, 3.1);
        let ranges = Ranges::of(&[truth, pose(1.0, 1.0, 0.0)]).unwrap();
        let turned = PoseQ { quaternion: truth.quaternion.negated(), ..truth };
        let found = measure(&[(truth, turned), (turned, truth)], &ranges).unwrap();
        assert_eq!(found.percent[2..], [Some(0.0), None, None, Some(0.0)]);
        assert!(found.rotation.quantile(1.0) < 1e-12);
    }

    #[test]
    fn groups_are_told_apart_and_what_is_not_finite_is_not_measured() {
        let ranges = Ranges::of(&[pose(0.0, 0.0, 0.0), pose(1.0, 1.0, 1.0)]).unwrap();
        let (here, there) = (pose(0.0, 0.0, 0.0), pose(0.3, 0.0, 0.0));
        let answers = [("evening", here, there), ("morning", here, here), ("evening", here, here)];
        let found = measure_groups(answers, &ranges);
        assert_eq!(found.keys().collect::<Vec<_>>(), [&"evening", &"morning"]);
        assert_eq!(
            found["evening"].as_ref().map(|found| (found.count, found.translation.median())),
            Some((2, 0.15))
        );
        assert_eq!(measure(&[(here, pose(f64::NAN, 0.0, 0.0))], &ranges), None);
        assert_eq!(measure(&[], &ranges), None);
    }
}
