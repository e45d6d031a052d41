//! The point of an intersection of half-planes that is nearest to another.

use crate::maths::{Vec2, add, clamp_axes, cross, distance, dot, greater, scale};

/// The v with `inward` · v ≥ `least`; `inward` has length 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct HalfPlane {
    pub inward: Vec2,
    pub least: f64,
}

/// What rounding may take from a half-plane.
const TOLERANCE: f64 = 1e-9;
/// Halvings of the least common violation.
const HALVINGS: usize = 40;

impl HalfPlane {
    pub fn holds(&self, v: Vec2) -> bool {
        dot(self.inward, v) >= self.least - TOLERANCE
    }

    /// Whether a velocity within limits on each axis can be outside.
    pub fn can_fail(&self, (low, high): (f64, f64)) -> bool {
        let worst: f64 = self.inward.iter().map(|part| -greater(-part * low, -part * high)).sum();
        worst < self.least
    }

    /// The point of its edge that is nearest to `v`.
    fn onto(&self, v: Vec2) -> Vec2 {
        add(v, scale(self.inward, self.least - dot(self.inward, v)))
    }

    /// Where its edge meets that of another; `None` if they are parallel.
    fn meets(&self, other: &HalfPlane) -> Option<Vec2> {
        let det = cross(self.inward, other.inward);
        (det.abs() > TOLERANCE).then(|| {
            let [a, b] = [self.inward, other.inward];
            [(self.least * b[1] - other.least * a[1]) / det, (a[0] * other.least - b[0] * self.least) / det]
        })
    }
}

/// The point of the half-planes within limits on each axis that is nearest to `asked`. If they have no point in common,
/// all are moved out by the least amount that gives them one.
pub(super) fn nearest_within(asked: Vec2, planes: &[HalfPlane], limits: (f64, f64)) -> Vec2 {
    let eased = |slack: f64| {
        let mut eased: Vec<HalfPlane> = planes.to_vec();
        eased.iter_mut().for_each(|plane| plane.least -= slack);
        nearest(asked, &eased, limits)
    };
    if let Some(found) = eased(0.0) {
        return found;
    }
    let worst = planes.iter().map(|plane| plane.least - dot(plane.inward, clamp_axes([0.0; 2], limits)));
    let (mut low, mut high) = (0.0, worst.fold(0.0, greater) + TOLERANCE);
    let mut best = clamp_axes([0.0; 2], limits);
    for _ in 0..HALVINGS {
        let slack = (low + high) / 2.0;
        match eased(slack) {
            Some(found) => (best, high) = (found, slack),
            None => low = slack,
        }
    }
    best
}

/// Such a point is `asked` itself, its foot on an edge, or a corner.
fn nearest(asked: Vec2, planes: &[HalfPlane], (low, high): (f64, f64)) -> Option<Vec2> {
    let limits = [([1.0, 0.0], low), ([0.0, 1.0], low), ([-1.0, 0.0], -high), ([0.0, -1.0], -high)];
    let limits = limits.map(|(inward, least)| HalfPlane { inward, least });
    let all: Vec<HalfPlane> = planes.iter().copied().chain(limits).collect();
    let feet = all.iter().map(|plane| plane.onto(asked));
    let pairs = all.iter().enumerate().flat_map(|(k, a)| all[k + 1..].iter().map(move |b| (a, b)));
    let corners = pairs.filter_map(|(a, b)| a.meets(b));
    let allowed =
        std::iter::once(asked).chain(feet).chain(corners).filter(|v| all.iter().all(|plane| plane.holds(*v)));
    allowed.min_by(|a, b| distance(*a, asked).total_cmp(&distance(*b, asked)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn plane(x: f64, y: f64, least: f64) -> HalfPlane {
        let length = x.hypot(y);
        HalfPlane { inward: [x / length, y / length], least }
    }

    const LIMITS: (f64, f64) = (-1.0, 1.0);

    #[test]
    fn what_is_allowed_stays() {
        assert_eq!(nearest_within([0.3, -0.2], &[plane(1.0, 0.0, 0.0)], LIMITS), [0.3, -0.2]);
    }

    /// One wall ahead stops what leads into it; a corner of two holds in both.
    #[test]
    fn walls_take_what_leads_into_them() {
        assert_eq!(nearest_within([0.5, 0.4], &[plane(-1.0, 0.0, -0.2)], LIMITS), [0.2, 0.4]);
        let corner = [plane(-1.0, 0.0, -0.2), plane(0.0, -1.0, 0.1)];
        assert_eq!(nearest_within([0.5, 0.4], &corner, LIMITS), [0.2, -0.1]);
    }

    /// x ≥ 0.5 and x ≤ −0.3 miss each other by 0.8: both give way by 0.4.
    #[test]
    fn a_contradiction_is_shared() {
        let found = nearest_within([0.0, 0.2], &[plane(1.0, 0.0, 0.5), plane(-1.0, 0.0, 0.3)], LIMITS);
        assert!(distance(found, [0.1, 0.2]) < 1e-6, "{found:?}");
    }

    prop_compose! {
        fn any_plane()(angle in 0.0..6.3, least in -0.8..0.4) -> HalfPlane {
            plane(f64::cos(angle), f64::sin(angle), least)
        }
    }

    proptest! {
        #![proptest_config(crate::sample::cases(300))]

        /// Against a grid of 0.02: nothing allowed is nearer.
        #[test]
        fn nothing_allowed_is_nearer(
            planes in proptest::collection::vec(any_plane(), 1..5), x in -1.0..1.0, y in -1.0..1.0,
        ) {
            let found = nearest_within([x, y], &planes, LIMITS);
            let grid = (-50..=50).flat_map(|i| (-50..=50).map(move |j| [f64::from(i) / 50.0, f64::from(j) / 50.0]));
            let allowed = grid.filter(|v| planes.iter().all(|plane| dot(plane.inward, *v) >= plane.least));
            let best = allowed.map(|v| distance(v, [x, y])).fold(f64::INFINITY, f64::min);
            if best.is_finite() {
                prop_assert!(planes.iter().all(|plane| plane.holds(found)), "{found:?}");
                prop_assert!(distance(found, [x, y]) <= best + 1e-8);
            }
            prop_assert!(found.iter().all(|axis| axis.abs() <= 1.0 + 1e-8));
        }
    }
}
