//! Tests of a scenario.

use std::collections::BTreeMap;

use super::fits::{TYPE_MISMATCH, Wanted};
use super::value::OUT_OF_RANGE;
use super::{Checker, Scope};
use crate::ast::{self, ExprAt, Item, Name, Span, Spanned, TestStep};
use crate::dim::Dim;
use crate::hir::{self, Control, Expr, Kind, Type};
use crate::plan::{BinaryOp, Function, Measure};
use crate::problem::{Code, Problem};
use crate::resolve::{DUPLICATE_NAME, Space, listed};

impl<'a> Checker<'a> {
    pub fn tests(&mut self) {
        let mut names: BTreeMap<&str, Span> = BTreeMap::new();
        let mut scope = self.scope_of_check();
        for (_, item) in self.main_items() {
            let Item::Test { name, steps, .. } = &item.node else { continue };
            if let Some(first) = names.get(name.node.as_str()) {
                let message = format!("two tests are called \"{}\"", name.node);
                let problem = Problem::error(&DUPLICATE_NAME, message).at(name.span, "again here");
                self.report(problem.with(*first, "first here"));
            }
            names.entry(&name.node).or_insert(name.span);
            if !steps.iter().any(|step| matches!(step.node, TestStep::Check { .. })) {
                let problem = Problem::warning(&BAD_TEST, "this test checks nothing").at(name.span, "");
                self.report(problem.help("end it with what shall hold: `check error < 1 cm`"));
            }
            let steps = steps.iter().filter_map(|step| {
                Some(Spanned { node: self.test_step(&step.node, &mut scope)?, span: step.span })
            });
            let steps = steps.collect();
            self.hir.tests.push(hir::Test { name: name.node.clone(), steps, span: name.span });
        }
    }

    /// `scope`: of what is checked.
    fn test_step(&mut self, step: &'a TestStep, scope: &mut Scope) -> Option<hir::TestStep> {
        let vector = |dim: Dim| Type::Vector(dim);
        Some(match step {
            TestStep::Place { agent, at } => {
                let agent = self.agent_in_test(agent, "what is placed");
                let position = self.value_in_test(at, &vector(self.units.base("length")), "a place");
                hir::TestStep::Place { agent: agent?, position }
            }
            TestStep::Turn { agent, to } => {
                let agent = self.agent_in_test(agent, "what is turned");
                let heading = self.value_in_test(to, &Type::Number(Dim::none()), "a heading");
                hir::TestStep::Turn { agent: agent?, heading }
            }
            TestStep::Steer { agent, at } => {
                let agent = self.agent_in_test(agent, "what is steered");
                let velocity = self.value_in_test(at, &vector(self.units.base("speed")), "a velocity");
                let agent = agent?;
                self.steered(&agent);
                hir::TestStep::Steer { agent, velocity }
            }
            TestStep::Step(steps) => {
                let steps = self.value_in_test(steps, &Type::Count, "the number of steps");
                hir::TestStep::Step(self.whole(&steps, &"the number of steps", 1.0)?)
            }
            TestStep::Check { text, condition, tolerance } => {
                let (actual, holds) = match tolerance {
                    None => {
                        let why = Wanted::by("what is checked");
                        let holds = self.wanted(scope, condition, &Type::Truth, &why);
                        let actual = match &holds.kind {
                            Kind::Binary(op, left, _) if compares(*op) => Some((**left).clone()),
                            _ => None,
                        };
                        (actual.filter(|actual| matches!(actual.type_, Type::Number(_))), holds)
                    }
                    Some(tolerance) => self.nearly(scope, condition, tolerance)?,
                };
                hir::TestStep::Check { text: text.clone(), actual, holds }
            }
        })
    }

    /// One agent or obstacle.
    fn agent_in_test(&mut self, at: &'a ExprAt, what: &str) -> Option<Expr> {
        let agent = self.value_in_test(at, &Type::Agent(None), what);
        (!agent.is_poison()).then_some(agent)
    }

    fn value_in_test(&mut self, at: &'a ExprAt, type_: &Type, what: &str) -> Expr {
        self.wanted(&mut Scope::of(self.program.main), at, type_, &Wanted::by(what))
    }

    fn steered(&mut self, agent: &Expr) {
        let Kind::Fixed(group, _) = agent.kind else { return };
        let Some(group) = self.hir.world.groups.get(group) else { return };
        if matches!(group.control, None | Some(Control::Learned)) {
            return;
        }
        let problem = Problem::error(&BAD_TEST, format!("`{}` cannot be steered", group.name))
            .at(agent.span, "does not learn")
            .with(group.span, "moves by itself");
        self.report(
            problem.help(format!("put it somewhere: `place {} at …`", self.sources.text(agent.span))),
        );
    }

    /// `reward`, `reward.gap`, `error` and `ended.crash`, besides everything else.
    fn scope_of_check(&self) -> Scope {
        let mut scope = Scope::of(self.program.main);
        let reward = Type::Number(self.hir.reward_dim.clone());
        let world = &self.hir.world;
        scope.add("reward", Kind::Measured(Measure::Reward), reward.clone());
        for (number, term) in world.reward.iter().enumerate() {
            scope.add(
                &format!("reward.{}", term.name),
                Kind::Measured(Measure::Term(number)),
                reward.clone(),
            );
        }
        for (number, end) in world.ends.iter().enumerate() {
            scope.add(&format!("ended.{}", end.name), Kind::Measured(Measure::Ended(number)), Type::Truth);
        }
        scope.add("error", Kind::Measured(Measure::Error), Type::Number(self.units.base("length")));
        scope
    }

    /// A name of a scope that has a dot in it.
    pub fn dotted(&mut self, scope: &Scope, of: &ExprAt, part: &Name, at: Span) -> Option<Expr> {
        let ast::Expr::Name(name) = &of.node else { return None };
        if let Some((kind, type_)) = scope.local(&format!("{name}.{}", part.node)) {
            return Some(self.make(kind, type_, at));
        }
        let start = format!("{name}.");
        let known: Vec<&str> = scope.locals.names().filter_map(|local| local.strip_prefix(&start)).collect();
        if known.is_empty() {
            let declared = self.program.find(scope.module, Space::Value, name).is_some();
            if declared || scope.local(name).is_some() || !matches!(name.as_str(), "reward" | "ended") {
                return None;
            }
            let text = format!("`{name}.{}` is known in a test only", part.node);
            let problem = Problem::error(&super::expr::WRONG_KIND, text).at(at, "");
            return Some(self.poison(
                at,
                problem.help("give what it is made of a name with `let` or `fn`, and use that"),
            ));
        }
        let what = if name == "reward" { "reward term" } else { "end" };
        let problem =
            Problem::error(&super::expr::UNKNOWN_NAME, format!("there is no {what} `{}`", part.node));
        let help = match self.meant(&part.node, known.iter().copied()) {
            Some(meant) => format!("did you mean `{meant}`?"),
            None => format!("there is {}", listed(known)),
        };
        Some(self.poison(at, problem.at(part.span, "").help(help)))
    }

    /// `a == b ± tolerance`, also for vectors. Gives `a`, if it is a number, and the condition.
    fn nearly(
        &mut self,
        scope: &mut Scope,
        condition: &'a ExprAt,
        tolerance: &'a ExprAt,
    ) -> Option<(Option<Expr>, Expr)> {
        let ast::Expr::Binary { op: BinaryOp::Equal, left, right, .. } = &condition.node else {
            let problem = Problem::error(&BAD_TEST, "a tolerance belongs to `==`")
                .at(tolerance.span, "of what?")
                .with(condition.span, "not an equation");
            self.report(problem.help("write `check reward.gap == -0.4 m ± 1 mm`"));
            return None;
        };
        let left = self.expr(scope, left);
        let right = self.expr(scope, right);
        let why = Wanted::like("the right side", left.span);
        let right = self.fits(right, &left.type_, &why, &[], &mut Default::default());
        let (dim, size) = match &left.type_ {
            Type::Number(dim) => (dim.clone(), Function::Abs),
            Type::Vector(dim) => (dim.clone(), Function::Norm),
            Type::Poison => return None,
            _ => {
                let have = self.describe(&left.type_);
                let problem = Problem::error(&TYPE_MISMATCH, format!("{have} has no tolerance"));
                self.report(
                    problem.at(left.span, format!("this is {have}")).with(tolerance.span, "a tolerance"),
                );
                return None;
            }
        };
        let number = Type::Number(dim);
        let why = Wanted::like("the tolerance", left.span);
        let tolerance = self.wanted(scope, tolerance, &number, &why);
        if right.is_poison() || tolerance.is_poison() {
            return None;
        }
        let known = self.constant(&tolerance, &"a tolerance")?;
        if known < 0.0 {
            let problem = Problem::error(&OUT_OF_RANGE, "a tolerance is not negative");
            self.report(problem.at(tolerance.span, "goes to both sides"));
            return None;
        }
        let (at, type_) = (condition.span, left.type_.clone());
        let actual = Some(left.clone()).filter(|left| matches!(left.type_, Type::Number(_)));
        let off = self.make(Kind::Binary(BinaryOp::Sub, Box::new(left), Box::new(right)), type_, at);
        let off = self.make(Kind::BuiltIn(size, vec![off]), number, at);
        let near = Kind::Binary(BinaryOp::LessEq, Box::new(off), Box::new(tolerance));
        Some((actual, self.make(near, Type::Truth, at)))
    }
}

fn compares(op: BinaryOp) -> bool {
    use BinaryOp::{Equal, Greater, GreaterEq, Less, LessEq, NotEqual};
    matches!(op, Less | LessEq | Greater | GreaterEq | Equal | NotEqual)
}

pub const BAD_TEST: Code = Code {
    name: "bad-test",
    explain: "\
A test puts agents somewhere, lets some steps pass and checks what holds then. Only agents that learn are steered;
others have a motion, or are placed. `±` gives an equation a tolerance.

    test \"one step to the right\" {
        place follower[1] at (0 m, 0 m)
        steer follower[1] at (0.5 m/s, 0 m/s)
        step 1
        check p[follower[1]] == (5 cm, 0 cm) ± 1 mm
    }",
};
