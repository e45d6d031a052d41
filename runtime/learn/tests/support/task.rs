//! A tiny task: a point on a line is to be at 0.

use mpgx_learn::{Config, LearnError, Learner, Transition};

pub const STATE: usize = 2;
pub const ACTION: usize = 1;
/// Steps of an episode.
pub const HORIZON: u32 = 20;

/// Position in [−1, 1], and a constant.
pub struct Task {
    x: f32,
    steps: u32,
}

pub fn learner(config: &Config, seed: u32) -> Learner {
    Learner::new(config.clone(), STATE, ACTION, 1, seed).unwrap()
}

impl Task {
    pub fn new() -> Self {
        Self { x: 0.7, steps: 0 }
    }

    /// One step of training; an episode begins on one side and the other in turn, and fails at the border.
    pub fn step(&mut self, learner: &mut Learner) -> Result<(), LearnError> {
        let (state, mut action) = ([self.x, 1.0], [0.0]);
        learner.explore(&state, &mut action);
        self.x = (self.x + 0.3 * action[0]).clamp(-1.0, 1.0);
        self.steps += 1;
        let failure = self.x.abs() == 1.0;
        let reward = -self.x.abs();
        learner.step([Transition {
            state: &state,
            action: &action,
            reward,
            next: &[self.x, 1.0],
            failure,
        }])?;
        if failure || self.steps.is_multiple_of(HORIZON) {
            learner.end_episode();
            self.x = if self.x > 0.0 { -0.7 } else { 0.7 };
        }
        Ok(())
    }

    pub fn steps(&mut self, learner: &mut Learner, steps: u32) {
        (0..steps).for_each(|_| self.step(learner).unwrap());
    }
}

pub fn saved(learner: &Learner) -> Vec<u8> {
    let mut bytes = Vec::new();
    learner.save(&mut bytes);
    bytes
}
