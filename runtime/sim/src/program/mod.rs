//! The reward machine: expressions of the Plan, compiled once and evaluated at every step.
//!
//! A program is a tree with one type for each kind of value, so that nothing is checked while it runs.
//! Names are resolved, constants folded, functions bound; index sets stay loops. Evaluation allocates nothing.

mod compile;
mod draw;
mod each;
mod lanes;
#[cfg(test)]
mod naive;
mod scene;

pub(crate) use compile::{Compiler, Layout, Scope, Varies};
pub(crate) use draw::Draws;
pub(crate) use each::Each;
pub(crate) use lanes::{Crowd, ManyDraws, Scenes, clearance as clearance_lanes};
pub(crate) use scene::{Agents, Constraint, Formation, Model, Scene, Track, clearance};

use std::sync::Arc;

use draw::Draw;
use each::Fold;

use crate::lanes::{Comparison, Function1, Function2, OfVector, OfVectors};
use crate::maths::{self, Vec2};

/// Index variables inside each other.
const MOST_VARIABLES: usize = 8;

/// An expression whose value is a number.
#[derive(Clone, Debug)]
pub(crate) enum Number {
    Constant(f64),
    Time,
    /// Value of a parameter that is drawn for each episode.
    Drawn(usize),
    State(usize),
    Heading(Who),
    Rest(Box<Rest>),
    /// An agent, and an agent or obstacle.
    Clearance(Box<[Who; 2]>),
    /// The number of an agent in its group.
    Ordinal(Who),
    /// A list and a number in it.
    Element(Box<(Vec<Number>, Number)>),
    Negate(Box<Number>),
    Add(Box<[Number; 2]>),
    Subtract(Box<[Number; 2]>),
    Multiply(Box<[Number; 2]>),
    Divide(Box<[Number; 2]>),
    Function1(Function1, Box<Number>),
    Function2(Function2, Box<[Number; 2]>),
    Clamp(Box<[Number; 3]>),
    OfVector(OfVector, Box<Vector>),
    OfVectors(OfVectors, Box<[Vector; 2]>),
    If(Box<(Truth, Number, Number)>),
    Fold(Fold, Box<Each>, Box<Number>),
    Count(Box<Each>, Box<Truth>),
    Draw(Box<Draw>),
}

/// The distance that the ends of an edge should have.
#[derive(Clone, Debug)]
pub(crate) struct Rest {
    formation: usize,
    edges: Arc<[[usize; 2]]>,
    /// The number of the edge.
    edge: Who,
}

/// An expression whose value is a plane vector.
#[derive(Clone, Debug)]
pub(crate) enum Vector {
    Constant(Vec2),
    State(usize),
    Position(Who),
    Velocity(Who),
    Command(Who),
    CommandChange(Who),
    Slot(usize, Who),
    Element(Box<(Vec<Vector>, Number)>),
    /// Position on a track at a time.
    Track(usize, Box<Number>),
    Pair(Box<[Number; 2]>),
    Negate(Box<Vector>),
    Add(Box<[Vector; 2]>),
    Subtract(Box<[Vector; 2]>),
    /// A number times a vector.
    Scale(Box<(Number, Vector)>),
    /// A vector times a number.
    ScaleBy(Box<(Vector, Number)>),
    Divide(Box<(Vector, Number)>),
    Rotate(Box<(Vector, Number)>),
    Unit(Box<Vector>),
    If(Box<(Truth, Vector, Vector)>),
    Draw(Box<Draw>),
}

/// An expression whose value is true or false.
#[derive(Clone, Debug)]
pub(crate) enum Truth {
    Constant(bool),
    Outside(Who),
    Same(Box<[Who; 2]>),
    Not(Box<Truth>),
    And(Box<[Truth; 2]>),
    Or(Box<[Truth; 2]>),
    Compare(Comparison, Box<[Number; 2]>),
    If(Box<(Truth, Truth, Truth)>),
    Any(Box<Each>, Box<Truth>),
    All(Box<Each>, Box<Truth>),
}

/// A program of any kind.
#[derive(Clone, Debug)]
pub(crate) enum Program {
    Number(Number),
    Vector(Vector),
    Truth(Truth),
}

/// An agent (or an edge): fixed, or the value of an index variable.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Who {
    Agent(usize),
    Variable(usize),
}

impl Number {
    pub fn eval(&self, scene: &mut Scene) -> f64 {
        match self {
            Number::Constant(x) => *x,
            Number::Time => scene.time_s,
            Number::Drawn(param) => scene.params[*param],
            Number::State(state) => scene.states[*state][0],
            Number::Heading(who) => scene.heading(scene.agent(*who)),
            Number::Rest(of) => {
                let edge = scene.agent(of.edge);
                scene.rest(of.formation, edge, of.edges[edge])
            }
            Number::Clearance(of) => scene.clearance(scene.agent(of[0]), scene.agent(of[1])),
            Number::Ordinal(who) => scene.model.numbers[scene.agent(*who)],
            Number::Element(of) => match element(of.0.len(), of.1.eval(scene)) {
                Some(entry) => of.0[entry].eval(scene),
                None => f64::NAN,
            },
            Number::Negate(x) => -x.eval(scene),
            Number::Add(of) => of[0].eval(scene) + of[1].eval(scene),
            Number::Subtract(of) => of[0].eval(scene) - of[1].eval(scene),
            Number::Multiply(of) => of[0].eval(scene) * of[1].eval(scene),
            Number::Divide(of) => of[0].eval(scene) / of[1].eval(scene),
            Number::Function1(function, x) => (function.one)(x.eval(scene)),
            Number::Function2(function, of) => (function.one)(of[0].eval(scene), of[1].eval(scene)),
            Number::Clamp(of) => maths::clamp(of[0].eval(scene), of[1].eval(scene), of[2].eval(scene)),
            Number::OfVector(function, v) => (function.one)(v.eval(scene)),
            Number::OfVectors(function, of) => (function.one)(of[0].eval(scene), of[1].eval(scene)),
            Number::If(of) => if of.0.eval(scene) { &of.1 } else { &of.2 }.eval(scene),
            Number::Fold(fold, each, body) => fold.eval(each, body, scene),
            Number::Count(each, body) => {
                let mut count = 0u64;
                each.visit(scene, |scene| {
                    count += u64::from(body.eval(scene));
                    true
                });
                count as f64
            }
            Number::Draw(draw) => draw.eval(scene)[0],
        }
    }
}

impl Vector {
    pub fn eval(&self, scene: &mut Scene) -> Vec2 {
        match self {
            Vector::Constant(v) => *v,
            Vector::State(state) => scene.states[*state],
            Vector::Position(who) => scene.agents.position[scene.agent(*who)],
            Vector::Velocity(who) => scene.agents.velocity[scene.agent(*who)],
            Vector::Command(who) => scene.agents.command[scene.agent(*who)],
            Vector::CommandChange(who) => {
                let agent = scene.agent(*who);
                maths::subtract(scene.agents.command[agent], scene.agents.last_command[agent])
            }
            Vector::Slot(formation, who) => scene.slot(*formation, scene.agent(*who)),
            Vector::Element(of) => match element(of.0.len(), of.1.eval(scene)) {
                Some(entry) => of.0[entry].eval(scene),
                None => [f64::NAN; 2],
            },
            Vector::Track(track, time) => {
                let time_s = time.eval(scene);
                scene.model.tracks[*track].at(time_s)
            }
            Vector::Pair(of) => [of[0].eval(scene), of[1].eval(scene)],
            Vector::Negate(v) => v.eval(scene).map(|x| -x),
            Vector::Add(of) => maths::add(of[0].eval(scene), of[1].eval(scene)),
            Vector::Subtract(of) => maths::subtract(of[0].eval(scene), of[1].eval(scene)),
            Vector::Scale(of) => {
                let factor = of.0.eval(scene);
                maths::scale(of.1.eval(scene), factor)
            }
            Vector::ScaleBy(of) => maths::scale(of.0.eval(scene), of.1.eval(scene)),
            Vector::Divide(of) => maths::divide(of.0.eval(scene), of.1.eval(scene)),
            Vector::Rotate(of) => maths::rotate(of.0.eval(scene), of.1.eval(scene)),
            Vector::Unit(v) => maths::unit(v.eval(scene)),
            Vector::If(of) => if of.0.eval(scene) { &of.1 } else { &of.2 }.eval(scene),
            Vector::Draw(draw) => draw.eval(scene),
        }
    }
}

impl Truth {
    pub fn eval(&self, scene: &mut Scene) -> bool {
        match self {
            Truth::Constant(truth) => *truth,
            Truth::Outside(who) => scene.agents.outside[scene.agent(*who)],
            Truth::Same(of) => scene.agent(of[0]) == scene.agent(of[1]),
            Truth::Not(truth) => !truth.eval(scene),
            Truth::And(of) => of[0].eval(scene) && of[1].eval(scene),
            Truth::Or(of) => of[0].eval(scene) || of[1].eval(scene),
            Truth::Compare(compare, of) => (compare.one)(&of[0].eval(scene), &of[1].eval(scene)),
            Truth::If(of) => if of.0.eval(scene) { &of.1 } else { &of.2 }.eval(scene),
            Truth::Any(each, body) => {
                let mut any = false;
                each.visit(scene, |scene| {
                    any = body.eval(scene);
                    !any
                });
                any
            }
            Truth::All(each, body) => {
                let mut all = true;
                each.visit(scene, |scene| {
                    all = body.eval(scene);
                    all
                });
                all
            }
        }
    }
}

impl Program {
    pub fn kind(&self) -> &'static str {
        match self {
            Program::Number(_) => "a number",
            Program::Vector(_) => "a vector",
            Program::Truth(_) => "a truth value",
        }
    }

    /// The value, numbers in x. Truth values have none.
    pub fn eval(&self, scene: &mut Scene) -> Vec2 {
        match self {
            Program::Number(number) => [number.eval(scene), 0.0],
            Program::Vector(vector) => vector.eval(scene),
            Program::Truth(_) => [f64::NAN; 2],
        }
    }
}

/// The entry of a list that a number from 1 on stands for, rounded down and clamped; none for NaN.
fn element(len: usize, number: f64) -> Option<usize> {
    (!number.is_nan()).then(|| (number.floor() as usize).clamp(1, len) - 1)
}
