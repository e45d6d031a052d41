//! Plan expressions to programs.

mod call;
mod layout;
mod sets;

use std::sync::Arc;

use mpgx_lang::plan::{BinaryOp, Expr, Measure, Quantity, UnaryOp, VarId, WorldConstant};

use super::{Agents, Number, Program, Scene, Truth, Vector};
use crate::error::Flaw;
use crate::lanes::{Comparison, lift};
use crate::maths;
pub(crate) use layout::Layout;

/// Expressions inside each other; keeps the stack safe from a Plan made by hand.
const MOST_DEPTH: usize = 400;

/// What an expression may use besides parameters and agents.
#[derive(Clone, Copy, Default)]
pub(crate) struct Scope<'a> {
    /// The agent that [`AgentRef::Member`] stands for.
    pub member: Option<usize>,
    /// Inside a formation: k and n.
    pub slot: Option<(usize, usize)>,
    /// For each state of the motion around whether it is a vector.
    pub states: &'a [bool],
    pub draws: bool,
    /// While agents are placed: which already are.
    pub placed: Option<&'a [bool]>,
    /// Whether this is a part of a formation, which may not refer to formations.
    pub formation: bool,
    /// While parameters are drawn: how many are. `None`: all.
    pub drawn: Option<usize>,
    /// In tests: what is measured of the present state.
    pub measured: Option<&'a dyn Fn(Measure) -> Option<Program>>,
}

/// When the value of an expression can change.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Varies {
    Never,
    /// With the agents that index variables stand for, and in no other way.
    WithMembers,
    InTime,
}

/// Compiles one expression.
pub(crate) struct Compiler<'a> {
    layout: &'a Layout<'a>,
    scope: Scope<'a>,
    variables: Vec<Bound>,
    /// Index variables that are loops, now.
    loops: usize,
    depth: usize,
    /// The sites of draws so far, and whether they are in a reduction.
    sites: Vec<(usize, bool)>,
    /// When what was compiled since this was last cleared can change.
    pub varies: Varies,
}

/// An index variable in scope and the agents it may stand for.
struct Bound {
    id: VarId,
    variable: usize,
    agents: Arc<[usize]>,
    /// Of the ends of an edge: the formation, and the variable that numbers the edges.
    edge: Option<(usize, usize)>,
}

impl<'a> Compiler<'a> {
    pub fn new(layout: &'a Layout<'a>, scope: Scope<'a>) -> Self {
        let varies = Varies::Never;
        Compiler { layout, scope, variables: Vec::new(), loops: 0, depth: 0, sites: Vec::new(), varies }
    }

    pub fn number(&mut self, expr: &Expr) -> Result<Number, Flaw> {
        match self.program(expr)? {
            Program::Number(number) => Ok(number),
            other => Err(Flaw::Kind { expected: "a number", found: other.kind() }),
        }
    }

    pub fn vector(&mut self, expr: &Expr) -> Result<Vector, Flaw> {
        match self.program(expr)? {
            Program::Vector(vector) => Ok(vector),
            other => Err(Flaw::Kind { expected: "a vector", found: other.kind() }),
        }
    }

    pub fn truth(&mut self, expr: &Expr) -> Result<Truth, Flaw> {
        match self.program(expr)? {
            Program::Truth(truth) => Ok(truth),
            other => Err(Flaw::Kind { expected: "a truth value", found: other.kind() }),
        }
    }

    /// Compiles an expression of any kind. What cannot change during an episode becomes a constant.
    pub fn program(&mut self, expr: &Expr) -> Result<Program, Flaw> {
        if self.depth == MOST_DEPTH {
            return Err(Flaw::TooDeep { most: MOST_DEPTH });
        }
        self.depth += 1;
        let around = std::mem::replace(&mut self.varies, Varies::Never);
        let mut program = self.node(expr)?;
        if self.varies == Varies::Never {
            program = self.constant(&program);
        }
        self.varies = self.varies.max(around);
        self.depth -= 1;
        Ok(program)
    }

    fn node(&mut self, expr: &Expr) -> Result<Program, Flaw> {
        Ok(match expr {
            Expr::Number(x) => Program::Number(Number::Constant(*x)),
            Expr::Truth(truth) => Program::Truth(Truth::Constant(*truth)),
            Expr::Param(id) => Program::Number(self.param(*id)?),
            Expr::World(constant) => Program::Number(Number::Constant(match constant {
                WorldConstant::Dt => self.layout.world.dt_s,
                WorldConstant::Safety => self.layout.world.safety_m,
                WorldConstant::Horizon => self.layout.world.horizon as f64,
            })),
            Expr::Time => {
                self.varies = Varies::InTime;
                Program::Number(Number::Time)
            }
            Expr::State(id) => {
                self.varies = Varies::InTime;
                match self.scope.states.get(*id) {
                    Some(false) => Program::Number(Number::State(*id)),
                    Some(true) => Program::Vector(Vector::State(*id)),
                    None => return Err(Flaw::UnknownState { id: *id }),
                }
            }
            Expr::SlotNumber => Program::Number(Number::Constant(self.slot()?.0 as f64)),
            Expr::SlotCount => Program::Number(Number::Constant(self.slot()?.1 as f64)),
            Expr::Vector(x, y) => Program::Vector(Vector::Pair(Box::new([self.number(x)?, self.number(y)?]))),
            Expr::Unary(UnaryOp::Not, of) => Program::Truth(Truth::Not(Box::new(self.truth(of)?))),
            Expr::Unary(UnaryOp::Neg, of) => match self.program(of)? {
                Program::Number(x) => Program::Number(Number::Negate(Box::new(x))),
                Program::Vector(v) => Program::Vector(Vector::Negate(Box::new(v))),
                truth => return Err(not_arithmetic(&truth)),
            },
            Expr::Binary(op, a, b) => self.binary(*op, a, b)?,
            Expr::Call(function, arguments) => self.call(*function, arguments)?,
            Expr::If { condition, then, otherwise } => {
                let condition = self.truth(condition)?;
                match (self.program(then)?, self.program(otherwise)?) {
                    (Program::Number(a), Program::Number(b)) => {
                        Program::Number(Number::If(Box::new((condition, a, b))))
                    }
                    (Program::Vector(a), Program::Vector(b)) => {
                        Program::Vector(Vector::If(Box::new((condition, a, b))))
                    }
                    (Program::Truth(a), Program::Truth(b)) => {
                        Program::Truth(Truth::If(Box::new((condition, a, b))))
                    }
                    (a, b) => return Err(Flaw::Kind { expected: a.kind(), found: b.kind() }),
                }
            }
            Expr::Agent(quantity, agent) => {
                let (who, _) = self.who(*agent)?;
                match quantity {
                    Quantity::Position => Program::Vector(Vector::Position(who)),
                    Quantity::Velocity => Program::Vector(Vector::Velocity(who)),
                    Quantity::Heading => Program::Number(Number::Heading(who)),
                    Quantity::Command => Program::Vector(Vector::Command(who)),
                    Quantity::CommandChange => Program::Vector(Vector::CommandChange(who)),
                    Quantity::Outside => Program::Truth(Truth::Outside(who)),
                }
            }
            Expr::Slot(formation, agent) => Program::Vector(self.slot_of(*formation, *agent)?),
            Expr::Rest(formation, a, b) => Program::Number(self.rest(*formation, *a, *b)?),
            Expr::Clearance(a, b) => Program::Number(self.clearance(*a, *b)?),
            Expr::Same(a, b) => Program::Truth(Truth::Same(Box::new([self.known(*a)?.0, self.known(*b)?.0]))),
            Expr::MemberNumber(agent) => Program::Number(Number::Ordinal(self.known(*agent)?.0)),
            Expr::Element(list, number) => self.element(list, number)?,
            Expr::Track(id, time) => {
                let time = Box::new(self.number(time)?);
                self.varies = Varies::InTime;
                Program::Vector(Vector::Track(self.layout.track(*id)?, time))
            }
            Expr::Measured(measure) => {
                let measured = self.scope.measured.ok_or(Flaw::OnlyInTests)?;
                measured(*measure).ok_or(Flaw::UnknownMeasure)?
            }
            Expr::Reduce { op, vars, over, filter, body } => {
                self.reduce(*op, vars, over, filter.as_deref(), body)?
            }
            Expr::Draw { distribution, site } => self.draw(distribution, *site)?,
        })
    }

    fn binary(&mut self, op: BinaryOp, a: &Expr, b: &Expr) -> Result<Program, Flaw> {
        let comparison: Comparison = match op {
            BinaryOp::And => {
                return Ok(Program::Truth(Truth::And(Box::new([self.truth(a)?, self.truth(b)?]))));
            }
            BinaryOp::Or => return Ok(Program::Truth(Truth::Or(Box::new([self.truth(a)?, self.truth(b)?])))),
            BinaryOp::Pow => return self.function2(lift!(map2, maths::power, a, b), a, b),
            BinaryOp::Add | BinaryOp::Sub | BinaryOp::Mul | BinaryOp::Div => {
                return self.arithmetic(op, a, b);
            }
            BinaryOp::Less => lift!(compare, f64::lt, a, b),
            BinaryOp::LessEq => lift!(compare, f64::le, a, b),
            BinaryOp::Greater => lift!(compare, f64::gt, a, b),
            BinaryOp::GreaterEq => lift!(compare, f64::ge, a, b),
            BinaryOp::Equal => lift!(compare, f64::eq, a, b),
            BinaryOp::NotEqual => lift!(compare, f64::ne, a, b),
        };
        Ok(Program::Truth(Truth::Compare(comparison, Box::new([self.number(a)?, self.number(b)?]))))
    }

    fn arithmetic(&mut self, op: BinaryOp, a: &Expr, b: &Expr) -> Result<Program, Flaw> {
        let programs = (self.program(a)?, self.program(b)?);
        Ok(match (op, programs) {
            (_, (truth @ Program::Truth(_), _) | (_, truth @ Program::Truth(_))) => {
                return Err(not_arithmetic(&truth));
            }
            (BinaryOp::Add, (Program::Vector(a), Program::Vector(b))) => {
                Program::Vector(Vector::Add(Box::new([a, b])))
            }
            (BinaryOp::Sub, (Program::Vector(a), Program::Vector(b))) => {
                Program::Vector(Vector::Subtract(Box::new([a, b])))
            }
            (BinaryOp::Mul, (Program::Number(a), Program::Vector(b))) => {
                Program::Vector(Vector::Scale(Box::new((a, b))))
            }
            (BinaryOp::Mul, (Program::Vector(a), Program::Number(b))) => {
                Program::Vector(Vector::ScaleBy(Box::new((a, b))))
            }
            (BinaryOp::Div, (Program::Vector(a), Program::Number(b))) => {
                Program::Vector(Vector::Divide(Box::new((a, b))))
            }
            (op, (Program::Number(a), Program::Number(b))) => {
                let operands = Box::new([a, b]);
                Program::Number(match op {
                    BinaryOp::Add => Number::Add(operands),
                    BinaryOp::Sub => Number::Subtract(operands),
                    BinaryOp::Mul => Number::Multiply(operands),
                    _ => Number::Divide(operands),
                })
            }
            (BinaryOp::Mul | BinaryOp::Div, (_, b)) => {
                return Err(Flaw::Kind { expected: "a number", found: b.kind() });
            }
            (_, (a, b)) => return Err(Flaw::Kind { expected: a.kind(), found: b.kind() }),
        })
    }

    fn param(&mut self, id: usize) -> Result<Number, Flaw> {
        let param = self.layout.params.get(id).ok_or(Flaw::UnknownParam { id })?;
        let randomised = &self.layout.world.randomise;
        match randomised.iter().position(|drawn| drawn.param == id) {
            None => Ok(Number::Constant(param.value)),
            Some(k) if self.scope.drawn.is_some_and(|drawn| k >= drawn) => {
                Err(Flaw::NotYetDrawn { param: param.name.clone() })
            }
            Some(k) => {
                self.varies = Varies::InTime;
                Ok(Number::Drawn(k))
            }
        }
    }

    fn element(&mut self, list: &[Expr], number: &Expr) -> Result<Program, Flaw> {
        let number = self.number(number)?;
        let (mut numbers, mut vectors) = (Vec::new(), Vec::new());
        for entry in list {
            match self.program(entry)? {
                Program::Number(entry) => numbers.push(entry),
                Program::Vector(entry) => vectors.push(entry),
                truth => return Err(not_arithmetic(&truth)),
            }
        }
        match (numbers.is_empty(), vectors.is_empty()) {
            (false, true) => Ok(Program::Number(Number::Element(Box::new((numbers, number))))),
            (true, false) => Ok(Program::Vector(Vector::Element(Box::new((vectors, number))))),
            (true, true) => Err(Flaw::EmptyList),
            (false, false) => Err(Flaw::Kind { expected: "a number", found: "a vector" }),
        }
    }

    fn slot(&self) -> Result<(usize, usize), Flaw> {
        self.scope.slot.ok_or(Flaw::NoSlotNumber)
    }

    /// The value of a program that looks at nothing.
    fn constant(&self, program: &Program) -> Program {
        let nobody = Agents::default();
        let mut scene = Scene::new(&self.layout.model, &nobody, &[], 0.0);
        match program {
            Program::Number(number) => Program::Number(Number::Constant(number.eval(&mut scene))),
            Program::Vector(vector) => Program::Vector(Vector::Constant(vector.eval(&mut scene))),
            Program::Truth(truth) => Program::Truth(Truth::Constant(truth.eval(&mut scene))),
        }
    }
}

fn not_arithmetic(program: &Program) -> Flaw {
    Flaw::Kind { expected: "a number or a vector", found: program.kind() }
}
