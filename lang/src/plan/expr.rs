//! Expressions of one step.

use serde::{Deserialize, Serialize};

use super::{AgentId, FormationId, GroupId, ParamId, TrackId, VarId};

/// A typed expression; the checker has made sure of types and dimensions. All numbers are SI.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Expr {
    Number(f64),
    Truth(bool),
    Param(ParamId),
    /// A constant of the world.
    World(WorldConstant),
    /// Seconds since the episode began.
    Time,
    /// State variable of the motion around (motions only).
    State(usize),
    /// k and n of [`Slots::Rule`](super::Slots::Rule).
    SlotNumber,
    SlotCount,
    /// x and y.
    Vector(Box<Expr>, Box<Expr>),
    Unary(UnaryOp, Box<Expr>),
    Binary(BinaryOp, Box<Expr>, Box<Expr>),
    Call(Function, Vec<Expr>),
    If {
        condition: Box<Expr>,
        then: Box<Expr>,
        otherwise: Box<Expr>,
    },
    /// A quantity of an agent.
    Agent(Quantity, AgentRef),
    /// Where an agent of the formation's group belongs: `about`'s position plus its displacement, metres.
    Slot(FormationId, AgentRef),
    /// The distance, metres, that two neighbours of a formation should have: of `Distances` the one declared, of
    /// `Displacements` that of their places. For variables of [`IndexSet::Edges`] of it, or fixed neighbours.
    Rest(FormationId, AgentRef, AgentRef),
    /// Distance between the outlines of two agents or obstacles, metres; negative if one is in the other.
    /// An agent is a disc of its radius. Two obstacles have none.
    Clearance(AgentRef, AgentRef),
    /// Whether two agents are the same.
    Same(AgentRef, AgentRef),
    /// The number of an agent in its group, from 1.
    MemberNumber(AgentRef),
    /// Entry of a list (numbers or vectors), numbered from 1; the number is rounded down, and clamped to the list.
    Element(Vec<Expr>, Box<Expr>),
    /// Position, metres, on a recorded path at a time in seconds, clamped to its ends.
    Track(TrackId, Box<Expr>),
    /// A term of [`World::reward`](super::World::reward), the whole reward, or a measure of the present state (tests only).
    Measured(Measure),
    /// A fold over an index set.
    Reduce {
        op: Reduction,
        vars: Vec<Binder>,
        over: IndexSet,
        filter: Option<Box<Expr>>,
        body: Box<Expr>,
    },
    /// A random draw (motions and starts only). `site` tells the draws of one expression apart.
    Draw {
        distribution: Distribution,
        site: usize,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Measure {
    Term(usize),
    Reward,
    /// Error of all formations, metres.
    Error,
    /// Whether the end of this index holds.
    Ended(usize),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum WorldConstant {
    /// Time step, s.
    Dt,
    /// Safety distance, m.
    Safety,
    /// Steps in an episode.
    Horizon,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum UnaryOp {
    Neg,
    Not,
}

/// Arithmetic works on numbers; `Add` and `Sub` also on two vectors, `Mul` and `Div` on a vector and a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum BinaryOp {
    Add,
    Sub,
    Mul,
    Div,
    /// To a constant rational power.
    Pow,
    Less,
    LessEq,
    Greater,
    GreaterEq,
    Equal,
    NotEqual,
    And,
    Or,
}

/// Built-in functions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Function {
    /// |v| of a vector.
    Norm,
    /// |x| of a number.
    Abs,
    X,
    Y,
    Dot,
    /// z of the cross product of two plane vectors.
    Cross,
    /// A vector turned anticlockwise by an angle (vector, angle).
    Rotate,
    /// A vector over its length; (0, 0) for (0, 0).
    Unit,
    Sqrt,
    Sin,
    Cos,
    Tan,
    Atan2,
    Exp,
    Ln,
    Tanh,
    Floor,
    /// x mod y, never negative for positive y.
    Mod,
    Sign,
    Min,
    Max,
    /// (x, low, high).
    Clamp,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Quantity {
    /// Position in m; of a unicycle, its hand point.
    Position,
    /// Velocity in m/s over the last step; (0, 0) at the start.
    Velocity,
    /// Heading in rad; of bodies without one the direction of their last motion, 0 before.
    Heading,
    /// The velocity command in m/s, as clipped to the speed limits; of agents that nobody commands their velocity.
    Command,
    /// By how much the command differs from that of the step before, m/s; (0, 0) in the first step.
    CommandChange,
    /// Whether the agent is outside its arena (a truth value).
    Outside,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum AgentRef {
    Fixed(AgentId),
    Var(VarId),
    /// The member whose start or motion this is.
    Member,
}

/// A bound index variable and its name in the source.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Binder {
    pub id: VarId,
    pub name: String,
}

/// What an index variable runs over. Stays a set: a Plan for 1,000 robots is as short as one for three.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum IndexSet {
    /// All agents.
    All,
    /// All obstacles.
    Obstacles,
    Group(GroupId),
    /// Unordered pairs i < j of different members; binds two variables.
    Pairs(Box<IndexSet>),
    /// The edges of a formation's graph; binds two variables.
    Edges(FormationId),
    /// The `count` members of a set that are nearest to an agent (which is none of them), by the distance of
    /// positions, nearest first; of equals the first. All of them if there are fewer.
    Nearest {
        count: usize,
        to: AgentRef,
        among: Box<IndexSet>,
    },
}

/// Numbers for `Sum` to `Max`, truth values for the rest. Over an empty set: 0 for `Sum`, `Mean`, `Count`,
/// +∞ for `Min`, −∞ for `Max`, false for `Any`, true for `All`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Reduction {
    Sum,
    Mean,
    Min,
    Max,
    Count,
    Any,
    All,
}

/// Scalar distributions; of vectors, each axis is drawn by itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Distribution {
    Uniform {
        low: Box<Expr>,
        high: Box<Expr>,
    },
    Normal {
        mean: Box<Expr>,
        deviation: Box<Expr>,
    },
    /// A point of the unit disc, uniformly (a vector).
    UnitDisc,
}

impl Expr {
    /// The expressions directly inside.
    pub fn parts(&self) -> Vec<&Expr> {
        match self {
            Expr::Vector(a, b) | Expr::Binary(_, a, b) => vec![a, b],
            Expr::Unary(_, a) => vec![a],
            Expr::Call(_, args) => args.iter().collect(),
            Expr::Element(list, number) => list.iter().chain([&**number]).collect(),
            Expr::Track(_, time) => vec![time],
            Expr::If { condition, then, otherwise } => vec![condition, then, otherwise],
            Expr::Reduce { filter, body, .. } => filter.as_deref().into_iter().chain([&**body]).collect(),
            Expr::Draw { distribution, .. } => match distribution {
                Distribution::Uniform { low, high } => vec![low, high],
                Distribution::Normal { mean, deviation } => vec![mean, deviation],
                Distribution::UnitDisc => Vec::new(),
            },
            _ => Vec::new(),
        }
    }
}
