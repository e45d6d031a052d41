//! Index sets and what is folded over them.

use std::sync::Arc;

use super::{Number, Scene, Truth, Who};
use crate::maths::{self, Vec2};

/// What index variables run over.
#[derive(Clone, Debug)]
pub(crate) struct Each {
    pub members: Arc<[usize]>,
    pub over: Over,
    /// The first of the variables that are bound.
    pub variable: usize,
    pub filter: Option<Truth>,
}

#[derive(Clone, Debug)]
pub(crate) enum Over {
    /// One member after the other.
    Members,
    /// Each pair of members, the one that is listed first before the other; binds two variables.
    Pairs,
    /// Binds two variables, and a third to the number of the edge.
    Edges(Arc<[[usize; 2]]>),
    /// The members nearest to an agent.
    Nearest { count: usize, to: Who },
}

/// How the numbers of a reduction are put together.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Fold {
    Sum,
    Mean,
    Min,
    Max,
}

impl Each {
    /// Visits the members for which the filter holds, as long as `visit` gives true.
    pub fn visit(&self, scene: &mut Scene, mut visit: impl FnMut(&mut Scene) -> bool) {
        let mut go_on = |scene: &mut Scene| {
            let kept = self.filter.as_ref().is_none_or(|filter| filter.eval(scene));
            !kept || visit(scene)
        };
        let variable = self.variable;
        match &self.over {
            Over::Members => {
                for &i in self.members.iter() {
                    scene.variables[variable] = i;
                    if !go_on(scene) {
                        return;
                    }
                }
            }
            Over::Pairs => {
                for (k, &i) in self.members.iter().enumerate() {
                    scene.variables[variable] = i;
                    for &j in &self.members[k + 1..] {
                        scene.variables[variable + 1] = j;
                        if !go_on(scene) {
                            return;
                        }
                    }
                }
            }
            Over::Edges(edges) => {
                for (k, &[i, j]) in edges.iter().enumerate() {
                    scene.variables[variable..variable + 3].copy_from_slice(&[i, j, k]);
                    if !go_on(scene) {
                        return;
                    }
                }
            }
            Over::Nearest { count, to } => {
                let to = scene.agent(*to);
                let mut last = None;
                for _ in 0..*count {
                    let place = |agent: usize| scene.agents.position[agent];
                    last = self.next_nearest(place, to, last);
                    let Some((_, next)) = last else { return };
                    scene.variables[variable] = self.members[next];
                    if !go_on(scene) {
                        return;
                    }
                }
            }
        }
    }

    /// The member that follows `last` (the bits of its distance, and its place in the list) in the order of distance: the
    /// bits of numbers from 0 are in their order, and those of what is not a number come after infinity.
    pub(super) fn next_nearest(
        &self,
        place: impl Fn(usize) -> Vec2,
        to: usize,
        last: Option<(u64, usize)>,
    ) -> Option<(u64, usize)> {
        let others = self.members.iter().enumerate().filter(|(_, member)| **member != to);
        let away = |member: usize| maths::distance(place(member), place(to)).abs().to_bits();
        let ordered = others.map(|(k, &member)| (away(member), k));
        ordered.filter(|next| last.is_none_or(|last| *next > last)).min()
    }
}

impl Each {
    pub fn is_nearest(&self) -> bool {
        matches!(self.over, Over::Nearest { .. })
    }

    /// Adds the members for which the filter holds, which looks at no positions; of the nearest any, as many as
    /// there can be.
    pub fn list(&self, scene: &mut Scene, members: &mut Vec<usize>) {
        match &self.over {
            Over::Nearest { count, to } => {
                let to = scene.agent(*to);
                let kept = self.filter.as_ref().is_none_or(|filter| filter.eval(scene));
                let others = self.members.iter().copied().filter(|member| kept && *member != to);
                members.extend(others.take(*count));
            }
            _ => self.visit(scene, |scene| {
                members.push(scene.variables[self.variable]);
                true
            }),
        }
    }
}

impl Fold {
    pub fn eval(self, each: &Each, body: &Number, scene: &mut Scene) -> f64 {
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
