//! The reward machine against an interpreter that walks the Plan itself.

use std::collections::BTreeMap;

use mpgx_lang::plan::*;
use mpgx_random::{Address, Purpose, Stream};
use proptest::prelude::*;

use super::{Agents, Compiler, Draws, Layout, Program, Scene, Scope, Shape, Vector};
use crate::error::Flaw;
use crate::maths::{self, Vec2};
use crate::sample;

#[derive(Clone, Copy, Debug)]
enum Value {
    Number(f64),
    Vector(Vec2),
    Truth(bool),
}

/// Two groups (2 and 3 agents), one formation of the second about agent 0, two motion states.
const GROUPS: [std::ops::Range<usize>; 2] = [0..2, 2..5];
const DISPLACEMENTS: [Vec2; 3] = [[-0.4, 0.0], [-0.4, -0.4], [0.0, -0.4]];

struct Naive<'a> {
    agents: &'a Agents,
    plan: &'a Plan,
    states: &'a [Vec2; 2],
    stream: Stream,
    /// By site.
    drawn: BTreeMap<usize, Value>,
    variables: Vec<(VarId, usize)>,
}

impl Naive<'_> {
    fn number(&mut self, expr: &Expr) -> f64 {
        let Value::Number(x) = self.value(expr) else { panic!("{expr:?} is no number") };
        x
    }

    fn vector(&mut self, expr: &Expr) -> Vec2 {
        let Value::Vector(v) = self.value(expr) else { panic!("{expr:?} is no vector") };
        v
    }

    fn truth(&mut self, expr: &Expr) -> bool {
        let Value::Truth(truth) = self.value(expr) else { panic!("{expr:?} is no truth value") };
        truth
    }

    fn agent(&self, agent: AgentRef) -> usize {
        match agent {
            AgentRef::Fixed(id) => id,
            AgentRef::Member => 1,
            AgentRef::Var(var) => self.variables.iter().rev().find(|(id, _)| *id == var).unwrap().1,
        }
    }

    fn value(&mut self, expr: &Expr) -> Value {
        use Value::{Number, Truth, Vector};
        match expr {
            Expr::Number(x) => Number(*x),
            Expr::Truth(truth) => Truth(*truth),
            Expr::Param(id) => Number(self.plan.params[*id].value),
            Expr::World(WorldConstant::Dt) => Number(self.plan.world.dt_s),
            Expr::World(WorldConstant::Safety) => Number(self.plan.world.safety_m),
            Expr::World(WorldConstant::Horizon) => Number(self.plan.world.horizon as f64),
            Expr::Time => Number(1.25),
            Expr::State(0) => Number(self.states[0][0]),
            Expr::State(_) => Vector(self.states[1]),
            Expr::SlotNumber | Expr::SlotCount => panic!("outside a formation"),
            Expr::Vector(x, y) => Vector([self.number(x), self.number(y)]),
            Expr::Unary(UnaryOp::Not, a) => Truth(!self.truth(a)),
            Expr::Unary(UnaryOp::Neg, a) => match self.value(a) {
                Number(x) => Number(-x),
                Vector([x, y]) => Vector([-x, -y]),
                Truth(_) => panic!("minus a truth value"),
            },
            Expr::Binary(BinaryOp::And, a, b) => Truth(self.truth(a) && self.truth(b)),
            Expr::Binary(BinaryOp::Or, a, b) => Truth(self.truth(a) || self.truth(b)),
            Expr::Binary(op, a, b) => {
                let (a, b) = (self.value(a), self.value(b));
                match (op, a, b) {
                    (BinaryOp::Add, Number(a), Number(b)) => Number(a + b),
                    (BinaryOp::Add, Vector(a), Vector(b)) => Vector([a[0] + b[0], a[1] + b[1]]),
                    (BinaryOp::Sub, Number(a), Number(b)) => Number(a - b),
                    (BinaryOp::Sub, Vector(a), Vector(b)) => Vector([a[0] - b[0], a[1] - b[1]]),
                    (BinaryOp::Mul, Number(a), Number(b)) => Number(a * b),
                    (BinaryOp::Mul, Number(x), Vector(v)) | (BinaryOp::Mul, Vector(v), Number(x)) => {
                        Vector([x * v[0], x * v[1]])
                    }
                    (BinaryOp::Div, Number(a), Number(b)) => Number(a / b),
                    (BinaryOp::Div, Vector(v), Number(x)) => Vector([v[0] / x, v[1] / x]),
                    (BinaryOp::Pow, Number(a), Number(b)) => Number(maths::power(a, b)),
                    (BinaryOp::Less, Number(a), Number(b)) => Truth(a < b),
                    (BinaryOp::LessEq, Number(a), Number(b)) => Truth(a <= b),
                    (BinaryOp::Greater, Number(a), Number(b)) => Truth(a > b),
                    (BinaryOp::GreaterEq, Number(a), Number(b)) => Truth(a >= b),
                    (BinaryOp::Equal, Number(a), Number(b)) => Truth(a == b),
                    (BinaryOp::NotEqual, Number(a), Number(b)) => Truth(a != b),
                    _ => panic!("{a:?} {op:?} {b:?}"),
                }
            }
            Expr::Call(function, of) => self.call(*function, of),
            Expr::If { condition, then, otherwise } => {
                if self.truth(condition) {
                    self.value(then)
                } else {
                    self.value(otherwise)
                }
            }
            Expr::Agent(quantity, agent) => {
                let agent = self.agent(*agent);
                match quantity {
                    Quantity::Position => Vector(self.agents.position[agent]),
                    Quantity::Velocity => Vector(self.agents.velocity[agent]),
                    Quantity::Heading => Number(self.agents.heading[agent]),
                    Quantity::Outside => Truth(self.agents.outside[agent]),
                    Quantity::Command | Quantity::CommandChange => panic!("not yet"),
                }
            }
            Expr::Slot(_, agent) => {
                let (about, displacement) = (self.agents.position[0], DISPLACEMENTS[self.agent(*agent) - 2]);
                Vector([about[0] + displacement[0], about[1] + displacement[1]])
            }
            Expr::Rest(..)
            | Expr::Clearance(..)
            | Expr::Same(..)
            | Expr::MemberNumber(_)
            | Expr::Element(..)
            | Expr::Track(..)
            | Expr::Measured(_) => panic!("not yet"),
            Expr::Reduce { op, vars, over, filter, body } => {
                self.reduce(*op, vars, over, filter.as_deref(), body)
            }
            Expr::Draw { distribution, site } => {
                if let Some(value) = self.drawn.get(site) {
                    return *value;
                }
                let value = self.draw(distribution);
                self.drawn.insert(*site, value);
                value
            }
        }
    }

    fn draw(&mut self, distribution: &Distribution) -> Value {
        match distribution {
            Distribution::UnitDisc => {
                let radius = self.stream.uniform().sqrt();
                Value::Vector(maths::rotate([radius, 0.0], std::f64::consts::TAU * self.stream.uniform()))
            }
            Distribution::Uniform { low, high } => match (self.value(low), self.value(high)) {
                (Value::Vector(a), Value::Vector(b)) => {
                    let x = a[0] + (b[0] - a[0]) * self.stream.uniform();
                    Value::Vector([x, a[1] + (b[1] - a[1]) * self.stream.uniform()])
                }
                (Value::Number(low), Value::Number(high)) => {
                    Value::Number(low + (high - low) * self.stream.uniform())
                }
                _ => panic!("a range of two kinds"),
            },
            Distribution::Normal { mean, deviation } => match (self.value(mean), self.value(deviation)) {
                (Value::Vector(mean), Value::Vector(deviation)) => {
                    let x = mean[0] + deviation[0] * self.stream.normal();
                    Value::Vector([x, mean[1] + deviation[1] * self.stream.normal()])
                }
                (Value::Number(mean), Value::Number(deviation)) => {
                    Value::Number(mean + deviation * self.stream.normal())
                }
                _ => panic!("mean and deviation of two kinds"),
            },
        }
    }

    fn call(&mut self, function: Function, of: &[Expr]) -> Value {
        use Value::{Number, Vector};
        match function {
            Function::Norm => Number(maths::norm(self.vector(&of[0]))),
            Function::Abs => Number(self.number(&of[0]).abs()),
            Function::X => Number(self.vector(&of[0])[0]),
            Function::Y => Number(self.vector(&of[0])[1]),
            Function::Dot => Number(maths::dot(self.vector(&of[0]), self.vector(&of[1]))),
            Function::Cross => Number(maths::cross(self.vector(&of[0]), self.vector(&of[1]))),
            Function::Rotate => Vector(maths::rotate(self.vector(&of[0]), self.number(&of[1]))),
            Function::Unit => Vector(maths::unit(self.vector(&of[0]))),
            Function::Sqrt => Number(libm::sqrt(self.number(&of[0]))),
            Function::Sin => Number(libm::sin(self.number(&of[0]))),
            Function::Cos => Number(libm::cos(self.number(&of[0]))),
            Function::Tan => Number(libm::tan(self.number(&of[0]))),
            Function::Atan2 => Number(libm::atan2(self.number(&of[0]), self.number(&of[1]))),
            Function::Exp => Number(libm::exp(self.number(&of[0]))),
            Function::Ln => Number(libm::log(self.number(&of[0]))),
            Function::Tanh => Number(libm::tanh(self.number(&of[0]))),
            Function::Floor => Number(libm::floor(self.number(&of[0]))),
            Function::Mod => Number(maths::modulo(self.number(&of[0]), self.number(&of[1]))),
            Function::Sign => Number(maths::sign(self.number(&of[0]))),
            Function::Min => Number(maths::lesser(self.number(&of[0]), self.number(&of[1]))),
            Function::Max => Number(maths::greater(self.number(&of[0]), self.number(&of[1]))),
            Function::Clamp => {
                Number(maths::clamp(self.number(&of[0]), self.number(&of[1]), self.number(&of[2])))
            }
        }
    }

    /// Lists the members first, with their filter; then folds the values.
    fn reduce(
        &mut self,
        op: Reduction,
        vars: &[Binder],
        over: &IndexSet,
        filter: Option<&Expr>,
        body: &Expr,
    ) -> Value {
        let members = |set: &IndexSet| match set {
            IndexSet::All => (0..5).collect::<Vec<_>>(),
            IndexSet::Group(group) => GROUPS[*group].clone().collect(),
            _ => panic!("not a set of single agents"),
        };
        let bindings: Vec<Vec<usize>> = match over {
            IndexSet::Pairs(of) => {
                let all = members(of);
                let pairs = all.iter().flat_map(|&i| all.iter().map(move |&j| vec![i, j]));
                pairs.filter(|pair| pair[0] < pair[1]).collect()
            }
            single => members(single).into_iter().map(|i| vec![i]).collect(),
        };
        let mut numbers = Vec::new();
        let mut truths = Vec::new();
        for binding in bindings {
            let outer = self.variables.len();
            self.variables.extend(vars.iter().map(|var| var.id).zip(binding));
            if filter.is_none_or(|filter| self.truth(filter)) {
                match self.value(body) {
                    Value::Number(x) => numbers.push(x),
                    Value::Truth(truth) => truths.push(truth),
                    Value::Vector(_) => panic!("a vector in a reduction"),
                }
            }
            self.variables.truncate(outer);
        }
        match op {
            Reduction::Sum => Value::Number(numbers.iter().fold(0.0, |a, b| a + b)),
            Reduction::Mean if numbers.is_empty() => Value::Number(0.0),
            Reduction::Mean => Value::Number(numbers.iter().fold(0.0, |a, b| a + b) / numbers.len() as f64),
            Reduction::Min => Value::Number(numbers.into_iter().fold(f64::INFINITY, maths::lesser)),
            Reduction::Max => Value::Number(numbers.into_iter().fold(f64::NEG_INFINITY, maths::greater)),
            Reduction::Count => Value::Number(truths.iter().filter(|&&truth| truth).count() as f64),
            Reduction::Any => Value::Truth(truths.contains(&true)),
            Reduction::All => Value::Truth(!truths.contains(&false)),
        }
    }
}

/// Writes random expressions.
struct Author {
    choice: Stream,
    /// Variables in scope, and whether their agents are all members of the formation.
    variables: Vec<(VarId, bool)>,
    /// A number for the next variable or site.
    next: usize,
    draws: bool,
}

impl Author {
    fn below(&mut self, n: u64) -> u64 {
        self.choice.below(n)
    }

    /// Half of them harmless, half of the kind that breaks things.
    fn literal(&mut self) -> f64 {
        const CORNERS: [f64; 9] =
            [0.0, -0.0, 1.0, -1.0, 2.0, 5e-324, f64::INFINITY, f64::NEG_INFINITY, f64::NAN];
        if self.below(2) == 0 { 4.0 * self.choice.uniform() - 2.0 } else { CORNERS[self.below(9) as usize] }
    }

    fn agent(&mut self) -> AgentRef {
        match self.below(4) {
            0 => AgentRef::Member,
            1 => AgentRef::Fixed(self.below(5) as usize),
            _ if self.variables.is_empty() => AgentRef::Fixed(3),
            _ => {
                let chosen = self.below(self.variables.len() as u64) as usize;
                AgentRef::Var(self.variables[chosen].0)
            }
        }
    }

    fn member(&mut self) -> AgentRef {
        let known = self.variables.iter().rev().find(|(_, member)| *member);
        known.map_or(AgentRef::Fixed(2), |(var, _)| AgentRef::Var(*var))
    }

    fn number(&mut self, depth: u32) -> Expr {
        let leaf = depth == 0;
        match self.below(if leaf { 6 } else { 18 }) {
            0 => Expr::Number(self.literal()),
            1 => Expr::Param(self.below(2) as usize),
            2 => Expr::World(
                [WorldConstant::Dt, WorldConstant::Safety, WorldConstant::Horizon][self.below(3) as usize],
            ),
            3 => Expr::Time,
            4 => Expr::State(0),
            5 => Expr::Agent(Quantity::Heading, self.agent()),
            6 => sample::negated(self.number(depth - 1)),
            7 | 8 => {
                use BinaryOp::{Add, Div, Mul, Pow, Sub};
                let op = [Add, Sub, Mul, Div, Pow][self.below(5) as usize];
                sample::binary(op, self.number(depth - 1), self.number(depth - 1))
            }
            9 => {
                use Function::{Abs, Cos, Exp, Floor, Ln, Sign, Sin, Sqrt, Tan, Tanh};
                let functions = [Abs, Cos, Exp, Floor, Ln, Sign, Sin, Sqrt, Tan, Tanh];
                Expr::Call(functions[self.below(10) as usize], vec![self.number(depth - 1)])
            }
            10 => {
                let functions = [Function::Atan2, Function::Mod, Function::Min, Function::Max];
                let of = vec![self.number(depth - 1), self.number(depth - 1)];
                Expr::Call(functions[self.below(4) as usize], of)
            }
            11 => Expr::Call(Function::Clamp, (0..3).map(|_| self.number(depth - 1)).collect()),
            12 => {
                let functions = [Function::Norm, Function::X, Function::Y];
                Expr::Call(functions[self.below(3) as usize], vec![self.vector(depth - 1)])
            }
            13 => {
                let functions = [Function::Dot, Function::Cross];
                Expr::Call(
                    functions[self.below(2) as usize],
                    vec![self.vector(depth - 1), self.vector(depth - 1)],
                )
            }
            14 => Expr::If {
                condition: Box::new(self.truth(depth - 1)),
                then: Box::new(self.number(depth - 1)),
                otherwise: Box::new(self.number(depth - 1)),
            },
            15 if self.draws => {
                let (a, b) = (self.number(depth - 1), self.number(depth - 1));
                self.draw(Some((a, b)))
            }
            16 => {
                let twice = self.number(depth - 1);
                sample::binary(BinaryOp::Sub, twice.clone(), twice)
            }
            _ => {
                use Reduction::{Count, Max, Mean, Min, Sum};
                let op = [Sum, Mean, Min, Max, Count][self.below(5) as usize];
                self.reduce(op, depth)
            }
        }
    }

    fn vector(&mut self, depth: u32) -> Expr {
        match self.below(if depth == 0 { 4 } else { 12 }) {
            0 => Expr::State(1),
            1 => Expr::Agent(Quantity::Position, self.agent()),
            2 => Expr::Agent(Quantity::Velocity, self.agent()),
            3 => Expr::Slot(0, self.member()),
            4 => Expr::Vector(Box::new(self.number(depth - 1)), Box::new(self.number(depth - 1))),
            5 => sample::negated(self.vector(depth - 1)),
            6 => {
                let op = [BinaryOp::Add, BinaryOp::Sub][self.below(2) as usize];
                sample::binary(op, self.vector(depth - 1), self.vector(depth - 1))
            }
            7 => {
                let (v, x) = (self.vector(depth - 1), self.number(depth - 1));
                match self.below(3) {
                    0 => sample::binary(BinaryOp::Mul, v, x),
                    1 => sample::binary(BinaryOp::Mul, x, v),
                    _ => sample::binary(BinaryOp::Div, v, x),
                }
            }
            8 => Expr::Call(Function::Rotate, vec![self.vector(depth - 1), self.number(depth - 1)]),
            9 => Expr::If {
                condition: Box::new(self.truth(depth - 1)),
                then: Box::new(self.vector(depth - 1)),
                otherwise: Box::new(self.vector(depth - 1)),
            },
            10 if self.draws => {
                let of = (self.below(2) == 0).then(|| (self.vector(depth - 1), self.vector(depth - 1)));
                self.draw(of)
            }
            _ => Expr::Call(Function::Unit, vec![self.vector(depth - 1)]),
        }
    }

    /// A draw with a site of its own.
    fn draw(&mut self, of: Option<(Expr, Expr)>) -> Expr {
        let distribution = match of.map(|(a, b)| (Box::new(a), Box::new(b))) {
            None => Distribution::UnitDisc,
            Some((low, high)) if self.below(2) == 0 => Distribution::Uniform { low, high },
            Some((mean, deviation)) => Distribution::Normal { mean, deviation },
        };
        self.next += 1;
        Expr::Draw { distribution, site: self.next }
    }

    fn truth(&mut self, depth: u32) -> Expr {
        match self.below(if depth == 0 { 2 } else { 7 }) {
            0 => Expr::Truth(self.below(2) == 0),
            1 => Expr::Agent(Quantity::Outside, self.agent()),
            2 => Expr::Unary(UnaryOp::Not, Box::new(self.truth(depth - 1))),
            3 => {
                let op = [BinaryOp::And, BinaryOp::Or][self.below(2) as usize];
                sample::binary(op, self.truth(depth - 1), self.truth(depth - 1))
            }
            4 | 5 => {
                use BinaryOp::{Equal, Greater, GreaterEq, Less, LessEq, NotEqual};
                let op = [Equal, Greater, GreaterEq, Less, LessEq, NotEqual][self.below(6) as usize];
                sample::binary(op, self.number(depth - 1), self.number(depth - 1))
            }
            _ => {
                let op = [Reduction::Any, Reduction::All][self.below(2) as usize];
                self.reduce(op, depth)
            }
        }
    }

    /// Draws inside reductions would depend on whether a fold stops early: there are none.
    fn reduce(&mut self, op: Reduction, depth: u32) -> Expr {
        let outer = self.variables.len();
        let draws = std::mem::take(&mut self.draws);
        let set = [IndexSet::All, IndexSet::Group(0), IndexSet::Group(1)][self.below(3) as usize].clone();
        let member = set == IndexSet::Group(1);
        let pairs = self.below(3) == 0 && outer < 6;
        let vars: Vec<VarId> = (self.next..self.next + if pairs { 2 } else { 1 }).collect();
        self.next += vars.len();
        self.variables.extend(vars.iter().map(|&var| (var, member)));
        let filter = (self.below(3) == 0).then(|| Box::new(self.truth(depth - 1)));
        let body = match op {
            Reduction::Count | Reduction::Any | Reduction::All => self.truth(depth - 1),
            _ => self.number(depth - 1),
        };
        self.variables.truncate(outer);
        self.draws = draws;
        let over = if pairs { IndexSet::Pairs(Box::new(set)) } else { set };
        match sample::reduce(op, &vars, over, body) {
            Expr::Reduce { op, vars, over, body, .. } => Expr::Reduce { op, vars, over, filter, body },
            other => other,
        }
    }
}

fn stream(seed: u64, part: u16) -> Draws {
    Draws::new(Address {
        master: seed,
        purpose: Purpose::Motion,
        protocol: 0,
        part,
        seed: 0,
        episode: 0,
        step: 0,
    })
}

/// Agents at random places, some on top of each other.
fn crowd(stream: &mut Stream) -> Agents {
    let mut agents = Agents::new(5);
    for k in 0..5 {
        agents.position[k] =
            [0, 1].map(|_| (4.0 * stream.uniform()).floor() / 2.0 - stream.uniform().floor());
        agents.velocity[k] = [0, 1].map(|_| stream.normal());
        agents.heading[k] = stream.normal();
        agents.outside[k] = stream.below(2) == 0;
    }
    agents
}

fn bits(value: [f64; 2]) -> [u64; 2] {
    value.map(|x| if x.is_nan() { f64::NAN.to_bits() } else { x.to_bits() })
}

proptest! {
    #![proptest_config(sample::cases(4000))]

    #[test]
    fn programs_give_the_bits_of_the_interpreter(seed: u64, kind in 0..3, draws: bool, depth in 0u32..6) {
        let mut author = Author { choice: stream(seed, 0).stream().clone(), variables: Vec::new(), next: 0, draws };
        let expr = match kind {
            0 => author.number(depth),
            1 => author.vector(depth),
            _ => author.truth(depth),
        };
        let agents = crowd(stream(seed, 1).stream());
        let mut world = sample::unison(sample::point());
        world.groups[0].size = 2;
        let plan = sample::plan(world);
        let layout = Layout {
            params: &plan.params, world: &plan.world, groups: GROUPS.into(), names: vec![String::new(); 5],
        };
        let scope = Scope { member: Some(1), states: &[false, true], draws, ..Scope::default() };
        let program = match Compiler::new(&layout, scope).program(&expr) {
            Err(Flaw::TooManyDraws { .. }) => return Ok(()),
            compiled => compiled.map_err(|flaw| TestCaseError::fail(flaw.to_string()))?,
        };
        let shape = Shape { about: 0, first: 2, displacements: DISPLACEMENTS.map(Vector::Constant).into() };
        let states = [[0.75, 0.0], [-0.5, 0.25]];
        let mut drawn = stream(seed, 2);
        let mut scene = Scene::new(&agents, std::slice::from_ref(&shape), 1.25).random(&states, &mut drawn);
        let found = match &program {
            Program::Truth(truth) => [f64::from(truth.eval(&mut scene)), 0.0],
            other => other.eval(&mut scene),
        };
        let mut naive = Naive {
            agents: &agents, plan: &plan, states: &states, stream: stream(seed, 2).stream().clone(), drawn: BTreeMap::new(), variables: Vec::new(),
        };
        let expected = match naive.value(&expr) {
            Value::Number(x) => [x, 0.0],
            Value::Vector(v) => v,
            Value::Truth(truth) => [f64::from(truth), 0.0],
        };
        prop_assert_eq!(bits(found), bits(expected), "{:?}", expr);
    }
}
