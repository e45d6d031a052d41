//! Index sets and what is folded over them, in lanes.

use super::Scenes;
use super::scene::Index;
use crate::lanes::{EVERYBODY, LANES, Lanes, Mask, NOBODY, ZEROS, and, at, map, map2, not, select, some};
use crate::maths;
use crate::program::Number;
use crate::program::each::{Each, Fold, Over};

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
                let mut last = [None; LANES];
                for turn in 0..*count {
                    let mut nearest = [0; LANES];
                    for (lane, last) in last.iter_mut().enumerate() {
                        let place = |agent: usize| at(&scene.agents.position[agent], lane);
                        if turn == 0 || last.is_some() {
                            *last = self.next_nearest(place, to.at(lane), *last);
                        }
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
    pub(in crate::program) fn eval_lanes(self, each: &Each, body: &Number, scene: &mut Scenes) -> Lanes {
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
