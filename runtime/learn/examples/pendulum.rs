//! Pendulum-v1 with the settings of the standard library, seed by seed:
//! `cargo run --release -p mpgx-learn --example pendulum -- "td3_original" 150 5`: what stands after `learn`
//! in a scenario, episodes, seeds.

use std::error::Error;
use std::time::Instant;

use mpgx_lang::source::NoFiles;
use mpgx_learn::{Config, pendulum};

/// The language wants a world; only its learner is used.
const WORLD: &str = "scenario pendulum
use std.start.uniform_in
world { dt = 0.05 s, horizon = 200 steps }
agent pole : point {
    speed = -1 m/s .. 1 m/s
    control = learned
    start ~ uniform_in(box(-1 m .. 1 m, -1 m .. 1 m))
}
observe { p[pole] }
reward { gap = -|p[pole]| }
";
/// The mean over 100 episodes still depends on where they start, by about 10.
const HELD_OUT: usize = 1000;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let learner = arguments.next().unwrap_or("td3_original".to_owned());
    let mut number = |default| arguments.next().map_or(Ok(default), |text| text.parse::<u32>());
    let (episodes, seeds) = (number(150)?, number(5)?);
    let compilation = mpgx_lang::compile("pendulum.scn", format!("{WORLD}learn {learner}\n"), &[], &NoFiles);
    let plan = compilation.plan.ok_or_else(|| format!("{:?}", compilation.problems))?;
    let config = Config::from_extern(&plan.learners[0].what)?;
    for seed in 0..seeds {
        let began = Instant::now();
        let (returns, mut policy) = pendulum::train(config.clone(), episodes, seed)?;
        let held_out = pendulum::evaluate(&mut policy, HELD_OUT as u32);
        let last = &returns[returns.len().saturating_sub(10)..];
        println!(
            "seed {seed}: {:8.1} in 100 held-out episodes, {:8.1} in {HELD_OUT}, {:8.1} in the last {} of training, {:.0} s",
            mean(&held_out[..100]),
            mean(&held_out),
            mean(last),
            last.len(),
            began.elapsed().as_secs_f64(),
        );
    }
    Ok(())
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}
