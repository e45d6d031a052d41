//! Bodies: how an agent answers a velocity command.

mod lanes;

use mpgx_lang::plan::{Extern, Place};

use crate::error::SimError;
use crate::maths::{Vec2, add, clamp, cross, dot, norm, rotate, scale, subtract, wrap};
use crate::settings::{Settings, list};

/// The names of all bodies.
pub const BODIES: &[&str] = &["point", "unicycle", "steered", "holonomic"];

/// The settings that a body reads; `None` if there is no such body.
pub fn body_settings(name: &str) -> Option<&'static [&'static str]> {
    match name {
        "point" => Some(&["acceleration"]),
        "unicycle" => Some(&["hand", "drive", "turn", "rate", "acceleration"]),
        "steered" => Some(&["hand", "drive", "turn", "acceleration"]),
        "holonomic" => Some(&["turn", "acceleration"]),
        _ => None,
    }
}

/// Where an agent is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pose {
    /// m; of a unicycle, its hand point.
    pub position: Vec2,
    /// rad in (−π, π]; 0 for bodies without one.
    pub heading: f64,
}

/// How an agent moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Body {
    kinematics: Kinematics,
    /// The most that the command may change by in a step (a norm), m/s.
    change_mps: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kinematics {
    /// Moves as commanded.
    Point,
    Unicycle(Unicycle),
    /// A unicycle that is commanded in its own frame: ahead, and what the turn moves the hand point to the left.
    Steered(Unicycle),
    /// Moves as commanded and turns its heading towards where it is told to go, within these limits of the
    /// turn rate, rad/s.
    Holonomic {
        turn_radps: (f64, f64),
    },
}

/// A robot on two driven wheels, commanded by the velocity of its hand point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Unicycle {
    /// Distance of the hand point from the axle, m.
    hand_m: f64,
    /// Limits of the forward velocity, m/s.
    drive_mps: (f64, f64),
    /// Limits of the turn rate, rad/s.
    turn_radps: (f64, f64),
    /// Steps of the inner loop in one step of the world, and their length in s.
    inner: usize,
    inner_s: f64,
}

/// An inner loop of more steps than this in one step of the world is refused.
const MOST_INNER: f64 = 1e5;

impl Body {
    /// What moves as it is told.
    pub const POINT: Body = Body { kinematics: Kinematics::Point, change_mps: f64::INFINITY };

    /// Reads a body for a world of time step `dt_s`. Without `acceleration` there is no limit of it.
    pub fn new(what: &Extern, dt_s: f64, at: &Place) -> Result<Body, SimError> {
        let Some(known) = body_settings(&what.name) else {
            return Err(SimError::Unknown {
                kind: "body",
                name: what.name.clone(),
                known: list(BODIES),
                at: at.clone(),
            });
        };
        let settings = Settings::new(what, known, at)?;
        let kinematics = match what.name.as_str() {
            "unicycle" => {
                let inner = (dt_s * settings.positive("rate", false)?).round().max(1.0);
                Kinematics::Unicycle(Unicycle::new(&settings, dt_s, inner, at)?)
            }
            "steered" => Kinematics::Steered(Unicycle::new(&settings, dt_s, 1.0, at)?),
            "holonomic" => Kinematics::Holonomic { turn_radps: settings.range("turn")? },
            _ => Kinematics::Point,
        };
        let change_mps = match settings.has("acceleration") {
            true => settings.positive("acceleration", false)? * dt_s,
            false => f64::INFINITY,
        };
        Ok(Body { kinematics, change_mps })
    }

    pub fn has_heading(&self) -> bool {
        self.kinematics != Kinematics::Point
    }

    /// Distance of the position from the axle, m; 0 without one.
    pub fn hand_m(&self) -> f64 {
        match &self.kinematics {
            Kinematics::Unicycle(unicycle) | Kinematics::Steered(unicycle) => unicycle.hand_m,
            Kinematics::Point | Kinematics::Holonomic { .. } => 0.0,
        }
    }

    /// Whether it needs its heading to go where it is commanded to, on the axes of the world.
    pub fn turns_commands(&self) -> bool {
        matches!(self.kinematics, Kinematics::Unicycle(_) | Kinematics::Holonomic { .. })
    }

    /// Whether the position follows the command, whatever the heading.
    pub fn goes_anywhere(&self) -> bool {
        !matches!(self.kinematics, Kinematics::Unicycle(_) | Kinematics::Steered(_))
    }

    /// The command that asks for a velocity at a heading, m/s.
    pub fn command(&self, heading: f64, velocity: Vec2) -> Vec2 {
        if matches!(self.kinematics, Kinematics::Steered(_)) { rotate(velocity, -heading) } else { velocity }
    }

    /// The command that the limit of the acceleration leaves of `command` after that of the step before, m/s.
    pub fn limited(&self, before: Vec2, command: Vec2) -> Vec2 {
        let change = subtract(command, before);
        if dot(change, change) > self.change_mps * self.change_mps {
            add(before, scale(change, self.change_mps / norm(change)))
        } else {
            command
        }
    }

    /// Where `pose` is after `dt_s` seconds of the velocity `command` (m/s, each axis).
    pub fn moved(&self, pose: Pose, command: Vec2, dt_s: f64) -> Pose {
        let shifted = || Pose { position: add(pose.position, scale(command, dt_s)), ..pose };
        match &self.kinematics {
            Kinematics::Point => shifted(),
            Kinematics::Unicycle(unicycle) => {
                unicycle.moved(pose, |ahead| [dot(ahead, command), cross(ahead, command)])
            }
            Kinematics::Steered(unicycle) => unicycle.moved(pose, |_| command),
            Kinematics::Holonomic { .. } if command == [0.0; 2] => pose,
            &Kinematics::Holonomic { turn_radps: (low, high) } => {
                let way = wrap(libm::atan2(command[1], command[0]) - pose.heading);
                let heading = wrap(pose.heading + clamp(way, low * dt_s, high * dt_s));
                Pose { heading, ..shifted() }
            }
        }
    }
}

impl Unicycle {
    fn new(settings: &Settings, dt_s: f64, inner: f64, at: &Place) -> Result<Unicycle, SimError> {
        if inner > MOST_INNER {
            return Err(SimError::OutOfRange {
                what: "number of inner steps (`dt` times `rate`)".into(),
                value: inner,
                must: "at most 100000",
                at: at.clone(),
            });
        }
        Ok(Unicycle {
            hand_m: settings.positive("hand", false)?,
            drive_mps: settings.range("drive")?,
            turn_radps: settings.range("turn")?,
            inner: inner as usize,
            inner_s: dt_s / inner,
        })
    }

    /// The inner loop: at each of its steps the commanded velocity a of the hand point becomes
    ///
    /// v = cos θ a_x + sin θ a_y,  ω = (−sin θ a_x + cos θ a_y) / hand,
    ///
    /// the inverse of the hand point's kinematics ṗ = v (cos θ, sin θ) + hand ω (−sin θ, cos θ), each clipped to
    /// its limits. The axle then runs along the exact arc of (v, ω): a chord of length v τ sinc(ω τ / 2) in the
    /// direction θ + ω τ / 2.
    ///
    /// `command` gives a in the robot's own frame for its direction (cos θ, sin θ).
    fn moved(&self, pose: Pose, command: impl Fn(Vec2) -> Vec2) -> Pose {
        let Pose { mut position, mut heading } = pose;
        let (sin, cos) = libm::sincos(heading);
        let mut ahead = [cos, sin];
        for _ in 0..self.inner {
            let (v, omega) = self.wheels(command(ahead));
            let half = omega * self.inner_s / 2.0;
            let (sin, cos) = libm::sincos(half);
            let sinc = if half == 0.0 { 1.0 } else { sin / half };
            let middle = turned(ahead, sin, cos);
            let after = turned(middle, sin, cos);
            let axle = scale(middle, v * self.inner_s * sinc);
            position = add(position, add(axle, scale(subtract(after, ahead), self.hand_m)));
            heading += 2.0 * half;
            ahead = after;
        }
        Pose { position, heading: wrap(heading) }
    }

    /// (v, ω) within their limits, for a velocity of the hand point ahead and to the left.
    fn wheels(&self, [v, left]: Vec2) -> (f64, f64) {
        let omega = left / self.hand_m;
        (clamp(v, self.drive_mps.0, self.drive_mps.1), clamp(omega, self.turn_radps.0, self.turn_radps.1))
    }
}

/// A direction turned by an angle whose sine and cosine are known.
fn turned(a: Vec2, sin: f64, cos: f64) -> Vec2 {
    [a[0] * cos - a[1] * sin, a[0] * sin + a[1] * cos]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::maths::{distance, rotate};
    use mpgx_lang::plan::Setting;
    use proptest::prelude::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    const DT: f64 = 0.1;

    fn unicycle(hand_m: f64, drive: f64, turn: f64, rate: f64) -> Body {
        let settings = [
            ("hand", Setting::Number(hand_m)),
            ("drive", Setting::Range(-drive, drive)),
            ("turn", Setting::Range(-turn, turn)),
            ("rate", Setting::Number(rate)),
        ];
        let settings = settings.map(|(name, value)| (name.to_string(), value)).into();
        Body::new(&Extern { name: "unicycle".into(), settings }, DT, &Place::default()).unwrap()
    }

    fn pose(x: f64, y: f64, heading: f64) -> Pose {
        Pose { position: [x, y], heading }
    }

    fn assert_near(found: Pose, expected: Pose) {
        let near = distance(found.position, expected.position) < 1e-12
            && (found.heading - expected.heading).abs() < 1e-12;
        assert!(near, "{found:?} is not {expected:?}");
    }

    fn axle(pose: Pose, hand_m: f64) -> Vec2 {
        subtract(pose.position, rotate([hand_m, 0.0], pose.heading))
    }

    #[test]
    fn a_point_moves_as_commanded() {
        assert_eq!(Body::POINT.moved(pose(1.0, 2.0, 0.0), [0.5, -0.25], DT), pose(1.05, 1.975, 0.0));
    }

    /// Axle at the origin, hand 0.15 m ahead, command (0.5, 0.15) m/s: v = 0.5 m/s, ω = 0.15 / 0.15 = 1 rad/s.
    /// The arc has the radius 0.5 m and turns by 0.1 rad.
    #[test]
    fn a_unicycle_follows_an_arc() {
        let (sin, cos) = (0.099_833_416_646_828_15, 0.995_004_165_278_025_8);
        let expected = pose(0.5 * sin + 0.15 * cos, 0.5 * (1.0 - cos) + 0.15 * sin, 0.1);
        let body = unicycle(0.15, 1.0, 5.0, 10.0);
        assert_near(body.moved(pose(0.15, 0.0, 0.0), [0.5, 0.15], DT), expected);
    }

    /// The same arc, commanded in the robot's own frame, whatever its heading.
    #[test]
    fn a_steered_robot_follows_the_same_arc() {
        let settings = [
            ("hand", Setting::Number(0.15)),
            ("drive", Setting::Range(-1.0, 1.0)),
            ("turn", Setting::Range(-5.0, 5.0)),
        ];
        let settings = settings.map(|(name, value)| (name.to_string(), value)).into();
        let body = Body::new(&Extern { name: "steered".into(), settings }, DT, &Place::default()).unwrap();
        let (sin, cos) = (0.099_833_416_646_828_15, 0.995_004_165_278_025_8);
        let expected = [0.5 * sin + 0.15 * cos, 0.5 * (1.0 - cos) + 0.15 * sin];
        assert_near(body.moved(pose(0.15, 0.0, 0.0), [0.5, 0.15], DT), pose(expected[0], expected[1], 0.1));
        let up = body.moved(pose(0.0, 0.15, FRAC_PI_2), [0.5, 0.15], DT);
        assert_near(up, pose(-expected[1], expected[0], FRAC_PI_2 + 0.1));
        assert!(distance(body.command(FRAC_PI_2, [0.0, 1.0]), [1.0, 0.0]) < 1e-12);
    }

    #[test]
    fn a_unicycle_runs_straight_along_its_heading() {
        let body = unicycle(0.15, 1.0, 5.0, 100.0);
        assert_near(body.moved(pose(0.0, 0.0, FRAC_PI_2), [0.0, 0.5], DT), pose(0.0, 0.05, FRAC_PI_2));
        assert_near(body.moved(pose(0.0, 0.0, FRAC_PI_2), [0.0, -0.5], DT), pose(0.0, -0.05, FRAC_PI_2));
    }

    /// A command of (1, 1) m/s would need v = 1 m/s and ω = 6.7 rad/s; it gets 0.2 m/s and 1 rad/s.
    #[test]
    fn limits_cut_the_command() {
        let (sin, cos) = (0.1f64.sin(), 0.1f64.cos());
        let expected = pose(0.2 * sin + 0.15 * cos, 0.2 * (1.0 - cos) + 0.15 * sin, 0.1);
        assert_near(unicycle(0.15, 0.2, 1.0, 10.0).moved(pose(0.15, 0.0, 0.0), [1.0, 1.0], DT), expected);
    }

    fn made(name: &str, settings: &[(&str, Setting)]) -> Body {
        let settings = settings.iter().map(|(name, value)| (name.to_string(), value.clone())).collect();
        Body::new(&Extern { name: name.into(), settings }, DT, &Place::default()).unwrap()
    }

    /// At most 0.2 rad to the left and 0.1 rad to the right in a step.
    #[test]
    fn a_holonomic_body_goes_as_told_and_turns_as_it_can() {
        let body = made("holonomic", &[("turn", Setting::Range(-1.0, 2.0))]);
        assert_near(body.moved(pose(1.0, 0.0, 0.0), [0.0, 0.5], DT), pose(1.0, 0.05, 0.2));
        assert_near(body.moved(pose(1.0, 0.0, 0.0), [0.0, -0.5], DT), pose(1.0, -0.05, -0.1));
        assert_near(body.moved(pose(0.0, 0.0, 1.5), [0.0, 0.5], DT), pose(0.0, 0.05, FRAC_PI_2));
        assert_near(body.moved(pose(0.0, 0.0, 3.0), [-0.5, -0.1], DT), pose(-0.05, -0.01, wrap(3.2)));
        assert_eq!(body.moved(pose(0.0, 0.0, 3.0), [0.0, 0.0], DT), pose(0.0, 0.0, 3.0));
        assert!(body.has_heading() && body.goes_anywhere());
    }

    /// 3 m/s² for 0.1 s are 0.3 m/s.
    #[test]
    fn the_command_changes_no_faster_than_the_acceleration_allows() {
        for (name, settings) in [("point", vec![]), ("holonomic", vec![("turn", Setting::Range(0.0, 0.0))])] {
            let mut settings = settings;
            settings.push(("acceleration", Setting::Number(3.0)));
            let body = made(name, &settings);
            let limited = body.limited([0.1, 0.2], [0.1 + 0.6, 0.2 - 0.8]);
            assert!(distance(limited, [0.1 + 0.18, 0.2 - 0.24]) < 1e-15, "{limited:?}");
            assert_eq!(body.limited([0.1, 0.2], [0.2, 0.4]), [0.2, 0.4]);
        }
        assert_eq!(Body::POINT.limited([-1e9, 0.0], [1e9, 0.3]), [1e9, 0.3]);
    }

    #[test]
    fn the_inner_loop_has_at_least_one_step_and_an_upper_limit() {
        for (rate, steps) in [(1.0, 1), (14.0, 1), (16.0, 2), (100.0, 10)] {
            let Kinematics::Unicycle(body) = unicycle(0.1, 1.0, 1.0, rate).kinematics else {
                panic!("a point")
            };
            assert_eq!((body.inner, body.inner_s), (steps, DT / steps as f64), "rate {rate}");
        }
        let mut what = Extern { name: "unicycle".into(), settings: Default::default() };
        what.settings.insert("rate".into(), Setting::Number(1e9));
        let refused = Body::new(&what, DT, &Place::default());
        assert!(matches!(refused, Err(SimError::OutOfRange { value: 1e8, .. })), "{refused:?}");
    }

    prop_compose! {
        fn any_pose()(x in -2.0..2.0, y in -2.0..2.0, heading in -PI..PI) -> Pose { pose(x, y, heading) }
    }

    prop_compose! {
        fn any_command()(x in -0.7..0.7, y in -0.7..0.7) -> Vec2 { [x, y] }
    }

    proptest! {
        #![proptest_config(crate::sample::cases(300))]

        /// The arcs against the differential equation ẋ = v cos θ, ẏ = v sin θ, θ̇ = ω of the axle,
        /// integrated by Simpson's rule.
        #[test]
        fn arcs_solve_the_equations_of_motion(
            start in any_pose(), a in any_command(), hand in 0.05..0.5, drive in 0.1..2.0, turn in 0.1..8.0,
        ) {
            let body = unicycle(hand, drive, turn, 40.0);
            let mut end = start;
            for _ in 0..4 {
                let (tau, theta) = (DT / 4.0, end.heading);
                let v = (theta.cos() * a[0] + theta.sin() * a[1]).clamp(-drive, drive);
                let omega = ((-theta.sin() * a[0] + theta.cos() * a[1]) / hand).clamp(-turn, turn);
                let rate = |t: f64| [v * (theta + omega * t).cos(), v * (theta + omega * t).sin()];
                let mut place = axle(end, hand);
                let pieces = 20;
                let h = tau / f64::from(pieces);
                for k in 0..pieces {
                    let t = f64::from(k) * h;
                    let (r0, r1, r2) = (rate(t), rate(t + h / 2.0), rate(t + h));
                    for k in 0..2 {
                        place[k] += h / 6.0 * (r0[k] + 4.0 * r1[k] + r2[k]);
                    }
                }
                let heading = theta + omega * tau;
                end = Pose { position: add(place, rotate([hand, 0.0], heading)), heading };
            }
            let found = body.moved(start, a, DT);
            prop_assert!(distance(found.position, end.position) < 1e-11, "{found:?} is not {end:?}");
            prop_assert!(wrap(found.heading - end.heading).abs() < 1e-11);
        }

        /// While an inner step of length τ lasts, the hand point moves with the commanded velocity a turned by
        /// at most |ω| τ, and |ω| ≤ |a| / hand; so it misses a dt by at most |a|² τ dt / (2 hand).
        #[test]
        fn the_hand_point_moves_as_commanded(
            start in any_pose(), a in any_command(), hand in 0.05..0.5, rate in 10.0..2000.0,
        ) {
            let body = unicycle(hand, 10.0, 100.0, rate);
            let Kinematics::Unicycle(Unicycle { inner_s, .. }) = body.kinematics else { panic!("a point") };
            let miss = distance(body.moved(start, a, DT).position, add(start.position, scale(a, DT)));
            let bound = norm(a).powi(2) * inner_s * DT / (2.0 * hand);
            prop_assert!(miss <= bound + 1e-14, "{miss} m, bound {bound} m");
        }

        #[test]
        fn the_axle_honours_its_limits(
            start in any_pose(), a in any_command(), hand in 0.05..0.5, drive in 0.0..1.0, turn in 0.0..3.0,
        ) {
            let end = unicycle(hand, drive, turn, 100.0).moved(start, a, DT);
            prop_assert!(distance(axle(start, hand), axle(end, hand)) <= drive * DT + 1e-12);
            prop_assert!(wrap(end.heading - start.heading).abs() <= turn * DT + 1e-12);
            prop_assert!(end.heading > -PI && end.heading <= PI);
        }
    }
}
