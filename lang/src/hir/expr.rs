//! Expressions and their types.

use std::sync::Arc;

use crate::ast::Span;
use crate::dim::Dim;
use crate::plan::{
    BinaryOp, Curve, FormationId, Function as BuiltIn, GroupId, Measure, ParamId, Quantity, Reduction,
    TrackId, UnaryOp, VarId, WorldConstant,
};

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
