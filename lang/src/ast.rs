//! The syntax tree: what was written, names unresolved, nothing checked.

/// Bytes `start..end` of one source file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Span {
    /// Index of the file in the compilation's [`crate::source::Sources`]; those of the standard library have fixed ones.
    pub file: usize,
    pub start: usize,
    pub end: usize,
}

impl Span {
    /// The smallest span that covers both (of one file).
    pub fn to(self, other: Span) -> Span {
        Span { file: self.file, start: self.start.min(other.start), end: self.end.max(other.end) }
    }
}

/// A node and where it stands.
#[derive(Clone, Debug, PartialEq)]
pub struct Spanned<T> {
    pub node: T,
    pub span: Span,
}

pub type Name = Spanned<String>;
pub type ExprAt = Spanned<Expr>;

/// One file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct File {
    /// The `//!` comment, without the marks.
    pub doc: String,
    pub items: Vec<Spanned<Item>>,
    /// Where items with syntax errors stand, which are left out.
    pub broken: Vec<Span>,
}

/// A top-level item. `doc` is the `///` comment before it.
#[derive(Clone, Debug, PartialEq)]
pub enum Item {
    /// `scenario square_unison`
    Scenario(Name),
    /// `use std.motion.{circle, square}`; no braces: one name, the last of the path.
    Use { path: Vec<Name>, names: Vec<Name> },
    /// `dimension speed = length / time`
    Dimension { doc: String, name: Name, value: Spanned<DimExpr> },
    /// `unit cm = 0.01 m`, or `unit m : length` for the SI unit of a base dimension.
    Unit { doc: String, name: Name, dimension: Option<Spanned<DimExpr>>, value: Option<ExprAt> },
    /// `param side = 0.4 m in 0.1 m .. 2 m`; `in` and the type are optional.
    Param(Parameter),
    /// `let x = …` at top level.
    Let(LetDecl),
    /// `fn outside_by(i: agent) -> length = …`, `dist near(…) -> point = …`, or either with `extern` and no body.
    Function(FunctionDecl),
    /// `motion circle(…) { … }`
    Motion(MotionDecl),
    /// `formation square(side: length) { slots { … } }`
    Shape(ShapeDecl),
    /// `extern algorithm mpg(…)`, `extern controller …`, `extern body …`
    Extern(ExternDecl),
    /// `preset tuned for mpg, td3 { gamma = 0.9 }`
    Preset { doc: String, name: Name, for_: Vec<Name>, settings: Vec<Assignment> },
    /// `world { dt = 0.1 s, … }`
    World(Vec<Assignment>),
    /// `randomise { side ~ uniform(0.3 m, 0.5 m) }`
    Randomise(Vec<Assignment>),
    /// `obstacle pillar : disc(0.1 m) { position = (1 m, 0 m) }`; the body is the outline.
    Obstacles(AgentsDecl),
    /// `landmark shelf : books(height = 50 cm) { at = (2 m, 1 m) }`; the body is what it looks like.
    Landmarks(AgentsDecl),
    /// `localiser eyes = resnet(layers = 18)`
    Localiser { doc: String, name: Name, what: Call },
    /// `agent leader : point { … }`, `agents follower[3] : unicycle(hand = 0.15 m) { … }`
    Agents(AgentsDecl),
    /// `formation F of follower = square(side) about leader`
    Formation(FormationDecl),
    /// `recording walk = "walk.csv"`
    Recording { doc: String, name: Name, file: Spanned<String> },
    /// `require …`
    Require(ExprAt),
    /// `observe { … }`, `observe each i in follower { … }`
    Observe { each: Option<Over>, items: Vec<ObserveItem> },
    /// `reward { gap = … }`, `reward each i in follower { … }`
    Reward { each: Option<Over>, terms: Vec<RewardTerm> },
    /// `end { crash when … costs … }`
    End(Vec<EndItem>),
    /// `learn mpg with tuned { … }`
    Learn { algorithm: Name, preset: Option<Name>, settings: Vec<Assignment> },
    /// `compare { td3, proportional(gain = 3 / s) }`
    Compare(Vec<Spanned<Call>>),
    /// `seeds 10`
    Seeds(ExprAt),
    /// `evaluate regular { leader.motion = …, episodes = 100 }`
    /// Who does not know its pose is told by observations with `via`.
    Evaluate { doc: String, name: Name, observe: Vec<Spanned<Item>>, settings: Vec<Assignment> },
    /// `stage slow { leader.speed = … } until error < 0.1 m over 20 episodes within 5000 steps`
    Stage(StageDecl),
    /// `variant strong { k_o = 0.5 }`
    /// What it observes (`Item::Observe`) is instead of what the scenario does.
    Variant { doc: String, name: Name, observe: Vec<Spanned<Item>>, settings: Vec<Assignment> },
    /// `sweep { side in [0.2 m, 0.4 m], (a, b) in [(1, 2), (3, 4)] }`
    Sweep { doc: String, axes: Vec<Axis> },
    /// `test "a pair collides" { place … }`
    Test { doc: String, name: Spanned<String>, steps: Vec<Spanned<TestStep>> },
    /// `expect …`
    Expect(Expectation),
}

/// A parameter of a scenario or a declaration: `name : type = default in low .. high`.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    pub doc: String,
    pub name: Name,
    pub type_: Option<Spanned<TypeExpr>>,
    pub default: Option<ExprAt>,
    pub range: Option<(ExprAt, ExprAt)>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct LetDecl {
    pub doc: String,
    pub name: Name,
    pub value: ExprAt,
}

/// A pure function (`fn`) or a distribution (`dist`, may draw).
#[derive(Clone, Debug, PartialEq)]
pub struct FunctionDecl {
    pub doc: String,
    pub random: bool,
    pub name: Name,
    /// Dimension variables: `<D>` of `fn sqrt<D>(x: D^2) -> D`.
    pub generics: Vec<Name>,
    pub params: Vec<Parameter>,
    pub result: Spanned<TypeExpr>,
    /// `None` for `extern`. A body is zero or more `let`s and an expression: `= e` or `{ let a = … e }`.
    pub body: Option<FunctionBody>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct FunctionBody {
    pub lets: Vec<LetDecl>,
    pub value: ExprAt,
}

#[derive(Clone, Debug, PartialEq)]
pub struct MotionDecl {
    pub doc: String,
    pub name: Name,
    pub params: Vec<Parameter>,
    pub lets: Vec<LetDecl>,
    /// `state phase ~ uniform(0 deg, 360 deg)` or `state k = 0`
    pub states: Vec<StateDecl>,
    /// `next phase = …`
    pub nexts: Vec<StateDecl>,
    /// `velocity ~ …`, `velocity = …`, `position = …`
    pub outputs: Vec<StateDecl>,
}

/// `name = value` or `name ~ distribution`.
#[derive(Clone, Debug, PartialEq)]
pub struct StateDecl {
    pub name: Name,
    pub random: bool,
    pub value: ExprAt,
}

#[derive(Clone, Debug, PartialEq)]
pub struct ShapeDecl {
    pub doc: String,
    pub name: Name,
    pub params: Vec<Parameter>,
    pub lets: Vec<LetDecl>,
    pub slots: ShapeSlots,
}

/// `formation F of group = shape about leader in its frame over ring`, or with edges instead of a shape.
#[derive(Clone, Debug, PartialEq)]
pub struct FormationDecl {
    pub doc: String,
    pub name: Name,
    pub group: Name,
    pub shape: Option<Call>,
    /// Also `with leader`.
    pub about: Option<Name>,
    /// `in its frame`
    pub frame: Option<Span>,
    /// `over ring`
    pub graph: Option<Name>,
    pub edges: Vec<EdgeDecl>,
}

/// `edge leader - follower[1] = 0.5 m`; in a shape `edge 1 - 2 = side`.
#[derive(Clone, Debug, PartialEq)]
pub struct EdgeDecl {
    pub from: ExprAt,
    pub to: ExprAt,
    pub distance: ExprAt,
}

#[derive(Clone, Debug, PartialEq)]
pub struct StageDecl {
    pub doc: String,
    pub name: Name,
    pub settings: Vec<Assignment>,
    pub until: Option<UntilDecl>,
    /// `within 5000 steps`
    pub within: Option<ExprAt>,
}

/// `until error < 0.1 m over 20 episodes`
#[derive(Clone, Debug, PartialEq)]
pub struct UntilDecl {
    pub measure: Name,
    pub below: bool,
    pub bound: ExprAt,
    pub over: Option<ExprAt>,
}

/// `side in [0.2 m, 0.4 m]`; several paths change together.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    pub paths: Vec<Vec<Name>>,
    pub values: ExprAt,
}

#[derive(Clone, Debug, PartialEq)]
pub enum TestStep {
    /// `place follower[1] at (1 m, 0 m)`
    Place { agent: ExprAt, at: ExprAt },
    /// `turn follower[1] to 90 deg`
    Turn { agent: ExprAt, to: ExprAt },
    /// `steer follower[1] at (0.7 m/s, 0 m/s)`
    Steer { agent: ExprAt, at: ExprAt },
    /// `step 3`
    Step(ExprAt),
    /// `check reward.gap == -0.42 m ± 1e-3 m`
    Check { text: String, condition: ExprAt, tolerance: Option<ExprAt> },
}

#[derive(Clone, Debug, PartialEq)]
pub enum ShapeSlots {
    /// `slots { (-side, 0 m), … }`
    List(Vec<ExprAt>),
    /// `slot k of n = …`
    Rule { number: Name, count: Name, value: ExprAt },
    /// `edge 1 - 2 = side`, …
    Edges(Vec<EdgeDecl>),
    /// `edges ring = side`
    Graph { graph: Name, distance: ExprAt },
}

#[derive(Clone, Debug, PartialEq)]
pub struct ExternDecl {
    pub doc: String,
    pub kind: ExternKind,
    pub name: Name,
    pub params: Vec<Parameter>,
    /// `extern algorithm td3 = mpg(delay = 2)`: the parameters of `mpg`, with these defaults instead.
    pub base: Option<Call>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ExternKind {
    Algorithm,
    Controller,
    Body,
    /// The outline of an obstacle.
    Solid,
    /// A safety filter.
    Filter,
    /// What cameras look at.
    Room,
    Lighting,
    Camera,
    /// How robots count their own ways.
    Odometry,
    /// What a landmark looks like.
    Landmark,
    /// What tells robots where they are.
    Localiser,
}

impl ExternKind {
    /// As it is written after `extern`.
    pub fn word(self) -> &'static str {
        match self {
            ExternKind::Algorithm => "algorithm",
            ExternKind::Controller => "controller",
            ExternKind::Body => "body",
            ExternKind::Solid => "solid",
            ExternKind::Filter => "filter",
            ExternKind::Room => "room",
            ExternKind::Lighting => "lighting",
            ExternKind::Camera => "camera",
            ExternKind::Odometry => "odometry",
            ExternKind::Landmark => "landmark",
            ExternKind::Localiser => "localiser",
        }
    }
}

/// `a.b.c = value` or `start ~ distribution`.
#[derive(Clone, Debug, PartialEq)]
pub struct Assignment {
    pub path: Vec<Name>,
    pub random: bool,
    pub value: ExprAt,
}

#[derive(Clone, Debug, PartialEq)]
pub struct AgentsDecl {
    pub doc: String,
    pub name: Name,
    /// `[3]`; `None` for `agent`.
    pub size: Option<ExprAt>,
    pub body: Call,
    pub settings: Vec<Assignment>,
}

/// `name(arguments)`; the parentheses may be missing where noted.
#[derive(Clone, Debug, PartialEq)]
pub struct Call {
    pub name: Name,
    pub args: Vec<Argument>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Argument {
    /// `hand = 0.15 m`
    pub name: Option<Name>,
    pub value: ExprAt,
}

/// `value`, or `value for i in set if filter`, with the sensor's settings: `{ noise = 2 cm, delay = 1 step }`; in
/// evaluations also `camera(follower) via eyes` and `camera(follower) via eyes with odometry`.
#[derive(Clone, Debug, PartialEq)]
pub struct ObserveItem {
    pub value: ExprAt,
    pub over: Option<Over>,
    pub settings: Vec<Assignment>,
    /// The localiser.
    pub via: Option<Name>,
    /// `with odometry`, where it is written.
    pub odometry: Option<Span>,
}

/// `i in set`, `i, j in pairs(set)`, with an optional `if filter`.
#[derive(Clone, Debug, PartialEq)]
pub struct Over {
    pub vars: Vec<Name>,
    pub set: Box<ExprAt>,
    pub filter: Option<Box<ExprAt>>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct RewardTerm {
    pub doc: String,
    pub name: Name,
    pub value: ExprAt,
}

/// `name when condition costs cost`, or `limit name when …`.
#[derive(Clone, Debug, PartialEq)]
pub struct EndItem {
    /// Not a failure.
    pub limit: bool,
    pub name: Name,
    pub when: ExprAt,
    pub cost: Option<ExprAt>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Expectation {
    pub text: String,
    pub kind: ExpectationKind,
}

#[derive(Clone, Debug, PartialEq)]
pub enum ExpectationKind {
    /// `expect [mpg.]random.error < 0.02 m at 95%`: `path` is two or three names.
    Bound { path: Vec<Name>, below: bool, bound: ExprAt, confidence: Option<ExprAt> },
    /// `expect mpg beats td3 on random.return at 95%`
    Beats { better: Name, worse: Name, path: Vec<Name>, confidence: Option<ExprAt> },
}

#[derive(Clone, Debug, PartialEq)]
pub enum Expr {
    /// `0.4`, `0.4 m`, `3 m/s^2`, `95%`: a literal and its unit.
    Number {
        value: f64,
        unit: Option<Spanned<UnitExpr>>,
    },
    Truth(bool),
    /// A name: parameter, agent, group, index variable, state, setting word, …
    Name(String),
    /// `a.b`: `world.safety`, `std.x`, components `v.x`.
    Member(Box<ExprAt>, Name),
    /// `p[i]`, `F[follower]`, `heading[i]`
    Index(Box<ExprAt>, Box<ExprAt>),
    /// `f(a, b = c)`
    Call(Call),
    /// `(x, y)`
    Vector(Box<ExprAt>, Box<ExprAt>),
    /// `(a, b, c)`, three or more; in sweeps.
    Tuple(Vec<ExprAt>),
    /// `[400, 300]`
    List(Vec<ExprAt>),
    /// `low .. high`
    Range(Box<ExprAt>, Box<ExprAt>),
    /// `|x|`: absolute value or length.
    Bars(Box<ExprAt>),
    Unary(UnaryOp, Box<ExprAt>),
    /// `op_span` is the operator's place.
    Binary {
        op: BinaryOp,
        op_span: Span,
        left: Box<ExprAt>,
        right: Box<ExprAt>,
    },
    /// `if c then a else b`
    If {
        condition: Box<ExprAt>,
        then: Box<ExprAt>,
        otherwise: Box<ExprAt>,
    },
    /// `sum(i in follower if …) body`; the body is a whole multiplicative expression:
    /// `sum(i in a) x * y + z` is `(sum(i in a) x * y) + z`. For `any`, `all`, `count` the body may be a comparison.
    Reduce {
        op: Spanned<Reduction>,
        over: Over,
        body: Box<ExprAt>,
    },
}

pub use crate::plan::{BinaryOp, Reduction, UnaryOp};

/// `m`, `m/s^2`, `1/s`, `m^(1/2)`.
#[derive(Clone, Debug, PartialEq)]
pub struct UnitExpr {
    /// Each unit with its exponent as a fraction; those after `/` are negative.
    pub factors: Vec<(Name, (i32, i32))>,
}

/// `length`, `length / time^2`, `D^(1/2)`, `number`.
#[derive(Clone, Debug, PartialEq)]
pub struct DimExpr {
    pub factors: Vec<(Name, (i32, i32))>,
}

/// The type of a parameter or result.
#[derive(Clone, Debug, PartialEq)]
pub enum TypeExpr {
    /// A number of a dimension; also the names `bool`, `agent`, `point`, `area`, `list`, `count`, resolved later.
    Dim(DimExpr),
    /// `vec(length)`
    Vector(DimExpr),
    /// `range(speed)`
    Range(DimExpr),
    /// `one of (episode, step)`
    OneOf(Vec<Name>),
}
