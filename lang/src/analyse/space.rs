//! Whether there is room and speed enough for what is asked.

use super::Ground;
use super::eval::{Eval, Who};
use super::formations::agent_name;
use super::influence::at;
use super::interval::Interval;
use super::scene::{Scene, way};
use super::value::Plane;
use crate::ast::Span;
use crate::plan::{AgentId, AgentRef, Constraint, Control, Expr, GroupId, IndexSet, MotionOutput, Slots};
use crate::problem::{Code, Problem, Severity};

/// What is only a matter of rounding, m.
const ROUNDING_M: f64 = 1e-9;
/// Agents and places that are looked at one by one, at most.
const LOOKED_AT: usize = 300;

/// Checks a world; `context` is the evaluation or stage whose world it is.
pub fn space(scene: &Scene, context: Option<(&str, Span)>, ground: &mut Ground) {
    let mut found = Vec::new();
    for id in 0..scene.world.formations.len() {
        places_in_arena(scene, id, ground, &mut found);
        leader_speed(scene, id, ground, &mut found);
        time_to_arrive(scene, id, ground, &mut found);
    }
    fixed_starts(scene, ground, &mut found);
    starts_in_obstacles(scene, ground, &mut found);
    requirements(scene, ground, &mut found);
    long_steps(scene, ground, &mut found);
    for problem in found {
        ground.tell(match context {
            Some((name, span)) => problem.with(span, format!("in `{name}`")),
            None => problem,
        });
    }
}

/// Where each member's place is seen from `about`, each with the member's agent.
fn displacements(scene: &Scene, formation: usize) -> Vec<(AgentId, Plane)> {
    let Some(it) = scene.world.formations.get(formation) else { return Vec::new() };
    let Constraint::Displacements { slots, .. } = &it.constraint else { return Vec::new() };
    let size = scene.world.groups.get(it.group).map_or(0, |group| group.size);
    let count = match slots {
        Slots::List(all) => all.len().min(size),
        Slots::Rule(_) => size,
    };
    let first = scene.world.first_of(it.group);
    let displacement = |k| Eval::new(scene).displacement(formation, &AgentRef::Fixed(k));
    (first..first + count.min(LOOKED_AT)).map(|agent| (agent, displacement(agent))).collect()
}

/// How far a box reaches beyond another, and whether it ever lies within.
fn beyond(part: Plane, whole: Plane) -> (f64, bool) {
    let axis = |part: Interval, whole: Interval| (whole.low - part.low).max(part.high - whole.high);
    let apart = |part: Interval, whole: Interval| {
        part.high < whole.low - ROUNDING_M || part.low > whole.high + ROUNDING_M
    };
    let never = apart(part.x, whole.x) || apart(part.y, whole.y);
    (axis(part.x, whole.x).max(axis(part.y, whole.y)), never)
}

fn places_in_arena(scene: &Scene, id: usize, ground: &Ground, found: &mut Vec<Problem>) {
    let Some(it) = scene.world.formations.get(id) else { return };
    let Some(arena) = scene.world.groups.get(it.group).and_then(|group| group.arena) else { return };
    let Some(about) = it.about.filter(|about| scene.group_of(*about) != Some(it.group)) else { return };
    let arena = Plane::new(Interval::new(arena.x_m.0, arena.x_m.1), Interval::new(arena.y_m.0, arena.y_m.1));
    let leader = Eval::new(scene).position(&AgentRef::Fixed(about));
    if !leader.is_finite() {
        return;
    }
    let reached = displacements(scene, id).into_iter().map(|(agent, displacement)| {
        let (out, never) = beyond(leader + displacement, arena);
        (agent, out, never)
    });
    // A place that is never inside is the worst.
    let worst =
        reached.max_by(|a, b| (a.2, a.1).partial_cmp(&(b.2, b.1)).unwrap_or(std::cmp::Ordering::Equal));
    let Some((agent, out, never)) = worst.filter(|(_, out, _)| *out > ROUNDING_M && out.is_finite()) else {
        return;
    };
    let place = format!("the place of `{}`", agent_name(scene.world, agent));
    let (name, about) = (ground.group_name(it.group), agent_name(scene.world, about));
    let problem = match never {
        true => Problem::error(&PLACE_OUTSIDE, format!("{place} is never inside the arena of `{name}`")),
        false => Problem::warning(
            &PLACE_OUTSIDE,
            format!("{place} can be {} m outside the arena of `{name}`", shown(out)),
        ),
    };
    let mut problem =
        at(problem, ground.formation_span(id), format!("wherever `{about}` goes, each place follows"));
    if let Some(span) = ground.arena_span(it.group) {
        problem = problem.with(span, "too small for that");
    }
    if let Some(span) = scene
        .group_of(it.about.unwrap_or(0))
        .and_then(|group| ground.arena_span(group).or(ground.group_span(group)))
    {
        let range = |side: Interval| format!("{} m .. {} m", shown(side.low), shown(side.high));
        problem = problem
            .with(span, format!("`{about}` can be anywhere in {} by {}", range(leader.x), range(leader.y)));
    }
    found.push(problem.help(format!(
        "enlarge the arena of `{name}` by {} m, keep `{about}` nearer to its middle, or make the formation smaller",
        shown(out)
    )));
}

fn leader_speed(scene: &Scene, id: usize, ground: &Ground, found: &mut Vec<Problem>) {
    let Some(it) = scene.world.formations.get(id) else { return };
    let Some(leader) = it.about.and_then(|about| scene.group_of(about)) else { return };
    let (Some(group), Some(own)) = (scene.world.groups.get(leader), scene.world.groups.get(it.group)) else {
        return;
    };
    let Control::Motion(motion) = &group.control else { return };
    if own.control != Control::Learned || !matches!(motion.output, MotionOutput::Velocity(_)) {
        return;
    }
    let Some(command) = scene.groups.get(leader).map(|known| known.asked) else { return };
    let speed = Interval::new(own.speed_mps.0, own.speed_mps.1);
    let slack = 1e-9 * command.x.magnitude().max(command.y.magnitude());
    let reach = speed.wider(slack);
    if !command.is_finite() || reach.covers(command.x) && reach.covers(command.y) {
        return;
    }
    let never = [command.x, command.y].iter().any(|axis| axis.low > reach.high || axis.high < reach.low);
    let (name, about) = (&own.name, &group.name);
    let message = match never {
        true => format!("`{name}` can never keep up with `{about}`"),
        false => format!("`{name}` is slower than `{about}`"),
    };
    let severity = if never { Severity::Error } else { Severity::Warning };
    let range = |axis: Interval| format!("{} m/s .. {} m/s", shown(axis.low), shown(axis.high));
    let problem = Problem { severity, ..Problem::error(&TOO_SLOW, message) };
    let label = format!("goes {} on each axis", range(speed));
    let mut problem = at(problem, ground.speed_span(it.group).or(ground.group_span(it.group)), label);
    let wider =
        if command.x.high - command.x.low >= command.y.high - command.y.low { command.x } else { command.y };
    if let Some(span) = ground.speed_span(leader).or(ground.group_span(leader)) {
        problem = problem.with(span, format!("goes {} on an axis", range(wider)));
    }
    found.push(problem.help(format!("let `{name}` be as fast as `{about}`, or slow `{about}` down")));
}

/// From the nearest start to the nearest place.
fn time_to_arrive(scene: &Scene, id: usize, ground: &Ground, found: &mut Vec<Problem>) {
    let Some(it) = scene.world.formations.get(id) else { return };
    let Some(group) = scene.world.groups.get(it.group).filter(|group| group.control == Control::Learned)
    else {
        return;
    };
    let (Some(about), Some(start)) = (it.about, scene.groups.get(it.group).map(|known| known.start)) else {
        return;
    };
    let leader = Eval::new(scene).position(&AgentRef::Fixed(about));
    let nearest = displacements(scene, id).into_iter().map(|(_, by)| (leader + by - start).length.low);
    let nearest = nearest.fold(0.0, f64::max);
    let farthest = way(group) * scene.world.dt_s * scene.world.horizon as f64;
    if nearest > farthest {
        let message = format!("`{}` cannot reach its place before the episode is over", group.name);
        let label = format!("starts at least {} m away from it", shown(nearest));
        let problem = at(Problem::warning(&TOO_SHORT, message), ground.group_span(it.group), label);
        let problem = match ground.hir.world.horizon.as_ref() {
            Some(horizon) => problem.with(horizon.span, format!("time for {} m at most", shown(farthest))),
            None => problem,
        };
        found.push(problem.help("let episodes be longer, or let it start nearer to its place"));
    }
}

/// Where an agent starts, if that is the same in every episode.
fn fixed_start(scene: &Scene, agent: AgentId) -> Option<(f64, f64)> {
    let group = scene.group_of(agent)?;
    let start = scene.world.groups.get(group)?.start.as_ref()?;
    let member = Some(Who { groups: vec![group], agent: Some(agent) });
    Eval { member, at_start: true, ..Eval::new(scene) }.vector(start).constant()
}

fn fixed_starts(scene: &Scene, ground: &Ground, found: &mut Vec<Problem>) {
    let world = scene.world;
    let agents = (0..world.agents().min(LOOKED_AT)).filter_map(|agent| {
        let group = scene
            .group_of(agent)
            .filter(|group| world.groups.get(*group).is_some_and(|it| it.solid.is_none()))?;
        Some((agent, group, fixed_start(scene, agent)?))
    });
    let agents: Vec<_> = agents.collect();
    for (k, (a, group, here)) in agents.iter().enumerate() {
        for (b, other, there) in agents.iter().skip(k + 1) {
            let radius = |group: &GroupId| world.groups.get(*group).map_or(0.0, |group| group.radius_m);
            let apart = (here.0 - there.0).hypot(here.1 - there.1) - radius(group) - radius(other);
            if apart >= world.safety_m * (1.0 - ROUNDING_M) {
                continue;
            }
            let (first, second) = (agent_name(world, *a), agent_name(world, *b));
            let message = format!("`{first}` and `{second}` collide where they start");
            let problem = Problem::warning(&START_COLLISION, message);
            let label = match apart > 0.0 {
                true => format!("only {} m from `{first}`, in every episode", shown(apart)),
                false => format!("in the same place as `{first}`, in every episode"),
            };
            let mut problem = at(problem, ground.start_span(*other).or(ground.group_span(*other)), label);
            if let Some(safety) = ground.hir.world.safety.as_ref() {
                problem = problem.with(safety.span, "the safety distance");
            }
            found.push(problem.help("let them start further apart, for example `start ~ near(F[i], 0.2 m)`"));
            return;
        }
    }
}

fn starts_in_obstacles(scene: &Scene, ground: &Ground, found: &mut Vec<Problem>) {
    let groups = &scene.world.groups;
    let asked = scene.world.require.iter().any(asks_for_obstacles);
    for (obstacle, solid) in groups.iter().enumerate().filter(|(_, group)| group.solid.is_some()) {
        for (id, agent) in groups.iter().enumerate().filter(|(_, group)| group.solid.is_none()) {
            let vars = vec![(0, Who::group(id)), (1, Who::group(obstacle))];
            let clearance = Expr::Clearance(AgentRef::Var(0), AgentRef::Var(1));
            let apart = Eval { vars, at_start: true, ..Eval::new(scene) }.number(&clearance);
            let never = apart.high < 0.0;
            // What hardly ever happens, or cannot be told, is not worth a word.
            if !never && (asked || apart.low >= 0.0 || !apart.is_finite()) {
                continue;
            }
            let (name, solid) = (&agent.name, &solid.name);
            let problem = match never {
                true => {
                    Problem::error(&START_IN_OBSTACLE, format!("`{name}` always starts inside `{solid}`"))
                }
                false => Problem::warning(&START_IN_OBSTACLE, format!("`{name}` can start inside `{solid}`")),
            };
            let span = ground.start_span(id).or(ground.group_span(id));
            let mut problem = at(problem, span, "where it starts");
            if let Some(span) = ground.group_span(obstacle) {
                problem = problem.with(span, "where it is");
            }
            found.push(problem.help(match never {
                true => format!("let `{name}` start elsewhere"),
                false => format!(
                    "let it start elsewhere, or draw again: \
                     `require all(i in {name}) all(o in {solid}) clearance(i, o) > 0 m`"
                ),
            }));
        }
    }
}

fn asks_for_obstacles(expr: &Expr) -> bool {
    let asks = match expr {
        Expr::Clearance(..) => true,
        Expr::Reduce { over, .. } => matches!(over, IndexSet::Obstacles),
        _ => false,
    };
    asks || expr.parts().into_iter().any(asks_for_obstacles)
}

fn requirements(scene: &Scene, ground: &Ground, found: &mut Vec<Problem>) {
    for (k, require) in scene.world.require.iter().enumerate() {
        let holds = Eval { at_start: true, ..Eval::new(scene) }.truth(require);
        if holds.can_hold {
            continue;
        }
        let problem = Problem::error(&NEVER_STARTS, "no episode can begin: this never holds");
        let span = ground.hir.world.require.get(k).map(|require| require.span);
        found.push(
            at(problem, span, "fails wherever the agents start").help("change it, or where they start"),
        );
    }
}

fn long_steps(scene: &Scene, ground: &Ground, found: &mut Vec<Problem>) {
    for (id, group) in scene.world.groups.iter().enumerate() {
        let Some(arena) = group.arena.filter(|_| group.control == Control::Learned) else { continue };
        let fast = group.speed_mps.1.max(-group.speed_mps.0);
        let narrow = (arena.x_m.1 - arena.x_m.0).min(arena.y_m.1 - arena.y_m.0);
        let step = fast * scene.world.dt_s;
        if step <= narrow {
            continue;
        }
        let message = format!("`{}` crosses its arena in one step", group.name);
        let label = format!("{} m wide, and a step can be {} m", shown(narrow), shown(step));
        let problem = at(Problem::warning(&LONG_STEP, message), ground.arena_span(id), label);
        let problem = match ground.hir.world.dt.as_ref() {
            Some(dt) => problem.with(dt.span, "the time step"),
            None => problem,
        };
        found.push(problem.help("choose a shorter time step, a lower speed or a larger arena"));
    }
}

fn shown(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}

pub const PLACE_OUTSIDE: Code = Code {
    name: "place-outside",
    explain: "\
A place of a formation lies outside the arena of the agents that should be there, always (an error) or while the leader is
at the edge of its own arena (a warning). An agent that does what it should leaves its arena.

    agent leader : point { arena = box(-1 m .. 1 m, -1 m .. 1 m) … }
    agents follower[3] : point { arena = box(-1 m .. 1 m, -1 m .. 1 m) … }     // wrong for `square(0.4 m)`
    agents follower[3] : point { arena = box(-2 m .. 2 m, -2 m .. 2 m) … }     // room for its places",
};

pub const TOO_SLOW: Code = Code {
    name: "too-slow",
    explain: "\
The velocity of a leader goes beyond the limits of those that should follow it, on an axis, always (an error) or
sometimes (a warning). They fall behind, however well they learn.

    agent leader : point { speed = -1 m/s .. 1 m/s, motion = random_velocity(1 m/s) … }
    agent follower : point { speed = -0.7 m/s .. 0.7 m/s, control = learned … }         // too slow

What counts is the motion clipped to the leader's own limits; motions that give positions are not looked at.",
};

pub const TOO_SHORT: Code = Code {
    name: "too-short",
    explain: "\
At top speed from its nearest start, an agent needs more time to its place in the formation than an episode has.

    world { dt = 0.1 s, horizon = 10 steps }        // one second: at 0.7 m/s less than a metre on each axis",
};

pub const START_COLLISION: Code = Code {
    name: "start-collision",
    explain: "\
Two agents start in every episode closer than the safety distance, so every episode begins with a collision. Often a group
has one fixed start for all its members.

    agents follower[3] : point { start = (0 m, 0 m) … }             // all three in one place
    agents follower[3] : point { start ~ near(F[i], 0.2 m) … }",
};

pub const START_IN_OBSTACLE: Code = Code {
    name: "start-in-obstacle",
    explain: "\
An agent starts inside an obstacle, always (an error), or because the region of its start and the obstacle overlap (a
warning). A `require` that keeps them apart draws starts again until it holds.",
};

pub const NEVER_STARTS: Code = Code {
    name: "never-starts",
    explain: "\
A `require` fails for all starts that can be drawn, so no episode can begin.

    agent a : point { start = (0 m, 0 m) … }
    agent b : point { start ~ near((0 m, 0 m), 0.2 m) … }
    require |p[a] - p[b]| > 0.5 m                   // never: at most 0.2 m",
};

pub const LONG_STEP: Code = Code {
    name: "long-step",
    explain: "\
In one time step an agent at full speed goes further than its arena is wide. Such a simulation is too coarse to tell
anything.

    world { dt = 10 s }                             // was 10 ms meant?",
};
