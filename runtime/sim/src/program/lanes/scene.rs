//! What an evaluation over lanes may look at.

use super::{ManyDraws, rotated};
use crate::lanes::{
    EVERYBODY, LANES, Lanes, Mask, Plane, ZEROS, and, by_axis, map_vector, map_vectors, not, select_plane,
};
use crate::maths;
use crate::outline::Outline;
use crate::program::{Constraint, MOST_VARIABLES, Model, Vector, Who};

/// The columns of [`crate::program::Agents`] for environments side by side.
#[derive(Clone, Debug, Default)]
pub(crate) struct Crowd {
    pub position: Vec<Plane>,
    pub velocity: Vec<Plane>,
    pub course: Vec<Plane>,
    pub heading: Vec<Lanes>,
    pub command: Vec<Plane>,
    pub last_command: Vec<Plane>,
    pub outside: Vec<Mask>,
}

/// What an evaluation may look at in environments side by side.
pub(crate) struct Scenes<'a> {
    pub model: &'a Model,
    pub agents: &'a Crowd,
    pub params: &'a [Lanes],
    pub time_s: f64,
    pub states: &'a [Plane],
    pub draws: Option<&'a mut ManyDraws>,
    /// Who evaluates.
    pub active: Mask,
    pub(super) variables: [Index; MOST_VARIABLES],
}

/// What an index variable stands for.
#[derive(Clone, Copy, Debug)]
pub(super) enum Index {
    /// The same in all lanes.
    All(usize),
    Each([usize; LANES]),
}

impl<'a> Scenes<'a> {
    pub fn new(model: &'a Model, agents: &'a Crowd, params: &'a [Lanes], time_s: f64) -> Self {
        let variables = [Index::All(0); MOST_VARIABLES];
        Scenes { model, agents, params, time_s, states: &[], draws: None, active: EVERYBODY, variables }
    }

    /// The same with the states of a motion (numbers in x) and random draws.
    pub fn random(self, states: &'a [Plane], draws: &'a mut ManyDraws) -> Self {
        draws.forget();
        Scenes { states, draws: Some(draws), ..self }
    }

    /// Makes the first index variable stand for an agent.
    pub fn bind(&mut self, agent: usize) {
        self.variables[0] = Index::All(agent);
    }

    pub(super) fn index(&self, who: Who) -> Index {
        match who {
            Who::Agent(agent) => Index::All(agent),
            Who::Variable(variable) => self.variables[variable],
        }
    }

    pub(super) fn agent(&self, who: Who, lane: usize) -> usize {
        self.index(who).at(lane)
    }

    /// Evaluates for some of those who evaluate.
    pub(super) fn only<T>(&mut self, some: Mask, eval: impl FnOnce(&mut Self) -> T) -> T {
        let outer = std::mem::replace(&mut self.active, some);
        let value = eval(self);
        self.active = outer;
        value
    }

    /// Evaluates for one agent after the other, if they are not the same in all lanes.
    pub(super) fn for_each(&mut self, who: Who, mut eval: impl FnMut(&mut Self, usize) -> Plane) -> Plane {
        match self.index(who) {
            Index::All(agent) => eval(self, agent),
            Index::Each(agents) => {
                let (mut value, mut left) = ([ZEROS; 2], EVERYBODY);
                while let Some(first) = left.iter().position(|&left| left) {
                    let same = agents.map(|agent| agent == agents[first]);
                    value = select_plane(&same, &eval(self, agents[first]), &value);
                    left = and(left, not(same));
                }
                value
            }
        }
    }

    pub(super) fn heading(&mut self, who: Who) -> Lanes {
        self.for_each(who, |scene, agent| [scene.heading_of(agent), ZEROS])[0]
    }

    fn heading_of(&self, agent: usize) -> Lanes {
        if self.model.headed[agent] {
            self.agents.heading[agent]
        } else {
            map_vector(&self.agents.course[agent], |[x, y]| libm::atan2(y, x))
        }
    }

    /// Where member `agent` of a formation belongs, m.
    pub fn slot(&mut self, formation: usize, agent: usize) -> Plane {
        let formation = &self.model.formations[formation];
        match &formation.constraint {
            Constraint::Displacements { about, displacements, turned } => {
                let mut way = self.displacement(&displacements[agent - formation.first]);
                if *turned {
                    way = rotated(&way, &self.heading_of(*about));
                }
                by_axis(&self.agents.position[*about], &way, |a, b| a + b)
            }
            Constraint::Distances { .. } => [[f64::NAN; LANES]; 2],
        }
    }

    fn displacement(&mut self, displacement: &Vector) -> Plane {
        match displacement {
            Vector::Constant([x, y]) => [[*x; LANES], [*y; LANES]],
            changing => self.apart(|scene| changing.eval_lanes(scene)),
        }
    }

    /// The distance that the two ends of an edge, given by its number and by its agents, should have, m.
    pub fn rest(&mut self, formation: usize, edge: usize, ends: [usize; 2]) -> Lanes {
        let it = &self.model.formations[formation];
        match &it.constraint {
            Constraint::Distances { lengths, .. } => {
                let length = lengths.get(edge).unwrap_or(&lengths[0]);
                self.apart(|scene| length.eval_lanes(scene))
            }
            Constraint::Displacements { about, displacements, .. } => {
                let place = |agent: usize| match agent == *about {
                    true => [ZEROS; 2],
                    false => self.displacement(&displacements[agent - it.first]),
                };
                let [a, b] = ends.map(place);
                map_vectors(&a, &b, maths::distance)
            }
        }
    }

    /// Distance of the outlines of an agent and something else, m.
    pub(super) fn clearance(&self, agent: Who, other: Who) -> Lanes {
        if let (Index::All(agent), Index::All(other)) = (self.index(agent), self.index(other)) {
            return clearance(self.model, &self.agents.position, agent, other);
        }
        std::array::from_fn(|lane| {
            let (agent, other) = (self.agent(agent, lane), self.agent(other, lane));
            clearance(self.model, &self.agents.position, agent, other)[lane]
        })
    }

    /// Evaluates what has index variables of its own.
    fn apart<T>(&mut self, eval: impl FnOnce(&mut Self) -> T) -> T {
        let outer = self.variables;
        let value = eval(self);
        self.variables = outer;
        value
    }
}

impl Index {
    pub(super) fn at(&self, lane: usize) -> usize {
        match self {
            Index::All(agent) => *agent,
            Index::Each(agents) => agents[lane],
        }
    }

    pub(super) fn of(&self, column: &[Plane]) -> Plane {
        match self {
            Index::All(agent) => column[*agent],
            Index::Each(agents) => {
                [0, 1].map(|axis| std::array::from_fn(|lane| column[agents[lane]][axis][lane]))
            }
        }
    }
}

/// Distance of the outlines of an agent, a disc, and an agent or obstacle, m; negative inside.
pub(crate) fn clearance(model: &Model, position: &[Plane], agent: usize, other: usize) -> Lanes {
    let (outline, radius) = (&model.outlines[other], model.radii[agent]);
    let (agent, other) = (&position[agent], &position[other]);
    match outline {
        Outline::Disc(size) => map_vectors(agent, other, |a, b| maths::distance(a, b) - size - radius),
        _ => map_vectors(agent, other, |a, b| outline.distance(maths::subtract(a, b)) - radius),
    }
}
