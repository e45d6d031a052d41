//! The things in the room: books and robots to steer by, furniture, people. Each is a handful of solids around the origin
//! of the floor, to be placed.

use mpgx_random::Stream;

use crate::colour::{Rgb, WHITE, hue, mixed, scaled};
use crate::solid::Solid;
use crate::texture::Texture;

/// Skins of all things, which the solids index.
#[derive(Clone, Debug, Default)]
pub(crate) struct Skins(pub Vec<Texture>);

impl Skins {
    fn add(&mut self, texture: Texture) -> usize {
        self.0.push(texture);
        self.0.len() - 1
    }

    fn plain(&mut self, colour: Rgb) -> usize {
        self.add(Texture::plain(colour))
    }
}

/// A pile of books with some upright ones on it, as high as `height` m.
pub(crate) fn books(height: f32, skins: &mut Skins, stream: &mut Stream) -> Vec<Solid> {
    let first = stream.uniform() as f32;
    let paper = skins.add(Texture::of(4, 32, |_, v| {
        scaled([0.80, 0.76, 0.64], 0.8 + 0.2 * ((v * 16.0) as usize % 2) as f32)
    }));
    let mut book = |size: [f32; 3], centre: [f32; 3], upright: bool, number: usize, stream: &mut Stream| {
        let colour = hue(first + 0.382 * number as f32, 0.75 + 0.2 * stream.uniform() as f32, 0.75);
        let (band, dot) = (0.2 + 0.4 * stream.uniform() as f32, 0.5 * stream.uniform() as f32 + 0.25);
        let ink = if stream.uniform() < 0.5 { [0.9, 0.85, 0.6] } else { scaled(colour, 0.12) };
        let cover = skins.add(Texture::of(32, 32, |u, v| {
            let title = (v - band).abs() < 0.09 && (0.12..0.88).contains(&u);
            let (x, y) = (u - dot, v - 0.75);
            if title || x * x + y * y < 0.02 { ink } else { colour }
        }));
        // An upright book shows its cover along x and its spine at the ends of y; a lying one its spine along x.
        let faces = if upright { [cover, cover, paper] } else { [paper, cover, cover] };
        Solid::block(centre, size, faces)
    };
    let scale = height / 0.5;
    let mut solids = Vec::new();
    let mut top = 0.0;
    for number in 0..3 {
        let thick = scale * (0.05 + 0.03 * stream.uniform() as f32);
        let shift = scale * 0.04 * (stream.uniform() as f32 - 0.5);
        let size = [scale * (0.34 - 0.03 * number as f32), scale * 0.25, thick];
        solids.push(book(size, [shift, -shift, top + thick / 2.0], false, number, stream));
        top += thick;
    }
    let mut left = -0.13 * scale;
    for number in 3..6 {
        let thick = scale * (0.05 + 0.03 * stream.uniform() as f32);
        let high = (height - top) * (0.8 + 0.2 * stream.uniform() as f32);
        solids.push(book(
            [thick, 0.19 * scale, high],
            [left + thick / 2.0, 0.0, top + high / 2.0],
            true,
            number,
            stream,
        ));
        left += thick + 0.004 * scale;
    }
    solids
}

/// A round robot of plates, as TurtleBots are, its camera ahead; `number` gives it its colour.
pub(crate) fn robot(height: f32, number: usize, skins: &mut Skins) -> Vec<Solid> {
    let colour = hue(0.02 + 0.618 * number as f32, 0.9, 0.8);
    let (dark, grey, black) =
        (skins.plain([0.04; 3]), skins.plain([0.22, 0.22, 0.24]), skins.plain([0.015; 3]));
    let banner = skins.plain(colour);
    // Stripes tell its sides apart: a thick one ahead.
    let ring = skins.add(Texture::of(64, 4, |u, _| {
        let ahead = (u - 0.5).abs() < 0.08;
        let stripe = ((u * 8.0) as usize).is_multiple_of(2);
        if ahead {
            WHITE
        } else if stripe {
            colour
        } else {
            scaled(colour, 0.35)
        }
    }));
    let up = |share: f32| share * height;
    let disc = |middle: f32, high: f32, radius: f32, side: usize, end: usize| {
        Solid::column([0.0, 0.0, up(middle)], radius, up(high), [side, end, end])
    };
    let mut solids = vec![
        disc(0.14, 0.22, 0.17, dark, grey),
        disc(0.31, 0.10, 0.175, ring, grey),
        disc(0.58, 0.03, 0.165, banner, banner),
        disc(0.84, 0.03, 0.165, banner, banner),
        Solid::block([0.07, 0.0, up(0.93)], [0.07, 0.22, up(0.13)], [black, dark, grey]),
    ];
    for (x, y) in [(0.11, 0.09), (0.11, -0.09), (-0.13, 0.06), (-0.13, -0.06)] {
        solids.push(Solid::column([x, y, up(0.6)], 0.014, up(0.5), [grey; 3]));
    }
    solids
}

/// Something that stands with its back (greatest y) to a wall.
pub(crate) struct Furniture {
    pub solids: Vec<Solid>,
    /// m.
    pub width: f32,
    pub depth: f32,
}

/// A drawn piece of furniture, low where it would hide a window.
pub(crate) fn furniture(low: bool, skins: &mut Skins, stream: &mut Stream) -> Furniture {
    let mut between = |low: f32, high: f32| low + (high - low) * stream.uniform() as f32;
    let tone = mixed([0.40, 0.26, 0.14], [0.55, 0.55, 0.54], between(0.0, 1.0));
    let tone = scaled(tone, between(0.4, 1.1));
    let (width, depth) = (between(0.5, 1.3), between(0.35, 0.55));
    let height = if low { between(0.4, 0.75) } else { between(0.7, 1.9) };
    let accent = hue(between(0.0, 1.0), between(0.3, 0.9), between(0.2, 0.7));
    let seed = between(0.0, 1.0);
    let plain = skins.plain(tone);
    let whole = |front: usize| {
        vec![Solid::block([0.0, 0.0, height / 2.0], [width, depth, height], [plain, front, plain])]
    };
    let solids = match stream.below(5) {
        // A cupboard with doors or drawers.
        0 => {
            let rows = 1 + (height / 0.45) as usize;
            let front = skins.add(Texture::of(64, 64, |u, v| {
                let (x, y) = ((u * 2.0).fract() - 0.5, (v * rows as f32).fract() - 0.5);
                if x.abs().max(y.abs()) > 0.46 {
                    scaled(tone, 0.35)
                } else if x.abs() < 0.08 && (y + 0.25).abs() < 0.04 {
                    [0.6, 0.6, 0.58]
                } else {
                    scaled(tone, 1.15)
                }
            }));
            whole(front)
        }
        // Shelves full of books.
        1 => {
            let rows = (1.0 + height / 0.35) as usize as f32;
            let front = skins.add(Texture::of(128, 128, |u, v| {
                let (row, y) = (libm::floorf(v * rows), (v * rows).fract());
                let place = u * width * 22.0 + 9.0 * row;
                let turn = (place as usize as f32 + row) * 0.618 + seed;
                let tall = 0.2 + 0.35 * (turn * 3.7).fract();
                if y > 0.92 || u.min(1.0 - u) < 0.03 {
                    tone
                } else if y < tall || place.fract() < 0.08 {
                    scaled(tone, 0.2)
                } else {
                    hue(turn, 0.3 + 0.5 * (turn * 2.3).fract(), 0.2 + 0.5 * (turn * 5.1).fract())
                }
            }));
            whole(front)
        }
        // A table with something on it.
        2 => {
            let high = height.min(0.76);
            let mut solids = vec![Solid::block([0.0, 0.0, high - 0.02], [width, depth, 0.04], [plain; 3])];
            for (x, y) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
                let centre = [x * (width / 2.0 - 0.05), y * (depth / 2.0 - 0.05), high / 2.0 - 0.02];
                solids.push(Solid::column(centre, 0.022, high - 0.04, [plain; 3]));
            }
            let thing = skins.plain(accent);
            let size = [0.3, 0.2, 0.1 + 0.25 * seed];
            solids.push(Solid::block(
                [(seed - 0.5) * 0.6 * width, 0.0, high + size[2] / 2.0],
                size,
                [thing; 3],
            ));
            solids
        }
        // A plant in a pot.
        3 => {
            let (pot, wood) = (skins.plain(accent), skins.plain([0.10, 0.07, 0.04]));
            let leaf = skins.add(Texture::of(64, 32, |u, v| {
                let light = (libm::sinf(u * 60.0 + 9.0 * v) * libm::sinf(v * 37.0 + 7.0 * u)).max(0.0);
                mixed([0.03, 0.09, 0.02], [0.16, 0.34, 0.08], light)
            }));
            let ball = |x: f32, y: f32, z: f32, radius: f32| Solid::ball([x, y, z * height], radius, leaf);
            let stem = Solid::column([0.0, 0.0, height / 3.0], 0.018, 2.0 * height / 3.0, [wood; 3]);
            let mut solids = vec![Solid::column([0.0, 0.0, 0.14], 0.15, 0.28, [pot; 3]), stem];
            solids.extend([
                ball(0.0, 0.0, 0.8, 0.19),
                ball(0.1, -0.06, 0.6, 0.16),
                ball(-0.11, 0.02, 0.65, 0.15),
            ]);
            solids
        }
        // Boxes, one on another.
        _ => {
            let card = skins.add(Texture::of(32, 32, |u, v| {
                let tape = (u - 0.5).abs() < 0.06;
                let print = (0.15..0.4).contains(&u) && (0.55..0.8).contains(&v);
                if tape {
                    [0.55, 0.45, 0.28]
                } else if print {
                    scaled(accent, 0.5)
                } else {
                    [0.42, 0.30, 0.17]
                }
            }));
            let side = width.min(0.6);
            let lower = Solid::block([0.0, 0.0, 0.2], [side, depth, 0.4], [card; 3]);
            let upper =
                Solid::block([0.1 * (seed - 0.5), 0.0, 0.53], [0.6 * side, 0.7 * depth, 0.26], [card; 3]);
            vec![lower, upper]
        }
    };
    Furniture { solids, width, depth }
}

/// The clothes of somebody who walks by.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Clothes {
    skin: usize,
    hair: usize,
    shirt: usize,
    trousers: usize,
    shoes: usize,
    height: f32,
}

impl Clothes {
    pub fn drawn(skins: &mut Skins, stream: &mut Stream) -> Clothes {
        let mut between = |low: f32, high: f32| low + (high - low) * stream.uniform() as f32;
        let (shirt, stripe) =
            (hue(between(0.0, 1.0), between(0.1, 0.9), between(0.1, 0.8)), between(0.3, 1.2));
        let trousers = hue(between(0.5, 0.75), between(0.1, 0.6), between(0.03, 0.3));
        let skin = mixed([0.62, 0.42, 0.31], [0.16, 0.09, 0.06], between(0.0, 1.0));
        let hair = mixed([0.02, 0.015, 0.01], [0.32, 0.2, 0.09], between(0.0, 1.0));
        let height = between(1.55, 1.9);
        let striped =
            Texture::of(4, 32, |_, v| if (v * 8.0).fract() < 0.5 { shirt } else { scaled(shirt, stripe) });
        Clothes {
            skin: skins.plain(skin),
            hair: skins.plain(hair),
            shirt: skins.add(striped),
            trousers: skins.plain(trousers),
            shoes: skins.plain([0.03; 3]),
            height,
        }
    }

    /// The walker who heads along x, `phase` rad into a pair of steps.
    pub fn walker(&self, phase: f32) -> Vec<Solid> {
        let swing = libm::sinf(phase);
        let up = |share: f32| share * self.height;
        let limb = |x: f32, y: f32, (low, high): (f32, f32), radius: f32, skin: usize| {
            Solid::column([x, y, up((low + high) / 2.0)], radius, up(high - low), [skin; 3])
        };
        let mut solids = vec![
            limb(0.0, 0.0, (0.46, 0.81), 0.155, self.shirt),
            limb(0.0, 0.0, (0.80, 0.86), 0.055, self.skin),
            Solid::ball([0.0, 0.0, up(0.915)], 0.115, self.skin),
            Solid::ball([-0.02, 0.0, up(0.935)], 0.115, self.hair),
        ];
        for side in [-1.0, 1.0] {
            let stride = side * swing;
            solids.extend([
                limb(0.06 * stride, 0.085 * side, (0.26, 0.48), 0.085, self.trousers),
                limb(0.17 * stride, 0.085 * side, (0.03, 0.27), 0.06, self.trousers),
                Solid::block(
                    [0.17 * stride + 0.05, 0.085 * side, up(0.02)],
                    [0.25, 0.09, up(0.04)],
                    [self.shoes; 3],
                ),
                limb(-0.05 * stride, 0.2 * side, (0.60, 0.80), 0.05, self.shirt),
                limb(-0.15 * stride, 0.21 * side, (0.43, 0.61), 0.038, self.skin),
            ]);
        }
        solids
    }
}
