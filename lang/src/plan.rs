//! The Plan: what the compiler makes and the runtime runs.
//!
//! Plain data, SI numbers, no source text needed. It prints to RON and reads back to the same value.
//! `runtime` runs Plans and nothing else; `lang` knows no algorithm, no body and no controller by name.

mod sight;

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

pub use sight::{Landmark, Localised, Localiser, Scenery};

/// Index into [`Plan::params`].
pub type ParamId = usize;
/// Index into [`World::groups`].
pub type GroupId = usize;
/// Index into [`World::formations`].
pub type FormationId = usize;
/// Index into [`Plan::tracks`].
pub type TrackId = usize;
/// Flat index of an agent or obstacle: the groups in order, each group's members in order.
pub type AgentId = usize;
/// An index variable; unique within one top-level expression.
pub type VarId = usize;

/// A compiled scenario, all defaults filled in.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
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
    /// The first training seed; the scenario's own begin with 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub first_seed: usize,
    /// Number of training seeds, one after another.
    pub seeds: usize,
    /// Held-out evaluations of the final policy.
    pub protocols: Vec<Protocol>,
    /// Claims to be decided from the evaluated statistics.
    pub claims: Vec<Claim>,
    /// Recorded paths, referred to by [`Expr::Track`].
    pub tracks: Vec<Track>,
    /// A curriculum: training goes through these worlds, in order, before [`Plan::world`].
    pub stages: Vec<Stage>,
    /// The same scenario with something changed, each a study of its own; without variants of their own.
    pub variants: Vec<Variant>,
    /// What must hold of the scenario in situations that it spells out.
    pub tests: Vec<Test>,
    /// How robots tell where they are, where they do not know it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub localisers: Vec<Localiser>,
}

/// Where something stands in the source: 1-based line and column. Not part of the meaning.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Place {
    pub file: String,
    pub line: usize,
    pub column: usize,
}

/// A named constant of the scenario.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Param {
    pub name: String,
    pub doc: String,
    /// SI value.
    pub value: f64,
    /// Dimension as text, for people: `length/time`, `number`.
    pub dimension: String,
    /// The value as written: `0.4 m`.
    pub text: String,
    pub at: Place,
}

/// A recorded path: positions over time, joined by straight lines.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Track {
    pub name: String,
    /// Seconds, rising, at least one.
    pub t_s: Vec<f64>,
    /// One position for each time, metres.
    pub p_m: Vec<(f64, f64)>,
    pub at: Place,
}

/// A stage of a curriculum.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stage {
    pub name: String,
    /// Of the same state and action as the world of training.
    pub world: Box<World>,
    /// The stage is over when this holds.
    pub until: Option<Until>,
    /// The stage is over after this many environment steps at the latest.
    pub most_steps: Option<usize>,
    pub at: Place,
}

/// Whether the mean of a measure over the last training episodes lies on one side of a bound.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Until {
    /// `return`, `error_m`, `steps` (length of an episode) or `failures` (share of episodes that ended as one).
    pub measure: String,
    pub below: bool,
    /// SI.
    pub bound: f64,
    /// Episodes of this stage that the mean is taken of; with fewer it does not hold.
    pub episodes: usize,
}

/// A scenario derived from another by changing something.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Variant {
    pub name: String,
    /// What it changes, as written: `k_o = 0.5`.
    pub text: String,
    pub plan: Box<Plan>,
    pub at: Place,
}

/// A test of the scenario: an episode whose course it prescribes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Test {
    pub name: String,
    pub steps: Vec<TestStep>,
    pub at: Place,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum TestStep {
    /// Puts an agent or obstacle at a position (m) at rest; of one with a motion, until its next step.
    Place { agent: AgentId, position: Expr, at: Place },
    /// Turns an agent to a heading (rad).
    Turn { agent: AgentId, heading: Expr, at: Place },
    /// The velocity command (m/s) of a learned agent from now on; zero before.
    Steer { agent: AgentId, velocity: Expr, at: Place },
    /// Steps of the world, without putting agents back into their arenas.
    Step { steps: usize, at: Place },
    /// `actual` (if it is a number) is for the message. Terms, reward and measures are those of the present state.
    Check { text: String, actual: Option<Expr>, holds: Expr, at: Place },
}

/// Everything the simulator needs for one kind of episode.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct World {
    /// Time step in seconds.
    pub dt_s: f64,
    /// Steps in an episode.
    pub horizon: usize,
    /// Two agents closer than this, in metres, collide.
    pub safety_m: f64,
    pub groups: Vec<Group>,
    pub formations: Vec<Formation>,
    /// Parameters that are drawn anew for each episode, in order; a later one may refer to those before.
    pub randomise: Vec<Randomised>,
    /// Drawn starts are kept only if all of these hold (booleans).
    pub require: Vec<Expr>,
    /// `None`: one policy sees the state and commands all learned agents. Otherwise each member of a group of
    /// learned agents has a state of its own, and one policy, shared by them, commands each from its own.
    pub shared: Option<Shared>,
    /// The state of the learner (or of each member), in order.
    pub observe: Vec<Observation>,
    /// The reward is the sum of these.
    pub reward: Vec<Term>,
    pub ends: Vec<End>,
    /// What cameras see. `None`: nothing, and no group has a camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scenery: Option<Scenery>,
    /// Who does not know its pose; of held-out worlds only.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub localised: Vec<Localised>,
}

/// One policy for each member of a group.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Shared {
    /// The only learned group.
    pub group: GroupId,
    /// Stands for the member in [`World::observe`].
    pub var: Binder,
    /// Stands for the member in [`World::reward`]: each is rewarded for itself, and the reward of the team is the
    /// mean over the members. `None`: all get the reward of the team. Costs of ends are charged to all.
    pub rewarded: Option<Binder>,
}

/// A parameter drawn for each episode.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Randomised {
    pub param: ParamId,
    /// A number with draws in it; may refer to parameters.
    pub value: Expr,
    pub at: Place,
}

/// One agent (or obstacle) or several of a kind.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Group {
    pub name: String,
    pub size: usize,
    /// Of obstacles their outline; they are no agents: not in [`IndexSet::All`], and they do not collide.
    pub solid: Option<Solid>,
    /// Groups of agents that these obstacles stop: an agent that would move into one comes to rest at its outline.
    pub stops: Vec<GroupId>,
    /// Radius of an agent, m; counts in [`Expr::Clearance`].
    pub radius_m: f64,
    /// Kinematics: an implementation of the simulator, by name (`point`, `unicycle`).
    pub body: Extern,
    /// Limits of the position, if any. Leaving it is what `outside` tells.
    pub arena: Option<Area>,
    /// Limits of the velocity command on each axis, m/s.
    pub speed_mps: (f64, f64),
    pub control: Control,
    /// What changes the commands of a learned group before its bodies get them, for safety, by name (`barrier`).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub filter: Option<Extern>,
    /// The camera on each member, by name (`pinhole`).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<Extern>,
    /// How each member counts its own ways, by name (`wheels`).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub odometry: Option<Extern>,
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

/// The outline of an obstacle, relative to its position; it does not turn.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Solid {
    Disc {
        radius_m: f64,
    },
    /// From the position to this displacement.
    Segment {
        to_m: (f64, f64),
    },
    /// A simple polygon, convex or not, at least three corners.
    Polygon {
        corners_m: Vec<(f64, f64)>,
    },
}

/// What moves an agent.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Control {
    /// It stays where it starts.
    #[default]
    Still,
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

/// How the members of a group should be arranged: F(z) = F(z*) of the paper.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Formation {
    /// The name in the scenario (`F`).
    pub name: String,
    /// What made it (`square`).
    pub shape: String,
    pub group: GroupId,
    /// The agent it is about; with it, the first of the formation's nodes.
    pub about: Option<AgentId>,
    pub constraint: Constraint,
    /// Who is a neighbour of whom, over the nodes: `about` (if any), then the members in order.
    pub graph: Graph,
    pub at: Place,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Constraint {
    /// Each member has a place: a displacement from `about` (which is there), metres.
    Displacements { slots: Slots, frame: Frame },
    /// Neighbours keep a distance, metres: one for all edges, or one for each of [`Graph::Edges`].
    Distances(Vec<Expr>),
}

/// The axes that displacements are taken along.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Frame {
    Global,
    /// x points along the heading of `about`; of a body without a heading, along its last motion (global x before).
    Heading,
}

/// Edges over n nodes, numbered from 0. Stays a rule, so that a Plan for 1,000 robots is as short as one for three.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Graph {
    /// Every two nodes.
    Complete,
    /// Each node and the next, the last and the first; of two nodes one edge.
    Ring,
    /// The first node and each other.
    Star,
    /// Each node and the next.
    Path,
    Edges(Vec<(usize, usize)>),
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
    /// Standard deviation of the normal noise on each entry, in the value's SI unit.
    pub noise: Option<Expr>,
    /// Steps by which the value is late; in the first steps of an episode it is that of the start.
    pub delay: usize,
    pub at: Place,
}

/// `for i in set`; not over pairs or edges.
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

/// A condition that ends an episode. Reaching the horizon does as well and is not listed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct End {
    pub name: String,
    pub when: Expr,
    /// Whether this is a failure, after which nothing can be gained. If not, learning looks beyond it, as beyond
    /// the horizon.
    pub failure: bool,
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
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
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
    Schedule(Schedule),
}

/// A number that changes over training: `from` up to the share `begin` of training, then along `curve` to `to` at
/// the share `end`, and `to` from there on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Schedule {
    pub curve: Curve,
    pub from: f64,
    pub to: f64,
    /// 0 to 1, not above `end`.
    pub begin: f64,
    pub end: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Curve {
    Linear,
    /// Half a wave of a cosine.
    Cosine,
    /// The same factor at each step; both ends are positive.
    Geometric,
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
    /// A term of [`World::reward`], the whole reward, or a measure of the present state (tests only).
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

impl World {
    /// Number of agents.
    pub fn agents(&self) -> usize {
        self.groups.iter().map(|group| group.size).sum()
    }

    /// Number of edges of a formation's graph.
    pub fn edges(&self, formation: &Formation) -> usize {
        let members = self.groups.get(formation.group).map_or(0, |group| group.size);
        formation.graph.edges(members + usize::from(formation.about.is_some()))
    }

    /// First agent of a group.
    pub fn first_of(&self, group: GroupId) -> AgentId {
        self.groups.iter().take(group).map(|group| group.size).sum()
    }

    /// An agent as the scenario calls it: `leader`, `follower[2]`.
    pub fn agent_name(&self, agent: AgentId) -> String {
        let mut first = 0;
        for group in &self.groups {
            match agent.checked_sub(first) {
                Some(0) if group.size == 1 => return group.name.clone(),
                Some(member) if member < group.size => return format!("{}[{}]", group.name, member + 1),
                _ => first += group.size,
            }
        }
        "?".to_owned()
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

/// As it would be written, in SI units.
impl std::fmt::Display for Setting {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let number = |value: &f64| {
            let size = value.abs();
            let plain = size == 0.0 || (1e-3..1e6).contains(&size);
            if plain { value.to_string() } else { format!("{value:e}") }
        };
        match self {
            Setting::Number(value) => f.write_str(&number(value)),
            Setting::Truth(truth) => write!(f, "{truth}"),
            Setting::Word(word) => f.write_str(word),
            Setting::Range(low, high) => write!(f, "{} .. {}", number(low), number(high)),
            Setting::List(all) => {
                write!(f, "[{}]", all.iter().map(number).collect::<Vec<_>>().join(", "))
            }
            Setting::Schedule(Schedule { curve, from, to, begin, end }) => {
                let curve = format!("{curve:?}").to_lowercase();
                let (from, to, begin, end) = (number(from), number(to), 100.0 * begin, 100.0 * end);
                write!(f, "{curve}({from}, {to}, begin = {begin}%, end = {end}%)")
            }
        }
    }
}

impl Graph {
    /// Number of edges over `nodes` nodes.
    pub fn edges(&self, nodes: usize) -> usize {
        match self {
            Graph::Complete => nodes * nodes.saturating_sub(1) / 2,
            Graph::Ring if nodes > 2 => nodes,
            Graph::Ring | Graph::Path | Graph::Star => nodes.saturating_sub(1),
            Graph::Edges(edges) => edges.len(),
        }
    }

    /// Edge k over `nodes` nodes: for `Complete` in the order (0, 1), (0, 2), …, (1, 2), …; the others as declared.
    pub fn iter(&self, nodes: usize) -> Box<dyn Iterator<Item = (usize, usize)> + '_> {
        match self {
            Graph::Complete => Box::new((0..nodes).flat_map(move |i| (i + 1..nodes).map(move |j| (i, j)))),
            Graph::Star => Box::new((1..nodes).map(|j| (0, j))),
            Graph::Path => Box::new((1..nodes).map(|j| (j - 1, j))),
            Graph::Ring => {
                let last = (nodes > 2).then(|| (nodes - 1, 0));
                Box::new((1..nodes).map(|j| (j - 1, j)).chain(last))
            }
            Graph::Edges(edges) => Box::new(edges.iter().copied()),
        }
    }
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

fn is_zero(number: &usize) -> bool {
    *number == 0
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
