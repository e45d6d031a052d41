//! Blocks, upright columns and balls: where rays meet them, and what is seen there.

use crate::colour::{greatest, least};

/// A thing in space. Its skins index the scene's textures.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Solid {
    pub shape: Shape,
    /// m.
    pub centre: [f32; 3],
    pub skins: Skins,
}

#[derive(Clone, Copy, Debug)]
pub(crate) enum Shape {
    /// Upright, its half sizes along its own axes, turned by an angle of this cosine and sine.
    Block {
        half: [f32; 3],
        turn: [f32; 2],
    },
    /// Its axis points up.
    Column {
        radius: f32,
        half_height: f32,
    },
    Ball {
        radius: f32,
    },
}

/// Of a block: the faces across its x, across its y, above and below. Of a column: the side and the ends. Of a ball: the
/// first.
pub(crate) type Skins = [usize; 3];

/// What a ray meets.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spot {
    pub normal: [f32; 3],
    pub skin: usize,
    /// Where on the skin, 0..1.
    pub u: f32,
    pub v: f32,
    /// Length of the skin along u, m.
    pub across: f32,
}

impl Solid {
    pub fn block(centre: [f32; 3], size: [f32; 3], skins: Skins) -> Solid {
        Solid { shape: Shape::Block { half: size.map(|x| x / 2.0), turn: [1.0, 0.0] }, centre, skins }
    }

    pub fn column(centre: [f32; 3], radius: f32, height: f32, skins: Skins) -> Solid {
        Solid { shape: Shape::Column { radius, half_height: height / 2.0 }, centre, skins }
    }

    pub fn ball(centre: [f32; 3], radius: f32, skin: usize) -> Solid {
        Solid { shape: Shape::Ball { radius }, centre, skins: [skin; 3] }
    }

    /// The solid of a model that stands at (x, y), turned by an angle of this cosine and sine.
    pub fn placed(&self, [x, y]: [f32; 2], [cos, sin]: [f32; 2]) -> Solid {
        let [a, b, z] = self.centre;
        let shape = match self.shape {
            Shape::Block { half, turn: [c, s] } => {
                Shape::Block { half, turn: [c * cos - s * sin, s * cos + c * sin] }
            }
            round => round,
        };
        Solid { shape, centre: [x + a * cos - b * sin, y + a * sin + b * cos, z], skins: self.skins }
    }

    /// Radius of a disc on the floor that it stands on, about, m.
    pub fn footprint(&self) -> f32 {
        match self.shape {
            Shape::Block { half: [x, y, _], .. } => (x * y).sqrt(),
            Shape::Column { radius, .. } | Shape::Ball { radius } => radius,
        }
    }

    /// How far a place is from it, m; 0 inside. For a turned block and columns exact.
    pub fn distance(&self, place: [f32; 3]) -> f32 {
        let [x, y, z] = self.offset(place);
        let length = |a: f32, b: f32, c: f32| (a * a + b * b + c * c).sqrt();
        match self.shape {
            Shape::Block { half, .. } => length(
                (x.abs() - half[0]).max(0.0),
                (y.abs() - half[1]).max(0.0),
                (z.abs() - half[2]).max(0.0),
            ),
            Shape::Column { radius, half_height } => {
                length((length(x, y, 0.0) - radius).max(0.0), (z.abs() - half_height).max(0.0), 0.0)
            }
            Shape::Ball { radius } => (length(x, y, z) - radius).max(0.0),
        }
    }

    /// From the centre to a place, in the solid's own axes.
    #[inline]
    pub fn offset(&self, place: [f32; 3]) -> [f32; 3] {
        self.shape.local(std::array::from_fn(|i| place[i] - self.centre[i]))
    }

    /// How often `direction` fits between `origin` and the first place where the ray enters the solid; infinite if it
    /// does not, or if it starts inside.
    pub fn meets(&self, origin: [f32; 3], direction: [f32; 3]) -> f32 {
        self.shape.meets(self.offset(origin), self.shape.local(direction))
    }

    /// What is at a place on the surface.
    #[inline]
    pub fn spot(&self, place: [f32; 3]) -> Spot {
        let [x, y, z] = self.offset(place);
        match self.shape {
            Shape::Block { half: [hx, hy, hz], turn: [cos, sin] } => {
                let out = [x.abs() / hx, y.abs() / hy, z.abs() / hz];
                let v = 0.5 - z / (2.0 * hz);
                if out[2] >= out[0].max(out[1]) {
                    let normal = [0.0, 0.0, z.signum()];
                    let (u, v) = (0.5 + x / (2.0 * hx), 0.5 + y / (2.0 * hy));
                    Spot { normal, skin: self.skins[2], u, v, across: 2.0 * hx }
                } else if out[0] >= out[1] {
                    let normal = [cos * x.signum(), sin * x.signum(), 0.0];
                    let u = 0.5 + x.signum() * y / (2.0 * hy);
                    Spot { normal, skin: self.skins[0], u, v, across: 2.0 * hy }
                } else {
                    let normal = [-sin * y.signum(), cos * y.signum(), 0.0];
                    let u = 0.5 - y.signum() * x / (2.0 * hx);
                    Spot { normal, skin: self.skins[1], u, v, across: 2.0 * hx }
                }
            }
            Shape::Column { radius, half_height } => {
                let (aside, above) = ((x * x + y * y).sqrt() / radius, z.abs() / half_height);
                if above >= aside {
                    let (u, v) = (0.5 + x / (2.0 * radius), 0.5 + y / (2.0 * radius));
                    return Spot {
                        normal: [0.0, 0.0, z.signum()],
                        skin: self.skins[1],
                        u,
                        v,
                        across: 2.0 * radius,
                    };
                }
                let (turn, v) = (around(x, y), 0.5 - z / (2.0 * half_height));
                let normal = [x / radius, y / radius, 0.0];
                Spot { normal, skin: self.skins[0], u: turn, v, across: std::f32::consts::TAU * radius }
            }
            Shape::Ball { radius } => {
                let normal = [x / radius, y / radius, z / radius];
                let across = std::f32::consts::TAU * radius;
                Spot { normal, skin: self.skins[0], u: around(x, y), v: 0.5 - z / (2.0 * radius), across }
            }
        }
    }
}

impl Shape {
    /// A vector in the shape's own axes.
    #[inline]
    pub fn local(&self, [x, y, z]: [f32; 3]) -> [f32; 3] {
        match self {
            Shape::Block { turn: [cos, sin], .. } => [x * cos + y * sin, y * cos - x * sin, z],
            _ => [x, y, z],
        }
    }

    /// How far it reaches from its centre along an axis of length 1 (its support function).
    pub fn reach(&self, axis: [f32; 3]) -> f32 {
        let [x, y, z] = self.local(axis);
        match *self {
            Shape::Block { half, .. } => half[0] * x.abs() + half[1] * y.abs() + half[2] * z.abs(),
            Shape::Column { radius, half_height } => radius * (x * x + y * y).sqrt() + half_height * z.abs(),
            Shape::Ball { radius } => radius,
        }
    }

    /// [`Solid::meets`], for origin and direction in the shape's own axes.
    #[inline]
    pub fn meets(&self, o: [f32; 3], d: [f32; 3]) -> f32 {
        let met = match *self {
            Shape::Block { half, .. } => {
                let slab = |i: usize| {
                    let (a, b) = ((-half[i] - o[i]) / d[i], (half[i] - o[i]) / d[i]);
                    (least(a, b), greatest(a, b))
                };
                let ((x0, x1), (y0, y1), (z0, z1)) = (slab(0), slab(1), slab(2));
                let (enters, leaves) = (greatest(greatest(x0, y0), z0), least(least(x1, y1), z1));
                if enters < leaves { enters } else { f32::INFINITY }
            }
            Shape::Column { radius, half_height } => {
                let (a, b) = (d[0] * d[0] + d[1] * d[1], o[0] * d[0] + o[1] * d[1]);
                let c = o[0] * o[0] + o[1] * o[1] - radius * radius;
                let squared = b * b - a * c;
                // With a direction straight up, a is 0, and only the ends can be met: the ray is inside or outside.
                if !(squared > 0.0 || (a == 0.0 && c < 0.0)) {
                    return f32::INFINITY;
                }
                let root = squared.sqrt();
                let (z0, z1) = ((-half_height - o[2]) / d[2], (half_height - o[2]) / d[2]);
                let (near, far) = if a > 0.0 {
                    ((-b - root) / a, (root - b) / a)
                } else {
                    (f32::NEG_INFINITY, f32::INFINITY)
                };
                let (enters, leaves) = (greatest(near, least(z0, z1)), least(far, greatest(z0, z1)));
                if enters < leaves { enters } else { f32::INFINITY }
            }
            Shape::Ball { radius } => {
                let a = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
                let b = o[0] * d[0] + o[1] * d[1] + o[2] * d[2];
                let c = o[0] * o[0] + o[1] * o[1] + o[2] * o[2] - radius * radius;
                let squared = b * b - a * c;
                if squared > 0.0 { (-b - squared.sqrt()) / a } else { f32::INFINITY }
            }
        };
        if met > 0.0 { met } else { f32::INFINITY }
    }
}

/// The direction of (x, y) in turns, 0..1.
fn around(x: f32, y: f32) -> f32 {
    0.5 + libm::atan2f(y, x) / std::f32::consts::TAU
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAIN: Skins = [0, 1, 2];

    #[test]
    fn rays_meet_what_stands_before_them() {
        let ahead = [1.0, 0.0, 0.0];
        let block = Solid::block([5.0, 0.0, 1.0], [2.0, 2.0, 2.0], PLAIN);
        assert_eq!(block.meets([0.0, 0.0, 1.0], ahead), 4.0);
        assert_eq!(block.meets([0.0, 0.0, 1.0], [2.0, 0.0, 0.0]), 2.0);
        assert_eq!(block.meets([0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]), f32::INFINITY);
        assert_eq!(block.meets([0.0, 1.5, 1.0], ahead), f32::INFINITY);
        assert_eq!(block.meets([5.0, 0.0, 1.0], ahead), f32::INFINITY);
        let column = Solid::column([5.0, 0.0, 1.0], 1.0, 2.0, PLAIN);
        assert_eq!(column.meets([0.0, 0.0, 1.0], ahead), 4.0);
        assert_eq!(column.meets([0.0, 0.0, 2.5], ahead), f32::INFINITY);
        assert_eq!(column.meets([5.0, 0.0, 4.0], [0.0, 0.0, -1.0]), 2.0);
        let ball = Solid::ball([5.0, 0.0, 1.0], 1.0, 0);
        assert_eq!(ball.meets([0.0, 0.0, 1.0], ahead), 4.0);
        assert_eq!(ball.meets([0.0, 1.5, 1.0], ahead), f32::INFINITY);
    }

    #[test]
    fn a_block_can_be_turned_and_shows_the_face_that_is_met() {
        // By a right angle: 4 along y, 2 along x.
        let block = Solid::block([0.0, 0.0, 1.0], [4.0, 2.0, 2.0], PLAIN).placed([5.0, 0.0], [0.0, 1.0]);
        let met = block.meets([0.0, 0.5, 1.5], [1.0, 0.0, 0.0]);
        assert_eq!(met, 4.0);
        let spot = block.spot([met, 0.5, 1.5]);
        assert_eq!((spot.skin, spot.v, spot.across), (1, 0.25, 4.0));
        assert_eq!(spot.normal, [-1.0, 0.0, 0.0]);
        assert_eq!(block.spot([5.0, 0.5, 2.0]).skin, 2);
        assert_eq!(block.distance([5.0, 4.0, 1.0]), 2.0);
    }
}
