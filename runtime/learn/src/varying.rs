//! Numbers that may change over training.

use std::f64::consts::PI;

use mpgx_lang::plan::{Curve, Schedule};

/// A setting that is a number or a schedule over the share of training done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Varying {
    Constant(f64),
    Scheduled(Schedule),
}

impl From<f64> for Varying {
    fn from(value: f64) -> Self {
        Varying::Constant(value)
    }
}

impl Varying {
    /// The value when the share `done` of training, 0 to 1, is over.
    pub fn at(&self, done: f64) -> f64 {
        match self {
            Varying::Constant(value) => *value,
            Varying::Scheduled(schedule) => value(schedule, done),
        }
    }

    /// Both ends, between which all values lie.
    pub(crate) fn ends(&self) -> [f64; 2] {
        match self {
            Varying::Constant(value) => [*value; 2],
            Varying::Scheduled(Schedule { from, to, .. }) => [*from, *to],
        }
    }
}

fn value(schedule: &Schedule, done: f64) -> f64 {
    let Schedule { curve, from, to, begin, end } = *schedule;
    if done >= end {
        return to;
    }
    if done <= begin {
        return from;
    }
    let way = (done - begin) / (end - begin);
    match curve {
        Curve::Linear => from + (to - from) * way,
        Curve::Cosine => to + (from - to) * 0.5 * (1.0 + libm::cos(PI * way)),
        Curve::Geometric => from * libm::pow(to / from, way),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn schedules_run_along_their_curves() {
        let at = |curve, done: [f64; 7]| {
            let schedule = Schedule { curve, from: 8.0, to: 2.0, begin: 0.2, end: 0.6 };
            done.map(|done| Varying::Scheduled(schedule).at(done))
        };
        let done = [0.0, 0.2, 0.3, 0.4, 0.5, 0.6, 1.0];
        let half_root = 0.5 * f64::sqrt(0.5);
        for (curve, expected) in [
            (Curve::Linear, [8.0, 8.0, 6.5, 5.0, 3.5, 2.0, 2.0]),
            (Curve::Cosine, [8.0, 8.0, 5.0 + 6.0 * half_root, 5.0, 5.0 - 6.0 * half_root, 2.0, 2.0]),
            (Curve::Geometric, [8.0, 8.0, 8.0 / f64::sqrt(2.0), 4.0, 2.0 * f64::sqrt(2.0), 2.0, 2.0]),
        ] {
            let found = at(curve, done);
            let near = found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12);
            assert!(near, "{curve:?}: {found:?}");
            // Before and after, to the bit.
            assert_eq!([found[0], found[1], found[5], found[6]], [8.0, 8.0, 2.0, 2.0]);
        }
        let jump = Schedule { curve: Curve::Linear, from: 8.0, to: 2.0, begin: 0.5, end: 0.5 };
        assert_eq!([0.49, 0.5, 0.51].map(|done| Varying::Scheduled(jump).at(done)), [8.0, 2.0, 2.0]);
        assert_eq!([0.0, 0.3, 1.0].map(|done| Varying::from(0.1).at(done)), [0.1; 3]);
    }
}
