//! Worlds made by hand, for tests.

use std::collections::BTreeMap;

use mpgx_lang::plan::*;
use proptest::test_runner::{Config, RngSeed};

use crate::task::Task;

/// The same cases every time: this many, or as many as `PROPTEST_CASES` says.
pub fn cases(cases: u32) -> Config {
    let asked = std::env::var("PROPTEST_CASES").ok().and_then(|asked| asked.parse().ok());
    let cases = asked.unwrap_or(cases);
    Config { cases, rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..Config::default() }
}

pub fn number(x: f64) -> Expr {
    Expr::Number(x)
}

pub fn vector(x: f64, y: f64) -> Expr {
    Expr::Vector(Box::new(number(x)), Box::new(number(y)))
}

pub fn binary(op: BinaryOp, a: Expr, b: Expr) -> Expr {
    Expr::Binary(op, Box::new(a), Box::new(b))
}

pub fn negated(a: Expr) -> Expr {
    Expr::Unary(UnaryOp::Neg, Box::new(a))
}

pub fn position(agent: AgentRef) -> Expr {
    Expr::Agent(Quantity::Position, agent)
}

pub fn distance(a: Expr, b: Expr) -> Expr {
    Expr::Call(Function::Norm, vec![binary(BinaryOp::Sub, a, b)])
}

/// The only draw of an expression.
pub fn draw(distribution: Distribution) -> Expr {
    Expr::Draw { distribution, site: 0 }
}

/// Normally distributed on each axis, deviation 1.
pub fn noise() -> Expr {
    let [x, y] = [0, 1].map(|site| {
        let distribution =
            Distribution::Normal { mean: Box::new(number(0.0)), deviation: Box::new(number(1.0)) };
        Box::new(Expr::Draw { distribution, site })
    });
    Expr::Vector(x, y)
}

pub fn reduce(op: Reduction, vars: &[VarId], over: IndexSet, body: Expr) -> Expr {
    let binder = |&id: &VarId| Binder { id, name: format!("i{id}") };
    Expr::Reduce { op, vars: vars.iter().map(binder).collect(), over, filter: None, body: Box::new(body) }
}

/// The number of pairs closer than the safety distance.
pub fn collisions() -> Expr {
    let close = binary(
        BinaryOp::Less,
        distance(position(AgentRef::Var(0)), position(AgentRef::Var(1))),
        Expr::World(WorldConstant::Safety),
    );
    reduce(Reduction::Count, &[0, 1], IndexSet::Pairs(Box::new(IndexSet::All)), close)
}

pub fn point() -> Extern {
    Extern { name: "point".into(), settings: BTreeMap::new() }
}

pub fn unicycle() -> Extern {
    let settings = [
        ("hand", Setting::Number(0.15)),
        ("drive", Setting::Range(-1.0, 1.0)),
        ("turn", Setting::Range(-5.0, 5.0)),
        ("rate", Setting::Number(100.0)),
    ];
    Extern { name: "unicycle".into(), settings: settings.map(|(name, value)| (name.into(), value)).into() }
}

/// The same robot, commanded in its own frame.
pub fn steered() -> Extern {
    let mut body = Extern { name: "steered".into(), ..unicycle() };
    body.settings.remove("rate");
    body
}

/// A motion without states, that goes on at `velocity`.
pub fn velocity(velocity: Expr) -> Control {
    Control::Motion(Motion {
        name: "velocity".into(),
        states: Vec::new(),
        output: MotionOutput::Velocity(velocity),
    })
}

/// A motion whose position is `position`.
pub fn at(position: Expr) -> Control {
    Control::Motion(Motion {
        name: "at".into(),
        states: Vec::new(),
        output: MotionOutput::Position(position),
    })
}

pub fn group(name: &str, size: usize, body: Extern, control: Control, start: Option<Expr>) -> Group {
    let place = Place { file: format!("{name}.scn"), line: 1, column: 1 };
    let speed_mps = (-0.7, 0.7);
    Group { name: name.into(), size, body, speed_mps, control, start, at: place, ..Group::default() }
}

pub fn term(name: &str, value: Expr) -> Term {
    let at = Place { file: format!("{name}.scn"), line: 2, column: 3 };
    Term { name: name.into(), doc: String::new(), value, dimension: "length".into(), at }
}

pub fn end(name: &str, when: Expr, cost: Option<f64>) -> End {
    End { name: name.into(), when, failure: true, cost: cost.map(number), at: Place::default() }
}

/// A leader that stands at the origin and three followers that keep a square, as in `square_unison`.
pub fn unison(body: Extern) -> World {
    let square = |side: f64| vec![vector(-side, 0.0), vector(-side, -side), vector(0.0, -side)];
    let start = binary(BinaryOp::Add, Expr::Slot(0, AgentRef::Member), draw(Distribution::UnitDisc));
    let way = binary(
        BinaryOp::Sub,
        Expr::Slot(0, AgentRef::Var(0)),
        Expr::Agent(Quantity::Position, AgentRef::Var(0)),
    );
    let gap = distance(position(AgentRef::Var(0)), Expr::Slot(0, AgentRef::Var(0)));
    World {
        dt_s: 0.1,
        horizon: 200,
        safety_m: 0.1,
        groups: vec![
            group("leader", 1, point(), velocity(vector(0.0, 0.0)), Some(vector(0.0, 0.0))),
            group("follower", 3, body, Control::Learned, Some(start)),
        ],
        formations: vec![Formation {
            name: "F".into(),
            shape: "square".into(),
            group: 1,
            about: Some(0),
            constraint: Constraint::Displacements { slots: Slots::List(square(0.4)), frame: Frame::Global },
            graph: Graph::Star,
            at: Place::default(),
        }],
        observe: vec![Observation {
            text: "F[i] - p[i]".into(),
            value: way,
            vector: true,
            over: Some(Each {
                var: Binder { id: 0, name: "i".into() },
                set: IndexSet::Group(1),
                filter: None,
            }),
            noise: None,
            delay: 0,
            at: Place::default(),
        }],
        reward: vec![
            term("gap", negated(reduce(Reduction::Sum, &[0], IndexSet::Group(1), gap))),
            term("crash", negated(collisions())),
        ],
        ..World::default()
    }
}

pub fn plan(world: World) -> Plan {
    Plan {
        name: "sample".into(),
        doc: String::new(),
        params: vec![
            Param {
                name: "k".into(),
                doc: String::new(),
                value: 3.0,
                dimension: "number".into(),
                ..Param::default()
            };
            2
        ],
        world,
        seeds: 1,
        ..Plan::default()
    }
}

pub fn task(world: World) -> Task {
    let plan = plan(world);
    Task::new(&plan, &plan.world).unwrap()
}

/// The constraint of a formation with these places in the global frame.
pub fn places(slots: Vec<Expr>) -> Constraint {
    Constraint::Displacements { slots: Slots::List(slots), frame: Frame::Global }
}

/// The constraint of a formation with a rule for places in the global frame.
pub fn rule(slot: Expr) -> Constraint {
    Constraint::Displacements { slots: Slots::Rule(slot), frame: Frame::Global }
}

/// The places of a formation that [`places`] made.
pub fn places_of(formation: &mut Formation) -> &mut Vec<Expr> {
    match &mut formation.constraint {
        Constraint::Displacements { slots: Slots::List(list), .. } => list,
        other => panic!("no list: {other:?}"),
    }
}
