//! Random draws in lanes.

use mpgx_random::{Address, Stream};

use super::{Scenes, rotated};
use crate::lanes::{LANES, Lanes, Mask, NOBODY, Plane, ZEROS, and, map, map2, not, or, select_plane, some};
use crate::program::draw::{Distribution, Draw, MOST_DRAWS};

/// The random numbers of one agent and step in each lane.
#[derive(Clone, Debug)]
pub(crate) struct ManyDraws {
    addresses: [Address; LANES],
    streams: Vec<Option<Stream>>,
    drawn: [(Mask, Plane); MOST_DRAWS],
}

impl ManyDraws {
    pub fn new(addresses: [Address; LANES]) -> Self {
        ManyDraws { addresses, streams: vec![None; LANES], drawn: [(NOBODY, [ZEROS; 2]); MOST_DRAWS] }
    }

    /// Begins the streams of other addresses.
    pub fn begin(&mut self, addresses: [Address; LANES]) {
        self.addresses = addresses;
        self.streams.fill(None);
    }

    pub(in crate::program) fn forget(&mut self) {
        self.drawn.iter_mut().for_each(|(known, _)| *known = NOBODY);
    }
}

impl Draw {
    pub(in crate::program) fn eval_lanes(&self, scene: &mut Scenes) -> Plane {
        let Some(memory) = self.memory else { return self.from.eval_lanes(scene) };
        let known = scene.draws.as_deref().map_or(NOBODY, |draws| draws.drawn[memory].0);
        let missing = and(scene.active, not(known));
        if some(missing) {
            let value = scene.only(missing, |scene| self.from.eval_lanes(scene));
            if let Some(draws) = scene.draws.as_deref_mut() {
                let (known, values) = &mut draws.drawn[memory];
                *values = select_plane(&missing, &value, values);
                *known = or(*known, missing);
            }
        }
        scene.draws.as_deref().map_or([[f64::NAN; LANES]; 2], |draws| draws.drawn[memory].1)
    }
}

impl Distribution {
    pub(in crate::program) fn eval_lanes(&self, scene: &mut Scenes) -> Plane {
        match self {
            Distribution::Uniform(of) => {
                let [low, high] = [0, 1].map(|k: usize| of[k].eval_lanes(scene));
                [between(&low, &high, &drawn(scene, Stream::uniform)), ZEROS]
            }
            Distribution::Normal(of) => {
                let [mean, deviation] = [0, 1].map(|k: usize| of[k].eval_lanes(scene));
                [about(&mean, &deviation, &drawn(scene, Stream::normal)), ZEROS]
            }
            Distribution::UniformAxes(of) => {
                let [low, high] = [0, 1].map(|k: usize| of[k].eval_lanes(scene));
                [0, 1].map(|axis: usize| between(&low[axis], &high[axis], &drawn(scene, Stream::uniform)))
            }
            Distribution::NormalAxes(of) => {
                let [mean, deviation] = [0, 1].map(|k: usize| of[k].eval_lanes(scene));
                [0, 1].map(|axis: usize| about(&mean[axis], &deviation[axis], &drawn(scene, Stream::normal)))
            }
            Distribution::UnitDisc => {
                let radius = map(&drawn(scene, Stream::uniform), f64::sqrt);
                let angle = map(&drawn(scene, Stream::uniform), |share| std::f64::consts::TAU * share);
                rotated(&[radius, ZEROS], &angle)
            }
        }
    }
}

fn between(low: &Lanes, high: &Lanes, share: &Lanes) -> Lanes {
    let way = map2(&map2(high, low, |high, low| high - low), share, |way, share| way * share);
    map2(low, &way, |low, way| low + way)
}

fn about(mean: &Lanes, deviation: &Lanes, normal: &Lanes) -> Lanes {
    map2(mean, &map2(deviation, normal, |deviation, normal| deviation * normal), |mean, off| mean + off)
}

/// The next numbers of the streams of those who evaluate.
fn drawn(scene: &mut Scenes, next: fn(&mut Stream) -> f64) -> Lanes {
    let mut out = [f64::NAN; LANES];
    let Some(draws) = scene.draws.as_deref_mut() else { return out };
    let streams = draws.streams.iter_mut().zip(&draws.addresses);
    for ((out, (stream, address)), active) in out.iter_mut().zip(streams).zip(&scene.active) {
        if *active {
            *out = next(stream.get_or_insert_with(|| address.stream()));
        }
    }
    out
}
