//! The parts of a Plan that are worlds or Plans of their own, and the tests.

use std::cell::Cell;

use super::{Lower, lower};
use crate::analyse::scene::{Mode, Scene};
use crate::analyse::sizes::sizes;
use crate::ast::Span;
use crate::case::Case;
use crate::check::units::Units;
use crate::check::value::not_constant;
use crate::hir::{self, Hir};
use crate::inline::Value;
use crate::plan::{AgentId, AgentRef, Plan, Protocol, Stage, Test, TestStep, Variant, World};
use crate::problem::{Code, Problem, Problems};
use crate::source::Sources;

/// Passes on the problems of a case, and says of which.
fn told_of(own: &Problems, span: Span, label: &str, problems: &mut Problems) {
    own.iter().for_each(|problem| problems.push(problem.clone().with(span, label)));
}

/// The worlds of evaluations and stages, where the policy goes on that is learned in the world of the Plan.
pub struct Cases<'a> {
    pub hir: &'a Hir,
    pub units: &'a Units,
    pub sources: &'a Sources,
    pub spent: &'a Cell<usize>,
    pub plan: &'a Plan,
    pub problems: &'a mut Problems,
}

impl Cases<'_> {
    pub fn protocol(&mut self, protocol: &hir::Protocol) -> Option<Protocol> {
        let training = Case::of(self.hir, &self.hir.params, self.spent);
        let episodes = training.number(&protocol.episodes);
        if episodes.is_none() {
            self.problems.push(not_constant(protocol.episodes.span, &"`episodes`"));
        }
        let world = match &protocol.changed {
            Some(changed) => {
                Some(self.world(changed, protocol.span, &format!("the evaluation `{}`", protocol.name))?)
            }
            None => None,
        };
        Some(Protocol {
            name: protocol.name.clone(),
            episodes: episodes? as usize,
            world: world.filter(|world| **world != self.plan.world),
            at: self.sources.place(protocol.span),
        })
    }

    pub fn stage(&mut self, stage: &hir::Stage) -> Option<Stage> {
        Some(Stage {
            name: stage.name.clone(),
            world: self.world(&stage.changed, stage.span, &format!("the stage `{}`", stage.name))?,
            until: stage.until.clone(),
            most_steps: stage.most_steps,
            at: self.sources.place(stage.span),
        })
    }

    pub fn variant(&mut self, variant: &hir::Variant) -> Option<Variant> {
        let mut own = Problems::default();
        let plan = lower(&variant.changed, self.units, self.sources, &mut own);
        told_of(&own, variant.span, &format!("in the variant `{}`", variant.name), self.problems);
        Some(Variant {
            name: variant.name.clone(),
            text: variant.text.clone(),
            plan: Box::new(Plan { tests: Vec::new(), ..plan? }),
            at: self.sources.place(variant.span),
        })
    }

    fn world(&mut self, changed: &Hir, span: Span, what: &str) -> Option<Box<World>> {
        let case = Case::of(changed, &self.hir.params, self.spent);
        let mut own = Problems::default();
        let (units, sources) = (self.units, self.sources);
        let world = Lower { hir: changed, units, sources, case: &case, problems: &mut own }.world();
        told_of(&own, span, &format!("in {what}"), self.problems);
        let world = world?;
        let entries = |world: &World| {
            let sizes = sizes(&Scene::unknown(self.plan, world, Mode::Training));
            (sizes.state_len(), sizes.action_len())
        };
        let (own, other) = (entries(&self.plan.world), entries(&world));
        if own != other {
            let say = |(state, action): (usize, usize)| {
                format!("a state of {state} and an action of {action} entries")
            };
            let problem = Problem::error(&OTHER_SIZES, format!("{what} does not fit the policy"));
            let problem = problem.at(span, format!("has {}", say(other)));
            let learns = self.hir.world.observe.first().map_or(span, |observation| observation.span);
            self.problems.push(
                problem
                    .with(learns, format!("the policy is learned for {}", say(own)))
                    .help("keep the numbers of agents, or share one policy with `observe each`"),
            );
            return None;
        }
        Some(Box::new(world))
    }
}

impl Lower<'_> {
    pub fn test(&mut self, test: &hir::Test) -> Option<Test> {
        let steps = test.steps.iter().map(|step| self.test_step(&step.node, step.span));
        let steps = steps.collect::<Option<_>>()?;
        Some(Test { name: test.name.clone(), steps, at: self.sources.place(test.span) })
    }

    fn test_step(&mut self, step: &hir::TestStep, span: Span) -> Option<TestStep> {
        let at = self.sources.place(span);
        Some(match step {
            hir::TestStep::Place { agent, position } => {
                TestStep::Place { agent: self.agent(agent)?, position: self.expr(position)?, at }
            }
            hir::TestStep::Turn { agent, heading } => {
                TestStep::Turn { agent: self.agent(agent)?, heading: self.expr(heading)?, at }
            }
            hir::TestStep::Steer { agent, velocity } => {
                TestStep::Steer { agent: self.agent(agent)?, velocity: self.expr(velocity)?, at }
            }
            hir::TestStep::Step(steps) => TestStep::Step { steps: *steps, at },
            hir::TestStep::Check { text, actual, holds } => {
                let actual = match actual {
                    Some(actual) => Some(self.expr(actual)?),
                    None => None,
                };
                TestStep::Check { text: text.clone(), actual, holds: self.expr(holds)?, at }
            }
        })
    }

    /// A certain agent.
    fn agent(&mut self, agent: &hir::Expr) -> Option<AgentId> {
        let fixed = match self.case.value(agent) {
            Ok(Value::Agent(AgentRef::Fixed(id), _)) => Some(id),
            _ => None,
        };
        self.constant(fixed, agent.span)
    }
}

pub const OTHER_SIZES: Code = Code {
    name: "other-sizes",
    explain: "\
A policy is a network with a fixed number of inputs and outputs. An evaluation or a stage in which more or fewer agents
are seen or learn cannot use the policy that is learned, unless the agents share one: with `observe each`, every
member of the group has the same small state, and there may be any number of them.

    observe { p[i] for i in follower }              // one network sees all
    evaluate crowd { follower.size = 5 }            // wrong: it was made for three

    observe each i in follower { F[i] - p[i] }      // right: each has its own two entries",
};
