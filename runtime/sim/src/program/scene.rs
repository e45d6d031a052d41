//! What an evaluation may look at.

use std::sync::Arc;

use mpgx_lang::plan::Graph;

use super::{Draws, MOST_VARIABLES, Number, Vector, Who};
use crate::maths::{self, Vec2};
use crate::outline::Outline;

/// All agents and obstacles, one entry of each column each.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Agents {
    /// m.
    pub position: Vec<Vec2>,
    /// m/s over the last step.
    pub velocity: Vec<Vec2>,
    /// The velocity of the last motion, m/s; along x before the first.
    pub course: Vec<Vec2>,
    /// rad; 0 for bodies without one.
    pub heading: Vec<f64>,
    /// The velocity command, m/s; the velocity of those that have none.
    pub command: Vec<Vec2>,
    /// The command of the step before.
    pub last_command: Vec<Vec2>,
    pub outside: Vec<bool>,
}

/// What never changes of a world, as far as expressions look at it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Model {
    /// Of each agent and obstacle.
    pub outlines: Vec<Outline>,
    /// The radius of each agent, m; 0 of obstacles.
    pub radii: Vec<f64>,
    /// The number of each in its group, from 1.
    pub numbers: Vec<f64>,
    /// Whether the body of each has a heading.
    pub headed: Vec<bool>,
    pub formations: Vec<Formation>,
    pub tracks: Vec<Track>,
}

/// A compiled formation of the agents `first` on.
#[derive(Clone, Debug)]
pub(crate) struct Formation {
    pub first: usize,
    pub members: usize,
    /// The agent it is about or that is in it besides its members; with it, the first node of its graph.
    pub about: Option<usize>,
    pub graph: Graph,
    pub constraint: Constraint,
}

#[derive(Clone, Debug)]
pub(crate) enum Constraint {
    /// From the agent `about`, m; one a member. Along its heading if `turned`.
    Displacements { about: usize, displacements: Vec<Vector>, turned: bool },
    /// Of neighbours, m: one for all edges or one for each.
    Distances { lengths: Vec<Number>, edges: Arc<[[usize; 2]]> },
}

/// A recorded path, joined by straight lines.
#[derive(Clone, Debug)]
pub(crate) struct Track {
    /// Rising, at least one.
    pub t_s: Vec<f64>,
    /// One for each time, m.
    pub p_m: Vec<Vec2>,
}

/// What an evaluation may look at.
pub(crate) struct Scene<'a> {
    pub(super) model: &'a Model,
    pub(super) agents: &'a Agents,
    /// The parameters drawn for this episode.
    pub(super) params: &'a [f64],
    pub(super) time_s: f64,
    pub(super) states: &'a [Vec2],
    pub(super) draws: Option<&'a mut Draws>,
    pub(super) variables: [usize; MOST_VARIABLES],
}

impl Agents {
    /// All at rest at the origin.
    pub fn new(count: usize) -> Self {
        Agents {
            position: vec![[0.0; 2]; count],
            velocity: vec![[0.0; 2]; count],
            course: vec![[1.0, 0.0]; count],
            heading: vec![0.0; count],
            command: vec![[0.0; 2]; count],
            last_command: vec![[0.0; 2]; count],
            outside: vec![false; count],
        }
    }
}

impl Formation {
    /// How many members have a place.
    pub fn places(&self) -> usize {
        if matches!(self.constraint, Constraint::Displacements { .. }) { self.members } else { 0 }
    }

    /// Whether an agent is a member.
    pub fn has(&self, agent: usize) -> bool {
        (self.first..self.first + self.members).contains(&agent)
    }

    /// All neighbours, in the order of the edges.
    pub fn neighbours(&self) -> impl Iterator<Item = [usize; 2]> {
        let nodes: Vec<usize> = self.about.into_iter().chain(self.first..self.first + self.members).collect();
        let edges: Vec<_> = self.graph.iter(nodes.len()).collect();
        edges.into_iter().filter_map(move |(a, b)| Some([*nodes.get(a)?, *nodes.get(b)?]))
    }

    /// The neighbours whose distance is prescribed.
    pub fn edges(&self) -> &[[usize; 2]] {
        match &self.constraint {
            Constraint::Distances { edges, .. } => edges,
            Constraint::Displacements { .. } => &[],
        }
    }
}

impl Track {
    /// Position at a time, clamped to the ends, m.
    pub fn at(&self, time_s: f64) -> Vec2 {
        let after = self.t_s.partition_point(|t| *t <= time_s);
        match (after.checked_sub(1), self.t_s.get(after)) {
            _ if time_s.is_nan() => [f64::NAN; 2],
            (None, _) => self.p_m[0],
            (Some(before), None) => self.p_m[before],
            (Some(before), Some(end)) => {
                let begin = self.t_s[before];
                let way = maths::subtract(self.p_m[after], self.p_m[before]);
                maths::add(self.p_m[before], maths::scale(way, (time_s - begin) / (end - begin)))
            }
        }
    }
}

impl<'a> Scene<'a> {
    /// A scene without draws and motion states.
    pub fn new(model: &'a Model, agents: &'a Agents, params: &'a [f64], time_s: f64) -> Self {
        Scene { model, agents, params, time_s, states: &[], draws: None, variables: [0; MOST_VARIABLES] }
    }

    /// The same with the states of a motion (numbers in x) and random draws.
    pub fn random(self, states: &'a [Vec2], draws: &'a mut Draws) -> Self {
        draws.forget();
        Scene { states, draws: Some(draws), ..self }
    }

    /// Makes the first index variable stand for an agent.
    pub fn bind(&mut self, agent: usize) {
        self.variables[0] = agent;
    }

    pub(super) fn agent(&self, who: Who) -> usize {
        match who {
            Who::Agent(agent) => agent,
            Who::Variable(variable) => self.variables[variable],
        }
    }

    /// rad; of bodies without a heading the direction of their last motion.
    pub(super) fn heading(&self, agent: usize) -> f64 {
        if self.model.headed[agent] {
            self.agents.heading[agent]
        } else {
            let [x, y] = self.agents.course[agent];
            libm::atan2(y, x)
        }
    }

    /// Where member `agent` of a formation belongs, m.
    pub fn slot(&mut self, formation: usize, agent: usize) -> Vec2 {
        let Formation { first, constraint, .. } = &self.model.formations[formation];
        match constraint {
            Constraint::Displacements { about, displacements, turned } => {
                let mut way = self.displacement(&displacements[agent - first]);
                if *turned {
                    way = maths::rotate(way, self.heading(*about));
                }
                maths::add(self.agents.position[*about], way)
            }
            Constraint::Distances { .. } => [f64::NAN; 2],
        }
    }

    fn displacement(&mut self, displacement: &Vector) -> Vec2 {
        match displacement {
            Vector::Constant(displacement) => *displacement,
            changing => self.apart(|scene| changing.eval(scene)),
        }
    }

    /// The distance that the two ends of an edge, given by its number and by its agents, should have, m.
    pub fn rest(&mut self, formation: usize, edge: usize, ends: [usize; 2]) -> f64 {
        let it = &self.model.formations[formation];
        match &it.constraint {
            Constraint::Distances { lengths, .. } => {
                let length = lengths.get(edge).unwrap_or(&lengths[0]);
                self.apart(|scene| length.eval(scene))
            }
            Constraint::Displacements { about, displacements, .. } => {
                let place = |agent: usize| match agent == *about {
                    true => [0.0; 2],
                    false => self.displacement(&displacements[agent - it.first]),
                };
                let [a, b] = ends.map(place);
                maths::distance(a, b)
            }
        }
    }

    /// Distance of the outlines of an agent and something else, m.
    pub(super) fn clearance(&self, agent: usize, other: usize) -> f64 {
        clearance(self.model, &self.agents.position, agent, other)
    }

    /// Evaluates what has index variables of its own.
    fn apart<T>(&mut self, eval: impl FnOnce(&mut Self) -> T) -> T {
        let outer = self.variables;
        let value = eval(self);
        self.variables = outer;
        value
    }
}

/// Distance of the outlines of an agent, a disc, and an agent or obstacle, m; negative inside.
pub(crate) fn clearance(model: &Model, position: &[Vec2], agent: usize, other: usize) -> f64 {
    let away = model.outlines[other].distance(maths::subtract(position[agent], position[other]));
    away - model.radii[agent]
}
