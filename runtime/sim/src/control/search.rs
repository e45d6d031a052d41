//! The search for the velocity command that misses least.

use crate::maths::{Vec2, add, clamp_axes, rotate};

/// Good enough.
pub(super) const CLOSE_M: f64 = 1e-6;
/// Commands on each axis of the grid.
pub(super) const GRID: usize = 5;
/// The pattern turns by this many rad each time, so that no direction is left out: the limits of the wheels
/// make ridges that run anywhere.
const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;
/// The pattern shrinks after so many failures.
const PATIENCE: usize = 2;

/// Commands spread evenly between the limits, `size` on each axis.
pub(super) fn grid((low, high): (f64, f64), size: usize) -> impl Iterator<Item = Vec2> {
    let along = move |k: usize| low + (high - low) * (k as f64 / (size - 1) as f64);
    (0..size * size).map(move |k| [along(k / size), along(k % size)])
}

/// Runs the `most` best of some searches, down to `finest` m/s; gives the one that found the least.
pub(super) fn search<F: Fn(Vec2) -> f64>(
    mut starts: Vec<Search<F>>,
    most: usize,
    finest: f64,
) -> Option<Search<F>> {
    starts.sort_by(|a, b| a.least.total_cmp(&b.least));
    starts.truncate(most);
    starts.iter_mut().for_each(|start| start.run(finest));
    starts.into_iter().min_by(|a, b| a.least.total_cmp(&b.least))
}

/// A search from one command on.
pub(super) struct Search<F> {
    /// How far a command misses: a length, or a sum of lengths.
    miss: F,
    limits: (f64, f64),
    /// The best command so far, and how far it misses.
    pub best: Vec2,
    pub least: f64,
}

impl<F: Fn(Vec2) -> f64> Search<F> {
    pub fn new(miss: F, limits: (f64, f64), best: Vec2) -> Self {
        let least = miss(best);
        Search { miss, limits, best, least }
    }

    /// Tries a command; tells whether it is better.
    fn offer(&mut self, command: Vec2) -> bool {
        let miss = (self.miss)(command);
        let better = miss < self.least;
        if better {
            (self.best, self.least) = (command, miss);
        }
        better
    }

    /// Tries patterns of four commands around the best that become smaller, down to `finest` m/s.
    fn run(&mut self, finest: f64) {
        let (mut turn, mut failures) = (0.0, 0);
        let mut reach = (self.limits.1 - self.limits.0) / (GRID - 1) as f64;
        while reach > finest && self.least > CLOSE_M {
            turn += GOLDEN_ANGLE;
            let centre = self.best;
            let [x, y] = rotate([reach, 0.0], turn);
            let mut better = false;
            for step in [[x, y], [-y, x], [-x, -y], [y, -x]] {
                better |= self.offer(clamp_axes(add(centre, step), self.limits));
            }
            failures = if better { 0 } else { failures + 1 };
            if failures == PATIENCE {
                (reach, failures) = (reach / 2.0, 0);
            }
        }
    }
}
