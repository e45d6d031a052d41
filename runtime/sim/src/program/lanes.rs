//! Programs over lanes: interpreted once for environments side by side.
//!
//! What only some environments would evaluate (a branch, the operand behind a short circuit, a member that a
//! filter lets pass) is evaluated for all if for any, and counts for those; random numbers are drawn for those
//! alone, in the order in which each would draw them by itself.

use mpgx_random::{Address, Stream};

use super::draw::{Distribution, Draw, MOST_DRAWS};
use super::each::{Each, Fold, Over};
use super::{Constraint, MOST_VARIABLES, Model, Number, Program, Truth, Vector, Who, element};
use crate::lanes::{
    EVERYBODY, LANES, Lanes, Mask, NOBODY, Plane, ZEROS, and, at, by_axis, by_number, each, map, map_vector,
    map_vectors, map2, not, or, select, select_plane, some,
};
use crate::maths;
use crate::outline::Outline;

/// The columns of [`super::Agents`] for environments side by side.
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
    variables: [Index; MOST_VARIABLES],
}

/// What an index variable stands for.
#[derive(Clone, Copy, Debug)]
enum Index {
    /// The same in all lanes.
    All(usize),
    Each([usize; LANES]),
}

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

    fn forget(&mut self) {
        self.drawn.iter_mut().for_each(|(known, _)| *known = NOBODY);
    }
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

    fn index(&self, who: Who) -> Index {
        match who {
            Who::Agent(agent) => Index::All(agent),
            Who::Variable(variable) => self.variables[variable],
        }
    }

    fn agent(&self, who: Who, lane: usize) -> usize {
        self.index(who).at(lane)
    }

    /// Evaluates for some of those who evaluate.
    fn only<T>(&mut self, some: Mask, eval: impl FnOnce(&mut Self) -> T) -> T {
        let outer = std::mem::replace(&mut self.active, some);
        let value = eval(self);
        self.active = outer;
        value
    }

    /// Evaluates for one agent after the other, if they are not the same in all lanes.
    fn for_each(&mut self, who: Who, mut eval: impl FnMut(&mut Self, usize) -> Plane) -> Plane {
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

    fn heading(&mut self, who: Who) -> Lanes {
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
    fn clearance(&self, agent: Who, other: Who) -> Lanes {
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
    fn at(&self, lane: usize) -> usize {
        match self {
            Index::All(agent) => *agent,
            Index::Each(agents) => agents[lane],
        }
    }

    fn of(&self, column: &[Plane]) -> Plane {
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

fn rotated(v: &Plane, angle: &Lanes) -> Plane {
    each(v, |lane, v| maths::rotate(v, angle[lane]))
}

/// The entries of a list that lanes choose, one after the other.
fn elements<T>(
    scene: &mut Scenes,
    list: &[T],
    number: &Number,
    mut eval: impl FnMut(&T, &mut Scenes) -> Plane,
) -> Plane {
    let number = number.eval_lanes(scene);
    let mut value = [[f64::NAN; LANES]; 2];
    for (k, entry) in list.iter().enumerate() {
        let chosen = number.map(|number| element(list.len(), number) == Some(k));
        let chosen = and(scene.active, chosen);
        if some(chosen) {
            let entry = scene.only(chosen, |scene| eval(entry, scene));
            value = select_plane(&chosen, &entry, &value);
        }
    }
    value
}

/// Each branch for those who take it.
fn branches<T>(
    scene: &mut Scenes,
    condition: &Truth,
    [then, otherwise]: [&T; 2],
    mut eval: impl FnMut(&T, &mut Scenes) -> Plane,
) -> Plane {
    let truth = condition.eval_lanes(scene);
    let (yes, no) = (and(scene.active, truth), and(scene.active, not(truth)));
    match (some(yes), some(no)) {
        (true, false) => eval(then, scene),
        (false, _) => eval(otherwise, scene),
        (true, true) => {
            let a = scene.only(yes, |scene| eval(then, scene));
            let b = scene.only(no, |scene| eval(otherwise, scene));
            select_plane(&yes, &a, &b)
        }
    }
}

impl Number {
    pub fn eval_lanes(&self, scene: &mut Scenes) -> Lanes {
        match self {
            Number::Constant(x) => [*x; LANES],
            Number::Time => [scene.time_s; LANES],
            Number::Drawn(param) => scene.params[*param],
            Number::State(state) => scene.states[*state][0],
            Number::Heading(who) => scene.heading(*who),
            Number::Rest(of) => {
                let rest = |scene: &mut Scenes, edge| [scene.rest(of.formation, edge, of.edges[edge]), ZEROS];
                scene.for_each(of.edge, rest)[0]
            }
            Number::Clearance(of) => scene.clearance(of[0], of[1]),
            Number::Ordinal(who) => std::array::from_fn(|lane| scene.model.numbers[scene.agent(*who, lane)]),
            Number::Element(of) => {
                elements(scene, &of.0, &of.1, |entry, scene| [entry.eval_lanes(scene), ZEROS])[0]
            }
            Number::Negate(x) => map(&x.eval_lanes(scene), |x| -x),
            Number::Add(of) => binary(of, scene, |a, b| a + b),
            Number::Subtract(of) => binary(of, scene, |a, b| a - b),
            Number::Multiply(of) => binary(of, scene, |a, b| a * b),
            Number::Divide(of) => binary(of, scene, |a, b| a / b),
            Number::Function1(function, x) => (function.many)(&x.eval_lanes(scene)),
            Number::Function2(function, of) => {
                (function.many)(&of[0].eval_lanes(scene), &of[1].eval_lanes(scene))
            }
            Number::Clamp(of) => {
                let [x, low, high] = [0, 1, 2].map(|k: usize| of[k].eval_lanes(scene));
                map2(&map2(&x, &low, maths::greater), &high, maths::lesser)
            }
            Number::OfVector(function, v) => (function.many)(&v.eval_lanes(scene)),
            Number::OfVectors(function, of) => {
                (function.many)(&of[0].eval_lanes(scene), &of[1].eval_lanes(scene))
            }
            Number::If(of) => {
                branches(scene, &of.0, [&of.1, &of.2], |number, scene| [number.eval_lanes(scene), ZEROS])[0]
            }
            Number::Fold(fold, each, body) => fold.eval_lanes(each, body, scene),
            Number::Count(each, body) => {
                let mut count = ZEROS;
                each.visit_lanes(scene, |scene| {
                    let holds = and(scene.active, body.eval_lanes(scene));
                    for (count, holds) in count.iter_mut().zip(&holds) {
                        *count += f64::from(u8::from(*holds));
                    }
                    NOBODY
                });
                count
            }
            Number::Draw(draw) => draw.eval_lanes(scene)[0],
        }
    }
}

#[inline(always)]
fn binary(of: &[Number; 2], scene: &mut Scenes, f: impl Fn(f64, f64) -> f64) -> Lanes {
    let a = of[0].eval_lanes(scene);
    // Constants and products by them are the most frequent operands.
    if let Number::Constant(b) = of[1] { map(&a, |a| f(a, b)) } else { map2(&a, &of[1].eval_lanes(scene), f) }
}

impl Vector {
    pub fn eval_lanes(&self, scene: &mut Scenes) -> Plane {
        match self {
            Vector::Constant([x, y]) => [[*x; LANES], [*y; LANES]],
            Vector::State(state) => scene.states[*state],
            Vector::Position(who) => scene.index(*who).of(&scene.agents.position),
            Vector::Velocity(who) => scene.index(*who).of(&scene.agents.velocity),
            Vector::Command(who) => scene.index(*who).of(&scene.agents.command),
            Vector::CommandChange(who) => {
                let who = scene.index(*who);
                by_axis(&who.of(&scene.agents.command), &who.of(&scene.agents.last_command), |a, b| a - b)
            }
            Vector::Slot(formation, who) => {
                scene.for_each(*who, |scene, agent| scene.slot(*formation, agent))
            }
            Vector::Element(of) => elements(scene, &of.0, &of.1, Vector::eval_lanes),
            Vector::Track(track, time) => {
                let (times, track) = (time.eval_lanes(scene), &scene.model.tracks[*track]);
                each(&[times, times], |_, [time_s, _]| track.at(time_s))
            }
            Vector::Pair(of) => [of[0].eval_lanes(scene), of[1].eval_lanes(scene)],
            Vector::Negate(v) => v.eval_lanes(scene).map(|axis| map(&axis, |x| -x)),
            Vector::Add(of) => by_axis(&of[0].eval_lanes(scene), &of[1].eval_lanes(scene), |a, b| a + b),
            Vector::Subtract(of) => by_axis(&of[0].eval_lanes(scene), &of[1].eval_lanes(scene), |a, b| a - b),
            Vector::Scale(of) => {
                let factor = of.0.eval_lanes(scene);
                by_number(&of.1.eval_lanes(scene), &factor, |x, factor| x * factor)
            }
            Vector::ScaleBy(of) => {
                by_number(&of.0.eval_lanes(scene), &of.1.eval_lanes(scene), |x, factor| x * factor)
            }
            Vector::Divide(of) => by_number(&of.0.eval_lanes(scene), &of.1.eval_lanes(scene), |x, by| x / by),
            Vector::Rotate(of) => rotated(&of.0.eval_lanes(scene), &of.1.eval_lanes(scene)),
            Vector::Unit(v) => each(&v.eval_lanes(scene), |_, v| maths::unit(v)),
            Vector::If(of) => branches(scene, &of.0, [&of.1, &of.2], Vector::eval_lanes),
            Vector::Draw(draw) => draw.eval_lanes(scene),
        }
    }
}

impl Truth {
    /// Where it holds, among those who evaluate; elsewhere anything.
    pub fn eval_lanes(&self, scene: &mut Scenes) -> Mask {
        match self {
            Truth::Constant(truth) => [*truth; LANES],
            Truth::Outside(who) => {
                let who = scene.index(*who);
                std::array::from_fn(|lane| scene.agents.outside[who.at(lane)][lane])
            }
            Truth::Same(of) => {
                let [a, b] = [scene.index(of[0]), scene.index(of[1])];
                std::array::from_fn(|lane| a.at(lane) == b.at(lane))
            }
            Truth::Not(truth) => not(truth.eval_lanes(scene)),
            Truth::And(of) => {
                let a = of[0].eval_lanes(scene);
                let open = and(scene.active, a);
                if !some(open) {
                    return a;
                }
                and(a, scene.only(open, |scene| of[1].eval_lanes(scene)))
            }
            Truth::Or(of) => {
                let a = of[0].eval_lanes(scene);
                let open = and(scene.active, not(a));
                if !some(open) {
                    return a;
                }
                or(a, scene.only(open, |scene| of[1].eval_lanes(scene)))
            }
            Truth::Compare(compare, of) => (compare.many)(&of[0].eval_lanes(scene), &of[1].eval_lanes(scene)),
            Truth::If(of) => {
                let number = |truth: &Truth, scene: &mut Scenes| {
                    [truth.eval_lanes(scene).map(|truth| f64::from(u8::from(truth))), ZEROS]
                };
                branches(scene, &of.0, [&of.1, &of.2], number)[0].map(|truth| truth == 1.0)
            }
            Truth::Any(each, body) => {
                let mut any = NOBODY;
                each.visit_lanes(scene, |scene| {
                    let found = and(scene.active, body.eval_lanes(scene));
                    any = or(any, found);
                    found
                });
                any
            }
            Truth::All(each, body) => {
                let mut failed = NOBODY;
                each.visit_lanes(scene, |scene| {
                    let found = and(scene.active, not(body.eval_lanes(scene)));
                    failed = or(failed, found);
                    found
                });
                not(failed)
            }
        }
    }
}

impl Program {
    /// The values, numbers in x. Truth values have none.
    pub fn eval_lanes(&self, scene: &mut Scenes) -> Plane {
        match self {
            Program::Number(number) => [number.eval_lanes(scene), ZEROS],
            Program::Vector(vector) => vector.eval_lanes(scene),
            Program::Truth(_) => [[f64::NAN; LANES]; 2],
        }
    }
}

impl Draw {
    fn eval_lanes(&self, scene: &mut Scenes) -> Plane {
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
    fn eval_lanes(&self, scene: &mut Scenes) -> Plane {
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

impl Each {
    /// Visits the members, active those for whom the filter holds. `visit` tells who has seen enough.
    pub fn visit_lanes(&self, scene: &mut Scenes, mut visit: impl FnMut(&mut Scenes) -> Mask) {
        let outer = scene.active;
        let mut going = outer;
        let mut go_on = |scene: &mut Scenes, here: &Mask| {
            scene.active = and(going, *here);
            if let Some(filter) = &self.filter {
                scene.active = and(scene.active, filter.eval_lanes(scene));
            }
            if some(scene.active) {
                going = and(going, not(visit(scene)));
            }
            some(going)
        };
        self.bind_lanes(scene, &mut go_on);
        scene.active = outer;
    }

    /// Binds the variables to one member, pair or edge after the other as long as `go_on` gives true; it is told
    /// which lanes have one.
    fn bind_lanes(&self, scene: &mut Scenes, go_on: &mut impl FnMut(&mut Scenes, &Mask) -> bool) {
        let variable = self.variable;
        match &self.over {
            Over::Members => {
                for &i in self.members.iter() {
                    scene.variables[variable] = Index::All(i);
                    if !go_on(scene, &EVERYBODY) {
                        return;
                    }
                }
            }
            Over::Pairs => {
                for (k, &i) in self.members.iter().enumerate() {
                    scene.variables[variable] = Index::All(i);
                    for &j in &self.members[k + 1..] {
                        scene.variables[variable + 1] = Index::All(j);
                        if !go_on(scene, &EVERYBODY) {
                            return;
                        }
                    }
                }
            }
            Over::Edges(edges) => {
                for (k, &[i, j]) in edges.iter().enumerate() {
                    scene.variables[variable..variable + 3].copy_from_slice(&[i, j, k].map(Index::All));
                    if !go_on(scene, &EVERYBODY) {
                        return;
                    }
                }
            }
            Over::Nearest { count, to } => {
                let to = scene.index(*to);
                let mut last = [Some((f64::NEG_INFINITY, 0)); LANES];
                for _ in 0..*count {
                    let mut nearest = [0; LANES];
                    for (lane, last) in last.iter_mut().enumerate() {
                        let place = |agent: usize| at(&scene.agents.position[agent], lane);
                        *last = last.and_then(|last| self.next_nearest(place, to.at(lane), last));
                        nearest[lane] = last.map_or(to.at(lane), |(_, k)| self.members[k]);
                    }
                    scene.variables[variable] = Index::Each(nearest);
                    let there = last.map(|last| last.is_some());
                    if !some(there) || !go_on(scene, &there) {
                        return;
                    }
                }
            }
        }
    }
}

impl Fold {
    fn eval_lanes(self, each: &Each, body: &Number, scene: &mut Scenes) -> Lanes {
        let all = scene.active;
        let mut count = ZEROS;
        let mut total = match self {
            Fold::Sum | Fold::Mean => ZEROS,
            Fold::Min => [f64::INFINITY; LANES],
            Fold::Max => [f64::NEG_INFINITY; LANES],
        };
        each.visit_lanes(scene, |scene| {
            let value = body.eval_lanes(scene);
            let next = match self {
                Fold::Sum | Fold::Mean => map2(&total, &value, |a, b| a + b),
                Fold::Min => map2(&total, &value, maths::lesser),
                Fold::Max => map2(&total, &value, maths::greater),
            };
            total = if scene.active == all { next } else { select(&scene.active, &next, &total) };
            if matches!(self, Fold::Mean) {
                count = select(&scene.active, &map(&count, |count| count + 1.0), &count);
            }
            NOBODY
        });
        match self {
            Fold::Mean => map2(&total, &count, |sum, count| if count > 0.0 { sum / count } else { sum }),
            _ => total,
        }
    }
}
