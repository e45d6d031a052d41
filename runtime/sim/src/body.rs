//! Bodies: how an agent answers a velocity command.

use mpgx_lang::plan::{Extern, Place};

use crate::error::SimError;
use crate::maths::{Vec2, add, clamp, scale, subtract, wrap};
use crate::settings::{Settings, list};

/// The names of all bodies.
pub const BODIES: &[&str] = &["point", "unicycle"];

/// The settings that a body reads; `None` if there is no such body.
pub fn body_settings(name: &str) -> Option<&'static [&'static str]> {
    match name {
        "point" => Some(&[]),
        "unicycle" => Some(&["hand", "drive", "turn", "rate"]),
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

/// Kinematics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Body {
    /// Moves as commanded.
    Point,
    Unicycle(Unicycle),
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
    /// Reads a body for a world of time step `dt_s`.
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
        if what.name == "point" {
            return Ok(Body::Point);
        }
        let inner = (dt_s * settings.positive("rate", false)?).round().max(1.0);
        if inner > MOST_INNER {
            return Err(SimError::OutOfRange {
                what: "number of inner steps (`dt` times `rate`)".into(),
                value: inner,
                must: "at most 100000",
                at: at.clone(),
            });
        }
        Ok(Body::Unicycle(Unicycle {
            hand_m: settings.positive("hand", false)?,
            drive_mps: settings.range("drive")?,
            turn_radps: settings.range("turn")?,
            inner: inner as usize,
            inner_s: dt_s / inner,
        }))
    }

    pub fn has_heading(&self) -> bool {
        matches!(self, Body::Unicycle(_))
    }

    /// Where `pose` is after `dt_s` seconds of the velocity `command` (m/s, each axis).
    pub fn moved(&self, pose: Pose, command: Vec2, dt_s: f64) -> Pose {
        match self {
            Body::Point => Pose { position: add(pose.position, scale(command, dt_s)), ..pose },
            Body::Unicycle(unicycle) => unicycle.moved(pose, command),
        }
    }
}

impl Unicycle {
    /// The inner loop: at each of its steps the commanded velocity a of the hand point becomes
    ///
    /// v = cos θ a_x + sin θ a_y,  ω = (−sin θ a_x + cos θ a_y) / hand,
    ///
    /// the inverse of the hand point's kinematics ṗ = v (cos θ, sin θ) + hand ω (−sin θ, cos θ), each clipped to
    /// its limits. The axle then runs along the exact arc of (v, ω): a chord of length v τ sinc(ω τ / 2) in the
    /// direction θ + ω τ / 2.
    fn moved(&self, pose: Pose, command: Vec2) -> Pose {
        let Pose { mut position, mut heading } = pose;
        let (sin, cos) = libm::sincos(heading);
        let mut ahead = [cos, sin];
        for _ in 0..self.inner {
            let (v, omega) = self.wheels(ahead, command);
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

    /// (v, ω) within their limits, for the direction `ahead` = (cos θ, sin θ).
    fn wheels(&self, ahead: Vec2, command: Vec2) -> (f64, f64) {
        let v = ahead[0] * command[0] + ahead[1] * command[1];
        let omega = (-ahead[1] * command[0] + ahead[0] * command[1]) / self.hand_m;
        (clamp(v, self.drive_mps.0, self.drive_mps.1), clamp(omega, self.turn_radps.0, self.turn_radps.1))
    }
}

/// A direction turned by an angle whose sine and cosine are known.
fn turned(a: Vec2, sin: f64, cos: f64) -> Vec2 {
    [a[0] * cos - a[1] * sin, a[0] * sin + a[1] * cos]
}
