//! Plan expressions to programs.

use std::ops::Range;

use mpgx_lang::plan::{
    AgentRef, BinaryOp, Binder, Distribution, Expr, Function, GroupId, IndexSet, Param, Quantity, Reduction,
    UnaryOp, VarId, World, WorldConstant,
};

use super::draw::{Distribution as Law, Draw, MOST_DRAWS};
use super::{Agents, Each, Fold, MOST_VARIABLES, Number, Program, Scene, Truth, Vector, Who};
use crate::error::Flaw;
use crate::maths;

/// Expressions inside each other; keeps the stack safe from a Plan made by hand.
const MOST_DEPTH: usize = 400;

/// What the names of a World stand for.
pub(crate) struct Layout<'a> {
    pub params: &'a [Param],
    pub world: &'a World,
    /// The agents of each group.
    pub groups: Vec<Range<usize>>,
    /// `leader`, `follower[2]`; one an agent.
    pub names: Vec<String>,
}

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
    /// A variable that stands for one agent.
    pub bound: Option<(VarId, usize)>,
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
    /// Whether anything compiled since this was last cleared can change during an episode.
    varies: bool,
}

/// An index variable in scope and the agents it may stand for.
struct Bound {
    id: VarId,
    who: Who,
    agents: Range<usize>,
}

impl<'a> Compiler<'a> {
    pub fn new(layout: &'a Layout<'a>, scope: Scope<'a>) -> Self {
        let bound = |(id, agent)| Bound { id, who: Who::Agent(agent), agents: agent..agent + 1 };
        let variables = scope.bound.map(bound).into_iter().collect();
        Compiler { layout, scope, variables, loops: 0, depth: 0, sites: Vec::new(), varies: false }
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
        let around = std::mem::replace(&mut self.varies, false);
        let mut program = self.node(expr)?;
        if !self.varies {
            program = constant(&program);
        }
        self.varies |= around;
        self.depth -= 1;
        Ok(program)
    }

    fn node(&mut self, expr: &Expr) -> Result<Program, Flaw> {
        Ok(match expr {
            Expr::Number(x) => Program::Number(Number::Constant(*x)),
            Expr::Truth(truth) => Program::Truth(Truth::Constant(*truth)),
            Expr::Param(id) => match self.layout.params.get(*id) {
                Some(param) => Program::Number(Number::Constant(param.value)),
                None => return Err(Flaw::UnknownParam { id: *id }),
            },
            Expr::World(constant) => Program::Number(Number::Constant(match constant {
                WorldConstant::Dt => self.layout.world.dt_s,
                WorldConstant::Safety => self.layout.world.safety_m,
                WorldConstant::Horizon => self.layout.world.horizon as f64,
            })),
            Expr::Time => {
                self.varies = true;
                Program::Number(Number::Time)
            }
            Expr::State(id) => {
                self.varies = true;
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
                    Quantity::Outside => Program::Truth(Truth::Outside(who)),
                    Quantity::Command | Quantity::CommandChange => {
                        return Err(Flaw::Unsupported { what: "a command" });
                    }
                }
            }
            Expr::Slot(formation, agent) => self.slot_of(*formation, *agent)?,
            Expr::Rest(..)
            | Expr::Clearance(..)
            | Expr::Same(..)
            | Expr::MemberNumber(_)
            | Expr::Element(..)
            | Expr::Track(..)
            | Expr::Measured(_) => return Err(Flaw::Unsupported { what: "this expression" }),
            Expr::Reduce { op, vars, over, filter, body } => {
                self.reduce(*op, vars, over, filter.as_deref(), body)?
            }
            Expr::Draw { distribution, site } => self.draw(distribution, *site)?,
        })
    }

    fn binary(&mut self, op: BinaryOp, a: &Expr, b: &Expr) -> Result<Program, Flaw> {
        let comparison: fn(&f64, &f64) -> bool = match op {
            BinaryOp::And => {
                return Ok(Program::Truth(Truth::And(Box::new([self.truth(a)?, self.truth(b)?]))));
            }
            BinaryOp::Or => return Ok(Program::Truth(Truth::Or(Box::new([self.truth(a)?, self.truth(b)?])))),
            BinaryOp::Pow => return self.function2(maths::power, a, b),
            BinaryOp::Add | BinaryOp::Sub | BinaryOp::Mul | BinaryOp::Div => {
                return self.arithmetic(op, a, b);
            }
            BinaryOp::Less => f64::lt,
            BinaryOp::LessEq => f64::le,
            BinaryOp::Greater => f64::gt,
            BinaryOp::GreaterEq => f64::ge,
            BinaryOp::Equal => f64::eq,
            BinaryOp::NotEqual => f64::ne,
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

    fn call(&mut self, function: Function, arguments: &[Expr]) -> Result<Program, Flaw> {
        let arity = |expected| Flaw::Arity {
            function: format!("{function:?}").to_lowercase(),
            expected,
            found: arguments.len(),
        };
        match function {
            Function::Norm | Function::X | Function::Y | Function::Unit => {
                let [v] = arguments else { return Err(arity(1)) };
                let v = Box::new(self.vector(v)?);
                Ok(match function {
                    Function::Norm => Program::Number(Number::OfVector(maths::norm, v)),
                    Function::X => Program::Number(Number::OfVector(|v| v[0], v)),
                    Function::Y => Program::Number(Number::OfVector(|v| v[1], v)),
                    _ => Program::Vector(Vector::Unit(v)),
                })
            }
            Function::Dot | Function::Cross => {
                let [a, b] = arguments else { return Err(arity(2)) };
                let operands = Box::new([self.vector(a)?, self.vector(b)?]);
                let formula = if function == Function::Dot { maths::dot } else { maths::cross };
                Ok(Program::Number(Number::OfVectors(formula, operands)))
            }
            Function::Rotate => {
                let [v, angle] = arguments else { return Err(arity(2)) };
                Ok(Program::Vector(Vector::Rotate(Box::new((self.vector(v)?, self.number(angle)?)))))
            }
            Function::Atan2 | Function::Mod | Function::Min | Function::Max => {
                let [a, b] = arguments else { return Err(arity(2)) };
                let formula = match function {
                    Function::Atan2 => libm::atan2,
                    Function::Mod => maths::modulo,
                    Function::Min => maths::lesser,
                    _ => maths::greater,
                };
                self.function2(formula, a, b)
            }
            Function::Clamp => {
                let [x, low, high] = arguments else { return Err(arity(3)) };
                let operands = [self.number(x)?, self.number(low)?, self.number(high)?];
                Ok(Program::Number(Number::Clamp(Box::new(operands))))
            }
            Function::Abs
            | Function::Sqrt
            | Function::Sin
            | Function::Cos
            | Function::Tan
            | Function::Exp
            | Function::Ln
            | Function::Tanh
            | Function::Floor
            | Function::Sign => {
                let [x] = arguments else { return Err(arity(1)) };
                let formula: fn(f64) -> f64 = match function {
                    Function::Abs => f64::abs,
                    Function::Sqrt => f64::sqrt,
                    Function::Sin => libm::sin,
                    Function::Cos => libm::cos,
                    Function::Tan => libm::tan,
                    Function::Exp => libm::exp,
                    Function::Ln => libm::log,
                    Function::Tanh => libm::tanh,
                    Function::Floor => f64::floor,
                    _ => maths::sign,
                };
                Ok(Program::Number(Number::Function1(formula, Box::new(self.number(x)?))))
            }
        }
    }

    fn function2(&mut self, formula: fn(f64, f64) -> f64, a: &Expr, b: &Expr) -> Result<Program, Flaw> {
        let operands = Box::new([self.number(a)?, self.number(b)?]);
        Ok(Program::Number(Number::Function2(formula, operands)))
    }

    fn slot(&self) -> Result<(usize, usize), Flaw> {
        self.scope.slot.ok_or(Flaw::NoSlotNumber)
    }

    fn slot_of(&mut self, formation: usize, agent: AgentRef) -> Result<Program, Flaw> {
        if self.scope.slot.is_some() {
            return Err(Flaw::SlotInFormation);
        }
        let shape = self.layout.world.formations.get(formation);
        let shape = shape.ok_or(Flaw::UnknownFormation { id: formation })?;
        let about = shape.about.ok_or(Flaw::Unsupported { what: "a place in a formation about nobody" })?;
        self.must_be_placed(about..about + 1)?;
        let (who, agents) = self.known(agent)?;
        let members = self.group(shape.group)?;
        if let Some(stranger) = agents.into_iter().find(|agent| !members.contains(agent)) {
            return Err(Flaw::NotInFormation { agent: self.layout.names[stranger].clone() });
        }
        self.varies = true;
        Ok(Program::Vector(Vector::Slot(formation, who)))
    }

    /// An agent whose state is looked at.
    fn who(&mut self, agent: AgentRef) -> Result<(Who, Range<usize>), Flaw> {
        self.varies = true;
        let (who, agents) = self.known(agent)?;
        self.must_be_placed(agents.clone())?;
        Ok((who, agents))
    }

    fn known(&self, agent: AgentRef) -> Result<(Who, Range<usize>), Flaw> {
        let fixed = |agent| (Who::Agent(agent), agent..agent + 1);
        match agent {
            AgentRef::Fixed(id) if id < self.layout.names.len() => Ok(fixed(id)),
            AgentRef::Fixed(id) => Err(Flaw::UnknownAgent { id }),
            AgentRef::Member => self.scope.member.map(fixed).ok_or(Flaw::NoMember),
            AgentRef::Var(id) => {
                let bound = self.variables.iter().rev().find(|bound| bound.id == id);
                let bound = bound.ok_or(Flaw::UnboundVariable { id })?;
                Ok((bound.who, bound.agents.clone()))
            }
        }
    }

    fn must_be_placed(&self, mut agents: Range<usize>) -> Result<(), Flaw> {
        let Some(placed) = self.scope.placed else { return Ok(()) };
        match agents.find(|&agent| placed.get(agent) != Some(&true)) {
            None => Ok(()),
            Some(agent) => Err(Flaw::NotYetPlaced { agent: self.layout.names[agent].clone() }),
        }
    }

    fn group(&self, id: GroupId) -> Result<Range<usize>, Flaw> {
        self.layout.groups.get(id).cloned().ok_or(Flaw::UnknownGroup { id })
    }

    /// The members of an index set that is not of pairs.
    pub fn members(&self, set: &IndexSet) -> Result<Range<usize>, Flaw> {
        match set {
            IndexSet::All => Ok(0..self.layout.names.len()),
            IndexSet::Group(id) => self.group(*id),
            IndexSet::Pairs(_) => Err(Flaw::PairsOfPairs),
            IndexSet::Obstacles | IndexSet::Edges(_) | IndexSet::Nearest { .. } => {
                Err(Flaw::Unsupported { what: "this set" })
            }
        }
    }

    fn reduce(
        &mut self,
        op: Reduction,
        binders: &[Binder],
        set: &IndexSet,
        filter: Option<&Expr>,
        body: &Expr,
    ) -> Result<Program, Flaw> {
        let (agents, expected) = match set {
            IndexSet::Pairs(of) => (self.members(of)?, 2),
            single => (self.members(single)?, 1),
        };
        if binders.len() != expected {
            return Err(Flaw::Binders { expected, found: binders.len() });
        }
        let variable = self.loops;
        if variable + expected > MOST_VARIABLES {
            return Err(Flaw::TooManyVariables { most: MOST_VARIABLES });
        }
        for binder in binders {
            let who = Who::Variable(self.loops);
            self.variables.push(Bound { id: binder.id, who, agents: agents.clone() });
            self.loops += 1;
        }
        let filter = filter.map(|filter| self.truth(filter)).transpose()?;
        let each =
            Box::new(Each { first: agents.start, end: agents.end, pairs: expected == 2, variable, filter });
        let program = match op {
            Reduction::Sum => Program::Number(Number::Fold(Fold::Sum, each, Box::new(self.number(body)?))),
            Reduction::Mean => Program::Number(Number::Fold(Fold::Mean, each, Box::new(self.number(body)?))),
            Reduction::Min => Program::Number(Number::Fold(Fold::Min, each, Box::new(self.number(body)?))),
            Reduction::Max => Program::Number(Number::Fold(Fold::Max, each, Box::new(self.number(body)?))),
            Reduction::Count => Program::Number(Number::Count(each, Box::new(self.truth(body)?))),
            Reduction::Any => Program::Truth(Truth::Any(each, Box::new(self.truth(body)?))),
            Reduction::All => Program::Truth(Truth::All(each, Box::new(self.truth(body)?))),
        };
        self.loops = variable;
        self.variables.truncate(self.variables.len() - expected);
        Ok(program)
    }

    fn draw(&mut self, distribution: &Distribution, site: usize) -> Result<Program, Flaw> {
        if !self.scope.draws {
            return Err(Flaw::NoDraw);
        }
        let (from, vector) = match distribution {
            Distribution::UnitDisc => (Law::UnitDisc, true),
            Distribution::Uniform { low: a, high: b } | Distribution::Normal { mean: a, deviation: b } => {
                let uniform = matches!(distribution, Distribution::Uniform { .. });
                match (self.program(a)?, self.program(b)?) {
                    (Program::Number(a), Program::Number(b)) if uniform => (Law::Uniform([a, b]), false),
                    (Program::Number(a), Program::Number(b)) => (Law::Normal([a, b]), false),
                    (Program::Vector(a), Program::Vector(b)) if uniform => (Law::UniformAxes([a, b]), true),
                    (Program::Vector(a), Program::Vector(b)) => (Law::NormalAxes([a, b]), true),
                    (a, b) => return Err(Flaw::Kind { expected: a.kind(), found: b.kind() }),
                }
            }
        };
        self.varies = true;
        let draw = Box::new(Draw { from, memory: self.memory(site)? });
        Ok(if vector { Program::Vector(Vector::Draw(draw)) } else { Program::Number(Number::Draw(draw)) })
    }

    /// Where the draw of a site is kept. In a reduction it is drawn for each member, and kept nowhere.
    fn memory(&mut self, site: usize) -> Result<Option<usize>, Flaw> {
        let looped = self.loops > 0;
        match self.sites.iter().position(|&(known, _)| known == site) {
            Some(memory) if !looped && !self.sites[memory].1 => Ok(Some(memory)),
            Some(_) => Err(Flaw::DrawInReduction),
            None if self.sites.len() == MOST_DRAWS => Err(Flaw::TooManyDraws { most: MOST_DRAWS }),
            None => {
                self.sites.push((site, looped));
                Ok((!looped).then_some(self.sites.len() - 1))
            }
        }
    }
}

/// The value of a program that looks at nothing.
fn constant(program: &Program) -> Program {
    let nobody = Agents::default();
    let mut scene = Scene::new(&nobody, &[], 0.0);
    match program {
        Program::Number(number) => Program::Number(Number::Constant(number.eval(&mut scene))),
        Program::Vector(vector) => Program::Vector(Vector::Constant(vector.eval(&mut scene))),
        Program::Truth(truth) => Program::Truth(Truth::Constant(truth.eval(&mut scene))),
    }
}

fn not_arithmetic(program: &Program) -> Flaw {
    Flaw::Kind { expected: "a number or a vector", found: program.kind() }
}
