//! Outlines of agents and obstacles: signed distances, nearest points, crossings.
//!
//! Everything is told relative to the position of the outline's owner. Inside is negative; a segment has no inside.

use mpgx_lang::plan::Solid;

use crate::maths::{Vec2, add, clamp, cross, distance, dot, norm, scale, subtract};

/// An outline, relative to its owner's position. An agent is a disc.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Outline {
    Disc(f64),
    Segment(Vec2),
    Polygon(Vec<Vec2>),
}

/// The point of an outline that is nearest to another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Nearest {
    pub point: Vec2,
    /// Distance from the outline; negative inside.
    pub distance: f64,
    /// Away from the inside, of length 1. Of a segment: towards the other point.
    pub outward: Vec2,
}

/// Where a path first meets an outline from outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Crossing {
    /// Share of the path before it, 0 to 1.
    pub share: f64,
    pub point: Vec2,
    /// Towards the side that the path comes from, of length 1.
    pub back: Vec2,
}

impl Outline {
    pub fn new(solid: &Solid) -> Outline {
        match solid {
            Solid::Disc { radius_m } => Outline::Disc(*radius_m),
            Solid::Segment { to_m } => Outline::Segment((*to_m).into()),
            Solid::Polygon { corners_m } => {
                Outline::Polygon(corners_m.iter().map(|&corner| corner.into()).collect())
            }
        }
    }

    /// Distance of `p` from the outline, m; negative inside.
    pub fn distance(&self, p: Vec2) -> f64 {
        match self {
            Outline::Disc(radius) => norm(p) - radius,
            _ => self.nearest(p).distance,
        }
    }

    pub fn nearest(&self, p: Vec2) -> Nearest {
        match self {
            Outline::Disc(radius) => {
                let outward = direction(p, [1.0, 0.0]);
                Nearest { point: scale(outward, *radius), distance: norm(p) - radius, outward }
            }
            Outline::Segment(end) => {
                let point = on_segment([0.0; 2], *end, p);
                let outward = direction(subtract(p, point), left_of(*end));
                Nearest { point, distance: distance(p, point), outward }
            }
            Outline::Polygon(corners) => nearest_of_polygon(corners, p),
        }
    }

    /// Where the straight path `from` → `to` first meets the outline, if it begins outside.
    pub fn crossing(&self, from: Vec2, to: Vec2) -> Option<Crossing> {
        match self {
            Outline::Disc(radius) => into_disc(*radius, from, to),
            Outline::Segment(end) => through_segment([0.0; 2], *end, from, to),
            Outline::Polygon(corners) if !is_inside(corners, from) => edges(corners)
                .filter_map(|[a, b]| through_segment(a, b, from, to))
                .min_by(|a, b| a.share.total_cmp(&b.share)),
            Outline::Polygon(_) => None,
        }
    }
}

/// The edges of a polygon.
fn edges(corners: &[Vec2]) -> impl Iterator<Item = [Vec2; 2]> {
    let next = corners.iter().cycle().skip(1);
    corners.iter().zip(next).map(|(a, b)| [*a, *b])
}

/// `a` over its length; `otherwise` if it has none.
fn direction(a: Vec2, otherwise: Vec2) -> Vec2 {
    let length = norm(a);
    if length > 0.0 { scale(a, 1.0 / length) } else { otherwise }
}

/// The direction to the left of `along`.
fn left_of([x, y]: Vec2) -> Vec2 {
    direction([-y, x], [0.0, 1.0])
}

/// The point of the segment `a` → `b` nearest to `p`.
fn on_segment(a: Vec2, b: Vec2, p: Vec2) -> Vec2 {
    let along = subtract(b, a);
    let square = dot(along, along);
    let share = if square > 0.0 { clamp(dot(subtract(p, a), along) / square, 0.0, 1.0) } else { 0.0 };
    if share == 1.0 { b } else { add(a, scale(along, share)) }
}

fn nearest_of_polygon(corners: &[Vec2], p: Vec2) -> Nearest {
    let mut nearest = [[0.0; 2]; 2];
    let (mut point, mut least) = ([f64::NAN; 2], f64::INFINITY);
    for edge in edges(corners) {
        let candidate = on_segment(edge[0], edge[1], p);
        let away = distance(p, candidate);
        if away < least {
            (nearest, point, least) = (edge, candidate, away);
        }
    }
    let inside = is_inside(corners, p);
    let way = if inside { subtract(point, p) } else { subtract(p, point) };
    // On the outline itself: away from the inside of the edge.
    let left = left_of(subtract(nearest[1], nearest[0]));
    let outward = direction(way, if turns_left(corners) { scale(left, -1.0) } else { left });
    Nearest { point, distance: if inside { -least } else { least }, outward }
}

/// Whether the corners go round anticlockwise (the shoelace formula).
fn turns_left(corners: &[Vec2]) -> bool {
    edges(corners).map(|[a, b]| cross(a, b)).sum::<f64>() > 0.0
}

/// Whether a ray to the right of `p` leaves the polygon an odd number of times.
fn is_inside(corners: &[Vec2], p: Vec2) -> bool {
    edges(corners).fold(false, |inside, [a, b]| {
        let upwards = b[1] > p[1];
        let passes = (a[1] > p[1]) != upwards && (cross(subtract(b, a), subtract(p, a)) > 0.0) == upwards;
        inside != passes
    })
}

fn through_segment(a: Vec2, b: Vec2, from: Vec2, to: Vec2) -> Option<Crossing> {
    let (along, way) = (subtract(b, a), subtract(to, from));
    let side = |p: Vec2| cross(along, subtract(p, a));
    let (before, after) = (side(from), side(to));
    if before == 0.0 || (after != 0.0 && (before > 0.0) == (after > 0.0)) {
        return None;
    }
    let share = before / (before - after);
    let point = add(from, scale(way, share));
    let place = dot(subtract(point, a), along);
    if place < 0.0 || place > dot(along, along) {
        return None;
    }
    let back = scale(left_of(along), if before > 0.0 { 1.0 } else { -1.0 });
    Some(Crossing { share, point, back })
}

/// |from + share · way| = radius, the lesser root.
fn into_disc(radius: f64, from: Vec2, to: Vec2) -> Option<Crossing> {
    let way = subtract(to, from);
    let (a, b, c) = (dot(way, way), dot(from, way), dot(from, from) - radius * radius);
    let root = b * b - a * c;
    if c < 0.0 || b >= 0.0 || root <= 0.0 {
        return None;
    }
    let share = (-b - root.sqrt()) / a;
    let point = add(from, scale(way, share));
    (share <= 1.0).then(|| Crossing { share, point, back: direction(point, [1.0, 0.0]) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A square of 2 m without its upper right quarter, about the origin.
    fn corner() -> Outline {
        let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 0.0], [0.0, 0.0], [0.0, 1.0], [-1.0, 1.0]];
        Outline::Polygon(corners.into())
    }

    #[test]
    fn distances_are_those_worked_out_by_hand() {
        let disc = Outline::Disc(0.5);
        let wall = Outline::Segment([3.0, 4.0]);
        let notched = corner();
        for (outline, p, expected) in [
            (&disc, [3.0, 4.0], 4.5),
            (&disc, [0.0, 0.3], -0.2),
            (&disc, [0.0, 0.0], -0.5),
            (&wall, [1.5, 2.0], 0.0),
            (&wall, [1.5 - 4.0 / 5.0, 2.0 + 3.0 / 5.0], 1.0),
            (&wall, [-3.0, -4.0], 5.0),
            (&wall, [3.0, 6.0], 2.0),
            (&notched, [-0.5, -0.75], -0.25),
            (&notched, [0.25, 0.5], 0.25),
            (&notched, [0.3, 0.4], 0.3),
            (&notched, [-0.1, -0.1], -(0.02f64.sqrt())),
            (&notched, [2.0, 1.0], 2f64.sqrt()),
            (&notched, [0.5, 0.0], 0.0),
        ] {
            let found = outline.distance(p);
            assert!((found - expected).abs() < 1e-15, "{outline:?} at {p:?}: {found}, not {expected}");
        }
    }

    /// Outside the way leads away from the outline; inside, and on it, it leads out.
    #[test]
    fn the_way_out_is_the_shortest() {
        let clockwise = Outline::Polygon(vec![[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]]);
        for (outline, p, point, outward) in [
            (Outline::Disc(0.5), [0.0, 0.25], [0.0, 0.5], [0.0, 1.0]),
            (Outline::Disc(0.5), [0.0, 0.0], [0.5, 0.0], [1.0, 0.0]),
            (Outline::Segment([2.0, 0.0]), [1.0, -0.5], [1.0, 0.0], [0.0, -1.0]),
            (Outline::Segment([2.0, 0.0]), [1.0, 0.0], [1.0, 0.0], [0.0, 1.0]),
            (Outline::Segment([0.0, 0.0]), [0.0, 3.0], [0.0, 0.0], [0.0, 1.0]),
            (corner(), [-0.5, -0.75], [-0.5, -1.0], [0.0, -1.0]),
            (corner(), [0.5, 0.25], [0.5, 0.0], [0.0, 1.0]),
            (corner(), [0.5, 0.0], [0.5, 0.0], [0.0, 1.0]),
            (clockwise.clone(), [0.5, 0.0], [0.5, 0.0], [0.0, -1.0]),
            (clockwise, [0.5, 0.125], [0.5, 0.0], [0.0, -1.0]),
        ] {
            let found = outline.nearest(p);
            assert_eq!((found.point, found.outward), (point, outward), "{outline:?} at {p:?}");
        }
    }

    #[test]
    fn a_path_meets_the_first_thing_in_its_way() {
        let met =
            |outline: &Outline, from, to| outline.crossing(from, to).map(|it| (it.share, it.point, it.back));
        let wall = Outline::Segment([0.0, 1.0]);
        assert_eq!(met(&wall, [-1.0, 0.5], [3.0, 0.5]), Some((0.25, [0.0, 0.5], [-1.0, 0.0])));
        assert_eq!(met(&wall, [1.0, 0.5], [-1.0, 0.5]), Some((0.5, [0.0, 0.5], [1.0, 0.0])));
        assert_eq!(met(&wall, [1.0, 0.5], [0.0, 0.5]), Some((1.0, [0.0, 0.5], [1.0, 0.0])), "it ends on it");
        assert_eq!(
            met(&wall, [-1.0, 0.5], [0.0, 0.5]),
            Some((1.0, [0.0, 0.5], [-1.0, 0.0])),
            "on both sides"
        );
        assert_eq!(met(&wall, [-1.0, 1.5], [1.0, 1.5]), None, "past its end");
        assert_eq!(met(&wall, [-1.0, 0.5], [-0.5, 0.5]), None, "not far enough");
        let square = corner();
        assert_eq!(met(&square, [-2.0, 0.5], [2.0, 0.5]), Some((0.25, [-1.0, 0.5], [-1.0, 0.0])));
        assert_eq!(met(&square, [0.5, 0.5], [-1.5, 0.5]), Some((0.25, [0.0, 0.5], [1.0, 0.0])), "the notch");
        assert_eq!(met(&square, [-0.5, 0.5], [-2.0, 0.5]), None, "from inside");
        let disc = Outline::Disc(0.5);
        assert_eq!(met(&disc, [-1.5, 0.0], [0.5, 0.0]), Some((0.5, [-0.5, 0.0], [-1.0, 0.0])));
        assert_eq!(met(&disc, [-1.5, 0.0], [-0.75, 0.0]), None);
        assert_eq!(met(&disc, [-1.5, 0.6], [1.5, 0.6]), None);
        assert_eq!(met(&disc, [0.0, 0.0], [2.0, 0.0]), None, "from inside");
    }

    /// A star-shaped polygon about the origin: it does not cut itself, and whether something is inside is told
    /// by its direction and length alone.
    fn star(lengths: &[f64]) -> Vec<Vec2> {
        let corner = |(k, r): (usize, &f64)| {
            let angle = std::f64::consts::TAU * k as f64 / lengths.len() as f64;
            [r * angle.cos(), r * angle.sin()]
        };
        lengths.iter().enumerate().map(corner).collect()
    }

    proptest! {
        #![proptest_config(crate::sample::cases(300))]

        /// Against points sampled along the outline, closer than the mean of their spacing.
        #[test]
        fn distances_are_those_of_sampled_outlines(
            lengths in prop::collection::vec(0.2..2.0f64, 3..9), p in [-3.0..3.0, -3.0..3.0], backwards: bool,
        ) {
            let mut corners = star(&lengths);
            let inside = edges(&corners).any(|[a, b]| {
                // In the triangle of the edge and the origin.
                let [u, v, w] = [cross(a, p), cross(p, b), cross(subtract(b, a), subtract(p, a))];
                u >= 0.0 && v >= 0.0 && w >= 0.0
            });
            let samples = 2000;
            let (mut least, mut spacing) = (f64::INFINITY, 0.0);
            for [a, b] in edges(&corners) {
                spacing = f64::max(spacing, distance(a, b) / f64::from(samples));
                for k in 0..=samples {
                    let share = f64::from(k) / f64::from(samples);
                    least = least.min(distance(p, add(a, scale(subtract(b, a), share))));
                }
            }
            if backwards {
                corners.reverse();
            }
            let found = Outline::Polygon(corners).nearest(p);
            prop_assert!((found.distance.abs() - least).abs() <= spacing, "{found:?}, sampled {least}");
            prop_assert_eq!(found.distance < 0.0, inside);
            let back = add(found.point, scale(found.outward, found.distance));
            prop_assert!(distance(back, p) < 1e-12, "{:?} leads to {:?}", found, back);
        }

        /// Where a path first meets an outline, against small steps along it.
        #[test]
        fn crossings_are_those_of_small_steps(
            lengths in prop::collection::vec(0.2..2.0f64, 3..9),
            from in [-3.0..3.0, -3.0..3.0], to in [-3.0..3.0, -3.0..3.0], disc: bool,
        ) {
            let outline = if disc { Outline::Disc(lengths[0]) } else { Outline::Polygon(star(&lengths)) };
            prop_assume!(outline.distance(from) > 0.0);
            let steps = 2000;
            let at = |k: i32| add(from, scale(subtract(to, from), f64::from(k) / f64::from(steps)));
            let entered = (0..=steps).find(|&k| outline.distance(at(k)) < 0.0);
            match (outline.crossing(from, to), entered) {
                (Some(found), Some(k)) => {
                    let share = f64::from(k) / f64::from(steps);
                    prop_assert!(found.share <= share && share - found.share < 2.0 / f64::from(steps) + 1e-12
                        || outline.distance(add(found.point, scale(found.back, -1e-4))) < 0.0);
                    prop_assert!(outline.distance(found.point).abs() < 1e-12);
                    prop_assert!(dot(found.back, subtract(to, from)) <= 0.0);
                }
                (None, None) => {}
                // It may touch a corner between two steps.
                (Some(found), None) => prop_assert!(outline.distance(found.point).abs() < 1e-12),
                (None, Some(_)) => prop_assert!(false, "it was entered"),
            }
        }
    }
}
