//! Where the optimum of a stationary reward lies, if it is made of distances.
//!
//! As a learned agent sees it, let the reward be Σ −aₖ |p − cₖ| + Σ bₖ |p − oₖ| with points that do not depend on p.
//! Each distance changes by at most the way that is gone (the triangle inequality). So if one a is larger than all
//! other weights together, its c is the only maximiser: whatever the b are for, p = c. And since far from everything
//! each metre further away changes the reward by Σ b − Σ a, more b than a makes running away pay without bound.
//! The paper's obstacle reward −|p_l − p_f| + k_o Σ |p_f − o_i| over M obstacles has a = 1 and Σ b = k_o M.
//!
//! Of any other reward nothing is said.

use std::collections::BTreeSet;

use super::Ground;
use super::bounds::term_bounds;
use super::eval::Eval;
use super::influence::at;
use super::scene::Scene;
use crate::plan::{
    AgentId, AgentRef, BinaryOp, Control, Expr, Function, GroupId, IndexSet, ParamId, Quantity, Reduction,
    Solid, UnaryOp, VarId,
};
use crate::problem::{Code, Problem};

/// How far weights may differ and count as equal.
const EQUAL: f64 = 1e-9;

/// The agent whose position is p, or one of a group that is not.
#[derive(Clone, Copy, PartialEq)]
enum Role {
    Me,
    Other(GroupId),
}

/// A weight on distances from `count` points.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Pull {
    /// Each, per metre; positive if it is better to be near.
    weight: f64,
    count: usize,
    term: usize,
}

struct Collector<'s> {
    scene: &'s Scene<'s>,
    me: AgentId,
    group: GroupId,
    /// What each group's movement depends on.
    movers: &'s [BTreeSet<GroupId>],
    roles: Vec<(VarId, Role)>,
    term: usize,
    pulls: Vec<Pull>,
    /// Terms that depend on p in another way.
    other: BTreeSet<usize>,
}

/// Says where the optimum is for one agent of each learned group.
/// Gives the terms of which it is said that running away pays.
pub fn optimum(
    scene: &Scene,
    endless: &Scene,
    movers: &[BTreeSet<GroupId>],
    ground: &mut Ground,
) -> BTreeSet<usize> {
    let mut fleeing = BTreeSet::new();
    // Each member rewarded for itself is another question.
    if scene.world.shared.as_ref().is_some_and(|shared| shared.rewarded.is_some()) {
        return fleeing;
    }
    for (group, it) in scene.world.groups.iter().enumerate() {
        if it.control != Control::Learned || it.size == 0 {
            continue;
        }
        let mut collector = Collector {
            scene,
            me: scene.world.first_of(group),
            group,
            movers,
            roles: Vec::new(),
            term: 0,
            pulls: Vec::new(),
            other: BTreeSet::new(),
        };
        for (term, it) in scene.world.reward.iter().enumerate() {
            collector.term = term;
            collector.walk(&it.value, 1.0, 1);
        }
        let Collector { pulls, other, .. } = collector;
        let total = |sign: f64| -> f64 {
            pulls.iter().map(|pull| (sign * pull.weight).max(0.0) * pull.count as f64).sum()
        };
        let (near, far) = (total(1.0), total(-1.0));
        let strongest = pulls.iter().map(|pull| pull.weight).fold(0.0, f64::max);
        let bounded_below = |term: &usize| {
            let value = scene.world.reward.get(*term).map(|term| term_bounds(endless, &term.value));
            value.is_some_and(|value| value.low.is_finite())
        };
        if far == 0.0 {
            continue;
        }
        if far > near * (1.0 + EQUAL) && other.iter().all(bounded_below) {
            fleeing.extend(pulls.iter().map(|pull| pull.term));
            ground.fleeing_pays(group, near, far, &pulls);
        } else if far <= (2.0 * strongest - near) * (1.0 + EQUAL) && other.is_empty() {
            ground.without_effect(group, near, far, &pulls);
        }
    }
    fleeing
}

impl Collector<'_> {
    fn role(&self, agent: &AgentRef) -> Option<Role> {
        match agent {
            AgentRef::Fixed(id) if *id == self.me => Some(Role::Me),
            AgentRef::Fixed(id) => self.scene.group_of(*id).map(Role::Other),
            AgentRef::Var(var) => self.roles.iter().rev().find(|(id, _)| id == var).map(|(_, role)| *role),
            AgentRef::Member => None,
        }
    }

    fn is_mine(&self, agent: &AgentRef) -> bool {
        match self.role(agent) {
            Some(Role::Me) | None => true,
            Some(Role::Other(group)) => {
                group != self.group
                    && self.movers.get(group).is_some_and(|movers| movers.contains(&self.group))
            }
        }
    }

    /// Whether the value of an expression depends on p.
    fn depends(&mut self, expr: &Expr) -> bool {
        match expr {
            Expr::Agent(_, agent) => self.is_mine(agent),
            Expr::Clearance(a, b) => self.is_mine(a) || self.is_mine(b),
            Expr::Slot(formation, _) => {
                let about = self.scene.world.formations.get(*formation).and_then(|it| it.about);
                about.is_none_or(|about| self.is_mine(&AgentRef::Fixed(about)))
            }
            Expr::Reduce { vars, over, .. } => {
                let Some(choices) = self.choices(over) else { return true };
                choices.into_iter().any(|(roles, _)| {
                    let outer = self.roles.len();
                    self.roles.extend(vars.iter().map(|var| var.id).zip(roles));
                    let depends = expr.parts().into_iter().any(|part| self.depends(part));
                    self.roles.truncate(outer);
                    depends
                })
            }
            _ => expr.parts().into_iter().any(|part| self.depends(part)),
        }
    }

    /// Who the variables of a set can be, and how often.
    fn choices(&self, set: &IndexSet) -> Option<Vec<(Vec<Role>, usize)>> {
        let groups = &self.scene.world.groups;
        let single = |group: GroupId| {
            let size = groups.get(group).map_or(0, |group| group.size);
            let mine = group == self.group;
            let me = mine.then(|| (vec![Role::Me], 1));
            let others = (vec![Role::Other(group)], size - usize::from(mine));
            me.into_iter().chain([others]).filter(|(_, count)| *count > 0)
        };
        let solid = |solid: bool| {
            let ids = (0..groups.len())
                .filter(move |id| groups.get(*id).is_some_and(|it| it.solid.is_some() == solid));
            ids.flat_map(single).collect::<Vec<_>>()
        };
        Some(match set {
            IndexSet::Group(group) => single(*group).collect(),
            IndexSet::All => solid(false),
            IndexSet::Obstacles => solid(true),
            IndexSet::Pairs(of) => {
                let of = self.choices(of)?;
                let mut pairs = Vec::new();
                for (k, (a, m)) in of.iter().enumerate() {
                    pairs.push(([a.as_slice(), a].concat(), m * m.saturating_sub(1) / 2));
                    pairs.extend(of.iter().skip(k + 1).map(|(b, n)| ([a.as_slice(), b].concat(), m * n)));
                }
                pairs.retain(|(_, count)| *count > 0);
                pairs
            }
            IndexSet::Edges(_) | IndexSet::Nearest { .. } => return None,
        })
    }

    fn constant(&mut self, expr: &Expr) -> Option<f64> {
        if self.depends(expr) {
            return None;
        }
        Eval::new(self.scene).number(expr).constant()
    }

    /// Adds what `factor` times an expression, `times` over, contributes.
    fn walk(&mut self, expr: &Expr, factor: f64, times: usize) {
        if !self.depends(expr) {
            return;
        }
        match expr {
            Expr::Unary(UnaryOp::Neg, a) => self.walk(a, -factor, times),
            Expr::Binary(BinaryOp::Add, a, b) => {
                self.walk(a, factor, times);
                self.walk(b, factor, times);
            }
            Expr::Binary(BinaryOp::Sub, a, b) => {
                self.walk(a, factor, times);
                self.walk(b, -factor, times);
            }
            Expr::Binary(BinaryOp::Mul, a, b) => match (self.constant(a), self.constant(b)) {
                (Some(a), _) => self.walk(b, factor * a, times),
                (_, Some(b)) => self.walk(a, factor * b, times),
                _ => self.opaque(),
            },
            Expr::Binary(BinaryOp::Div, a, b) => match self.constant(b).filter(|b| *b != 0.0) {
                Some(b) => self.walk(a, factor / b, times),
                None => self.opaque(),
            },
            Expr::Call(Function::Norm, args) => {
                match args.first().and_then(|v| self.slope(v)).filter(|slope| *slope != 0.0) {
                    Some(slope) => self.pull(-factor * slope.abs(), times),
                    None => self.opaque(),
                }
            }
            Expr::Clearance(a, b) => self.clearance(a, b, factor, times),
            Expr::Reduce { op: Reduction::Sum | Reduction::Mean, .. } => self.fold(expr, factor, times),
            _ => self.opaque(),
        }
    }

    /// The term depends on p in another way.
    fn opaque(&mut self) {
        self.other.insert(self.term);
    }

    fn pull(&mut self, weight: f64, count: usize) {
        self.pulls.push(Pull { weight, count, term: self.term });
    }

    fn clearance(&mut self, a: &AgentRef, b: &AgentRef, factor: f64, times: usize) {
        let other = match (self.role(a), self.role(b)) {
            (Some(Role::Me), Some(Role::Other(other))) | (Some(Role::Other(other)), Some(Role::Me)) => other,
            _ => return self.opaque(),
        };
        let solid = self.scene.world.groups.get(other).and_then(|group| group.solid.as_ref());
        let round = matches!(solid, None | Some(Solid::Disc { .. }));
        match self.is_point(other) && (round || factor > 0.0) {
            true => self.pull(-factor, times),
            false => self.opaque(),
        }
    }

    /// Whether where a group is can be taken as given.
    fn is_point(&self, group: GroupId) -> bool {
        let learned = self.scene.world.groups.get(group).is_none_or(|it| it.control == Control::Learned);
        !learned && !self.movers.get(group).is_some_and(|movers| movers.contains(&self.group))
    }

    /// A sum or a mean.
    fn fold(&mut self, reduction: &Expr, factor: f64, times: usize) {
        let Expr::Reduce { op, vars, over, filter, body } = reduction else { return self.opaque() };
        let bound = |roles: Vec<Role>| vars.iter().map(|var| var.id).zip(roles).collect::<Vec<_>>();
        let Some(choices) = self.choices(over) else { return self.opaque() };
        let mut kept = Vec::new();
        for (roles, count) in choices {
            let outer = self.roles.len();
            self.roles.extend(bound(roles.clone()));
            let keeps = filter.as_ref().map_or(Some(true), |filter| self.decided(filter));
            self.roles.truncate(outer);
            match keeps {
                Some(true) => kept.push((roles, count)),
                Some(false) => {}
                None => return self.opaque(),
            }
        }
        let total: usize = kept.iter().map(|(_, count)| count).sum();
        let factor = if *op == Reduction::Mean { factor / total.max(1) as f64 } else { factor };
        for (roles, count) in kept {
            let outer = self.roles.len();
            self.roles.extend(bound(roles));
            self.walk(body, factor, times * count);
            self.roles.truncate(outer);
        }
    }

    /// A filter that only asks who is who.
    fn decided(&self, filter: &Expr) -> Option<bool> {
        match filter {
            Expr::Truth(truth) => Some(*truth),
            Expr::Unary(UnaryOp::Not, a) => self.decided(a).map(|holds| !holds),
            Expr::Binary(BinaryOp::And, a, b) => Some(self.decided(a)? && self.decided(b)?),
            Expr::Binary(BinaryOp::Or, a, b) => Some(self.decided(a)? || self.decided(b)?),
            Expr::Same(a, b) => match (self.role(a)?, self.role(b)?) {
                (Role::Me, Role::Me) => Some(true),
                (Role::Me, _) | (_, Role::Me) => Some(false),
                (Role::Other(a), Role::Other(b)) if a != b => Some(false),
                _ => None,
            },
            _ => None,
        }
    }

    /// k, if a vector is k p plus something that is given.
    fn slope(&mut self, vector: &Expr) -> Option<f64> {
        if !self.depends(vector) {
            return if self.given(vector) { Some(0.0) } else { None };
        }
        match vector {
            Expr::Agent(Quantity::Position, agent) if self.role(agent) == Some(Role::Me) => Some(1.0),
            Expr::Unary(UnaryOp::Neg, a) => self.slope(a).map(|slope| -slope),
            Expr::Binary(BinaryOp::Add, a, b) => Some(self.slope(a)? + self.slope(b)?),
            Expr::Binary(BinaryOp::Sub, a, b) => Some(self.slope(a)? - self.slope(b)?),
            Expr::Binary(BinaryOp::Mul, a, b) => match (self.constant(a), self.constant(b)) {
                (Some(factor), _) => Some(factor * self.slope(b)?),
                (_, Some(factor)) => Some(factor * self.slope(a)?),
                _ => None,
            },
            _ => None,
        }
    }

    /// Whether no learned agent has a say in a value.
    fn given(&self, expr: &Expr) -> bool {
        match expr {
            Expr::Agent(_, agent) => match self.role(agent) {
                Some(Role::Other(group)) => self.is_point(group),
                _ => false,
            },
            Expr::Slot(formation, _) => {
                let about = self.scene.world.formations.get(*formation).and_then(|it| it.about);
                about.and_then(|about| self.scene.group_of(about)).is_some_and(|group| self.is_point(group))
            }
            Expr::Reduce { .. } => false,
            _ => expr.parts().into_iter().all(|part| self.given(part)),
        }
    }
}

impl Ground<'_> {
    fn without_effect(&mut self, group: GroupId, near: f64, far: f64, pulls: &[Pull]) {
        let name = self.group_name(group).to_owned();
        let message = format!("the reward for distance cannot make `{name}` keep away from anything");
        let problem = Problem::warning(&AVOIDANCE_WITHOUT_EFFECT, message);
        let problem = self.weights(problem, near, far, pulls);
        let best = match far < near * (1.0 - EQUAL) {
            true => "it is best at that place alone, whatever is in the way",
            false => "no place is better than that one, whatever is in the way",
        };
        let note = format!(
            "a metre away from the place it is drawn to costs {} and gains at most {}: {best}",
            shown(near),
            shown(far)
        );
        self.problems.push(problem.note(note).help(self.nearby(group)));
    }

    fn fleeing_pays(&mut self, group: GroupId, near: f64, far: f64, pulls: &[Pull]) {
        let name = self.group_name(group).to_owned();
        let problem = Problem::warning(&FLEEING_PAYS, format!("running away pays for `{name}`"));
        let problem = self.weights(problem, near, far, pulls);
        let bound = match self.plan.world.groups.get(group).is_some_and(|group| group.arena.is_some()) {
            true => "only its arena bounds that",
            false => "nothing bounds that",
        };
        let note =
            format!("far from everything, each metre further away gains {}; {bound}", shown(far - near));
        self.problems.push(problem.note(note).help(self.nearby(group)));
    }

    /// Shows the terms that reward distance, those that reward nearness, and the parameter that decides.
    fn weights(&self, problem: Problem, near: f64, far: f64, pulls: &[Pull]) -> Problem {
        let terms = |sign: f64| -> BTreeSet<usize> {
            pulls.iter().filter(|pull| sign * pull.weight > 0.0).map(|pull| pull.term).collect()
        };
        let (attracting, repelling) = (terms(1.0), terms(-1.0));
        let mut problem = problem;
        for term in &repelling {
            let both =
                if attracting.contains(term) { format!(", against {}", shown(near)) } else { String::new() };
            let pulls = pulls.iter().filter(|pull| pull.term == *term && pull.weight < 0.0);
            let each = pulls.map(|pull| match pull.count {
                1 => shown(-pull.weight),
                count => format!("{count} × {}", shown(-pull.weight)),
            });
            let sum = each.collect::<Vec<_>>().join(" + ");
            let total = if repelling.len() > 1 || sum == shown(far) {
                sum
            } else {
                format!("{sum} = {}", shown(far))
            };
            let label = format!("rewards distance: {total} for each metre{both}");
            problem = at(problem, self.term_span(*term), label);
        }
        for term in attracting.difference(&repelling) {
            if let Some(span) = self.term_span(*term) {
                problem = problem.with(span, format!("rewards nearness: {} for each metre", shown(near)));
            }
        }
        let mut params = BTreeSet::new();
        for term in &repelling {
            self.plan
                .world
                .reward
                .get(*term)
                .into_iter()
                .for_each(|term| params_in(&term.value, &mut params));
        }
        if let (Some(id), 1) = (params.first(), params.len())
            && let (Some(param), Some(hir)) = (self.plan.params.get(*id), self.hir.params.get(*id))
        {
            problem = problem.with(hir.span, format!("`{}` is {}", param.name, shown(param.value)));
        }
        problem
    }

    fn nearby(&self, group: GroupId) -> String {
        let name = self.group_name(group);
        let groups = &self.plan.world.groups;
        let (who, all) = match groups.get(group).is_some_and(|group| group.size > 1) {
            true => ("i".to_owned(), format!("sum(i in {name}) ")),
            false => (name.to_owned(), String::new()),
        };
        let example = match groups.iter().any(|group| group.solid.is_some()) {
            true => format!("`-k * {all}obstacle_range({who}, reach = 0.3 m)` of std.reward"),
            false => format!("`-k * {all}max(0 m, 0.3 m - |p[{who}] - p[other]|)` for each to be avoided"),
        };
        format!("reward distance only where it matters, for example {example}")
    }
}

fn params_in(expr: &Expr, found: &mut BTreeSet<ParamId>) {
    if let Expr::Param(id) = expr {
        found.insert(*id);
    }
    expr.parts().into_iter().for_each(|part| params_in(part, found));
}

/// Rounded, for people.
fn shown(value: f64) -> String {
    ((value * 1e6).round() / 1e6).to_string()
}

pub const AVOIDANCE_WITHOUT_EFFECT: Code = Code {
    name: "avoidance-without-effect",
    explain: "\
A reward that grows with the distance from obstacles is too weak to matter. Going x metres away from the leader loses x,
and brings at most x more distance from each obstacle. So with M obstacles and k M < 1

    reward { gap = -|p[leader] - p[follower]|, avoid = k * sum(o in obstacles) |p[follower] - p[o]| }

is highest with the follower exactly on the leader, also where that is inside an obstacle. With k M > 1 running away
pays instead (`fleeing-pays`). No k makes this reward right; reward distance only near obstacles:

    avoid = -k * sum(o in obstacles) max(0 m, 0.25 m - |p[follower] - p[o]|)",
};

pub const FLEEING_PAYS: Code = Code {
    name: "fleeing-pays",
    explain: "\
Far from everything, going a metre further away loses less nearness to the leader than it gains in distance from others.
With M obstacles and k M > 1

    reward { gap = -|p[leader] - p[follower]|, avoid = k * sum(o in obstacles) |p[follower] - p[o]| }

is the higher the further the follower runs; only the arena bounds it. With k M < 1 the term has no effect at all
(`avoidance-without-effect`). Reward distance only near obstacles:

    avoid = -k * sum(o in obstacles) max(0 m, 0.25 m - |p[follower] - p[o]|)",
};
