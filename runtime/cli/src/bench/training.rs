//! Steps of training: the simulator, observation, exploration, replay and an update.

use mpgx_lang::plan::Plan;
use mpgx_learn::Transition;
use mpgx_sim::{EpisodeKey, Mode, Task};

use super::Figure;
use super::learners::learner;
use super::stopwatch::{Windows, seconds_a_run};
use crate::failure::{Exit, Failure};

/// Of one learner on the task of [`super::tracking`].
pub fn figure(windows: Windows, plan: &Plan, batch: usize) -> Result<Figure, Failure> {
    let internal = |error: &dyn std::fmt::Display| Failure::new(Exit::Internal, error.to_string());
    let task = Task::new(plan, &plan.world).map_err(|error| internal(&error))?;
    let (what, mut learner) = learner(plan, task.state_len(), task.action_len())?;
    let mut world = task.episode();
    let (mut state, mut action) = (vec![0.0; task.state_len()], vec![0.0; task.action_len()]);
    let (mut next, mut number, mut failed) = (state.clone(), 0, None);
    let mut step = || {
        if world.time_steps() == task.horizon() || number == 0 {
            number += 1;
            let key = EpisodeKey { episode: number, ..EpisodeKey::default() };
            task.reset(&mut world, key).map_err(|error| internal(&error))?;
            task.observe(&world, &mut state);
        }
        learner.explore(&state, &mut action);
        let reward = task.step(&mut world, &action, Mode::Evaluate).reward as f32;
        task.observe(&world, &mut next);
        let transition = Transition { state: &state, action: &action, reward, next: &next, failure: false };
        learner.step([transition]).map_err(|error| internal(&error))?;
        std::mem::swap(&mut state, &mut next);
        Ok(())
    };
    for _ in 0..100 + batch {
        step()?;
    }
    let seconds = seconds_a_run(windows, || failed = failed.take().or(step().err()));
    match failed {
        Some(failure) => Err(failure),
        None => Ok(Figure::new(format!("{what}, batch {batch}, tracking"), 1.0 / seconds, "steps/s")),
    }
}
