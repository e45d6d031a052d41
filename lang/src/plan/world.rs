//! The world of episodes: who is in it, how they move, and the places that they keep.

use serde::{Deserialize, Serialize};

use super::{
    AgentId, Binder, End, Expr, Extern, GroupId, Localised, Observation, ParamId, Place, Scenery, Term,
};

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
    /// Of obstacles their outline; they are no agents: not in [`IndexSet::All`](super::IndexSet::All), and they do not collide.
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
