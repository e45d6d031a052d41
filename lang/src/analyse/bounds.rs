//! What rewards can be: of each term, of a step, and of an episode.

use super::eval::{Eval, Who};
use super::interval::Interval;
use super::scene::{Mode, Scene};
use crate::plan::{Expr, World};

/// Bounds in SI units.
#[derive(Clone, Debug, PartialEq)]
pub struct Bounds {
    /// Of each term of the reward.
    pub terms: Vec<Interval>,
    /// What the ends that hold cost together in one step.
    pub costs: Interval,
    /// The terms less the costs.
    pub reward: Interval,
    /// Sum of the rewards of an episode, not discounted.
    pub total: Interval,
}

pub fn bounds(scene: &Scene) -> Bounds {
    let world = scene.world;
    let terms: Vec<Interval> = world.reward.iter().map(|term| term_bounds(scene, &term.value)).collect();
    let gained = terms.iter().fold(Interval::ZERO, |sum, term| sum + *term);
    let mut costs = Interval::ZERO;
    let (mut can_end, mut reward) = (false, gained);
    for end in &world.ends {
        let when = Eval::new(scene).truth(&end.when);
        can_end |= when.can_hold;
        let Some(cost) = end.cost.as_ref().filter(|_| when.can_hold) else { continue };
        let cost = Eval::new(scene).number(cost);
        let paid = if when.certain() { cost } else { cost.hull(Interval::ZERO) };
        costs = costs + paid;
        reward = reward - paid;
    }
    let steps = world.horizon;
    let total = match scene.mode {
        Mode::Evaluation => reward.summed(steps, steps),
        // Ends stop the episode, so their costs are paid once.
        _ => {
            let least = if can_end { 1.min(steps) } else { steps };
            gained.summed(least, steps) - costs
        }
    };
    Bounds { terms, costs, reward: of_team(world, reward), total: of_team(world, total) }
}

/// Bounds of a term (of any member, if each is rewarded for itself).
pub fn term_bounds(scene: &Scene, term: &Expr) -> Interval {
    of_member(scene).number(term)
}

/// Evaluates what is rewarded.
pub fn of_member<'s>(scene: &'s Scene<'s>) -> Eval<'s> {
    let eval = Eval::new(scene);
    match scene.world.shared.as_ref().and_then(|shared| Some((shared.group, shared.rewarded.as_ref()?))) {
        Some((group, var)) => eval.bind(var.id, Who::group(group)),
        None => eval,
    }
}

/// The mean over members, and sums in whatever order.
fn of_team(world: &World, reward: Interval) -> Interval {
    let group = world.shared.as_ref().filter(|shared| shared.rewarded.is_some()).map(|shared| shared.group);
    let size = group.and_then(|group| world.groups.get(group)).map_or(1, |group| group.size);
    let slack = 4.0 * f64::EPSILON * (size + world.horizon) as f64 * reward.magnitude();
    let wide = if slack.is_finite() { reward.wider(slack) } else { reward };
    let low = if reward.low >= 0.0 { wide.low.max(0.0) } else { wide.low };
    Interval::new(low, if reward.high <= 0.0 { wide.high.min(0.0) } else { wide.high })
}
