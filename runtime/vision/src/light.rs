//! The light of a room: sky and sun through windows, lamps at the ceiling, by time of day.

use mpgx_random::Stream;
use serde::{Deserialize, Serialize};

use crate::colour::{BLACK, Rgb, greatest, plus, ramp, scaled};

/// When a trial takes place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TimeOfDay {
    Morning,
    #[default]
    Afternoon,
    Evening,
}

impl TimeOfDay {
    /// The light of a trial where none is asked for: each in turn.
    pub fn of_trial(number: u32) -> TimeOfDay {
        TimeOfDay::ALL[number as usize % TimeOfDay::ALL.len()]
    }

    pub const ALL: [TimeOfDay; 3] = [TimeOfDay::Morning, TimeOfDay::Afternoon, TimeOfDay::Evening];

    pub fn name(self) -> &'static str {
        match self {
            TimeOfDay::Morning => "morning",
            TimeOfDay::Afternoon => "afternoon",
            TimeOfDay::Evening => "evening",
        }
    }
}

/// A window in the wall of greatest y: its middle along x, its sill and its size, m.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Window {
    pub x: f32,
    pub sill: f32,
    pub width: f32,
    pub height: f32,
}

/// All that shines.
#[derive(Clone, Debug)]
pub(crate) struct Light {
    /// y of the wall with the windows, height of the ceiling, m.
    wall_y: f32,
    ceiling: f32,
    pub windows: Vec<Window>,
    /// x and y of the lamps at the ceiling, m.
    pub lamps: Vec<[f32; 2]>,
    pub sky: Rgb,
    pub sun: Rgb,
    /// Towards the sun, of length 1.
    pub sunwards: [f32; 3],
    pub lamp: Rgb,
}

/// The light that arrives at a place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Glow {
    ambient: Rgb,
    /// Directions it comes from and how much: the windows, the lamps, the sun.
    keys: [([f32; 3], Rgb); 3],
}

impl Light {
    /// The light of a time of day, each time a little different.
    pub fn of(time: TimeOfDay, half: [f32; 2], ceiling: f32, stream: &mut Stream) -> Light {
        let mut around =
            |middle: f32, share: f32| middle * (1.0 + share * (2.0 * stream.uniform() as f32 - 1.0));
        let (elevation, azimuth, sun, sky, lamp) = match time {
            TimeOfDay::Morning => (
                around(0.42, 0.3),
                around(0.75, 0.4),
                scaled([1.0, 0.74, 0.46], around(5.0, 0.5)),
                scaled([0.80, 0.88, 1.0], around(5.0, 0.3)),
                scaled([1.0, 0.86, 0.66], around(0.2, 0.9)),
            ),
            TimeOfDay::Afternoon => (
                around(0.85, 0.2),
                around(-0.5, 0.6),
                scaled([1.0, 0.94, 0.84], around(7.0, 0.6)),
                scaled([0.95, 1.0, 1.06], around(9.0, 0.3)),
                BLACK,
            ),
            TimeOfDay::Evening => (
                0.1,
                0.0,
                BLACK,
                scaled([0.22, 0.26, 0.52], around(0.5, 0.6)),
                scaled([1.0, 0.76, 0.48], around(1.5, 0.25)),
            ),
        };
        let (sin_e, cos_e) = libm::sincosf(elevation);
        let (sin_a, cos_a) = libm::sincosf(azimuth);
        let window =
            |x: f32| Window { x: half[0] * x, sill: 0.85, width: half[0] * 0.55, height: ceiling - 1.35 };
        let lamps = [[-0.45, -0.45], [0.45, -0.45], [-0.45, 0.45], [0.45, 0.45]];
        Light {
            wall_y: half[1],
            ceiling,
            windows: vec![window(-0.45), window(0.4)],
            lamps: lamps.map(|[x, y]| [x * half[0], y * half[1]]).to_vec(),
            sky,
            sun,
            sunwards: [sin_a * cos_e, cos_a * cos_e, sin_e],
            lamp,
        }
    }

    /// What arrives at a place; `shaded` tells whether something stands between it and the sun.
    pub fn at(&self, place: [f32; 3], shaded: impl Fn([f32; 3], [f32; 3]) -> bool) -> Glow {
        let mut windows = ([0.0; 3], 0.0);
        for window in &self.windows {
            for share in [-0.3, 0.3] {
                let source =
                    [window.x + share * window.width, self.wall_y, window.sill + window.height / 2.0];
                let facing = |towards: [f32; 3]| towards[1].max(0.0);
                add(&mut windows, place, source, 0.5 * window.width * window.height, facing);
            }
        }
        let mut lamps = ([0.0; 3], 0.0);
        for &[x, y] in &self.lamps {
            add(&mut lamps, place, [x, y, self.ceiling], 2.0, |towards| towards[2].max(0.0));
        }
        let sunlit = self.sunlit(place);
        let sunlit = if sunlit > 0.0 && shaded(place, self.sunwards) { 0.0 } else { sunlit };
        // Light that bounced around the room, more of it near its source.
        let bounced = |arriving: f32| 0.035 + 0.25 * arriving;
        Glow {
            ambient: plus(scaled(self.sky, bounced(windows.1)), scaled(self.lamp, 6.0 * bounced(lamps.1))),
            keys: [
                (unit(windows.0), scaled(self.sky, windows.1)),
                (unit(lamps.0), scaled(self.lamp, lamps.1)),
                (self.sunwards, scaled(self.sun, sunlit)),
            ],
        }
    }

    /// The share of the sun that falls through a window on a place, with soft edges.
    fn sunlit(&self, place: [f32; 3]) -> f32 {
        let away = (self.wall_y - place[1]) / self.sunwards[1];
        if self.sun == BLACK || !(0.0..1e3).contains(&away) {
            return 0.0;
        }
        let (x, z) = (place[0] + away * self.sunwards[0], place[2] + away * self.sunwards[2]);
        let soft = 0.02 + 0.01 * away;
        let inside = |offset: f32, half: f32| ramp(-soft, soft, half - offset.abs());
        let through = |window: &Window| {
            let middle = window.sill + window.height / 2.0;
            let bar = ramp(-soft, soft, (x - window.x).abs() - 0.03);
            inside(x - window.x, window.width / 2.0) * inside(z - middle, window.height / 2.0) * bar
        };
        self.windows.iter().map(through).sum()
    }
}

/// Adds a source of an area, m², to a sum of directions and of what arrives.
fn add(
    sum: &mut ([f32; 3], f32),
    place: [f32; 3],
    source: [f32; 3],
    area: f32,
    facing: impl Fn([f32; 3]) -> f32,
) {
    let away: [f32; 3] = std::array::from_fn(|i| source[i] - place[i]);
    let squared = away[0] * away[0] + away[1] * away[1] + away[2] * away[2] + 0.05;
    let towards = away.map(|x| x / squared.sqrt());
    let arriving = area * facing(towards) / (std::f32::consts::PI * squared);
    for (total, x) in sum.0.iter_mut().zip(towards) {
        *total += arriving * x;
    }
    sum.1 += arriving;
}

fn unit(v: [f32; 3]) -> [f32; 3] {
    let length = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt().max(1e-9);
    v.map(|x| x / length)
}

impl Glow {
    /// What falls on a surface with this normal.
    #[inline]
    pub fn on(&self, normal: [f32; 3]) -> Rgb {
        let mut sum = scaled(self.ambient, 0.85 + 0.15 * normal[2]);
        for (towards, light) in &self.keys {
            let facing = normal[0] * towards[0] + normal[1] * towards[1] + normal[2] * towards[2];
            sum = plus(sum, scaled(*light, greatest(facing, 0.0)));
        }
        sum
    }
}
