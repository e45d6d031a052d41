//! Random worlds whose terms can be bounded.

use mpgx_lang::plan::{
    AgentRef, Area, BinaryOp, Binder, Constraint, Control, Distribution, End, Expr, Extern, Formation, Frame,
    Function, Graph, Group, IndexSet, Motion, MotionOutput, MotionState, Param, Place, Plan, Quantity,
    Randomised, Reduction, Setting, Slots, Solid, Term, Track, UnaryOp, World, WorldConstant,
};
use mpgx_random::Stream;

/// A leader, two followers, two obstacles of one outline, and terms of all kinds.
pub fn random(random: &mut Stream) -> Plan {
    Generator { random, vars: Vec::new(), next_var: 0 }.plan()
}

/// Below `n`.
fn pick(random: &mut Stream, n: usize) -> usize {
    ((random.uniform() * n as f64) as usize).min(n - 1)
}

struct Generator<'r> {
    random: &'r mut Stream,
    vars: Vec<(usize, Who)>,
    next_var: usize,
}

/// Who a variable stands for.
#[derive(Clone, Copy, PartialEq)]
enum Who {
    Agent,
    Follower,
    Neighbour,
    Obstacle,
}

fn boxed(expr: Expr) -> Box<Expr> {
    Box::new(expr)
}

fn binary(op: BinaryOp, a: Expr, b: Expr) -> Expr {
    Expr::Binary(op, boxed(a), boxed(b))
}

impl Generator<'_> {
    fn pick(&mut self, n: usize) -> usize {
        pick(self.random, n)
    }

    fn chance(&mut self) -> bool {
        self.pick(2) == 0
    }

    fn constant(&mut self) -> f64 {
        let values = [0.0, 1.0, -1.0, 0.5, 2.0];
        match self.pick(7) {
            k if k < 5 => values[k],
            _ => self.random.normal() * 2.0,
        }
    }

    fn agent(&mut self) -> AgentRef {
        match self.vars.last() {
            Some((var, who)) if *who != Who::Obstacle && pick(self.random, 2) == 0 => AgentRef::Var(*var),
            _ => AgentRef::Fixed(self.pick(3)),
        }
    }

    fn follower(&mut self) -> AgentRef {
        match self.vars.last() {
            Some((var, Who::Follower)) => AgentRef::Var(*var),
            _ => AgentRef::Fixed(1 + self.pick(2)),
        }
    }

    fn obstacle(&mut self) -> AgentRef {
        match self.vars.last() {
            Some((var, Who::Obstacle)) => AgentRef::Var(*var),
            _ => AgentRef::Fixed(3 + self.pick(2)),
        }
    }

    fn anyone(&mut self) -> AgentRef {
        if self.pick(4) == 0 { self.obstacle() } else { self.agent() }
    }

    /// Of two agents, or of an agent and an obstacle.
    fn clearance(&mut self) -> Expr {
        let (agent, other) = (self.agent(), self.obstacle());
        match self.pick(5) {
            0 => Expr::Clearance(agent, self.agent()),
            1 => Expr::Clearance(other, agent),
            _ => Expr::Clearance(agent, other),
        }
    }

    /// The distance that two neighbours of the formation should have.
    fn rest(&mut self) -> Expr {
        match self.vars.as_slice() {
            [.., (a, Who::Neighbour), (b, Who::Neighbour)] => {
                Expr::Rest(0, AgentRef::Var(*a), AgentRef::Var(*b))
            }
            _ => Expr::Rest(0, AgentRef::Fixed(0), AgentRef::Fixed(1 + self.pick(2))),
        }
    }

    fn number(&mut self, depth: usize) -> Expr {
        if depth == 0 {
            return match self.pick(12) {
                0 => Expr::Time,
                1 => Expr::Param(0),
                2 => {
                    let constants = [WorldConstant::Dt, WorldConstant::Safety, WorldConstant::Horizon];
                    Expr::World(constants[self.pick(3)])
                }
                3 => Expr::Agent(Quantity::Heading, self.agent()),
                4 => Expr::Call(Function::X, vec![self.vector(0)]),
                5 => Expr::Call(Function::Y, vec![self.vector(0)]),
                6 | 7 => self.clearance(),
                8 => self.rest(),
                9 => Expr::MemberNumber(self.anyone()),
                _ => Expr::Number(self.constant()),
            };
        }
        let deeper = depth - 1;
        let at_least_a_bit =
            |of: Expr| binary(BinaryOp::Add, Expr::Call(Function::Abs, vec![of]), Expr::Number(0.1));
        match self.pick(22) {
            0 => binary(BinaryOp::Add, self.number(deeper), self.number(deeper)),
            1 => binary(BinaryOp::Sub, self.number(deeper), self.number(deeper)),
            2 => binary(BinaryOp::Mul, self.number(deeper), self.number(deeper)),
            3 => {
                let by = at_least_a_bit(self.number(deeper));
                binary(BinaryOp::Div, self.number(deeper), by)
            }
            4 => {
                let exponents = [2.0, 3.0, 0.5, -1.0, 1.5, -2.0];
                let exponent = exponents[self.pick(6)];
                binary(BinaryOp::Pow, at_least_a_bit(self.number(deeper)), Expr::Number(exponent))
            }
            5 => Expr::Unary(UnaryOp::Neg, boxed(self.number(deeper))),
            6 | 7 => Expr::Call(Function::Norm, vec![self.vector(deeper)]),
            8 => {
                let two = [Function::Min, Function::Max, Function::Atan2];
                Expr::Call(two[self.pick(3)], vec![self.number(deeper), self.number(deeper)])
            }
            9 => Expr::Call(Function::Mod, vec![self.number(deeper), Expr::Number(0.7)]),
            10 => {
                Expr::Call(Function::Clamp, vec![self.number(deeper), Expr::Number(-1.0), Expr::Number(2.0)])
            }
            11 | 12 => {
                let one = [
                    Function::Sin,
                    Function::Cos,
                    Function::Tanh,
                    Function::Floor,
                    Function::Sign,
                    Function::Abs,
                ];
                Expr::Call(one[self.pick(6)], vec![self.number(deeper)])
            }
            13 => Expr::Call(Function::Ln, vec![at_least_a_bit(self.number(deeper))]),
            14 => Expr::Call(Function::Exp, vec![Expr::Call(Function::Tanh, vec![self.number(deeper)])]),
            15 => {
                let two = [Function::Dot, Function::Cross];
                Expr::Call(two[self.pick(2)], vec![self.vector(deeper), self.vector(deeper)])
            }
            16 => Expr::Element(
                (0..1 + self.pick(3)).map(|_| self.number(deeper)).collect(),
                boxed(self.number(deeper)),
            ),
            17 => Expr::Call(Function::Sqrt, vec![at_least_a_bit(self.number(deeper))]),
            18 => Expr::Call(Function::Tan, vec![Expr::Call(Function::Tanh, vec![self.number(deeper)])]),
            19 => Expr::If {
                condition: boxed(self.truth(deeper)),
                then: boxed(self.number(deeper)),
                otherwise: boxed(self.number(deeper)),
            },
            _ => {
                let ops = [Reduction::Sum, Reduction::Mean, Reduction::Count, Reduction::Min, Reduction::Max];
                let op = ops[self.pick(5)];
                self.reduction(op, deeper)
            }
        }
    }

    fn reduction(&mut self, op: Reduction, depth: usize) -> Expr {
        if self.vars.len() > 2 {
            return if matches!(op, Reduction::Any | Reduction::All) {
                Expr::Truth(true)
            } else {
                Expr::Number(1.0)
            };
        }
        let (over, who, binders) = match self.pick(7) {
            0 => (IndexSet::All, Who::Agent, 1),
            1 => (IndexSet::Group(1), Who::Follower, 1),
            2 => (IndexSet::Pairs(boxed_set(IndexSet::All)), Who::Agent, 2),
            3 => (IndexSet::Edges(0), Who::Neighbour, 2),
            4 => {
                let (count, to) = (1 + self.pick(2), self.agent());
                (IndexSet::Nearest { count, to, among: boxed_set(IndexSet::All) }, Who::Agent, 1)
            }
            5 => {
                let (count, to) = (1 + self.pick(2), self.agent());
                (IndexSet::Nearest { count, to, among: boxed_set(IndexSet::Obstacles) }, Who::Obstacle, 1)
            }
            _ => (IndexSet::Obstacles, Who::Obstacle, 1),
        };
        let vars: Vec<usize> = (self.next_var..self.next_var + binders).collect();
        self.next_var += binders;
        self.vars.extend(vars.iter().map(|&var| (var, who)));
        // The least of nothing is infinite, which makes no good sums.
        let least = matches!(op, Reduction::Min | Reduction::Max);
        let filter = if !least && self.pick(3) == 0 { Some(boxed(self.truth(depth.min(1)))) } else { None };
        let truths = matches!(op, Reduction::Count | Reduction::Any | Reduction::All);
        let body = boxed(if truths { self.truth(depth) } else { self.number(depth) });
        self.vars.truncate(self.vars.len() - binders);
        let vars = vars.into_iter().map(|id| Binder { id, name: "i".into() }).collect();
        Expr::Reduce { op, vars, over, filter, body }
    }

    fn vector(&mut self, depth: usize) -> Expr {
        if depth == 0 {
            return match self.pick(8) {
                7 => Expr::Track(0, boxed(self.number(0))),
                0 => Expr::Agent(Quantity::Velocity, self.anyone()),
                1 => Expr::Slot(0, self.follower()),
                2 => Expr::Agent(Quantity::Command, self.agent()),
                3 => Expr::Agent(Quantity::CommandChange, self.agent()),
                _ => Expr::Agent(Quantity::Position, self.anyone()),
            };
        }
        let deeper = depth - 1;
        match self.pick(9) {
            0 => Expr::Vector(boxed(self.number(deeper)), boxed(self.number(deeper))),
            1 => binary(BinaryOp::Add, self.vector(deeper), self.vector(deeper)),
            2..=4 => binary(BinaryOp::Sub, self.vector(deeper), self.vector(deeper)),
            5 => binary(BinaryOp::Mul, self.number(deeper), self.vector(deeper)),
            6 => binary(BinaryOp::Div, self.vector(deeper), Expr::Number(-0.3)),
            7 => Expr::Call(Function::Rotate, vec![self.vector(deeper), self.number(deeper)]),
            _ => Expr::Call(Function::Unit, vec![self.vector(deeper)]),
        }
    }

    fn truth(&mut self, depth: usize) -> Expr {
        let comparisons = [BinaryOp::Less, BinaryOp::LessEq, BinaryOp::Greater, BinaryOp::GreaterEq];
        if depth == 0 || self.chance() {
            let op = comparisons[self.pick(4)];
            return binary(op, self.number(depth.min(1)), self.number(depth.min(1)));
        }
        let deeper = depth - 1;
        match self.pick(6) {
            5 => Expr::Same(self.agent(), self.agent()),
            0 => binary(BinaryOp::And, self.truth(deeper), self.truth(deeper)),
            1 => binary(BinaryOp::Or, self.truth(deeper), self.truth(deeper)),
            2 => Expr::Unary(UnaryOp::Not, boxed(self.truth(deeper))),
            3 => Expr::Agent(Quantity::Outside, self.agent()),
            _ => {
                let op = if self.chance() { Reduction::Any } else { Reduction::All };
                self.reduction(op, deeper)
            }
        }
    }

    fn area(&mut self) -> Area {
        let (x, y) = (self.random.uniform() * 2.0 - 1.0, self.random.uniform() * 2.0 - 1.0);
        let (wide, high) = (0.3 + 2.0 * self.random.uniform(), 0.3 + 2.0 * self.random.uniform());
        Area { x_m: (x - wide, x + wide), y_m: (y - high, y + high) }
    }

    /// A fixed place, or a box that may reach beyond the arena.
    fn start(&mut self) -> Expr {
        let area = self.area();
        let side = |(low, high): (f64, f64), site| Expr::Draw {
            distribution: Distribution::Uniform {
                low: boxed(Expr::Number(low)),
                high: boxed(Expr::Number(high)),
            },
            site,
        };
        match self.pick(3) {
            0 => Expr::Vector(boxed(Expr::Number(area.x_m.0)), boxed(Expr::Number(area.y_m.1))),
            _ => Expr::Vector(boxed(side(area.x_m, 0)), boxed(side(area.y_m, 1))),
        }
    }

    /// A disc, a wall, or a polygon with its corners around its position or beside it, convex or not.
    fn solid(&mut self) -> Solid {
        let size = 0.1 + 1.5 * self.random.uniform();
        match self.pick(4) {
            0 => Solid::Disc { radius_m: size },
            1 => Solid::Segment { to_m: (size, self.random.uniform() - 0.5) },
            _ => {
                let corners = 3 + self.pick(4);
                let aside = if self.chance() { 0.0 } else { 2.0 * size };
                let corner = |k: usize| {
                    let turn = std::f64::consts::TAU * k as f64 / corners as f64;
                    let far = size * (0.2 + self.random.uniform());
                    (aside + far * turn.cos(), 0.7 * far * turn.sin())
                };
                Solid::Polygon { corners_m: (0..corners).map(corner).collect() }
            }
        }
    }

    fn body(&mut self) -> Extern {
        if self.chance() {
            return point();
        }
        let turn = 0.5 + 5.0 * self.random.uniform();
        let settings = [
            ("hand", Setting::Number(0.05 + 0.3 * self.random.uniform())),
            ("drive", Setting::Range(-0.4, 0.2 + self.random.uniform())),
            ("turn", Setting::Range(-turn, turn)),
            ("rate", Setting::Number(50.0)),
        ];
        let settings = settings.map(|(name, value)| (name.to_string(), value)).into();
        Extern { name: "unicycle".into(), settings }
    }

    fn motion(&mut self) -> Motion {
        let normal = |site| Expr::Draw {
            distribution: Distribution::Normal {
                mean: boxed(Expr::Number(0.1)),
                deviation: boxed(Expr::Number(1.0)),
            },
            site,
        };
        let state = |name: &str, start: Expr, next: Expr| MotionState { name: name.into(), start, next };
        let zero = || Expr::Number(0.0);
        let (states, output) = match self.pick(5) {
            0 => (vec![], MotionOutput::Velocity(Expr::Vector(boxed(normal(0)), boxed(normal(1))))),
            // Round and round.
            1 => {
                let next = binary(BinaryOp::Add, Expr::State(0), Expr::Number(0.37));
                let next = Expr::Call(Function::Mod, vec![next, Expr::Number(std::f64::consts::TAU)]);
                let point = |f| Expr::Call(f, vec![Expr::State(0)]);
                let around = Expr::Vector(boxed(point(Function::Cos)), boxed(point(Function::Sin)));
                (vec![state("phase", zero(), next)], MotionOutput::Position(around))
            }
            // Straight on, without end.
            2 => {
                let next = binary(BinaryOp::Add, Expr::State(0), Expr::Number(0.05));
                let along = Expr::Vector(boxed(Expr::State(0)), boxed(Expr::Number(0.3)));
                (vec![state("way", zero(), next)], MotionOutput::Position(along))
            }
            // A walk within limits.
            3 => {
                let next = binary(BinaryOp::Add, Expr::State(0), normal(0));
                let limits = vec![next, Expr::Number(-0.4), Expr::Number(0.6)];
                let next = Expr::Call(Function::Clamp, limits);
                let walk = Expr::Vector(boxed(Expr::State(0)), boxed(Expr::Number(-0.1)));
                (vec![state("walk", zero(), next)], MotionOutput::Velocity(walk))
            }
            // After a follower.
            _ => {
                let position = |agent| Expr::Agent(Quantity::Position, agent);
                let way = binary(BinaryOp::Sub, position(AgentRef::Fixed(1)), position(AgentRef::Member));
                (vec![], MotionOutput::Velocity(Expr::Call(Function::Unit, vec![way])))
            }
        };
        Motion { name: "motion".into(), states, output }
    }

    fn plan(&mut self) -> Plan {
        let (moves, motion) = (self.pick(4) > 0, self.motion());
        let positions = moves && matches!(motion.output, MotionOutput::Position(_));
        let fast = 0.2 + self.random.uniform();
        let mut group = |name: &str, size, control, positions: bool| Group {
            name: name.into(),
            size,
            body: if positions { point() } else { self.body() },
            arena: if self.pick(3) > 0 { Some(self.area()) } else { None },
            speed_mps: if self.pick(4) > 0 { (-fast, fast) } else { (0.1, fast + 0.1) },
            control,
            start: if positions { None } else { Some(self.start()) },
            radius_m: if self.chance() { 0.0 } else { 0.3 * self.random.uniform() },
            ..Group::default()
        };
        let mut groups = vec![
            group("leader", 1, if moves { Control::Motion(motion) } else { Control::Still }, positions),
            group("follower", 2, Control::Learned, false),
            group("obstacle", 2, Control::Still, false),
        ];
        groups[2] = Group {
            solid: Some(self.solid()),
            body: point(),
            arena: None,
            radius_m: 0.0,
            stops: if self.chance() { vec![1] } else { Vec::new() },
            ..groups[2].clone()
        };
        if !moves {
            // Around it, or near it.
            let near = Expr::Draw { distribution: Distribution::UnitDisc, site: 0 };
            let near = binary(BinaryOp::Mul, Expr::Number(0.2), near);
            let leader = Expr::Agent(Quantity::Position, AgentRef::Fixed(0));
            groups[2].start = Some(binary(BinaryOp::Add, leader, near));
        }
        let vector = |x, y| Expr::Vector(boxed(x), boxed(y));
        let slot = |x, y| vector(Expr::Number(x), Expr::Number(y));
        let slots = match self.pick(3) {
            0 => {
                Slots::Rule(vector(binary(BinaryOp::Div, Expr::SlotNumber, Expr::SlotCount), Expr::Param(0)))
            }
            _ => Slots::List(vec![slot(0.4, -0.2), vector(Expr::Number(-0.3), Expr::Param(0))]),
        };
        let frame = if self.chance() { Frame::Global } else { Frame::Heading };
        let drawn = Distribution::Uniform {
            low: boxed(Expr::Number(-0.2)),
            high: boxed(Expr::Number(0.1 + self.random.uniform())),
        };
        let value = Expr::Draw { distribution: drawn, site: 0 };
        let drawn = Randomised { param: 0, value, at: Place::default() };
        let randomise = if self.chance() { vec![drawn] } else { Vec::new() };
        let track = Track {
            name: "track".into(),
            t_s: vec![-1.0, 0.25, 0.75, 2.0],
            p_m: vec![(0.3, 0.7), (1.0, 0.5), (0.5, -0.25), (-0.2, -0.4)],
            at: Place::default(),
        };
        let outside = Expr::Reduce {
            op: Reduction::Any,
            vars: vec![Binder { id: 1000, name: "i".into() }],
            over: IndexSet::Group(1),
            filter: None,
            body: boxed(Expr::Agent(Quantity::Outside, AgentRef::Var(1000))),
        };
        let end = |name: &str, when, cost| End {
            name: name.into(),
            when,
            failure: true,
            cost: Some(cost),
            at: Place::default(),
        };
        let mut ends = Vec::new();
        if self.chance() {
            ends.push(end("lost", outside, Expr::Number(1.5)));
        }
        if self.chance() {
            let cost = Expr::Call(Function::Abs, vec![self.number(1)]);
            ends.push(end("odd", self.truth(2), cost));
        }
        let term = |value| Term {
            name: "term".into(),
            doc: String::new(),
            value,
            dimension: "number".into(),
            at: Place::default(),
        };
        let world = World {
            dt_s: 0.1,
            horizon: 10 + self.pick(30),
            safety_m: 0.1,
            groups,
            formations: vec![Formation {
                name: "F".into(),
                shape: "some".into(),
                group: 1,
                about: Some(0),
                constraint: Constraint::Displacements { slots, frame },
                graph: Graph::Star,
                at: Place::default(),
            }],
            reward: (0..6).map(|k| term(self.number(k % 5))).collect(),
            ends,
            randomise,
            ..World::default()
        };
        Plan {
            name: "random".into(),
            params: vec![Param {
                name: "k".into(),
                value: 0.7,
                dimension: "number".into(),
                ..Param::default()
            }],
            world,
            tracks: vec![track],
            seeds: 1,
            ..Plan::default()
        }
    }
}

fn point() -> Extern {
    Extern { name: "point".into(), ..Extern::default() }
}

fn boxed_set(set: IndexSet) -> Box<IndexSet> {
    Box::new(set)
}
