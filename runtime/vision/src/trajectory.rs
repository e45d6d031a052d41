//! Closed paths that a robot drives for a recording: regular ones, random ones and whirlpools.

use mpgx_random::{Purpose, Stream};
use serde::{Deserialize, Serialize};

use crate::cast::Moving;
use crate::pose::Pose;
use crate::world::{ConfigError, Part, TrialKey, within};

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TrajectoryKind {
    /// An ellipse, a rounded rectangle or an eight.
    #[default]
    Regular,
    /// A smooth curve of drawn waves, which crosses itself.
    Random,
    /// A spiral inwards and out again, as a snail's shell.
    Whirlpool,
}

impl TrajectoryKind {
    pub const ALL: [TrajectoryKind; 3] =
        [TrajectoryKind::Regular, TrajectoryKind::Random, TrajectoryKind::Whirlpool];

    pub fn name(self) -> &'static str {
        match self {
            TrajectoryKind::Regular => "regular",
            TrajectoryKind::Random => "random",
            TrajectoryKind::Whirlpool => "whirlpool",
        }
    }
}

/// A kind of path and how it is driven.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TrajectoryConfig {
    pub kind: TrajectoryKind,
    /// Around which the path goes.
    pub middle_m: [f64; 2],
    /// The path stays within ± these of the middle.
    pub half_x_m: f64,
    pub half_y_m: f64,
    pub speed_mps: f64,
    /// Where the path bends more, the robot drives slower.
    pub turn_radps: f64,
}

impl Default for TrajectoryConfig {
    fn default() -> TrajectoryConfig {
        TrajectoryConfig {
            kind: TrajectoryKind::Regular,
            middle_m: [0.0; 2],
            half_x_m: 1.8,
            half_y_m: 1.6,
            speed_mps: 0.4,
            turn_radps: 1.2,
        }
    }
}

/// A closed path, driven for ever.
#[derive(Clone, Debug)]
pub struct Path {
    /// Poses on it, the heading without jumps, and when each is passed; the last is the first again.
    knots: Vec<(f64, Pose)>,
}

/// Pieces that a path is cut into.
const PIECES: usize = 4096;

impl Path {
    /// The path of robot `number` in a trial, 0 for the one with the camera: a pure function of its arguments.
    pub fn new(config: &TrajectoryConfig, key: TrialKey, number: u64) -> Result<Path, ConfigError> {
        config.check()?;
        let mut stream = key.stream(Purpose::Path, Part::Path, number);
        let curve = match config.kind {
            TrajectoryKind::Regular => regular(&mut stream),
            TrajectoryKind::Random => random(&mut stream),
            TrajectoryKind::Whirlpool => whirlpool(&mut stream),
        };
        let begin = stream.uniform();
        let backwards = stream.uniform() < 0.5;
        let places = (0..PIECES).map(|piece| {
            let share = piece as f64 / PIECES as f64;
            curve(begin + if backwards { -share } else { share })
        });
        let places: Vec<[f64; 2]> = places.collect();
        Ok(Path { knots: drive(&fitted(places, config), config) })
    }

    /// How long a round takes.
    pub fn period_s(&self) -> f64 {
        self.knots.last().map_or(0.0, |&(time, _)| time)
    }

    /// Where the robot is, and how it moves.
    pub fn at(&self, time_s: f64) -> Moving {
        let period = self.period_s();
        let time = time_s - period * libm::floor(time_s / period);
        let next = self.knots.partition_point(|&(passed, _)| passed <= time).clamp(1, self.knots.len() - 1);
        let ((t0, a), (t1, b)) = (self.knots[next - 1], self.knots[next]);
        let rate = |from: f64, to: f64| (to - from) / (t1 - t0);
        let (vx, vy) = (rate(a.x_m, b.x_m), rate(a.y_m, b.y_m));
        let turn_radps = rate(a.heading_rad, b.heading_rad);
        let later = time - t0;
        let pose = Pose {
            x_m: a.x_m + later * vx,
            y_m: a.y_m + later * vy,
            heading_rad: a.heading_rad + later * turn_radps,
        };
        Moving { pose, velocity_mps: [vx, vy], turn_radps }
    }
}

impl TrajectoryConfig {
    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        for middle in self.middle_m {
            within("the middle of the path", middle, (-20.0, 20.0), "-20 to 20 m")?;
        }
        within("the path's half length along x", self.half_x_m, (0.1, 20.0), "0.1 to 20 m")?;
        within("the path's half length along y", self.half_y_m, (0.1, 20.0), "0.1 to 20 m")?;
        within("the speed along the path", self.speed_mps, (0.01, 10.0), "0.01 to 10 m/s")?;
        within("the turning along the path", self.turn_radps, (0.01, 10.0), "0.01 to 10 rad/s")
    }
}

/// A closed curve: any share of a round to a place.
type Curve = Box<dyn Fn(f64) -> [f64; 2]>;

fn turn(share: f64) -> (f64, f64) {
    libm::sincos(std::f64::consts::TAU * share)
}

fn regular(stream: &mut Stream) -> Curve {
    let kind = stream.below(3);
    let (long, wide) = (0.55 + 0.45 * stream.uniform(), 0.55 + 0.45 * stream.uniform());
    let (x, y) =
        ((1.0 - long) * (2.0 * stream.uniform() - 1.0), (1.0 - wide) * (2.0 * stream.uniform() - 1.0));
    Box::new(move |share| {
        let (sin, cos) = turn(share);
        let [a, b] = match kind {
            0 => [cos, sin],
            // A superellipse of degree 6.
            1 => {
                let (c2, s2) = (cos * cos, sin * sin);
                let radius = 1.0 / libm::cbrt((c2 * c2 * c2 + s2 * s2 * s2).sqrt());
                [cos * radius, sin * radius]
            }
            _ => [sin, 2.0 * sin * cos],
        };
        [x + long * a, y + wide * b]
    })
}

fn random(stream: &mut Stream) -> Curve {
    let waves: Vec<[f64; 4]> = (1..=5)
        .map(|order| {
            let mut draw = || stream.normal() / f64::from(order);
            [draw(), draw(), draw(), draw()]
        })
        .collect();
    Box::new(move |share| {
        let mut place = [0.0; 2];
        for (order, [a, b, c, d]) in waves.iter().enumerate() {
            let (sin, cos) = turn(share * (order + 1) as f64);
            place[0] += a * cos + b * sin;
            place[1] += c * cos + d * sin;
        }
        place
    })
}

fn whirlpool(stream: &mut Stream) -> Curve {
    let turns = (5 + stream.below(4)) as f64;
    let (inner, sense) = (0.1 + 0.15 * stream.uniform(), if stream.uniform() < 0.5 { -1.0 } else { 1.0 });
    Box::new(move |share| {
        let (sin, cos) = turn(turns * share);
        let radius = inner + (1.0 - inner) * (0.5 + 0.5 * turn(share).1);
        [radius * cos, sense * radius * sin]
    })
}

/// The places moved and scaled as little as makes them fit; random curves, which are of any size, fill the room they have.
fn fitted(places: Vec<[f64; 2]>, config: &TrajectoryConfig) -> Vec<[f64; 2]> {
    let fills = config.kind == TrajectoryKind::Random;
    let axis = |axis: usize, half: f64| {
        let values = places.iter().map(|place| place[axis]);
        let low = values.clone().fold(f64::INFINITY, f64::min);
        let high = values.fold(f64::NEG_INFINITY, f64::max);
        let (middle, reach) = if fills { ((low + high) / 2.0, (high - low) / 2.0) } else { (0.0, 1.0) };
        move |value: f64| half * (value - middle) / reach.max(1e-9)
    };
    let (x, y) = (axis(0, config.half_x_m), axis(1, config.half_y_m));
    let [middle_x, middle_y] = config.middle_m;
    places.iter().map(|&[a, b]| [middle_x + x(a), middle_y + y(b)]).collect()
}

/// When each place of a closed line is passed, heading along it, no faster and turning no faster than allowed.
fn drive(places: &[[f64; 2]], config: &TrajectoryConfig) -> Vec<(f64, Pose)> {
    let count = places.len();
    let place = |i: usize| places[i % count];
    let mut knots: Vec<(f64, Pose)> = Vec::with_capacity(count + 1);
    let mut time = 0.0;
    for i in 0..=count {
        let ([x_m, y_m], [x0, y0], [x1, y1]) = (place(i), place(i + count - 1), place(i + 1));
        let direction = libm::atan2(y1 - y0, x1 - x0);
        let mut heading_rad = direction;
        if let Some((_, last)) = knots.last() {
            heading_rad = last.heading_rad + wrapped(direction - last.heading_rad);
            let way = libm::hypot(x_m - last.x_m, y_m - last.y_m);
            let turned = (heading_rad - last.heading_rad).abs();
            time += (way / config.speed_mps).max(turned / config.turn_radps).max(1e-9);
        }
        knots.push((time, Pose { x_m, y_m, heading_rad }));
    }
    knots
}

/// An angle in −π..=π.
fn wrapped(angle: f64) -> f64 {
    libm::remainder(angle, std::f64::consts::TAU)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paths() -> impl Iterator<Item = (TrajectoryConfig, Path)> {
        let cases =
            TrajectoryKind::ALL.into_iter().flat_map(|kind| (0..6).map(move |episode| (kind, episode)));
        cases.map(|(kind, episode)| {
            let config = TrajectoryConfig { kind, ..TrajectoryConfig::default() };
            let path = Path::new(&config, TrialKey { episode, ..TrialKey::default() }, 0).unwrap();
            (config, path)
        })
    }

    #[test]
    fn paths_are_closed_and_stay_inside_and_within_the_limits() {
        for (config, path) in paths() {
            let period = path.period_s();
            let (first, again) = (path.at(0.0).pose, path.at(period).pose);
            assert_eq!(first, again, "{config:?}");
            assert!((path.at(period - 1e-7).pose.x_m - first.x_m).abs() < 1e-6, "{config:?}");
            for step in 0..2000 {
                let Moving { pose, velocity_mps: [vx, vy], turn_radps } =
                    path.at(period * f64::from(step) / 2000.0);
                assert!(pose.x_m.abs() < config.half_x_m + 1e-9 && pose.y_m.abs() < config.half_y_m + 1e-9);
                assert!(libm::hypot(vx, vy) < config.speed_mps + 1e-9);
                assert!(turn_radps.abs() < config.turn_radps + 1e-9);
            }
        }
    }

    /// Robots cannot slip: they go where they head.
    #[test]
    fn headings_point_along_the_path() {
        for (config, path) in paths() {
            for step in 0..500 {
                let Moving { pose, velocity_mps: [vx, vy], .. } =
                    path.at(path.period_s() * f64::from(step) / 500.0);
                let (sin, cos) = libm::sincos(pose.heading_rad);
                let (along, aside) = (vx * cos + vy * sin, vy * cos - vx * sin);
                assert!(
                    along > 0.0 && aside.abs() < 0.02 * along + 1e-3,
                    "{config:?} {step}: {along} {aside}"
                );
            }
        }
    }
}
