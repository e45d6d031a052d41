//! Whole updates: exploration, replay, mini-batch and all optimisers, in a world that costs nothing.

use mpgx_lang::plan::Plan;
use mpgx_learn::measure::{Limits, Shape};
use mpgx_learn::{Config, LearnError, Learner, Transition};

use super::Figure;
use super::stopwatch::{Windows, seconds_a_run};
use crate::failure::{Exit, Failure};

/// The first learner of a plan, and its name.
pub fn learner(plan: &Plan, state: usize, action: usize) -> Result<(&str, Learner), Failure> {
    let method = plan.learners.first().ok_or_else(|| Failure::new(Exit::Internal, "nothing learns"))?;
    let config = Config::from_extern(&method.what).map_err(wrong)?;
    Ok((&method.label, Learner::new(config, state, action, 0, 0).map_err(wrong)?))
}

fn wrong(error: LearnError) -> Failure {
    Failure::new(Exit::Internal, error.to_string())
}

/// A learner that has begun to learn.
struct Bench {
    learner: Learner,
    state: Vec<f32>,
    next: Vec<f32>,
    action: Vec<f32>,
}

impl Bench {
    fn new(plan: &Plan, shape: &Shape) -> Result<Bench, Failure> {
        let (_, learner) = learner(plan, shape.state, shape.action)?;
        let (state, action) = (vec![0.1; shape.state], vec![0.0; shape.action]);
        let mut bench = Bench { learner, next: state.clone(), state, action };
        while bench.learner.updates() < 100 {
            bench.step().map_err(wrong)?;
        }
        Ok(bench)
    }

    /// Explores and learns: the state follows the action.
    fn step(&mut self) -> Result<(), LearnError> {
        self.learner.explore(&self.state, &mut self.action);
        for (k, (next, state)) in self.next.iter_mut().zip(&self.state).enumerate() {
            *next = 0.9 * state + 0.1 * self.action[k % self.action.len()];
        }
        let reward = -self.next.iter().map(|x| x * x).sum::<f32>();
        let Bench { learner, state, next, action } = self;
        learner.step([Transition { state, action, reward, next, failure: false }])?;
        std::mem::swap(&mut self.state, &mut self.next);
        Ok(())
    }

    fn seconds(mut self, windows: Windows) -> Result<f64, LearnError> {
        let mut failed = None;
        let seconds = seconds_a_run(windows, || failed = failed.take().or(self.step().err()));
        failed.map_or(Ok(seconds), Err)
    }
}

/// Updates a second of one learner.
pub fn one(windows: Windows, plan: &Plan, shape: &Shape, limits: &Limits) -> Result<Figure, Failure> {
    let seconds = Bench::new(plan, shape)?.seconds(windows).map_err(wrong)?;
    let bound: f64 = shape.update().iter().map(|part| part.bound_s(limits)).sum();
    Ok(Figure { share: Some(bound / seconds), ..Figure::new(name(plan, shape), 1.0 / seconds, "updates/s") })
}

/// Updates of two learners at once, each on a thread, for each of one alone.
pub fn two(windows: Windows, plan: &Plan, shape: &Shape) -> Result<Figure, Failure> {
    let alone = Bench::new(plan, shape)?.seconds(windows).map_err(wrong)?;
    let pair = [Bench::new(plan, shape)?, Bench::new(plan, shape)?];
    let rates = std::thread::scope(|scope| {
        let threads = pair.map(|bench| scope.spawn(move || bench.seconds(windows)));
        threads.map(|thread| match thread.join() {
            Ok(seconds) => seconds.map(|seconds| 1.0 / seconds).map_err(wrong),
            Err(_) => Err(Failure::new(Exit::Internal, "a thread of the bench ended early")),
        })
    });
    let [first, second] = rates;
    Ok(Figure::new(format!("{}: two at once", name(plan, shape)), (first? + second?) * alone, "× one"))
}

fn name(plan: &Plan, shape: &Shape) -> String {
    let method = plan.learners.first().map_or("", |method| &method.label);
    format!("{method}, batch {}, state {}, action {}", shape.batch, shape.state, shape.action)
}
