//! Programs over lanes: interpreted once for environments side by side.
//!
//! What only some environments would evaluate (a branch, the operand behind a short circuit, a member that a
//! filter lets pass) is evaluated for all if for any, and counts for those; random numbers are drawn for those
//! alone, in the order in which each would draw them by itself.

mod draw;
mod each;
mod scene;

pub(crate) use draw::ManyDraws;
pub(crate) use scene::{Crowd, Scenes, clearance};

use super::{Number, Program, Truth, Vector, element};
use crate::lanes::{
    LANES, Lanes, Mask, NOBODY, Plane, ZEROS, and, by_axis, by_number, each, map, map2, not, or,
    select_plane, some,
};
use crate::maths;

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
