//! Steps of the simulator, observation and reset included.

use mpgx_sim::{EpisodeKey, Mode, Task};

use super::Figure;
use super::stopwatch::{Windows, seconds_a_run};
use crate::scenario;

/// Scenarios that differ in their bodies.
const SCENARIOS: [&str; 3] = ["track_random", "square_unison_points", "square_unison"];

pub fn figures(windows: Windows) -> Vec<Figure> {
    SCENARIOS.iter().filter_map(|name| one(windows, name)).collect()
}

/// An environment by itself; none if the scenario is not there.
fn one(windows: Windows, name: &str) -> Option<Figure> {
    let plan = scenario::compile(name, &[]).ok()?.plan?;
    let task = Task::new(&plan, &plan.world).ok()?;
    let (mut episode, mut number) = (task.episode(), 0);
    let mut state = vec![0.0; task.state_len()];
    let action: Vec<f32> = (0..task.action_len()).map(|k| 0.5 * (k as f32 - 1.0)).collect();
    let seconds = seconds_a_run(windows, || {
        number += 1;
        let key = EpisodeKey { episode: number, ..EpisodeKey::default() };
        if task.reset(&mut episode, key).is_ok() {
            for _ in 0..task.horizon() {
                task.step(&mut episode, &action, Mode::Evaluate);
                task.observe(&episode, &mut state);
            }
        }
    });
    let agents = task.agents();
    let step = seconds / task.horizon() as f64;
    Some(Figure::new(format!("{name}, {agents} agents"), step * 1e6, "µs a step"))
}
