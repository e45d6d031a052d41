//! The typed scenario: names resolved, every expression with its type, nothing inlined yet.

use std::sync::Arc;

use crate::ast::{Span, Spanned};
use crate::dim::Dim;
use crate::plan::{BinaryOp, ClaimKind, Function as BuiltIn, Quantity, Reduction, UnaryOp, WorldConstant};
use crate::plan::{Curve, FormationId, Frame, Graph, GroupId, Measure, ParamId, TrackId, Until, VarId};

/// What an expression is.
#[derive(Clone, Debug, PartialEq)]
pub enum Type {
    Number(Dim),
    /// Two numbers of a dimension.
    Vector(Dim),
    Truth,
    /// A whole number, not negative; only as the type of a setting. In expressions it is a number.
    Count,
    /// An agent, of a group if that is known.
    Agent(Option<GroupId>),
    /// A box in the plane.
    Area,
    Range(Dim),
    /// Of numbers, or of vectors.
    List(Box<Type>),
    Formation,
    /// A set of agents or obstacles.
    Group,
    /// A recorded path.
    Track,
    /// A plain number that changes over training.
    Schedule,
    /// One of these words; only as the type of a setting.
    Word(Vec<String>),
    /// Of an expression that a problem was reported for; it fits everywhere.
    Poison,
}

#[derive(Clone, Debug)]
pub struct Expr {
    pub kind: Kind,
    pub type_: Type,
    pub span: Span,
    /// Levels of the expression after inlining, at most.
    pub depth: usize,
}

#[derive(Clone, Debug)]
pub enum Kind {
    Poison,
    /// SI.
    Number(f64),
    Truth(bool),
    Word(String),
    Param(ParamId),
    /// The value of a `let`.
    Let(Arc<Expr>),
    /// Parameter k of the function, motion or shape around.
    Argument(usize),
    State(usize),
    SlotNumber,
    SlotCount,
    Time,
    World(WorldConstant),
    /// A setting of a group.
    Setting(GroupId, OwnSetting),
    /// The member of the group whose settings these are.
    Member(GroupId),
    /// The agent that the motion around moves.
    Own,
    /// A member (from 0) of a group.
    Fixed(GroupId, usize),
    Var(VarId),
    Vector(Box<Expr>, Box<Expr>),
    List(Vec<Expr>),
    Range(Box<Expr>, Box<Expr>),
    /// Ranges of x and y.
    Area(Box<Expr>, Box<Expr>),
    Part(Part, Box<Expr>),
    Unary(UnaryOp, Box<Expr>),
    Binary(BinaryOp, Box<Expr>, Box<Expr>),
    BuiltIn(BuiltIn, Vec<Expr>),
    Call(Arc<Function>, Vec<Expr>),
    If {
        condition: Box<Expr>,
        then: Box<Expr>,
        otherwise: Box<Expr>,
    },
    Agent(Quantity, Box<Expr>),
    Formation(FormationId),
    /// Of a formation, for an agent.
    Slot(Box<Expr>, Box<Expr>),
    /// The distance that a formation wants of two neighbours.
    Rest(Box<Expr>, Box<[Expr; 2]>),
    Group(Set),
    /// How many a set has, or a list.
    Size(Box<Expr>),
    Clearance(Box<[Expr; 2]>),
    /// Whether two agents are the same.
    Same(Box<[Expr; 2]>),
    MemberNumber(Box<Expr>),
    /// An entry of a list, from 1.
    Element(Box<Expr>, Box<Expr>),
    Track(TrackId),
    /// The position on a path at a time.
    OnTrack(Box<Expr>, Box<Expr>),
    Duration(Box<Expr>),
    Reduce {
        op: Reduction,
        over: Over,
        body: Box<Expr>,
    },
    Draw(Draw, Vec<Expr>),
    /// From, to, begin and end.
    Schedule(Curve, Vec<Expr>),
    /// What a test reads off.
    Measured(Measure),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OwnSetting {
    Arena,
    Speed,
}

/// A side of an area or an end of a range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    Left,
    Right,
    Bottom,
    Top,
    Low,
    High,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Draw {
    Uniform,
    Normal,
    UnitDisc,
}

/// `vars in set if filter`.
#[derive(Clone, Debug)]
pub struct Over {
    pub vars: Vec<(VarId, String)>,
    pub set: Set,
    pub filter: Option<Box<Expr>>,
}

/// As [`crate::plan::IndexSet`], of formations and groups that may be arguments.
#[derive(Clone, Debug)]
pub enum Set {
    All,
    Obstacles,
    Group(GroupId),
    /// Parameter k of the function around.
    Argument(usize),
    /// The members of a formation.
    Members(Box<Expr>),
    Pairs(Box<Set>),
    Edges(Box<Expr>),
    Nearest {
        count: Box<Expr>,
        to: Box<Expr>,
        among: Box<Set>,
    },
}

/// A parameter of anything that can be called.
#[derive(Clone, Debug)]
pub struct Parameter {
    pub name: String,
    pub doc: String,
    pub type_: Type,
    pub default: Option<Expr>,
    pub range: Option<(Expr, Expr)>,
    pub span: Span,
}

/// A function or distribution with a body.
#[derive(Debug)]
pub struct Function {
    pub name: String,
    pub body: Expr,
}

#[derive(Clone, Debug)]
pub struct Motion {
    pub name: String,
    pub states: Vec<State>,
    /// `None` if a problem was reported.
    pub output: Option<Output>,
}

#[derive(Clone, Debug)]
pub struct State {
    pub name: String,
    pub start: Expr,
    pub next: Option<Expr>,
}

#[derive(Clone, Debug)]
pub enum Output {
    Velocity(Expr),
    Position(Expr),
}

/// How a formation arranges its members.
#[derive(Clone, Debug)]
pub struct Shape {
    pub name: String,
    pub slots: Slots,
}

#[derive(Clone, Debug)]
pub enum Slots {
    List(Vec<Expr>),
    Rule(Expr),
    /// Pairs of nodes, from 0, and their distances.
    Edges(Vec<Edge>),
    /// One distance for all edges of a graph.
    Graph(Graph, Expr),
}

#[derive(Clone, Debug)]
pub struct Edge {
    pub nodes: (usize, usize),
    pub distance: Expr,
    pub span: Span,
}

impl Slots {
    /// What gives the places.
    pub fn places(&self) -> &[Expr] {
        match self {
            Slots::List(all) => all,
            Slots::Rule(rule) => std::slice::from_ref(rule),
            Slots::Edges(_) | Slots::Graph(..) => &[],
        }
    }

    /// Whether neighbours keep distances, and nobody has a place.
    pub fn are_distances(&self) -> bool {
        matches!(self, Slots::Edges(_) | Slots::Graph(..))
    }
}

/// Something called with its arguments, defaults filled in, in the order of the parameters.
#[derive(Clone, Debug)]
pub struct Called<T> {
    pub what: Arc<T>,
    pub args: Vec<Expr>,
    pub span: Span,
}

/// Something that Rust provides, with a value for each of its settings.
#[derive(Clone, Debug)]
pub struct Extern {
    pub name: String,
    pub settings: Vec<(String, Expr)>,
}

/// What a setting chooses; `None` if a problem was reported.
#[derive(Clone, Debug)]
pub struct Chosen {
    pub what: Option<Extern>,
    pub span: Span,
}

/// Things that stand in the room.
#[derive(Clone, Debug)]
pub struct Landmark {
    pub name: String,
    /// `None`: one, without a number.
    pub size: Option<usize>,
    pub what: Option<Extern>,
    /// Of number [`Kind::SlotNumber`], or a list.
    pub at: Expr,
    pub heading: Option<Expr>,
    pub span: Span,
}

#[derive(Clone, Debug)]
pub struct Localiser {
    pub name: String,
    pub what: Option<Extern>,
    pub span: Span,
}

/// A group that does not know its poses, and the number of the localiser that tells them.
#[derive(Clone, Debug)]
pub struct Localised {
    pub group: GroupId,
    pub via: usize,
    /// Whether its odometry is joined to what it is told.
    pub odometry: bool,
    pub span: Span,
}

#[derive(Clone, Debug)]
pub struct Param {
    pub name: String,
    pub doc: String,
    pub dim: Dim,
    pub default: Expr,
    /// SI value under the overrides; `None` if a problem was reported.
    pub value: Option<f64>,
    pub span: Span,
}

/// A value that must lie in a range, if it is constant.
#[derive(Clone, Debug)]
pub struct Bound {
    pub name: String,
    pub value: Expr,
    /// Low and high, both allowed.
    pub range: Option<(Expr, Expr)>,
    /// Whether it must be a whole number, not negative.
    pub whole: bool,
    /// Where it is declared.
    pub declared: Span,
}

#[derive(Clone, Debug, Default)]
pub struct World {
    pub dt: Option<Expr>,
    pub horizon: Option<Expr>,
    pub safety: Option<Expr>,
    pub room: Option<Chosen>,
    pub lighting: Option<Chosen>,
    pub landmarks: Vec<Landmark>,
    /// Of evaluations.
    pub localised: Vec<Localised>,
    pub groups: Vec<Group>,
    pub formations: Vec<Formation>,
    pub require: Vec<Expr>,
    pub shared: Option<Shared>,
    pub observe: Vec<Observation>,
    pub reward: Vec<Term>,
    pub ends: Vec<End>,
    pub randomise: Vec<Randomised>,
}

/// One policy for each member of a group; the variables stand for the member.
#[derive(Clone, Debug)]
pub struct Shared {
    pub group: GroupId,
    pub var: (VarId, String),
    pub rewarded: Option<(VarId, String)>,
}

#[derive(Clone, Debug, Default)]
pub struct Group {
    pub name: String,
    /// 0 if a problem was reported.
    pub size: usize,
    /// Whether these are obstacles; then `body` is their outline.
    pub obstacle: bool,
    pub stops: Vec<GroupId>,
    pub body: Option<Extern>,
    pub radius: Option<Expr>,
    pub arena: Option<Expr>,
    pub speed: Option<Expr>,
    pub control: Option<Control>,
    pub filter: Option<Extern>,
    pub camera: Option<Chosen>,
    pub odometry: Option<Chosen>,
    pub start: Option<Expr>,
    pub span: Span,
}

impl Group {
    /// Whether its motion tells where it is, also at the beginning.
    pub fn gives_positions(&self) -> bool {
        matches!(&self.control, Some(Control::Motion(motion))
            if matches!(motion.what.output, Some(Output::Position(_))))
    }
}

#[derive(Clone, Debug)]
pub enum Control {
    Still,
    Learned,
    Motion(Called<Motion>),
}

#[derive(Clone, Debug)]
pub struct Formation {
    pub name: String,
    pub group: GroupId,
    /// Of one agent.
    pub about: Option<GroupId>,
    /// `None` if a problem was reported.
    pub shape: Option<Called<Shape>>,
    pub frame: Frame,
    /// Who is a neighbour of whom, where places are given.
    pub graph: Graph,
    pub span: Span,
}

#[derive(Clone, Debug)]
pub struct Observation {
    pub text: String,
    pub value: Expr,
    pub over: Option<Over>,
    pub noise: Option<Expr>,
    pub delay: Option<Expr>,
    pub span: Span,
}

#[derive(Clone, Debug)]
pub struct Term {
    pub name: String,
    pub doc: String,
    pub value: Expr,
    pub span: Span,
}

#[derive(Clone, Debug)]
pub struct End {
    pub name: String,
    pub when: Expr,
    pub failure: bool,
    pub cost: Option<Expr>,
    pub span: Span,
}

#[derive(Clone, Debug)]
pub struct Method {
    pub label: String,
    pub what: Extern,
    pub span: Span,
}

#[derive(Clone, Debug)]
pub struct Protocol {
    pub name: String,
    pub episodes: Expr,
    /// The scenario with its changes, as far as the world goes; `None`: it changes nothing.
    pub changed: Option<Box<Hir>>,
    pub span: Span,
}

#[derive(Clone, Debug)]
pub struct Stage {
    pub name: String,
    /// The scenario with its changes, as far as the world goes.
    pub changed: Box<Hir>,
    pub until: Option<Until>,
    pub most_steps: Option<usize>,
    pub span: Span,
}

/// The same scenario with changes: a whole study.
#[derive(Clone, Debug)]
pub struct Variant {
    pub name: String,
    /// The changes as written.
    pub text: String,
    pub changed: Box<Hir>,
    pub span: Span,
}

/// A parameter that is drawn anew for each episode.
#[derive(Clone, Debug)]
pub struct Randomised {
    pub param: ParamId,
    pub value: Expr,
    pub span: Span,
}

#[derive(Clone, Debug)]
pub struct Test {
    pub name: String,
    pub steps: Vec<Spanned<TestStep>>,
    pub span: Span,
}

#[derive(Clone, Debug)]
pub enum TestStep {
    Place { agent: Expr, position: Expr },
    Turn { agent: Expr, heading: Expr },
    Steer { agent: Expr, velocity: Expr },
    Step(usize),
    Check { text: String, actual: Option<Expr>, holds: Expr },
}

#[derive(Clone, Debug)]
pub struct Claim {
    pub text: String,
    pub kind: ClaimKind,
    pub span: Span,
}

/// A recorded path.
#[derive(Clone, Debug)]
pub struct Track {
    pub name: String,
    /// Seconds and metres.
    pub points: Arc<crate::recording::Points>,
    pub span: Span,
}

#[derive(Clone, Debug, Default)]
pub struct Hir {
    pub name: String,
    pub doc: String,
    pub params: Vec<Param>,
    pub tracks: Vec<Track>,
    pub world: World,
    /// Of all reward terms and costs.
    pub reward_dim: Dim,
    pub localisers: Vec<Localiser>,
    /// The one of `learn` first.
    pub learners: Vec<Method>,
    pub controllers: Vec<Method>,
    pub seeds: Option<Expr>,
    pub protocols: Vec<Protocol>,
    pub stages: Vec<Stage>,
    pub variants: Vec<Variant>,
    pub tests: Vec<Test>,
    pub claims: Vec<Claim>,
    pub bounds: Vec<Bound>,
}

impl World {
    /// The first agent of a group.
    pub fn first_of(&self, group: GroupId) -> usize {
        self.groups.iter().take(group).map(|group| group.size).sum()
    }

    /// The graph of a formation.
    pub fn graph<'w>(&'w self, formation: &'w Formation) -> std::borrow::Cow<'w, Graph> {
        use std::borrow::Cow;
        match formation.shape.as_ref().map(|shape| &shape.what.slots) {
            Some(Slots::Edges(edges)) => Cow::Owned(Graph::Edges(edges.iter().map(|e| e.nodes).collect())),
            Some(Slots::Graph(graph, _)) => Cow::Borrowed(graph),
            _ => Cow::Borrowed(&formation.graph),
        }
    }

    /// How many nodes a formation has: the agent it is about, and its members.
    pub fn nodes(&self, formation: &Formation) -> usize {
        let members = self.groups.get(formation.group).map_or(0, |group| group.size);
        members + usize::from(formation.about.is_some())
    }

    /// Whether two agents are neighbours in a formation.
    pub fn edge(&self, formation: FormationId, a: usize, b: usize) -> bool {
        let Some(formation) = self.formations.get(formation) else { return false };
        let about = formation.about.map(|about| self.first_of(about));
        let first = self.first_of(formation.group);
        let node = |agent: usize| match about {
            Some(about) if about == agent => Some(0),
            _ => agent.checked_sub(first).map(|member| member + usize::from(about.is_some())),
        };
        let (Some(a), Some(b)) = (node(a), node(b)) else { return false };
        self.graph(formation).iter(self.nodes(formation)).any(|edge| edge == (a, b) || edge == (b, a))
    }
}

impl Landmark {
    pub fn count(&self) -> usize {
        self.size.unwrap_or(1)
    }

    /// The name of one of them, from 0.
    pub fn member(&self, number: usize) -> String {
        match self.size {
            None => self.name.clone(),
            Some(_) => format!("{}[{}]", self.name, number + 1),
        }
    }
}

impl Localiser {
    /// Whether it tells poses from images.
    pub fn looks(&self) -> bool {
        self.what.as_ref().is_none_or(|what| what.name != "noisy")
    }
}

impl Set {
    /// The expressions that it depends on.
    pub fn exprs(&self) -> Vec<&Expr> {
        match self {
            Set::All | Set::Obstacles | Set::Group(_) | Set::Argument(_) => Vec::new(),
            Set::Members(of) | Set::Edges(of) => vec![of],
            Set::Pairs(of) => of.exprs(),
            Set::Nearest { count, to, among } => [&**count, &**to].into_iter().chain(among.exprs()).collect(),
        }
    }
}

impl Type {
    /// Whether its values are expressions of the Plan.
    pub fn is_plain(&self) -> bool {
        matches!(self, Type::Number(_) | Type::Vector(_) | Type::Truth | Type::Count)
    }
}

impl Expr {
    /// Stands for something that a problem was reported for.
    pub fn poison(span: Span) -> Expr {
        Expr { kind: Kind::Poison, type_: Type::Poison, span, depth: 1 }
    }

    /// So that copies are cheap.
    pub fn shared(self) -> Expr {
        if self.depth <= 2 {
            return self;
        }
        let (type_, span, depth) = (self.type_.clone(), self.span, self.depth + 1);
        Expr { kind: Kind::Let(Arc::new(self)), type_, span, depth }
    }

    pub fn is_poison(&self) -> bool {
        self.type_ == Type::Poison
    }

    /// Whether something holds for one of the expressions directly inside, looked at in the order of the source; of a `let`,
    /// for its value.
    pub fn any_child<'e>(&'e self, holds: &mut dyn FnMut(&'e Expr) -> bool) -> bool {
        match &self.kind {
            Kind::Let(value) => holds(value),
            Kind::Vector(a, b) | Kind::Range(a, b) | Kind::Area(a, b) | Kind::Binary(_, a, b) => {
                holds(a) || holds(b)
            }
            Kind::Part(_, a) | Kind::Unary(_, a) | Kind::Agent(_, a) => holds(a),
            Kind::MemberNumber(a) | Kind::Size(a) | Kind::Duration(a) => holds(a),
            Kind::Slot(a, b) | Kind::Element(a, b) | Kind::OnTrack(a, b) => holds(a) || holds(b),
            Kind::Clearance(pair) | Kind::Same(pair) => pair.iter().any(holds),
            Kind::Rest(of, pair) => holds(of) || pair.iter().any(holds),
            Kind::List(all) | Kind::BuiltIn(_, all) | Kind::Draw(_, all) | Kind::Schedule(_, all) => {
                all.iter().any(holds)
            }
            Kind::Call(function, args) => holds(&function.body) || args.iter().any(holds),
            Kind::If { condition, then, otherwise } => holds(condition) || holds(then) || holds(otherwise),
            Kind::Reduce { over, body, .. } => {
                over.set.exprs().into_iter().chain(over.filter.as_deref()).any(&mut *holds) || holds(body)
            }
            Kind::Group(set) => set.exprs().into_iter().any(holds),
            _ => false,
        }
    }

    /// Whether its value depends on a parameter.
    pub fn mentions(&self, param: ParamId) -> bool {
        self.any_inside(&mut |part| matches!(part.kind, Kind::Param(id) if id == param))
    }

    /// Whether something holds for this expression, or for one that it is made of or refers to.
    pub fn any_inside<'e>(&'e self, holds: &mut dyn FnMut(&'e Expr) -> bool) -> bool {
        holds(self) || self.any_child(&mut |child| child.any_inside(holds))
    }
}
