//! The task that learners are timed on: one follower tracks a leader of random velocity.

use mpgx_lang::plan::Plan;
use mpgx_lang::source::NoFiles;
use mpgx_learn::ALGORITHMS;

use crate::failure::{Exit, Failure};

/// State 4, action 2.
const WORLD: &str = "scenario bench
use std.motion.random_velocity
use std.start.uniform_in
world { dt = 0.1 s, horizon = 200 steps, safety = 0.1 m }
agent leader : point {
    arena = box(-1 m .. 1 m, -1 m .. 1 m)
    speed = -0.5 m/s .. 0.5 m/s
    motion = random_velocity
    start ~ uniform_in(arena)
}
agent follower : point {
    speed = -0.7 m/s .. 0.7 m/s
    control = learned
    start ~ uniform_in(box(-1 m .. 1 m, -1 m .. 1 m))
}
observe { p[leader], p[follower] }
reward { gap = -|p[leader] - p[follower]| }
";

/// The task with an algorithm as the standard library sets it, but for the mini-batch and the backend.
pub fn plan(algorithm: &str, batch: usize, backend: &str) -> Result<Plan, Failure> {
    if !ALGORITHMS.contains(&algorithm) {
        let message = format!("there is no algorithm `{algorithm}`");
        return Err(
            Failure::new(Exit::BadInput, message).help(format!("known are {}", ALGORITHMS.join(", ")))
        );
    }
    let text =
        format!("{WORLD}learn {algorithm} {{ batch = {batch}, replay = 100000, backend = {backend} }}\n");
    let compilation = mpgx_lang::compile("bench.scn", text, &[], &NoFiles);
    compilation.plan.ok_or_else(|| Failure::new(Exit::Internal, "the task of the bench does not compile"))
}

#[cfg(test)]
mod tests {
    #[test]
    fn it_compiles_for_every_algorithm() {
        for name in super::ALGORITHMS {
            super::plan(name, 16, "native").unwrap();
        }
    }
}
