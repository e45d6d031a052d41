//! Random expressions.

use mpgx_lang::plan::*;
use mpgx_random::Stream;

use super::EDGES;
use crate::sample;

/// Writes random expressions.
pub(super) struct Author {
    choice: Stream,
    /// Variables in scope, and whom they stand for.
    variables: Vec<(VarId, Kind)>,
    /// Formations whose edges are in scope, with their ends.
    edges: Vec<(FormationId, [VarId; 2])>,
    /// A number for the next variable or site.
    next: usize,
    draws: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Agent,
    /// Of group 1.
    Member,
    Obstacle,
}

impl Author {
    pub fn new(choice: Stream, draws: bool) -> Author {
        Author { choice, variables: Vec::new(), edges: Vec::new(), next: 0, draws }
    }

    fn below(&mut self, n: u64) -> u64 {
        self.choice.below(n)
    }

    /// Half of them harmless, half of the kind that breaks things.
    fn literal(&mut self) -> f64 {
        const CORNERS: [f64; 9] =
            [0.0, -0.0, 1.0, -1.0, 2.0, 5e-324, f64::INFINITY, f64::NEG_INFINITY, f64::NAN];
        if self.below(2) == 0 { 4.0 * self.choice.uniform() - 2.0 } else { CORNERS[self.below(9) as usize] }
    }

    /// An agent or obstacle.
    fn anything(&mut self) -> AgentRef {
        match self.below(4) {
            0 => AgentRef::Member,
            1 => AgentRef::Fixed(self.below(8) as usize),
            _ if self.variables.is_empty() => AgentRef::Fixed(3),
            _ => {
                let chosen = self.below(self.variables.len() as u64) as usize;
                AgentRef::Var(self.variables[chosen].0)
            }
        }
    }

    fn agent(&mut self) -> AgentRef {
        let known = self.variables.iter().rev().find(|(_, kind)| *kind != Kind::Obstacle);
        match (known, self.choice.below(3)) {
            (Some((var, _)), 0 | 1) => AgentRef::Var(*var),
            _ => AgentRef::Fixed(self.below(5) as usize),
        }
    }

    fn member(&mut self) -> AgentRef {
        let known = self.variables.iter().rev().find(|(_, kind)| *kind == Kind::Member);
        known.map_or(AgentRef::Fixed(2), |(var, _)| AgentRef::Var(*var))
    }

    /// The ends of an edge in scope, or of one that is fixed.
    fn rest(&mut self) -> Expr {
        let turned = self.below(2) == 0;
        let (formation, [a, b]) = match self.edges.last() {
            Some(&(formation, ends)) => (formation, ends.map(AgentRef::Var)),
            None => {
                let edge = EDGES[self.below(4) as usize];
                let star = [0, 2 + self.below(3) as usize];
                let formation = [0, 2][self.below(2) as usize];
                (formation, if formation == 2 { edge } else { star }.map(AgentRef::Fixed))
            }
        };
        if turned { Expr::Rest(formation, b, a) } else { Expr::Rest(formation, a, b) }
    }

    fn clearance(&mut self) -> Expr {
        let (a, b) = (self.agent(), self.anything());
        if self.below(2) == 0 { Expr::Clearance(a, b) } else { Expr::Clearance(b, a) }
    }

    /// A list and a number of an entry.
    fn element(&mut self, depth: u32, entry: fn(&mut Author, u32) -> Expr) -> Expr {
        let list = (0..=self.below(3)).map(|_| entry(self, depth)).collect();
        Expr::Element(list, Box::new(self.number(depth)))
    }

    pub fn number(&mut self, depth: u32) -> Expr {
        let leaf = depth == 0;
        match self.below(if leaf { 9 } else { 22 }) {
            0 => Expr::Number(self.literal()),
            1 => Expr::Param(self.below(2) as usize),
            2 => Expr::World(
                [WorldConstant::Dt, WorldConstant::Safety, WorldConstant::Horizon][self.below(3) as usize],
            ),
            3 => Expr::Time,
            4 => Expr::State(0),
            5 => Expr::Agent(Quantity::Heading, self.anything()),
            6 => Expr::MemberNumber(self.anything()),
            7 => self.clearance(),
            8 => self.rest(),
            18 => self.element(depth - 1, Author::number),
            9 => sample::negated(self.number(depth - 1)),
            10 | 11 => {
                use BinaryOp::{Add, Div, Mul, Pow, Sub};
                let op = [Add, Sub, Mul, Div, Pow][self.below(5) as usize];
                sample::binary(op, self.number(depth - 1), self.number(depth - 1))
            }
            12 => {
                use Function::{Abs, Cos, Exp, Floor, Ln, Sign, Sin, Sqrt, Tan, Tanh};
                let functions = [Abs, Cos, Exp, Floor, Ln, Sign, Sin, Sqrt, Tan, Tanh];
                Expr::Call(functions[self.below(10) as usize], vec![self.number(depth - 1)])
            }
            13 => {
                let functions = [Function::Atan2, Function::Mod, Function::Min, Function::Max];
                let of = vec![self.number(depth - 1), self.number(depth - 1)];
                Expr::Call(functions[self.below(4) as usize], of)
            }
            14 => Expr::Call(Function::Clamp, (0..3).map(|_| self.number(depth - 1)).collect()),
            15 => {
                let functions = [Function::Norm, Function::X, Function::Y];
                Expr::Call(functions[self.below(3) as usize], vec![self.vector(depth - 1)])
            }
            16 => {
                let functions = [Function::Dot, Function::Cross];
                Expr::Call(
                    functions[self.below(2) as usize],
                    vec![self.vector(depth - 1), self.vector(depth - 1)],
                )
            }
            17 => Expr::If {
                condition: Box::new(self.truth(depth - 1)),
                then: Box::new(self.number(depth - 1)),
                otherwise: Box::new(self.number(depth - 1)),
            },
            19 if self.draws => {
                let (a, b) = (self.number(depth - 1), self.number(depth - 1));
                self.draw(Some((a, b)))
            }
            20 => {
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

    pub fn vector(&mut self, depth: u32) -> Expr {
        match self.below(if depth == 0 { 4 } else { 14 }) {
            0 => Expr::State(1),
            1 => Expr::Agent(Quantity::Position, self.anything()),
            2 => {
                use Quantity::{Command, CommandChange, Velocity};
                Expr::Agent([Velocity, Command, CommandChange][self.below(3) as usize], self.anything())
            }
            3 => Expr::Slot(self.below(2) as usize, self.member()),
            12 => Expr::Track(0, Box::new(self.number(depth - 1))),
            13 => self.element(depth - 1, Author::vector),
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

    pub fn truth(&mut self, depth: u32) -> Expr {
        match self.below(if depth == 0 { 3 } else { 8 }) {
            0 => Expr::Truth(self.below(2) == 0),
            1 => Expr::Agent(Quantity::Outside, self.anything()),
            2 => Expr::Same(self.anything(), self.anything()),
            7 => Expr::Unary(UnaryOp::Not, Box::new(self.truth(depth - 1))),
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
        let (set, kind) = match self.below(6) {
            0 | 1 => (IndexSet::All, Kind::Agent),
            2 => (IndexSet::Group(0), Kind::Agent),
            3 => (IndexSet::Group(1), Kind::Member),
            4 => (IndexSet::Obstacles, Kind::Obstacle),
            _ => (IndexSet::Group(2), Kind::Obstacle),
        };
        let deep = outer > 3;
        let (over, kind, count) = match self.below(6) {
            0 if !deep => (IndexSet::Pairs(Box::new(set)), kind, 2),
            1 if !deep => (IndexSet::Edges(self.below(3) as usize), Kind::Agent, 2),
            2 => {
                let count = self.below(4) as usize;
                (IndexSet::Nearest { count, to: self.anything(), among: Box::new(set) }, kind, 1)
            }
            _ => (set, kind, 1),
        };
        let vars: Vec<VarId> = (self.next..self.next + count).collect();
        self.next += count;
        self.variables.extend(vars.iter().map(|&var| (var, kind)));
        let edges = self.edges.clone();
        if let (IndexSet::Edges(formation), &[a, b]) = (&over, vars.as_slice()) {
            self.edges.push((*formation, [a, b]));
        }
        let filter = (self.below(3) == 0).then(|| Box::new(self.truth(depth - 1)));
        let body = match op {
            Reduction::Count | Reduction::Any | Reduction::All => self.truth(depth - 1),
            _ => self.number(depth - 1),
        };
        self.variables.truncate(outer);
        (self.draws, self.edges) = (draws, edges);
        match sample::reduce(op, &vars, over, body) {
            Expr::Reduce { op, vars, over, body, .. } => Expr::Reduce { op, vars, over, filter, body },
            other => other,
        }
    }
}
