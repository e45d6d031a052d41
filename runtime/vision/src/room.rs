//! What the walls, the floor and the ceiling look like. Some of it stays, some changes with every trial.

use mpgx_random::Stream;

use crate::colour::{BLACK, Rgb, WHITE, hue, mixed, plus, ramp, scaled};
use crate::grain::Grain;
use crate::light::Light;

/// A side of the room, seen from inside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Face {
    Floor,
    Ceiling,
    /// Least and greatest x, least and greatest y.
    Wall(usize),
}

impl Face {
    /// In the order of their indices.
    pub const ALL: [Face; 6] =
        [Face::Floor, Face::Ceiling, Face::Wall(0), Face::Wall(1), Face::Wall(2), Face::Wall(3)];

    /// Into the room.
    pub fn normal(self) -> [f32; 3] {
        match self {
            Face::Floor => [0.0, 0.0, 1.0],
            Face::Ceiling => [0.0, 0.0, -1.0],
            Face::Wall(0) => [1.0, 0.0, 0.0],
            Face::Wall(1) => [-1.0, 0.0, 0.0],
            Face::Wall(2) => [0.0, 1.0, 0.0],
            Face::Wall(_) => [0.0, -1.0, 0.0],
        }
    }
}

/// Half the length along x and y, and the height, m.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Room {
    pub half: [f32; 2],
    pub height: f32,
}

impl Room {
    /// Length of a face along its u and v, m.
    pub fn size(&self, face: Face) -> [f32; 2] {
        let [x, y] = self.half.map(|half| 2.0 * half);
        match face {
            Face::Floor | Face::Ceiling => [x, y],
            Face::Wall(0 | 1) => [y, self.height],
            Face::Wall(_) => [x, self.height],
        }
    }

    /// The place at (u, v) m of a face: on walls, v counts from the ceiling.
    pub fn place(&self, face: Face, u: f32, v: f32) -> [f32; 3] {
        let [hx, hy] = self.half;
        match face {
            Face::Floor => [u - hx, v - hy, 0.0],
            Face::Ceiling => [u - hx, v - hy, self.height],
            Face::Wall(0) => [-hx, u - hy, self.height - v],
            Face::Wall(1) => [hx, u - hy, self.height - v],
            Face::Wall(2) => [u - hx, -hy, self.height - v],
            Face::Wall(_) => [u - hx, hy, self.height - v],
        }
    }
}

/// The paint of a room.
#[derive(Clone, Debug)]
pub(crate) struct Decor {
    room: Room,
    /// Stays.
    grain: Grain,
    /// What follows changes.
    upper: [Rgb; 4],
    lower: [Rgb; 4],
    pictures: [Vec<Picture>; 4],
    /// How far the blinds are drawn, for each window.
    blinds: Vec<f32>,
    outside: f32,
}

#[derive(Clone, Debug)]
struct Picture {
    /// Its middle and half size on the wall, m.
    u: f32,
    v: f32,
    half: [f32; 2],
    kind: u64,
    inks: [Rgb; 3],
    shift: f32,
}

impl Decor {
    /// `fixed` draws what stays, `trial` what changes.
    pub fn new(room: Room, windows: usize, fixed: &mut Stream, trial: &mut Stream) -> Decor {
        let grain = Grain::new(fixed);
        let tint = trial.uniform() as f32;
        let upper = std::array::from_fn(|_| {
            let turn = tint + 0.12 * trial.uniform() as f32;
            hue(turn, 0.08 + 0.25 * trial.uniform() as f32, 0.55 + 0.25 * trial.uniform() as f32)
        });
        let lower =
            upper.map(|colour| mixed(scaled(colour, 0.55), [0.30, 0.28, 0.26], trial.uniform() as f32));
        let pictures = std::array::from_fn(|wall| {
            let length = room.size(Face::Wall(wall))[0];
            (0..1 + trial.below(4)).map(|_| Picture::drawn(length, room.height, trial)).collect()
        });
        let blinds = (0..windows).map(|_| 0.6 * trial.uniform() as f32).collect();
        Decor { room, grain, upper, lower, pictures, blinds, outside: 40.0 * trial.uniform() as f32 }
    }

    /// What a place of a face reflects of the light, and what light it sends by itself.
    pub fn paint(&self, face: Face, u: f32, v: f32, light: &Light) -> (Rgb, Rgb) {
        match face {
            Face::Floor => (self.floor(u, v), BLACK),
            Face::Ceiling => self.ceiling(u, v, light),
            Face::Wall(wall) => self.wall(wall, u, v, light),
        }
    }

    /// Planks 16 cm wide along x.
    fn floor(&self, u: f32, v: f32) -> Rgb {
        let row = libm::floorf(v / 0.16);
        let along = u / 1.3 + 7.0 * self.grain.cell(row as i32, 91);
        let plank = libm::floorf(along);
        let tone = self.grain.cell(plank as i32 + 11, 3 * row as i32 + 5);
        let fibre = self.grain.cloud(2.0 * u + 9.0 * tone, 45.0 * v);
        let wood = mixed([0.42, 0.25, 0.13], [0.24, 0.13, 0.065], 0.75 * tone + 0.4 * (fibre - 0.5));
        let to_seam =
            (v / 0.16 - row).min(1.0 + row - v / 0.16).min(8.0 * (along - plank).min(1.0 + plank - along));
        scaled(wood, 0.55 + 0.45 * ramp(0.0, 0.09, to_seam))
    }

    fn ceiling(&self, u: f32, v: f32, light: &Light) -> (Rgb, Rgb) {
        let (x, y) = (u - self.room.half[0], v - self.room.half[1]);
        let on_panel = |&[a, b]: &[f32; 2]| (x - a).abs() < 0.6 && (y - b).abs() < 0.3;
        if light.lamps.iter().any(on_panel) {
            return ([0.7; 3], scaled(light.lamp, 2.5));
        }
        // Square tiles.
        let edge = |along: f32| (along / 0.6 - libm::floorf(along / 0.6) - 0.5).abs();
        let joint = ramp(0.47, 0.5, edge(u).max(edge(v)));
        (scaled(WHITE, 0.78 - 0.18 * joint + 0.05 * self.grain.cloud(3.0 * u, 3.0 * v)), BLACK)
    }

    fn wall(&self, wall: usize, u: f32, v: f32, light: &Light) -> (Rgb, Rgb) {
        let z = self.room.height - v;
        if wall == 3 {
            let windows = light.windows.iter().zip(&self.blinds);
            for (window, &blind) in windows {
                let aside = (u - self.room.half[0] - window.x).abs() - window.width / 2.0;
                let above = (z - window.sill - window.height / 2.0).abs() - window.height / 2.0;
                if aside.max(above) < 0.0 {
                    let bar = (aside + window.width / 2.0).min(-aside).min(-above) < 0.035;
                    let share = (window.sill + window.height - z) / window.height;
                    return if bar {
                        ([0.75; 3], BLACK)
                    } else if share < blind {
                        let slat = 0.5 + 0.5 * ramp(0.0, 0.4, z * 25.0 - libm::floorf(z * 25.0));
                        ([0.6; 3], scaled(light.sky, 0.10 * slat))
                    } else {
                        (BLACK, self.view(u, z, light))
                    };
                } else if aside.max(above) < 0.07 {
                    return ([0.8, 0.79, 0.76], BLACK);
                }
            }
        }
        if let Some(fixed) = self.fixture(wall, u, z) {
            return (fixed, BLACK);
        }
        for picture in &self.pictures[wall] {
            if let Some(colour) = picture.colour(u, v) {
                return (colour, BLACK);
            }
        }
        let plaster = 0.94 + 0.12 * self.grain.cloud(5.0 * u + 13.0 * wall as f32, 5.0 * v);
        let colour = if z < 0.09 {
            [0.62, 0.60, 0.57]
        } else if z < 0.95 {
            self.lower[wall]
        } else if z < 1.0 {
            scaled(self.lower[wall], 0.7)
        } else {
            self.upper[wall]
        };
        (scaled(colour, plaster), BLACK)
    }

    /// What hangs on the walls in every trial: a door, a white board, a cupboard's door.
    fn fixture(&self, wall: usize, u: f32, z: f32) -> Option<Rgb> {
        let middle = self.room.size(Face::Wall(wall))[0] / 2.0;
        let inside = |at: f32, half: f32, low: f32, high: f32| {
            (u - middle - at).abs() < half && (low..high).contains(&z)
        };
        match wall {
            2 if inside(-1.6, 0.52, 0.0, 2.12) => {
                let knob = inside(-1.25, 0.05, 1.0, 1.06);
                let panel = inside(-1.6, 0.30, 0.25, 0.95) || inside(-1.6, 0.30, 1.15, 1.9);
                let leaf = inside(-1.6, 0.45, 0.0, 2.05);
                Some(match (knob, panel, leaf) {
                    (true, ..) => [0.7, 0.65, 0.4],
                    (_, true, _) => [0.24, 0.105, 0.045],
                    (.., true) => [0.31, 0.14, 0.06],
                    _ => [0.7, 0.68, 0.64],
                })
            }
            0 if inside(0.6, 0.95, 0.85, 1.95) => {
                let sheet = inside(0.6, 0.90, 0.90, 1.90);
                let line = libm::floorf(z * 11.0);
                let written = self.grain.at(14.0 * u, 5.0 * line) > 0.55
                    && z * 11.0 - line < 0.35
                    && inside(0.35, 0.5, 1.15, 1.8);
                Some(match (written, sheet) {
                    (true, _) => [0.1, 0.12, 0.4],
                    (_, true) => [0.86, 0.87, 0.88],
                    _ => [0.35, 0.35, 0.36],
                })
            }
            1 if inside(-1.0, 0.6, 0.0, 1.8) => {
                let gap = inside(-1.0, 0.02, 0.1, 1.7);
                Some(if gap { [0.03; 3] } else { [0.10, 0.22, 0.30] })
            }
            _ => None,
        }
    }

    /// Through the window: sky above houses and trees.
    fn view(&self, u: f32, z: f32, light: &Light) -> Rgb {
        let roof = 1.05 + 0.5 * self.grain.cell((u * 1.7 + self.outside) as i32, 77);
        let trees = 0.9 + 0.5 * self.grain.cloud(2.5 * u + self.outside, 3.0);
        let sky = plus(light.sky, scaled(light.sun, 0.3));
        if z < trees {
            scaled([0.10, 0.16, 0.06], 0.25 * (sky[0] + sky[1]))
        } else if z < roof {
            let pane = self.grain.cell((u * 9.0) as i32, (z * 9.0) as i32) > 0.7;
            let lit = if pane { scaled(light.lamp, 0.5) } else { BLACK };
            plus(scaled([0.20, 0.15, 0.13], 0.3 * (sky[0] + sky[2])), lit)
        } else {
            let cloud = ramp(0.45, 0.75, self.grain.cloud(u + self.outside, 2.0 * z));
            plus(mixed(scaled(sky, 0.55), sky, cloud), scaled(sky, 0.1))
        }
    }
}

impl Picture {
    fn drawn(length: f32, height: f32, stream: &mut Stream) -> Picture {
        let mut between = |low: f32, high: f32| low + (high - low) * stream.uniform() as f32;
        let half = [between(0.25, 0.7), between(0.2, 0.5)];
        let (u, v) = (between(half[0], length - half[0]), height - between(1.15 + half[1], 2.2));
        let shift = between(0.0, 10.0);
        let mut ink = || hue(between(0.0, 1.0), between(0.2, 0.9), between(0.15, 0.8));
        let inks = [ink(), ink(), ink()];
        Picture { u, v, half, kind: stream.below(5), inks, shift }
    }

    /// Its colour at a place of the wall, if it hangs there.
    fn colour(&self, u: f32, v: f32) -> Option<Rgb> {
        let (x, y) = ((u - self.u) / self.half[0], (v - self.v) / self.half[1]);
        if x.abs().max(y.abs()) > 1.0 {
            return None;
        }
        let framed = (1.0 - x.abs()) * self.half[0] < 0.03 || (1.0 - y.abs()) * self.half[1] < 0.03;
        if framed {
            return Some(scaled(self.inks[2], 0.25));
        }
        let [first, second, third] = self.inks;
        let wave = |place: f32| libm::sinf(place + self.shift);
        let pick = |yes: bool| if yes { first } else { second };
        Some(match self.kind {
            0 => pick(wave(6.0 * x + 4.0 * y) > 0.0),
            1 if (x * x + y * y - 0.25).abs() < 0.2 => third,
            1 => mixed(first, second, 0.5 + 0.5 * y),
            2 if y > 0.3 * wave(3.0 * x) => mixed(first, BLACK, 0.5 * y),
            2 => mixed(second, WHITE, 0.3 - 0.3 * y),
            3 => pick((wave(5.0 * x) > 0.0) != (wave(5.0 * y) > 0.0)),
            _ => {
                let line = libm::floorf((y + 1.0) * 7.0);
                let blank = (y + 1.0) * 7.0 - line > 0.45 || x > 0.6 * wave(9.0 * line);
                if blank { [0.75, 0.74, 0.70] } else { scaled(first, 0.3) }
            }
        })
    }
}
