//! Random draws of starts and motions.

use std::f64::consts::TAU;

use mpgx_random::{Address, Stream};

use super::{Number, Scene, Vector};
use crate::maths::{Vec2, rotate};

/// Draws of one expression that can be told apart.
pub(crate) const MOST_DRAWS: usize = 16;

/// A distribution; the value of a scalar one is in x.
#[derive(Clone, Debug)]
pub(crate) enum Distribution {
    /// Low and high.
    Uniform([Number; 2]),
    /// Mean and standard deviation.
    Normal([Number; 2]),
    /// Of each axis by itself.
    UniformAxes([Vector; 2]),
    NormalAxes([Vector; 2]),
    /// A point of the unit disc.
    UnitDisc,
}

/// A draw. One that stands in an expression twice (a random argument used twice) is one draw: it is kept at
/// `memory` while the expression is evaluated.
#[derive(Clone, Debug)]
pub(crate) struct Draw {
    pub from: Distribution,
    pub memory: Option<usize>,
}

/// The random numbers of one agent and step: a stream that begins only if something is drawn from it.
pub(crate) struct Draws {
    address: Address,
    stream: Option<Stream>,
    drawn: [Option<Vec2>; MOST_DRAWS],
}

impl Draws {
    pub fn new(address: Address) -> Self {
        Draws { address, stream: None, drawn: [None; MOST_DRAWS] }
    }

    pub fn stream(&mut self) -> &mut Stream {
        self.stream.get_or_insert_with(|| self.address.stream())
    }

    /// Makes ready for another expression.
    pub fn forget(&mut self) {
        self.drawn = [None; MOST_DRAWS];
    }
}

impl Draw {
    pub fn eval(&self, scene: &mut Scene) -> Vec2 {
        let drawn =
            self.memory.and_then(|memory| scene.draws.as_deref().and_then(|draws| draws.drawn[memory]));
        if let Some(value) = drawn {
            return value;
        }
        let value = self.from.eval(scene);
        if let (Some(memory), Some(draws)) = (self.memory, scene.draws.as_deref_mut()) {
            draws.drawn[memory] = Some(value);
        }
        value
    }
}

impl Distribution {
    fn eval(&self, scene: &mut Scene) -> Vec2 {
        match self {
            Distribution::Uniform(of) => {
                let [low, high] = [of[0].eval(scene), of[1].eval(scene)];
                [low + (high - low) * drawn(scene, Stream::uniform), 0.0]
            }
            Distribution::Normal(of) => {
                let [mean, deviation] = [of[0].eval(scene), of[1].eval(scene)];
                [mean + deviation * drawn(scene, Stream::normal), 0.0]
            }
            Distribution::UniformAxes(of) => {
                let [low, high] = [of[0].eval(scene), of[1].eval(scene)];
                [0, 1].map(|axis| low[axis] + (high[axis] - low[axis]) * drawn(scene, Stream::uniform))
            }
            Distribution::NormalAxes(of) => {
                let [mean, deviation] = [of[0].eval(scene), of[1].eval(scene)];
                [0, 1].map(|axis| mean[axis] + deviation[axis] * drawn(scene, Stream::normal))
            }
            Distribution::UnitDisc => {
                let radius = drawn(scene, Stream::uniform).sqrt();
                rotate([radius, 0.0], TAU * drawn(scene, Stream::uniform))
            }
        }
    }
}

/// The next number of the stream; the compiler has seen to it that there is one.
fn drawn(scene: &mut Scene, next: fn(&mut Stream) -> f64) -> f64 {
    scene.draws.as_deref_mut().map_or(f64::NAN, |draws| next(draws.stream()))
}
