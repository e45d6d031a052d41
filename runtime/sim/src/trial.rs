//! Tests that a scenario holds: episodes whose course they prescribe.

use mpgx_lang::plan::{Expr, Measure, Place, Plan, Test, TestStep};
use thiserror::Error;

use crate::episode::{Episode, EpisodeKey};
use crate::error::{Flaw, SimError};
use crate::maths::{clamp_axes, wrap};
use crate::program::{Compiler, Layout, Number, Program, Scope, Truth};
use crate::step::{Fault, Mode};
use crate::task::Task;

/// Why a test failed.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum TestFailure {
    /// The test cannot be run.
    #[error(transparent)]
    World(#[from] SimError),
    /// Something does not hold after `step` steps.
    #[error("after {step} steps `{text}` does not hold{}", is(actual))]
    Check { text: String, actual: Option<f64>, step: usize, at: Place },
    /// A number of the simulation is not finite after `step` steps.
    #[error("after {step} steps {}", fault.cause)]
    Fault { fault: Box<Fault>, step: usize },
}

/// `: it is 0.3`.
fn is(actual: &Option<f64>) -> String {
    actual.map(|value| format!(": it is {value}")).unwrap_or_default()
}

/// Runs a test of a plan in the world of training: the first episode of master 0.
///
/// # Errors
/// Tells the first thing that does not hold, or why the test cannot be run.
pub fn run_test(plan: &Plan, test: &Test) -> Result<(), TestFailure> {
    let task = Task::new(plan, &plan.world)?;
    let layout = Layout::new(&plan.params, &plan.world, task.model.clone());
    let mut episode = task.episode();
    task.reset(&mut episode, EpisodeKey::default())?;
    let mut trial = Trial { task: &task, layout: &layout, name: &test.name, episode };
    for step in &test.steps {
        trial.follow(step)?;
    }
    Ok(())
}

struct Trial<'a> {
    task: &'a Task,
    layout: &'a Layout<'a>,
    name: &'a str,
    episode: Episode,
}

impl Trial<'_> {
    fn follow(&mut self, step: &TestStep) -> Result<(), TestFailure> {
        match step {
            TestStep::Place { agent, position, at } => {
                let position = self.vector(*agent, position, at)?;
                self.task.put(&mut self.episode, *agent, position);
            }
            TestStep::Turn { agent, heading, at } => {
                let heading = self.known(*agent).and_then(|()| self.compiler().number(heading));
                let heading = heading.map_err(|flaw| self.flawed(flaw, at))?;
                let heading = wrap(heading.eval(&mut self.task.scene(&self.episode)));
                let (sin, cos) = libm::sincos(heading);
                self.episode.agents.course[*agent] = [cos, sin];
                if self.task.model.headed[*agent] {
                    self.episode.agents.heading[*agent] = heading;
                }
                self.task.refresh_slots(&mut self.episode);
            }
            TestStep::Steer { agent, velocity, at } => {
                let velocity = self.vector(*agent, velocity, at)?;
                let Some(k) = self.task.learned.iter().position(|learned| learned == agent) else {
                    let agent = self.task.agents[*agent].name.clone();
                    return Err(self.flawed(Flaw::NotLearned { agent }, at));
                };
                self.episode.asked[k] = clamp_axes(velocity, self.task.agents[*agent].speed_mps);
            }
            TestStep::Step { steps, .. } => {
                for _ in 0..*steps {
                    let step = self.task.advance(&mut self.episode, Mode::Train);
                    if let Some(fault) = step.fault {
                        return Err(TestFailure::Fault { fault, step: self.episode.step });
                    }
                }
            }
            TestStep::Check { text, actual, holds, at } => self.check(text, actual.as_ref(), holds, at)?,
        }
        Ok(())
    }

    fn check(
        &mut self,
        text: &str,
        actual: Option<&Expr>,
        holds: &Expr,
        at: &Place,
    ) -> Result<(), TestFailure> {
        let step = self.task.judge(&mut self.episode);
        let task = self.task;
        let mut scene = task.scene(&self.episode);
        let ended: Vec<bool> = task.ends.iter().map(|end| end.when.eval(&mut scene)).collect();
        let number = |x: f64| Program::Number(Number::Constant(x));
        let measured = |measure| match measure {
            Measure::Term(term) => self.episode.terms.get(term).copied().map(number),
            Measure::Reward => Some(number(step.reward)),
            Measure::Error => Some(number(step.error_m)),
            Measure::Ended(end) => ended.get(end).map(|ended| Program::Truth(Truth::Constant(*ended))),
        };
        let scope = Scope { measured: Some(&measured), ..Scope::default() };
        let compiler = || Compiler::new(self.layout, scope);
        let holds = compiler().truth(holds).map_err(|flaw| self.flawed(flaw, at))?;
        if holds.eval(&mut scene) {
            return Ok(());
        }
        let actual = actual.map(|actual| compiler().number(actual)).transpose();
        let actual = actual.map_err(|flaw| self.flawed(flaw, at))?.map(|actual| actual.eval(&mut scene));
        Err(TestFailure::Check { text: text.into(), actual, step: self.episode.step, at: at.clone() })
    }

    /// The value of a vector that an agent is given.
    fn vector(&self, agent: usize, vector: &Expr, at: &Place) -> Result<[f64; 2], TestFailure> {
        let vector = self.known(agent).and_then(|()| self.compiler().vector(vector));
        let vector = vector.map_err(|flaw| self.flawed(flaw, at))?;
        Ok(vector.eval(&mut self.task.scene(&self.episode)))
    }

    fn known(&self, id: usize) -> Result<(), Flaw> {
        if id < self.task.agents.len() { Ok(()) } else { Err(Flaw::UnknownAgent { id }) }
    }

    fn compiler(&self) -> Compiler<'_> {
        Compiler::new(self.layout, Scope::default())
    }

    fn flawed(&self, flaw: Flaw, at: &Place) -> TestFailure {
        let what = format!("test `{}`", self.name);
        TestFailure::World(SimError::Expression { what, flaw, at: at.clone() })
    }
}

#[cfg(test)]
mod tests;
