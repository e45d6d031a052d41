//! What the names of a World stand for.

use std::cell::OnceCell;
use std::ops::Range;
use std::sync::Arc;

use mpgx_lang::plan::{Constraint, Formation, FormationId, GroupId, Param, TrackId, World};

use crate::error::Flaw;
use crate::program::Model;

/// A formation of more edges than this is refused.
const MOST_EDGES: usize = 1 << 22;

/// What the names of a World stand for.
pub(crate) struct Layout<'a> {
    pub params: &'a [Param],
    pub world: &'a World,
    /// Without the formations.
    pub model: Model,
    /// The agents of each group.
    pub groups: Vec<Range<usize>>,
    /// `leader`, `follower[2]`; one an agent.
    pub names: Vec<String>,
    /// All agents that are no obstacles.
    pub everyone: Arc<[usize]>,
    pub obstacles: Arc<[usize]>,
    /// Of each formation, once something asks for them.
    edges: Vec<OnceCell<Arc<[[usize; 2]]>>>,
}

impl<'a> Layout<'a> {
    pub fn new(params: &'a [Param], world: &'a World, model: Model) -> Self {
        let mut groups: Vec<Range<usize>> = Vec::new();
        let mut names = Vec::new();
        let (mut everyone, mut obstacles) = (Vec::new(), Vec::new());
        for group in &world.groups {
            let first = names.len();
            match group.size {
                1 => names.push(group.name.clone()),
                size => names.extend((1..=size).map(|member| format!("{}[{member}]", group.name))),
            }
            if group.solid.is_some() { &mut obstacles } else { &mut everyone }.extend(first..names.len());
            groups.push(first..names.len());
        }
        let edges = world.formations.iter().map(|_| OnceCell::new()).collect();
        let (everyone, obstacles) = (everyone.into(), obstacles.into());
        Layout { params, world, model, groups, names, everyone, obstacles, edges }
    }

    pub fn group(&self, id: GroupId) -> Result<Range<usize>, Flaw> {
        self.groups.get(id).cloned().ok_or(Flaw::UnknownGroup { id })
    }

    pub fn track(&self, id: TrackId) -> Result<TrackId, Flaw> {
        if id < self.model.tracks.len() { Ok(id) } else { Err(Flaw::UnknownTrack { id }) }
    }

    /// The agent that the places of a formation are about.
    pub fn about(&self, formation: &Formation) -> Result<usize, Flaw> {
        match (&formation.constraint, formation.about) {
            (Constraint::Displacements { .. }, Some(about)) if about < self.names.len() => Ok(about),
            (Constraint::Displacements { .. }, Some(about)) => Err(Flaw::UnknownAgent { id: about }),
            (Constraint::Displacements { .. }, None) => Err(Flaw::AboutNobody),
            (Constraint::Distances(_), _) => Err(Flaw::NoPlaces { formation: formation.name.clone() }),
        }
    }

    /// The agents that the graph of a formation is over.
    pub fn nodes(&self, id: FormationId) -> Result<Vec<usize>, Flaw> {
        let formation = self.world.formations.get(id).ok_or(Flaw::UnknownFormation { id })?;
        if let Some(about) = formation.about.filter(|about| *about >= self.names.len()) {
            return Err(Flaw::UnknownAgent { id: about });
        }
        Ok(formation.about.into_iter().chain(self.group(formation.group)?).collect())
    }

    /// The neighbours in a formation.
    pub fn edges(&self, id: FormationId) -> Result<Arc<[[usize; 2]]>, Flaw> {
        let nodes = self.nodes(id)?;
        let cell = &self.edges[id];
        if let Some(edges) = cell.get() {
            return Ok(edges.clone());
        }
        let graph = &self.world.formations[id].graph;
        let count = graph.edges(nodes.len());
        if count > MOST_EDGES {
            return Err(Flaw::TooManyEdges { count, most: MOST_EDGES });
        }
        let agents = |(a, b)| match (nodes.get(a), nodes.get(b)) {
            (Some(&a), Some(&b)) => Ok([a, b]),
            _ => Err(Flaw::UnknownNode { edge: (a, b), nodes: nodes.len() }),
        };
        let edges: Arc<[_]> = graph.iter(nodes.len()).map(agents).collect::<Result<_, _>>()?;
        Ok(cell.get_or_init(|| edges).clone())
    }
}
