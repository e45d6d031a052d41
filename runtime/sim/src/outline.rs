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
