//! The ray-caster: what a camera sees of a scene.
//!
//! Each of a pixel's rays goes through another place of the pixel at another moment of the exposure, so edges are smooth
//! and what moves is blurred. Textures are read at the size of what a ray stands for.

use mpgx_random::Purpose;

use crate::colour::{BLACK, Rgb, greatest, least, mixed, plus, scaled};
use crate::image::Image;
use crate::light::Glow;
use crate::pose::Pose;
use crate::room::Face;
use crate::solid::Solid;
use crate::world::{Part, Scene};

/// A robot that moves while light falls on the sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moving {
    /// In the middle of the exposure.
    pub pose: Pose,
    /// Along x and y.
    pub velocity_mps: [f64; 2],
    pub turn_radps: f64,
}

impl Moving {
    pub fn still(pose: Pose) -> Moving {
        Moving { pose, ..Moving::default() }
    }

    /// A robot that stood at `before` (x and y in m, heading in rad) and stands at `now`, `dt_s` later.
    pub fn between(before: [f64; 3], now: [f64; 3], dt_s: f64) -> Moving {
        let rate = |axis: usize| (now[axis] - before[axis]) / dt_s;
        Moving {
            pose: Pose { x_m: now[0], y_m: now[1], heading_rad: now[2] },
            velocity_mps: [rate(0), rate(1)],
            turn_radps: libm::remainder(now[2] - before[2], std::f64::consts::TAU) / dt_s,
        }
    }

    /// `later_s` after the middle of the exposure.
    pub fn at(&self, later_s: f64) -> Pose {
        Pose {
            x_m: self.pose.x_m + later_s * self.velocity_mps[0],
            y_m: self.pose.y_m + later_s * self.velocity_mps[1],
            heading_rad: self.pose.heading_rad + later_s * self.turn_radps,
        }
    }
}

/// A picture to take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shot<'a> {
    /// The robot that carries the camera.
    pub camera: Moving,
    /// The other robots; the first has the first colour. One that stands where the camera is does not hide its view.
    pub robots: &'a [Moving],
    /// Since the trial began, of the middle of the exposure: people walk by it.
    pub time_s: f64,
    /// Which picture of the trial: its noise.
    pub number: u64,
}

/// What a ray meets where it meets no solid.
const NOTHING: u32 = u32::MAX;
/// Nearest a camera comes to a wall, m.
const MARGIN_M: f32 = 0.05;
/// Of two robots nearer than this one would look from inside the other, m.
const INSIDE_M: f64 = 0.25;

impl Scene {
    /// What the camera sees. A camera outside the room looks from the nearest place in it.
    pub fn render(&self, shot: &Shot) -> Image {
        let (width, height) = (self.camera.width_px, self.camera.height_px);
        let mut film = vec![BLACK; width * height];
        let mut moved = Vec::new();
        self.movers(shot, 0.0, &mut moved);
        let glows: Vec<Glow> = moved.iter().map(|solid| self.light.at(solid.centre, |_, _| false)).collect();
        let samples = self.camera.samples;
        for sample in 0..samples {
            let share = (sample as f32 + 0.5) / samples as f32;
            let offset = [radical_inverse(2, sample), radical_inverse(3, sample)];
            let later_s = f64::from(share - 0.5) * self.camera.exposure_s;
            self.movers(shot, later_s, &mut moved);
            let view = View::new(self, shot.camera.at(later_s), offset);
            self.cast(&view, &moved, &glows, &mut film);
        }
        for light in &mut film {
            *light = scaled(*light, 1.0 / samples as f32);
        }
        self.sensor.develop(&film, width, &mut self.key.stream(Purpose::Camera, Part::Noise, shot.number))
    }

    /// All that moves, at a moment of the exposure.
    fn movers(&self, shot: &Shot, later_s: f64, solids: &mut Vec<Solid>) {
        solids.clear();
        for (robot, model) in shot.robots.iter().zip(self.robots.iter().cycle()) {
            let (from, to) = (shot.camera.pose, robot.pose);
            if libm::hypot(to.x_m - from.x_m, to.y_m - from.y_m) < INSIDE_M {
                continue;
            }
            let Pose { x_m, y_m, heading_rad } = robot.at(later_s);
            let (sin, cos) = libm::sincos(heading_rad);
            let turn = [cos as f32, sin as f32];
            solids.extend(model.iter().map(|solid| solid.placed([x_m as f32, y_m as f32], turn)));
        }
        for walker in &self.people {
            solids.extend(walker.at((shot.time_s + later_s) as f32));
        }
    }

    /// Adds one ray for each pixel.
    fn cast(&self, view: &View, moved: &[Solid], glows: &[Glow], film: &mut [Rgb]) {
        let width = view.width;
        let mut depth = vec![f32::INFINITY; film.len()];
        let mut met = vec![NOTHING; film.len()];
        for (number, solid) in self.solids.iter().chain(moved).enumerate() {
            let Some([columns, rows]) = view.bounds(solid) else { continue };
            let (shape, origin, right) =
                (solid.shape, solid.offset(view.origin), solid.shape.local(view.right));
            for y in rows.0..rows.1 {
                let start = shape.local(view.towards(0.0, y as f32));
                let row = y * width..(y + 1) * width;
                let pixels = depth[row.clone()].iter_mut().zip(&mut met[row]);
                for (x, (depth, met)) in pixels.enumerate().take(columns.1).skip(columns.0) {
                    let away = shape.meets(origin, plus(start, scaled(right, x as f32)));
                    if away < *depth {
                        *depth = away;
                        *met = number as u32;
                    }
                }
            }
        }
        let shadows = Shadow::of(moved);
        let still = self.solids.len();
        for y in 0..view.height {
            let start = view.towards(0.0, y as f32);
            for x in 0..width {
                let pixel = y * width + x;
                let direction = plus(start, scaled(view.right, x as f32));
                let number = met[pixel] as usize;
                let seen = if met[pixel] == NOTHING {
                    self.background(view, direction, &shadows)
                } else if number < still {
                    self.surface(view, direction, depth[pixel], &self.solids[number], &self.glows[number])
                } else {
                    self.surface(
                        view,
                        direction,
                        depth[pixel],
                        &moved[number - still],
                        &glows[number - still],
                    )
                };
                film[pixel] = plus(film[pixel], seen);
            }
        }
    }

    #[inline]
    fn surface(&self, view: &View, direction: [f32; 3], away: f32, solid: &Solid, glow: &Glow) -> Rgb {
        let spot = solid.spot(plus(view.origin, scaled(direction, away)));
        let skin = &self.skins.0[spot.skin];
        let area = view.area(direction, away, spot.normal);
        let texels = skin.width() / spot.across;
        let colour = skin.sample(spot.u, spot.v, area * texels * texels);
        let light = glow.on(spot.normal);
        [colour[0] * light[0], colour[1] * light[1], colour[2] * light[2]]
    }

    /// The side of the room that a ray meets.
    #[inline]
    fn background(&self, view: &View, d: [f32; 3], shadows: &[Shadow]) -> Rgb {
        let (o, [hx, hy], height) = (view.origin, self.room.half, self.room.height);
        let x = (if d[0] > 0.0 { hx - o[0] } else { -hx - o[0] }) / d[0];
        let y = (if d[1] > 0.0 { hy - o[1] } else { -hy - o[1] }) / d[1];
        let z = (if d[2] > 0.0 { height - o[2] } else { -o[2] }) / d[2];
        let away = least(least(x, y), z);
        let place = plus(o, scaled(d, away));
        let (u, v) = (0.5 + place[0] / (2.0 * hx), 0.5 + place[1] / (2.0 * hy));
        let down = 1.0 - place[2] / height;
        let (face, across, u, v) = if away == z {
            (usize::from(d[2] > 0.0), 2.0 * hx, u, v)
        } else if away == x {
            (2 + usize::from(d[0] > 0.0), 2.0 * hy, v, down)
        } else {
            (4 + usize::from(d[1] > 0.0), 2.0 * hx, u, down)
        };
        let texture = &self.faces[face];
        let texels = texture.width() / across;
        let colour = texture.sample(u, v, view.area(d, away, Face::ALL[face].normal()) * texels * texels);
        if face == 0 {
            shadows.iter().fold(colour, |colour, shadow| shadow.on(colour, place))
        } else {
            colour
        }
    }
}

/// One moment of a camera: where it is, and how its rays go.
struct View {
    width: usize,
    height: usize,
    origin: [f32; 3],
    /// From a column to the next, from a row to the next, and through the top left pixel, along the unit forward.
    right: [f32; 3],
    down: [f32; 3],
    corner: [f32; 3],
    /// Unit axes of the camera.
    axes: [[f32; 3]; 3],
    focal: f32,
    /// Where a pixel's ray goes through it.
    offset: [f32; 2],
    /// The share of a pixel that a ray stands for, at 1 m, m².
    area: f32,
}

impl View {
    fn new(scene: &Scene, robot: Pose, offset: [f32; 2]) -> View {
        let camera = &scene.camera;
        let pose = camera.pose(robot);
        let matrix = pose.quaternion.matrix();
        let axis = |column: usize| std::array::from_fn(|row| matrix[row][column] as f32);
        let axes: [[f32; 3]; 3] = [axis(0), axis(1), axis(2)];
        let focal = camera.focal_px() as f32;
        let inside = |at: f64, half: f32| (at as f32).clamp(MARGIN_M - half, half - MARGIN_M);
        let [x, y, z] = pose.position_m;
        let half = scene.room.height / 2.0;
        let [hx, hy] = scene.room.half;
        let (right, down) = (scaled(axes[0], 1.0 / focal), scaled(axes[1], 1.0 / focal));
        let left = offset[0] - camera.width_px as f32 / 2.0;
        let up = offset[1] - camera.height_px as f32 / 2.0;
        View {
            width: camera.width_px,
            height: camera.height_px,
            origin: [inside(x, hx), inside(y, hy), half + inside(z - f64::from(half), half)],
            right,
            down,
            corner: plus(axes[2], plus(scaled(right, left), scaled(down, up))),
            axes,
            focal,
            offset,
            area: 1.0 / (focal * focal * camera.samples as f32),
        }
    }

    /// The ray through column x and row y.
    #[inline]
    fn towards(&self, x: f32, y: f32) -> [f32; 3] {
        plus(self.corner, plus(scaled(self.right, x), scaled(self.down, y)))
    }

    /// How much of a surface a ray stands for, m².
    #[inline]
    fn area(&self, direction: [f32; 3], away: f32, normal: [f32; 3]) -> f32 {
        let facing = greatest(dot(direction, normal).abs(), 0.02);
        self.area * away * away / facing
    }

    /// Columns and rows (first and one past the last) that may see a solid; nothing if none does.
    fn bounds(&self, solid: &Solid) -> Option<[(usize, usize); 2]> {
        let away: [f32; 3] = std::array::from_fn(|i| solid.centre[i] - self.origin[i]);
        // How far it is to its middle, and from there to its edge, along an axis.
        let along = |axis: usize| (dot(away, self.axes[axis]), solid.shape.reach(self.axes[axis]));
        let (forward, deep) = along(2);
        if forward < -deep {
            return None;
        }
        let range = |axis: usize, count: usize| {
            if forward - deep < 0.02 {
                return Some((0, count));
            }
            let (aside, wide) = along(axis);
            let (low, high) = (aside - wide, aside + wide);
            let seen = |side: f32, outwards: bool| {
                side / if outwards { forward - deep } else { forward + deep } * self.focal
            };
            let middle = count as f32 / 2.0 - self.offset[axis];
            let first = greatest(middle + seen(low, low < 0.0), 0.0);
            let last = least(middle + seen(high, high > 0.0) + 2.0, count as f32);
            (first < last).then_some((first as usize, last as usize))
        };
        Some([range(0, self.width)?, range(1, self.height)?])
    }
}

/// The shadow below something that moves.
struct Shadow {
    place: [f32; 2],
    squared_radius: f32,
}

impl Shadow {
    /// Of the solids that come near the floor.
    fn of(solids: &[Solid]) -> Vec<Shadow> {
        let low = |solid: &&Solid| solid.centre[2] < 0.3;
        let shadow = |solid: &Solid| {
            let radius = 1.2 * solid.footprint() + 0.06;
            Shadow { place: [solid.centre[0], solid.centre[1]], squared_radius: radius * radius }
        };
        solids.iter().filter(low).map(shadow).collect()
    }

    #[inline]
    fn on(&self, colour: Rgb, place: [f32; 3]) -> Rgb {
        let (x, y) = (place[0] - self.place[0], place[1] - self.place[1]);
        let share = 1.0 - (x * x + y * y) / self.squared_radius;
        if share > 0.0 { mixed(colour, scaled(colour, 0.45), share) } else { colour }
    }
}

#[inline]
fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The digits of a number behind the point, in reverse: places spread evenly over 0..1 (van der Corput), 1/2 for the first.
fn radical_inverse(base: usize, number: usize) -> f32 {
    let (mut rest, mut digit, mut sum) = (number + 1, 1.0 / base as f32, 0.0);
    while rest > 0 {
        sum += (rest % base) as f32 * digit;
        rest /= base;
        digit /= base as f32;
    }
    sum
}
