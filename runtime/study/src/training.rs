//! Training: a learner acts in a world and learns from what follows, step by step.

use mpgx_lang::plan::Method;
use mpgx_learn::{Config, LearnError, Learner, Policy, Transition};
use mpgx_sim::{Episode, EpisodeKey, Fault, Mode, Task};

use crate::cell::Cell;
use crate::checkpoint::{Course, Restored};
use crate::error::{StudyError, no_start};
use crate::record::{Health, Training};

/// Updates between two entries of the learner's health.
const HEALTH_EVERY: u64 = 500;

/// A learner in its world.
pub(crate) struct Trainer<'a> {
    task: &'a Task,
    method: &'a Method,
    key: EpisodeKey,
    budget: Budget,
    learner: Learner,
    pub course: Course,
    world: Episode,
    sums: Sums,
    state: Vec<f32>,
    action: Vec<f32>,
    next: Vec<f32>,
}

/// Training ends when one of the two is spent.
#[derive(Clone, Copy)]
struct Budget {
    steps: u64,
    episodes: u64,
}

/// What is summed over the episode that is going on.
#[derive(Default)]
struct Sums {
    steps: u64,
    reward: f64,
    error_m: f64,
    terms: Vec<f64>,
}

/// An episode of training that has ended.
pub(crate) struct Ended {
    pub total: f64,
    pub error_m: f64,
}

impl<'a> Trainer<'a> {
    pub fn new(task: &'a Task, cell: &'a Cell, master: u64) -> Result<Trainer<'a>, StudyError> {
        let method = &cell.method;
        let wrong = |error: LearnError| StudyError::Plan { cause: error.to_string(), at: method.at.clone() };
        let config = Config::from_extern(&method.what).map_err(wrong)?;
        let budget = Budget { steps: config.steps, episodes: config.episodes };
        let (states, actions) = (task.state_len(), task.action_len());
        Ok(Trainer {
            task,
            method,
            key: EpisodeKey { master, protocol: 0, seed: cell.seed, episode: 0 },
            budget,
            learner: Learner::new(config, states, actions, master, cell.seed).map_err(wrong)?,
            course: Course::default(),
            world: task.episode(),
            sums: Sums::default(),
            state: vec![0.0; states],
            action: vec![0.0; actions],
            next: vec![0.0; states],
        })
    }

    /// Goes on from a checkpoint. The trainer must be new, and is worth nothing after an error.
    pub fn resume(&mut self, restored: Restored) -> Result<(), Fault> {
        self.learner.restore(&restored.learner).map_err(|error| self.diverged(error))?;
        self.learner.restore_rows(&restored.rows).map_err(|error| self.diverged(error))?;
        self.course = restored.course;
        if self.learner.replay_pushed() != self.course.steps {
            let cause = "its replay does not fit its steps".to_string();
            return Err(Fault { cause, at: self.method.at.clone() });
        }
        if self.course.actions.is_empty() {
            return Ok(());
        }
        self.begin_episode()?;
        for action in self.course.actions.chunks(self.action.len().max(1)) {
            let step = self.task.step(&mut self.world, action, Mode::Train);
            self.sums.add(step.reward, step.error_m, self.world.terms());
        }
        self.task.observe(&self.world, &mut self.state);
        Ok(())
    }

    pub fn is_done(&self) -> bool {
        self.course.steps >= self.budget.steps || u64::from(self.course.episode) >= self.budget.episodes
    }

    /// The most steps that training may take.
    pub fn most_steps(&self) -> u64 {
        self.budget.steps.min(self.budget.episodes.saturating_mul(self.task.horizon() as u64))
    }

    /// One step of the world and the updates that follow; tells if an episode has ended with it. An episode
    /// that the budget cuts short leaves no entry in the record.
    pub fn step(&mut self) -> Result<Option<Ended>, Fault> {
        if self.course.actions.is_empty() {
            self.begin_episode()?;
        }
        self.learner.explore(&self.state, &mut self.action);
        let step = self.task.step(&mut self.world, &self.action, Mode::Train);
        if let Some(fault) = step.fault {
            return Err(*fault);
        }
        self.sums.add(step.reward, step.error_m, self.world.terms());
        self.task.observe(&self.world, &mut self.next);
        self.learner.set_progress(self.progress());
        let transition = Transition {
            state: &self.state,
            action: &self.action,
            reward: step.reward as f32,
            next: &self.next,
            failure: step.ended.is_some(),
        };
        self.learner.step(transition).map_err(|error| self.diverged(error))?;
        self.note_health();
        std::mem::swap(&mut self.state, &mut self.next);
        self.course.actions.extend_from_slice(&self.action);
        self.course.steps += 1;
        Ok((step.last || step.ended.is_some()).then(|| self.end_episode(step.ended)))
    }

    /// The learner's state, to be kept with [`Trainer::course`].
    pub fn save(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        self.learner.save(&mut bytes);
        bytes
    }

    /// The replay rows pushed since step `from`; each step pushes one.
    pub fn rows_since(&self, from: u64) -> Vec<u8> {
        let mut bytes = Vec::new();
        self.learner.replay_rows(from, &mut bytes);
        bytes
    }

    /// The share of the budget that is spent.
    fn progress(&self) -> f64 {
        let steps = self.course.steps as f64 / self.budget.steps as f64;
        let episodes = f64::from(self.course.episode) / self.budget.episodes as f64;
        steps.max(episodes)
    }

    fn begin_episode(&mut self) -> Result<(), Fault> {
        let key = EpisodeKey { episode: self.course.episode, ..self.key };
        self.task.reset(&mut self.world, key).map_err(no_start)?;
        self.sums = Sums { terms: vec![0.0; self.task.term_count()], ..Sums::default() };
        self.task.observe(&self.world, &mut self.state);
        Ok(())
    }

    fn end_episode(&mut self, ended: Option<u16>) -> Ended {
        self.learner.end_episode();
        let Sums { steps, reward, error_m, terms } = std::mem::take(&mut self.sums);
        let error_m = error_m / steps as f64;
        let training = &mut self.course.training;
        training.steps.push(self.course.steps);
        training.returns.push(reward);
        training.error_m.push(error_m);
        training.terms.push(terms);
        training.ended.push(ended);
        self.course.episode += 1;
        self.course.actions.clear();
        Ended { total: reward, error_m }
    }

    /// A new entry of health when a multiple of [`HEALTH_EVERY`] updates is passed. A quantity that did not
    /// occur since keeps its last value.
    fn note_health(&mut self) {
        let updates = self.learner.updates();
        self.course.training.updates = updates;
        let Health { updates: noted, columns } = &mut self.course.training.health;
        if updates / HEALTH_EVERY <= noted.last().copied().unwrap_or(0) / HEALTH_EVERY {
            return;
        }
        for (name, value) in self.learner.take_health() {
            let column = columns.entry(name.to_string()).or_default();
            column.resize(noted.len(), column.last().copied().unwrap_or(value));
            column.push(value);
        }
        noted.push(updates);
        for column in columns.values_mut() {
            column.resize(noted.len(), column.last().copied().unwrap_or(0.0));
        }
    }

    fn diverged(&self, error: LearnError) -> Fault {
        Fault { cause: error.to_string(), at: self.method.at.clone() }
    }

    /// What is left when training is over: its record and the policy.
    pub fn finish(self) -> (Training, Policy) {
        (self.course.training, self.learner.policy())
    }
}

impl Sums {
    fn add(&mut self, reward: f64, error_m: f64, terms: &[f64]) {
        self.steps += 1;
        self.reward += reward;
        self.error_m += error_m;
        for (sum, term) in self.terms.iter_mut().zip(terms) {
            *sum += term;
        }
    }
}

#[cfg(test)]
mod tests {
    use mpgx_lang::plan::{Plan, Setting};

    use super::*;
    use crate::cell::cells;
    use crate::tests::sample;

    fn trained(plan: &Plan) -> Training {
        let task = Task::new(plan, &plan.world).unwrap();
        let cell = &cells(plan).unwrap()[0];
        let mut trainer = Trainer::new(&task, cell, 0).unwrap();
        while !trainer.is_done() {
            trainer.step().unwrap_or_else(|fault| panic!("{fault:?}"));
        }
        assert!(trainer.course.steps <= trainer.most_steps());
        trainer.finish().0
    }

    fn set(plan: &mut Plan, setting: &str, value: f64) {
        plan.learners[0].what.settings.insert(setting.into(), Setting::Number(value));
    }

    /// Nobody can be lost: every episode has seven steps.
    fn endless() -> Plan {
        let mut plan = sample::plan();
        plan.world.groups[1].arena = None;
        plan
    }

    #[test]
    fn training_ends_with_the_first_budget_that_is_spent() {
        let mut plan = endless();
        let training = trained(&plan);
        assert_eq!(training.steps, [7, 14, 21, 28]);
        assert_eq!(training.ended, [None; 4]);
        // 30 steps; the first two did not fill a mini-batch of three.
        assert_eq!(training.updates, 28);
        set(&mut plan, "episodes", 2.0);
        let training = trained(&plan);
        assert_eq!((training.steps, training.updates), (vec![7, 14], 12));
    }

    #[test]
    fn an_episode_sums_its_rewards_and_averages_its_errors() {
        let training = trained(&endless());
        for ((total, error_m), terms) in training.returns.iter().zip(&training.error_m).zip(&training.terms) {
            assert!((total + 7.0 * error_m).abs() < 1e-12 && *total < 0.0);
            assert_eq!(terms, &[*total]);
        }
    }

    #[test]
    fn an_end_stops_the_episode_and_costs_once() {
        let mut plan = sample::plan();
        plan.world.groups[1].speed_mps = (5.0, 6.0);
        let training = trained(&plan);
        assert!(training.ended.iter().all(|end| *end == Some(0)) && training.steps[0] < 7);
        assert!((training.returns[0] - (training.terms[0][0] - 1.0)).abs() < 1e-12);
    }

    #[test]
    fn health_is_noted_at_its_cadence_in_whole_columns() {
        let mut plan = endless();
        set(&mut plan, "steps", 62.0);
        set(&mut plan, "inner", 25.0);
        set(&mut plan, "delay", 700.0);
        let health = trained(&plan).health;
        assert_eq!(health.updates, [500, 1000, 1500]);
        assert!(health.columns.contains_key("loss/critic"));
        let actor = &health.columns["loss/actor"];
        assert_eq!((actor[0], actor.len()), (actor[1], 3));
        assert!(health.columns.values().flatten().all(|value| value.is_finite()));
        // It shrinks with every episode.
        let noise = &health.columns["noise/explore"];
        assert!(noise[0] > noise[1] && noise[1] > noise[2]);
    }
    #[test]
    fn either_budget_lowers_the_step_sizes() {
        for (setting, budget) in [("steps", 60.0), ("episodes", 9.0)] {
            let with = |rate_end| {
                let mut plan = endless();
                set(&mut plan, "steps", 1e9);
                set(&mut plan, setting, budget);
                set(&mut plan, "rate_end", rate_end);
                trained(&plan).returns
            };
            assert_ne!(with(1.0), with(0.0), "{setting}");
        }
    }
}
