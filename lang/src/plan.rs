//! The Plan: what the compiler makes and the runtime runs.
//!
//! Plain data, SI numbers, no source text needed. It prints to RON and reads back to the same value.
//! `runtime` runs Plans and nothing else; `lang` knows no algorithm, no body and no controller by name.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Index into [`Plan::params`].
pub type ParamId = usize;
/// Index into [`World::groups`].
pub type GroupId = usize;
/// Index into [`World::formations`].
pub type FormationId = usize;
/// Flat index of an agent: the groups in order, each group's members in order.
pub type AgentId = usize;
/// An index variable; unique within one top-level expression.
pub type VarId = usize;

/// A compiled scenario, all defaults filled in.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// The scenario's name.
    pub name: String,
    /// Its `//!` comment.
    pub doc: String,
    /// Named constants, referred to by [`Expr::Param`].
    pub params: Vec<Param>,
    /// What is trained in.
    pub world: World,
    /// The learners: the one of `learn` first, then the learners of `compare`.
    pub learners: Vec<Method>,
    /// Controllers that need no training, from `compare`.
    pub controllers: Vec<Method>,
    /// Number of training seeds: 0, 1, … seeds − 1.
    pub seeds: usize,
    /// Held-out evaluations of the final policy.
    pub protocols: Vec<Protocol>,
    /// Claims to be decided from the evaluated statistics.
    pub claims: Vec<Claim>,
}

/// Where something stands in the source: 1-based line and column. Not part of the meaning.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Place {
    pub file: String,
    pub line: usize,
    pub column: usize,
}

/// A named constant of the scenario.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Param {
    pub name: String,
    pub doc: String,
    /// SI value.
    pub value: f64,
    /// Dimension as text, for people: `length/time`, `number`.
    pub dimension: String,
    pub at: Place,
}

/// Everything the simulator needs for one kind of episode.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct World {
    /// Time step in seconds.
    pub dt_s: f64,
    /// Steps in an episode.
    pub horizon: usize,
    /// Two agents closer than this, in metres, collide.
    pub safety_m: f64,
    pub groups: Vec<Group>,
    pub formations: Vec<Formation>,
    /// Drawn starts are kept only if all of these hold (booleans).
    pub require: Vec<Expr>,
    /// The state of the learner, in order.
    pub observe: Vec<Observation>,
    /// The reward is the sum of these.
    pub reward: Vec<Term>,
    pub ends: Vec<End>,
}

/// One agent or several of a kind.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Group {
    pub name: String,
    pub size: usize,
    /// Kinematics: an implementation of the simulator, by name (`point`, `unicycle`).
    pub body: Extern,
    /// Limits of the position, if any. Leaving it is what `outside` tells.
    pub arena: Option<Area>,
    /// Limits of the velocity command on each axis, m/s.
    pub speed_mps: (f64, f64),
    pub control: Control,
    /// Where a member starts; `Member` stands for the member. `None` only if the motion gives positions.
    pub start: Option<Expr>,
    pub at: Place,
}

/// An axis-parallel box, metres.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Area {
    pub x_m: (f64, f64),
    pub y_m: (f64, f64),
}

/// What moves an agent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Control {
    /// The policy under study commands the velocity.
    Learned,
    /// A motion written in the language.
    Motion(Motion),
}

/// A motion: state variables, how they begin and change, and what they make the agent do.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    pub name: String,
    /// `Expr::State(k)` is `states[k]`, both inside this motion only.
    pub states: Vec<MotionState>,
    pub output: MotionOutput,
}

/// One state variable of a motion (a number or a vector).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MotionState {
    pub name: String,
    /// Its value when the episode begins. May draw; may use earlier states.
    pub start: Expr,
    /// Its value at the next step, from the present states (all change at once). May draw.
    pub next: Expr,
}

/// What a motion gives, evaluated once a step after its states have changed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum MotionOutput {
    /// Velocity in m/s; clipped to the group's speed on each axis, the position clamped into the arena.
    Velocity(Expr),
    /// Position in m; also the start of the episode (evaluated on the start states).
    Position(Expr),
}

/// Where each member of a group belongs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Formation {
    /// The name in the scenario (`F`).
    pub name: String,
    /// What made it (`square`).
    pub shape: String,
    pub group: GroupId,
    pub about: AgentId,
    /// Displacement of each member from `about`, metres, in the global frame.
    pub slots: Slots,
    pub at: Place,
}

/// The displacements of a formation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Slots {
    /// One vector a member.
    List(Vec<Expr>),
    /// The vector of member k (from 1) of n; [`Expr::SlotNumber`] and [`Expr::SlotCount`] stand for k and n.
    Rule(Expr),
}

/// One item of the learner's state: a number or a vector, in SI units, for each member of `over`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Observation {
    /// As written, for people.
    pub text: String,
    pub value: Expr,
    /// A vector gives two entries, x and y.
    pub vector: bool,
    /// `None`: once.
    pub over: Option<Each>,
    pub at: Place,
}

/// `for i in set`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Each {
    pub var: Binder,
    pub set: IndexSet,
    pub filter: Option<Box<Expr>>,
}

/// A named part of the reward.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Term {
    pub name: String,
    pub doc: String,
    /// A number in SI units.
    pub value: Expr,
    /// Dimension as text; the same for all terms.
    pub dimension: String,
    pub at: Place,
}

/// A condition that ends an episode as a failure. Reaching the horizon is no failure and not listed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct End {
    pub name: String,
    pub when: Expr,
    /// Taken from the reward of that step (a number in SI units, not negative).
    pub cost: Option<Expr>,
    pub at: Place,
}

/// A learner or controller as chosen by the scenario.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Method {
    /// The name in tables and folders.
    pub label: String,
    pub what: Extern,
    pub at: Place,
}

/// Something that Rust provides, with all its settings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Extern {
    pub name: String,
    pub settings: BTreeMap<String, Setting>,
}

/// The value of a setting, SI.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Setting {
    Number(f64),
    Truth(bool),
    /// One of the words that the declaration lists.
    Word(String),
    Range(f64, f64),
    List(Vec<f64>),
}

/// A held-out evaluation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Protocol {
    pub name: String,
    pub episodes: usize,
    /// `None`: the world of training.
    pub world: Option<Box<World>>,
    pub at: Place,
}

/// `expect …`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Claim {
    /// As written.
    pub text: String,
    pub kind: ClaimKind,
    pub at: Place,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum ClaimKind {
    /// The interval of a statistic lies on one side of a bound.
    Bound { protocol: String, metric: String, method: String, below: bool, bound: f64, confidence: f64 },
    /// One method is better than another; the interval of the difference excludes 0.
    Beats { better: String, worse: String, protocol: String, metric: String, confidence: f64 },
}

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
    /// k and n of [`Slots::Rule`].
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
    /// Heading in rad; 0 for bodies without one.
    Heading,
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
    Group(GroupId),
    /// Unordered pairs i < j of different members; binds two variables.
    Pairs(Box<IndexSet>),
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

impl World {
    /// Number of agents.
    pub fn agents(&self) -> usize {
        self.groups.iter().map(|group| group.size).sum()
    }

    /// First agent of a group.
    pub fn first_of(&self, group: GroupId) -> AgentId {
        self.groups.iter().take(group).map(|group| group.size).sum()
    }

    /// Agents whose velocity the policy commands, in order; the action has two entries for each.
    pub fn learned(&self) -> Vec<AgentId> {
        let mut learned = Vec::new();
        let mut next = 0;
        for group in &self.groups {
            if group.control == Control::Learned {
                learned.extend(next..next + group.size);
            }
            next += group.size;
        }
        learned
    }
}

impl Expr {
    /// The expressions directly inside.
    pub fn parts(&self) -> Vec<&Expr> {
        match self {
            Expr::Vector(a, b) | Expr::Binary(_, a, b) => vec![a, b],
            Expr::Unary(_, a) => vec![a],
            Expr::Call(_, args) => args.iter().collect(),
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

/// Nesting of a Plan in RON, at most; the compiler's limit on expressions stays far below.
const RON_DEPTH: usize = 1000;

impl Plan {
    /// As RON text. [`Plan::from_ron`] reads it back to the same value.
    pub fn to_ron(&self) -> String {
        let options = ron::Options::default().with_recursion_limit(RON_DEPTH);
        let pretty = ron::ser::PrettyConfig::new().new_line("\n".to_owned()).indentor("  ".to_owned());
        options.to_string_pretty(self, pretty).unwrap_or_default()
    }

    /// Reads what [`Plan::to_ron`] wrote. The error says where the text is wrong.
    pub fn from_ron(text: &str) -> Result<Plan, String> {
        let options = ron::Options::default().with_recursion_limit(RON_DEPTH);
        options.from_str(text).map_err(|error| error.to_string())
    }
}
