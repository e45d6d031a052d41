//! Training: a learner acts in a world and learns from what follows, step by step.

use mpgx_lang::plan::{Method, Stage};
use mpgx_learn::{Config, LearnError, Learner, Policy, Transition};
use mpgx_sim::{Episode, EpisodeKey, Fault, Mode};

use crate::cell::Cell;
use crate::checkpoint::{Course, Restored};
use crate::curriculum;
use crate::error::{StudyError, no_start};
use crate::record::{Health, StageEnd, Training};
use crate::team;
use crate::worlds::Ground;

/// Updates between two entries of the learner's health.
const HEALTH_EVERY: u64 = 500;

/// A learner in its world.
pub(crate) struct Trainer<'a> {
    /// One for each stage, then the world of training.
    grounds: &'a [Ground],
    stages: &'a [Stage],
    method: &'a Method,
    key: EpisodeKey,
    budget: Budget,
    learner: Learner,
    pub course: Course,
    world: Episode,
    sums: Sums,
    /// Of each member that acts on the policy: `[members][state]`, `[members][action]`.
    states: Vec<f32>,
    actions: Vec<f32>,
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
    /// `grounds` holds one world for each of `stages`, then the world of training.
    pub fn new(
        grounds: &'a [Ground],
        stages: &'a [Stage],
        cell: &'a Cell,
        master: u64,
    ) -> Result<Trainer<'a>, StudyError> {
        let method = &cell.method;
        let wrong = |error: LearnError| StudyError::Plan { cause: error.to_string(), at: method.at.clone() };
        let config = Config::from_extern(&method.what).map_err(wrong)?;
        let budget = Budget { steps: config.steps, episodes: config.episodes };
        let task = &grounds[0].task;
        let (state, action) = team::sizes(task);
        Ok(Trainer {
            grounds,
            stages,
            method,
            key: EpisodeKey { master, protocol: 0, seed: cell.seed, episode: 0 },
            budget,
            learner: Learner::new(config, state, action, master, cell.seed).map_err(wrong)?,
            course: Course::default(),
            world: task.episode(),
            sums: Sums::default(),
            states: Vec::new(),
            actions: Vec::new(),
            next: Vec::new(),
        })
    }

    /// Goes on from a checkpoint. The trainer must be new, and is worth nothing after an error.
    pub fn resume(&mut self, restored: Restored) -> Result<(), Fault> {
        self.learner.restore(&restored.learner).map_err(|error| self.diverged(error))?;
        self.learner.restore_rows(&restored.rows).map_err(|error| self.diverged(error))?;
        self.course = restored.course;
        if self.learner.replay_pushed() != self.course.rows {
            let cause = "its replay does not fit its steps".to_string();
            return Err(Fault { cause, at: self.method.at.clone() });
        }
        if self.course.actions.is_empty() {
            return Ok(());
        }
        self.begin_episode()?;
        let task = &self.ground().task;
        for action in self.course.actions.chunks(self.actions.len()) {
            let step = task.step(&mut self.world, action, Mode::Train);
            self.sums.add(step.reward, step.error_m, self.world.terms());
        }
        team::observe(task, &self.world, &mut self.states);
        Ok(())
    }

    /// Where training goes on now: in the first stage that has not ended, or past all.
    fn ground(&self) -> &'a Ground {
        &self.grounds[self.course.training.stages.len()]
    }

    pub fn is_done(&self) -> bool {
        self.course.steps >= self.budget.steps || u64::from(self.course.episode) >= self.budget.episodes
    }

    /// The most steps that training may take.
    pub fn most_steps(&self) -> u64 {
        let longest = self.grounds.iter().map(|ground| ground.task.horizon()).max().unwrap_or(0);
        self.budget.steps.min(self.budget.episodes.saturating_mul(longest as u64))
    }

    pub fn config(&self) -> &Config {
        self.learner.config()
    }

    /// Bytes of the learner's state, of its policy and of a replay row.
    pub fn bytes(&self) -> (u64, u64, u64) {
        let policy = self.learner.policy().to_bytes().len();
        (self.save().len() as u64, policy as u64, self.learner.row_bytes() as u64)
    }

    /// One step of the world and the updates that follow; tells if an episode has ended with it. An episode
    /// that the budget cuts short leaves no entry in the record.
    pub fn step(&mut self) -> Result<Option<Ended>, Fault> {
        if self.course.actions.is_empty() {
            self.begin_episode()?;
        }
        let Ground { task, failures } = self.ground();
        self.learner.set_progress(self.progress());
        self.learner.explore(&self.states, &mut self.actions);
        let step = task.step(&mut self.world, &self.actions, Mode::Train);
        if let Some(fault) = step.fault {
            return Err(*fault);
        }
        self.sums.add(step.reward, step.error_m, self.world.terms());
        team::observe(task, &self.world, &mut self.next);
        let (state, action) = team::sizes(task);
        let failure = step.ended.is_some_and(|end| failures[usize::from(end)]);
        let transitions = (self.states.chunks_exact(state).zip(self.actions.chunks_exact(action)))
            .zip(self.next.chunks_exact(state).zip(self.world.member_rewards()))
            .map(|((state, action), (next, reward))| Transition {
                state,
                action,
                reward: *reward as f32,
                next,
                failure,
            });
        self.learner.step(transitions).map_err(|error| self.diverged(error))?;
        self.note_health();
        std::mem::swap(&mut self.states, &mut self.next);
        self.course.actions.extend_from_slice(&self.actions);
        self.course.steps += 1;
        self.course.rows = self.learner.replay_pushed();
        Ok((step.last || step.ended.is_some()).then(|| self.end_episode(step.ended)))
    }

    /// The learner's state, to be kept with [`Trainer::course`].
    pub fn save(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        self.learner.save(&mut bytes);
        bytes
    }

    /// The replay rows pushed from row `from` on.
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
        let task = &self.ground().task;
        self.world = task.episode();
        task.reset(&mut self.world, key).map_err(no_start)?;
        self.sums = Sums { terms: vec![0.0; task.term_count()], ..Sums::default() };
        let states = team::members(task) * task.state_len();
        self.states.resize(states, 0.0);
        self.next.resize(states, 0.0);
        self.actions.resize(task.action_len(), 0.0);
        team::observe(task, &self.world, &mut self.states);
        Ok(())
    }

    fn end_episode(&mut self, ended: Option<u16>) -> Ended {
        let members = team::members(&self.ground().task);
        self.learner.look_back(self.sums.steps as usize, members);
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
        let stage = self.stages.get(training.stages.len());
        if stage.is_some_and(|stage| curriculum::is_over(stage, training)) {
            training.stages.push(StageEnd { steps: self.course.steps, episodes: self.course.episode });
        }
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
    use mpgx_lang::plan::{Plan, Setting, Until, World};

    use super::*;
    use crate::cell::cells;
    use crate::tests::sample;
    use crate::worlds::Worlds;

    fn trained(plan: &Plan) -> Training {
        with_policy(plan).0
    }

    fn with_policy(plan: &Plan) -> (Training, Vec<u8>) {
        let worlds = Worlds::new(plan).unwrap();
        let cell = &cells(plan).unwrap()[0];
        let mut trainer = Trainer::new(&worlds.training, &plan.stages, cell, 0).unwrap();
        while !trainer.is_done() {
            trainer.step().unwrap_or_else(|fault| panic!("{fault:?}"));
        }
        assert!(trainer.course.steps <= trainer.most_steps());
        let (training, policy) = trainer.finish();
        (training, policy.to_bytes())
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

    /// Each stage has a horizon of its own, so the lengths of the episodes tell which world they were in.
    #[test]
    fn training_goes_through_the_stages_to_the_world_itself() {
        let mut plan = endless();
        set(&mut plan, "steps", 60.0);
        for (horizon, most_steps) in [(3, 8), (5, 5)] {
            let mut stage = sample::stage(Some(most_steps));
            stage.world = Box::new(World { horizon, ..plan.world.clone() });
            plan.stages.push(stage);
        }
        let training = trained(&plan);
        assert_eq!(training.steps, [3, 6, 9, 14, 21, 28, 35, 42, 49, 56]);
        let ends = training.stages.iter().map(|end| (end.steps, end.episodes));
        assert_eq!(ends.collect::<Vec<_>>(), [(9, 3), (14, 4)]);
        // One update a step, but for the first two.
        assert_eq!(training.updates, 58);
        // A stage that never ends is where training stays.
        plan.stages[1].most_steps = None;
        let until = Until { measure: "error_m".into(), below: true, bound: -1.0, episodes: 1 };
        plan.stages[1].until = Some(until);
        let training = trained(&plan);
        assert_eq!((training.stages.len(), training.steps.last()), (1, Some(&59)));
    }

    /// What is no failure is learned beyond, as where failures do not count at all.
    #[test]
    fn an_end_that_is_no_failure_does_not_cut_the_value() {
        let run = |failure, terminal_mask| {
            let mut plan = sample::plan();
            plan.world.groups[1].speed_mps = (5.0, 6.0);
            plan.world.ends[0].failure = failure;
            let mask = Setting::Truth(terminal_mask);
            plan.learners[0].what.settings.insert("terminal_mask".into(), mask);
            let (training, policy) = with_policy(&plan);
            assert!(training.ended.iter().all(|end| *end == Some(0)));
            policy
        };
        assert_eq!(run(false, true), run(true, false));
        assert_ne!(run(true, true), run(true, false));
    }

    /// Reward and next state of each row are those of its own member; the sample's reward is −|next state|.
    #[test]
    fn robots_that_share_a_policy_store_a_row_each() {
        let mut plan = sample::shared();
        plan.stages.clear();
        plan.world.groups[1].arena = None;
        let worlds = Worlds::new(&plan).unwrap();
        let cell = &cells(&plan).unwrap()[0];
        let mut trainer = Trainer::new(&worlds.training, &plan.stages, cell, 0).unwrap();
        for _ in 0..5 {
            trainer.step().unwrap_or_else(|fault| panic!("{fault:?}"));
        }
        assert_eq!((trainer.course.rows, trainer.course.training.updates), (10, 4));
        let bytes = trainer.rows_since(0);
        let floats: Vec<f32> = bytes.as_chunks().0.iter().copied().map(f32::from_le_bytes).collect();
        // State, action, reward, failure, next state.
        let rows: Vec<&[f32]> = floats.chunks(8).collect();
        assert_eq!(rows.len(), 10);
        for (k, row) in rows.iter().enumerate() {
            let gap = f32::hypot(row[6], row[7]);
            assert!((row[4] + gap).abs() < 1e-6 && row[5] == 0.0, "{row:?}");
            if let Some(later) = rows.get(k + 2) {
                assert_eq!(row[6..], later[..2]);
            }
        }
        assert_ne!(rows[0][2..4], rows[1][2..4]);
    }

    #[test]
    fn health_is_noted_at_its_cadence_in_whole_columns() {
        let mut plan = endless();
        set(&mut plan, "steps", 62.0);
        set(&mut plan, "inner", 25.0);
        set(&mut plan, "delay", 700.0);
        let health = trained(&plan).health;
        assert_eq!(health.updates, [500, 1000, 1500]);
        for metric in ["loss/critic", "grad/critic", "q/estimate_minus_return"] {
            assert!(health.columns.contains_key(metric), "{metric}");
        }
        assert!(health.columns["grad/critic"].iter().all(|norm| *norm > 0.0));
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
