//! Steps of the simulator, observation and reset included: one environment by itself, several as a batch.

use mpgx_sim::{EpisodeKey, Mode, Task};

use super::Figure;
use super::stopwatch::{Windows, seconds_a_run};
use crate::scenario;

/// Scenarios that differ in their bodies.
const SCENARIOS: [&str; 3] = ["track_random", "square_unison_points", "square_unison"];

/// Each scenario with each number of environments.
pub fn figures(windows: Windows, counts: &[usize]) -> Vec<Figure> {
    let tasks = SCENARIOS.into_iter().filter_map(|name| {
        let plan = scenario::compile(name, &[]).ok()?.plan?;
        Some((name, Task::new(&plan, &plan.world).ok()?))
    });
    tasks
        .flat_map(|(name, task)| {
            counts.iter().map(move |&count| figure(windows, name, &task, count)).collect::<Vec<_>>()
        })
        .collect()
}

fn figure(windows: Windows, name: &str, task: &Task, count: usize) -> Figure {
    let actions: Vec<f32> = (0..count * task.action_len()).map(|k| (k as f32).sin()).collect();
    let mut states = vec![0.0; count * task.state_len()];
    let mut number = 0;
    let mut key = || {
        number += 1;
        EpisodeKey { episode: number, ..EpisodeKey::default() }
    };
    let seconds = if count == 1 {
        let mut episode = task.episode();
        seconds_a_run(windows, || {
            if task.reset(&mut episode, key()).is_ok() {
                for _ in 0..task.horizon() {
                    task.step(&mut episode, &actions, Mode::Evaluate);
                    task.observe(&episode, &mut states);
                }
            }
        })
    } else {
        let (mut batch, mut keys) = (task.batch(count), vec![EpisodeKey::default(); count]);
        seconds_a_run(windows, || {
            keys.fill_with(&mut key);
            if task.reset_batch(&mut batch, &keys).is_ok() {
                for _ in 0..task.horizon() {
                    task.step_batch(&mut batch, &actions, Mode::Evaluate);
                    task.observe_batch(&batch, &mut states);
                }
            }
        })
    };
    let step = seconds / (task.horizon() * count) as f64;
    let what = format!("{name}, {count} × {} agents", task.agents());
    if count == 1 {
        Figure::new(what, step * 1e6, "µs a step")
    } else {
        Figure::new(what, task.agents() as f64 / step / 1e6, "million agent-steps/s")
    }
}
