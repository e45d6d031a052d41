//! The reward machine: expressions of the Plan, compiled once and evaluated at every step.
//!
//! A program is a tree with one type for each kind of value, so that nothing is checked while it runs.
//! Names are resolved, constants folded, functions bound; index sets stay loops. Evaluation allocates nothing.

mod compile;
mod draw;
#[cfg(test)]
mod naive;

pub(crate) use compile::{Compiler, Layout, Scope};
pub(crate) use draw::Draws;

use draw::Draw;

use crate::maths::{self, Vec2};

/// Index variables inside each other.
const MOST_VARIABLES: usize = 8;

/// An expression whose value is a number.
#[derive(Clone, Debug)]
pub(crate) enum Number {
    Constant(f64),
    Time,
    State(usize),
    Heading(Who),
    Negate(Box<Number>),
    Add(Box<[Number; 2]>),
    Subtract(Box<[Number; 2]>),
    Multiply(Box<[Number; 2]>),
    Divide(Box<[Number; 2]>),
    Function1(fn(f64) -> f64, Box<Number>),
    Function2(fn(f64, f64) -> f64, Box<[Number; 2]>),
    Clamp(Box<[Number; 3]>),
    OfVector(fn(Vec2) -> f64, Box<Vector>),
    OfVectors(fn(Vec2, Vec2) -> f64, Box<[Vector; 2]>),
    If(Box<(Truth, Number, Number)>),
    Fold(Fold, Box<Each>, Box<Number>),
    Count(Box<Each>, Box<Truth>),
    Draw(Box<Draw>),
}

/// An expression whose value is a plane vector.
#[derive(Clone, Debug)]
pub(crate) enum Vector {
    Constant(Vec2),
    State(usize),
    Position(Who),
    Velocity(Who),
    Slot(usize, Who),
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
    Not(Box<Truth>),
    And(Box<[Truth; 2]>),
    Or(Box<[Truth; 2]>),
    Compare(fn(&f64, &f64) -> bool, Box<[Number; 2]>),
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

/// An agent: fixed, or the value of an index variable.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Who {
    Agent(usize),
    Variable(usize),
}

/// How the numbers of a reduction are put together.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Fold {
    Sum,
    Mean,
    Min,
    Max,
}

/// The agents that an index variable runs over: one after the other, or each pair i < j of them
/// (then `variable` and the one after it are bound).
#[derive(Clone, Debug)]
pub(crate) struct Each {
    first: usize,
    end: usize,
    pairs: bool,
    variable: usize,
    filter: Option<Truth>,
}

/// All agents, one entry of each column an agent.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Agents {
    /// m.
    pub position: Vec<Vec2>,
    /// m/s over the last step.
    pub velocity: Vec<Vec2>,
    /// rad.
    pub heading: Vec<f64>,
    pub outside: Vec<bool>,
}

/// A compiled formation: where the members of its group, `first` on, belong.
#[derive(Clone, Debug)]
pub(crate) struct Shape {
    pub about: usize,
    pub first: usize,
    /// From `about`, m; one a member.
    pub displacements: Vec<Vector>,
}

/// What an evaluation may look at.
pub(crate) struct Scene<'a> {
    agents: &'a Agents,
    shapes: &'a [Shape],
    time_s: f64,
    states: &'a [Vec2],
    draws: Option<&'a mut Draws>,
    variables: [usize; MOST_VARIABLES],
}

impl Agents {
    /// All at rest at the origin.
    pub fn new(count: usize) -> Self {
        Agents {
            position: vec![[0.0; 2]; count],
            velocity: vec![[0.0; 2]; count],
            heading: vec![0.0; count],
            outside: vec![false; count],
        }
    }
}

impl<'a> Scene<'a> {
    /// A scene without draws and motion states.
    pub fn new(agents: &'a Agents, shapes: &'a [Shape], time_s: f64) -> Self {
        Scene { agents, shapes, time_s, states: &[], draws: None, variables: [0; MOST_VARIABLES] }
    }

    /// The same with the states of a motion (numbers in x) and random draws.
    pub fn random(self, states: &'a [Vec2], draws: &'a mut Draws) -> Self {
        draws.forget();
        Scene { states, draws: Some(draws), ..self }
    }

    fn agent(&self, who: Who) -> usize {
        match who {
            Who::Agent(agent) => agent,
            Who::Variable(variable) => self.variables[variable],
        }
    }

    /// Where member `agent` of a formation belongs, m.
    pub fn slot(&mut self, shape: usize, agent: usize) -> Vec2 {
        let shape = &self.shapes[shape];
        let displacement = match &shape.displacements[agent - shape.first] {
            Vector::Constant(displacement) => *displacement,
            changing => {
                let outer = self.variables;
                let displacement = changing.eval(self);
                self.variables = outer;
                displacement
            }
        };
        maths::add(self.agents.position[shape.about], displacement)
    }
}

impl Each {
    /// Visits the members for which the filter holds, as long as `visit` gives true.
    fn visit(&self, scene: &mut Scene, mut visit: impl FnMut(&mut Scene) -> bool) {
        let mut go_on = |scene: &mut Scene| {
            let kept = self.filter.as_ref().is_none_or(|filter| filter.eval(scene));
            !kept || visit(scene)
        };
        for i in self.first..self.end {
            scene.variables[self.variable] = i;
            if self.pairs {
                for j in i + 1..self.end {
                    scene.variables[self.variable + 1] = j;
                    if !go_on(scene) {
                        return;
                    }
                }
            } else if !go_on(scene) {
                return;
            }
        }
    }
}

impl Number {
    pub fn eval(&self, scene: &mut Scene) -> f64 {
        match self {
            Number::Constant(x) => *x,
            Number::Time => scene.time_s,
            Number::State(state) => scene.states[*state][0],
            Number::Heading(who) => scene.agents.heading[scene.agent(*who)],
            Number::Negate(x) => -x.eval(scene),
            Number::Add(of) => of[0].eval(scene) + of[1].eval(scene),
            Number::Subtract(of) => of[0].eval(scene) - of[1].eval(scene),
            Number::Multiply(of) => of[0].eval(scene) * of[1].eval(scene),
            Number::Divide(of) => of[0].eval(scene) / of[1].eval(scene),
            Number::Function1(function, x) => function(x.eval(scene)),
            Number::Function2(function, of) => function(of[0].eval(scene), of[1].eval(scene)),
            Number::Clamp(of) => maths::clamp(of[0].eval(scene), of[1].eval(scene), of[2].eval(scene)),
            Number::OfVector(function, v) => function(v.eval(scene)),
            Number::OfVectors(function, of) => function(of[0].eval(scene), of[1].eval(scene)),
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

impl Fold {
    fn eval(self, each: &Each, body: &Number, scene: &mut Scene) -> f64 {
        let mut count = 0u64;
        let mut total = match self {
            Fold::Sum | Fold::Mean => 0.0,
            Fold::Min => f64::INFINITY,
            Fold::Max => f64::NEG_INFINITY,
        };
        each.visit(scene, |scene| {
            let value = body.eval(scene);
            count += 1;
            total = match self {
                Fold::Sum | Fold::Mean => total + value,
                Fold::Min => maths::lesser(total, value),
                Fold::Max => maths::greater(total, value),
            };
            true
        });
        match self {
            Fold::Mean if count > 0 => total / count as f64,
            _ => total,
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
            Vector::Slot(shape, who) => scene.slot(*shape, scene.agent(*who)),
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
            Truth::Not(truth) => !truth.eval(scene),
            Truth::And(of) => of[0].eval(scene) && of[1].eval(scene),
            Truth::Or(of) => of[0].eval(scene) || of[1].eval(scene),
            Truth::Compare(compare, of) => compare(&of[0].eval(scene), &of[1].eval(scene)),
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
