//! The world of episodes: who is in it, how they move, what is observed and rewarded.

use std::sync::Arc;

use super::{Expr, Over};
use crate::ast::Span;
use crate::plan::{FormationId, Frame, Graph, GroupId, ParamId, VarId};

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

/// A group that does not know its poses, and the number of the localiser that tells them.
#[derive(Clone, Debug)]
pub struct Localised {
    pub group: GroupId,
    pub via: usize,
    /// Whether its odometry is joined to what it is told.
    pub odometry: bool,
    pub span: Span,
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

/// A parameter that is drawn anew for each episode.
#[derive(Clone, Debug)]
pub struct Randomised {
    pub param: ParamId,
    pub value: Expr,
    pub span: Span,
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
