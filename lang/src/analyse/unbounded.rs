//! Terms of the reward that grow without limit as agents run away.

use super::Ground;
use super::bounds::{bounds, term_bounds};
use super::influence::{at, movers};
use super::optimum::optimum;
use super::scene::{Mode, Scene};
use crate::plan::Control;
use crate::problem::{Code, Problem};

/// Looks at rewards of places as far away as one likes, if nothing keeps the agents near.
pub fn unbounded(training: &Scene, ground: &mut Ground) {
    let endless = Scene::new(training.plan, training.world, Mode::Endless);
    let said = optimum(training, &endless, &movers(training), ground);
    let grows = |scene: &Scene, term: usize| {
        let value = scene.world.reward.get(term).map(|term| term_bounds(scene, &term.value));
        value.is_some_and(|value| value.high == f64::INFINITY)
    };
    let terms = 0..training.world.reward.len();
    let growing: Vec<usize> =
        terms.filter(|term| grows(&endless, *term) && !grows(training, *term)).collect();
    // What one term gains, others may take back; then this does not show which wins.
    let against = bounds(&endless).terms.iter().any(|term| term.low == f64::NEG_INFINITY);
    if against {
        return;
    }
    for term in growing.into_iter().filter(|term| !said.contains(term)) {
        ground.unbounded(term);
    }
}

impl Ground<'_> {
    fn unbounded(&mut self, term: usize) {
        let message = format!("the term `{}` grows without limit", self.term_name(term));
        let problem = Problem::warning(&UNBOUNDED_REWARD, message);
        let mut problem = at(problem, self.term_span(term), "the further away, the more");
        let free = self.plan.world.groups.iter().position(|group| group.control == Control::Learned);
        if let Some(group) = free
            && let Some(span) = self.group_span(group)
        {
            let arena = self.plan.world.groups.get(group).is_some_and(|group| group.arena.is_some());
            problem = problem.with(span, if arena { "may leave its arena" } else { "has no arena" });
        }
        let name = self.learned().map_or("i", |group| self.group_name(group)).to_owned();
        self.problems.push(problem.help(format!(
            "bound the term, for example by `min(1 m, …)`, or end episodes outside an arena: \
             `end {{ lost when outside({name}) costs 1 m }}`"
        )));
    }
}

pub const UNBOUNDED_REWARD: Code = Code {
    name: "unbounded-reward",
    explain: "\
A term of the reward has no upper bound: agents that nothing keeps in an arena gain more and more by running away.

    reward { clear = |p[follower] - p[leader]| }                    // the further, the better
    reward { clear = min(1 m, |p[follower] - p[leader]|) }          // far enough is enough

An `arena` together with an `end` that asks for `outside` bounds it as well.",
};
