//! How many numbers a learner sees and gives.

use crate::constant::{Constant, Constants};
use crate::plan::{AgentId, AgentRef, Each, Expr, GroupId, IndexSet, VarId, World};

/// Entries of the state and of the action: of the learner, or of each member where one policy is shared (then the
/// action is the velocity of that member). `None` if a filter is too clever to be seen through.
pub fn sizes(world: &World, constants: &Constants) -> Option<(usize, usize)> {
    let mut state = 0;
    for observation in &world.observe {
        let times = match &observation.over {
            None => 1,
            Some(each) => kept(world, each, constants)?,
        };
        state += times * if observation.vector { 2 } else { 1 };
    }
    let action = if world.shared.is_some() { 2 } else { 2 * world.learned().len() };
    Some((state, action))
}

/// Members of a set that a filter keeps.
fn kept(world: &World, each: &Each, constants: &Constants) -> Option<usize> {
    let Some(filter) = &each.filter else { return count(world, &each.set) };
    let members = members(world, &each.set)?;
    let kept = members.into_iter().map(|agent| {
        let filter = with(filter, each.var.id, agent, world)?;
        match constants.value(&filter)? {
            Constant::Truth(truth) => Some(usize::from(truth)),
            _ => None,
        }
    });
    kept.sum()
}

fn count(world: &World, set: &IndexSet) -> Option<usize> {
    match set {
        IndexSet::Nearest { count: nearest, among, .. } => Some(count(world, among)?.min(*nearest)),
        set => Some(members(world, set)?.len()),
    }
}

fn members(world: &World, set: &IndexSet) -> Option<Vec<AgentId>> {
    let of = |wanted: &dyn Fn(GroupId) -> bool| {
        let groups = (0..world.groups.len()).filter(|group| wanted(*group));
        groups
            .flat_map(|group| {
                let first = world.first_of(group);
                first..first + world.groups.get(group).map_or(0, |group| group.size)
            })
            .collect()
    };
    let obstacle = |group: GroupId| world.groups.get(group).is_some_and(|group| group.solid.is_some());
    match set {
        IndexSet::All => Some(of(&|group| !obstacle(group))),
        IndexSet::Obstacles => Some(of(&obstacle)),
        IndexSet::Group(group) => Some(of(&|other| other == *group)),
        IndexSet::Pairs(_) | IndexSet::Edges(_) | IndexSet::Nearest { .. } => None,
    }
}

/// An expression with a variable replaced by an agent, as far as agents are compared and numbered.
fn with(expr: &Expr, var: VarId, agent: AgentId, world: &World) -> Option<Expr> {
    let this = |expr: &Expr| with(expr, var, agent, world).map(Box::new);
    let known = |of: &AgentRef| match of {
        AgentRef::Fixed(id) => Some(*id),
        AgentRef::Var(id) if *id == var => Some(agent),
        _ => None,
    };
    Some(match expr {
        Expr::Same(a, b) => Expr::Truth(known(a)? == known(b)?),
        Expr::MemberNumber(of) => {
            let id = known(of)?;
            let firsts = (0..world.groups.len()).map(|group| world.first_of(group));
            Expr::Number((id - firsts.filter(|first| *first <= id).max()? + 1) as f64)
        }
        Expr::Unary(op, a) => Expr::Unary(*op, this(a)?),
        Expr::Binary(op, a, b) => Expr::Binary(*op, this(a)?, this(b)?),
        other => other.clone(),
    })
}
