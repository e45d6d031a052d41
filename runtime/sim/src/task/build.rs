//! From the Plan to the Task.

use std::ops::Range;

use mpgx_lang::plan::{self, Constraint, Control, Expr, MotionOutput, Place, Plan, Slots, World};

use super::{Agent, End, Observed, Task, Term};
use crate::body::Body;
use crate::error::{Flaw, SimError};
use crate::program::{Compiler, Layout, Number, Program, Scope, Shape, Truth, Vector};
use crate::script::Script;

/// Agents are part of 16-bit addresses of random numbers.
const MOST_AGENTS: usize = 1 << 16;
/// The index of an end is reported in 16 bits.
const MOST_ENDS: usize = 1 << 16;

impl Task {
    /// Checks and compiles a world of a plan.
    ///
    /// # Errors
    /// Whatever could go wrong later: numbers out of range, indices of things that do not exist, unknown or
    /// missing settings, expressions of the wrong kind or in the wrong place.
    pub fn new(plan: &Plan, world: &World) -> Result<Task, SimError> {
        check_numbers(world)?;
        let layout = Layout { params: &plan.params, world, groups: groups(world), names: names(world) };
        let mut task = Task {
            dt_s: world.dt_s,
            horizon: world.horizon,
            safety_m: world.safety_m,
            agents: Vec::new(),
            learned: world.learned(),
            scripts: Vec::new(),
            shapes: world.formations.iter().map(|f| shape(&layout, f)).collect::<Result<_, _>>()?,
            require: Vec::new(),
            observed: Vec::new(),
            terms: Vec::new(),
            ends: Vec::new(),
        };
        task.add_agents(&layout)?;
        for (k, expr) in world.require.iter().enumerate() {
            let requirement = Compiler::new(&layout, Scope::default()).truth(expr);
            let place = task.agents.last().map(|agent| &agent.at);
            task.require.push(requirement.map_err(|flaw| SimError::Expression {
                what: format!("requirement {}", k + 1),
                flaw,
                at: place.cloned().unwrap_or_default(),
            })?);
        }
        for observation in &world.observe {
            task.observed.extend(observed(&layout, observation).map_err(|flaw| SimError::Expression {
                what: format!("observation `{}`", observation.text),
                flaw,
                at: observation.at.clone(),
            })?);
        }
        for term in &world.reward {
            let value = Compiler::new(&layout, Scope::default()).number(&term.value);
            let what = format!("reward term `{}`", term.name);
            let value = value.map_err(|flaw| SimError::Expression { what, flaw, at: term.at.clone() })?;
            task.terms.push(Term { name: term.name.clone(), at: term.at.clone(), value });
        }
        for end in &world.ends {
            task.ends.push(compile_end(&layout, end).map_err(|flaw| SimError::Expression {
                what: format!("end `{}`", end.name),
                flaw,
                at: end.at.clone(),
            })?);
        }
        Ok(task)
    }

    fn add_agents(&mut self, layout: &Layout) -> Result<(), SimError> {
        let world = layout.world;
        let everyone = vec![true; layout.names.len()];
        let mut placed = vec![false; layout.names.len()];
        let mut memory = 0;
        for (group, agents) in world.groups.iter().zip(&layout.groups) {
            let Control::Motion(motion) = &group.control else { continue };
            let positions = matches!(motion.output, MotionOutput::Position(_));
            for agent in agents.clone() {
                let known = if positions { &placed } else { &everyone };
                let script = Script::new(layout, motion, agent, memory, known);
                let script = script.map_err(|flaw| SimError::Expression {
                    what: format!("motion `{}` of `{}`", motion.name, group.name),
                    flaw,
                    at: group.at.clone(),
                })?;
                memory += script.memory();
                self.scripts.push(script);
                placed[agent] = positions;
            }
        }
        for (group, agents) in world.groups.iter().zip(&layout.groups) {
            let body = Body::new(&group.body, self.dt_s, &group.at)?;
            for agent in agents.clone() {
                let start = match (&group.start, placed[agent]) {
                    (_, true) if body.has_heading() => {
                        return Err(SimError::PositionsForBody {
                            group: group.name.clone(),
                            body: group.body.name.clone(),
                            at: group.at.clone(),
                        });
                    }
                    (_, true) => None,
                    (Some(start), false) => Some(start_of(layout, group, start, agent, &placed)?),
                    (None, false) => {
                        return Err(SimError::NoStart { group: group.name.clone(), at: group.at.clone() });
                    }
                };
                placed[agent] = true;
                self.agents.push(Agent {
                    name: layout.names[agent].clone(),
                    group: group.name.clone(),
                    at: group.at.clone(),
                    body,
                    arena: group.arena,
                    speed_mps: group.speed_mps,
                    start,
                });
            }
        }
        Ok(())
    }
}

fn check_numbers(world: &World) -> Result<(), SimError> {
    let out_of_range = |what: &str, value: f64, must: &'static str| SimError::OutOfRange {
        what: what.into(),
        value,
        must,
        at: Place::default(),
    };
    if !(world.dt_s.is_finite() && world.dt_s > 0.0) {
        return Err(out_of_range("the time step", world.dt_s, "a finite time above 0 s"));
    }
    if !(world.safety_m.is_finite() && world.safety_m >= 0.0) {
        return Err(out_of_range("the safety distance", world.safety_m, "a finite length, not negative"));
    }
    if world.horizon == 0 {
        return Err(out_of_range("the horizon", 0.0, "at least 1 step"));
    }
    let agents = world.groups.iter().try_fold(0usize, |sum, group| sum.checked_add(group.size));
    if agents.is_none_or(|agents| agents > MOST_AGENTS) {
        let agents = agents.map_or(f64::INFINITY, |agents| agents as f64);
        return Err(out_of_range("the number of agents", agents, "at most 65536"));
    }
    if world.ends.len() > MOST_ENDS {
        return Err(out_of_range("the number of ends", world.ends.len() as f64, "at most 65536"));
    }
    for group in &world.groups {
        let mut ranges = vec![("speed", group.speed_mps)];
        ranges.extend(group.arena.iter().flat_map(|arena| [("arena x", arena.x_m), ("arena y", arena.y_m)]));
        for (what, (low, high)) in ranges {
            if !((high - low).is_finite() && low <= high) {
                let what = format!("{what} of `{}`", group.name);
                return Err(SimError::BadRange { what, low, high, at: group.at.clone() });
            }
        }
    }
    Ok(())
}

/// The agents of each group.
fn groups(world: &World) -> Vec<Range<usize>> {
    let mut first = 0;
    let range = |group: &plan::Group| {
        let range = first..first + group.size;
        first = range.end;
        range
    };
    world.groups.iter().map(range).collect()
}

/// The name of each agent.
fn names(world: &World) -> Vec<String> {
    let mut names = Vec::new();
    for group in &world.groups {
        match group.size {
            1 => names.push(group.name.clone()),
            size => names.extend((1..=size).map(|member| format!("{}[{member}]", group.name))),
        }
    }
    names
}

fn shape(layout: &Layout, formation: &plan::Formation) -> Result<Shape, SimError> {
    let missing = |what, id| SimError::BadFormation {
        formation: formation.name.clone(),
        what,
        id,
        at: formation.at.clone(),
    };
    let members =
        layout.groups.get(formation.group).ok_or_else(|| missing("group", formation.group))?.clone();
    let about = formation.about.unwrap_or_default();
    if about >= layout.names.len() {
        return Err(missing("agent", about));
    }
    let count = members.len();
    let Constraint::Displacements { slots, .. } = &formation.constraint else {
        return Err(SimError::Expression {
            what: format!("formation `{}`", formation.name),
            flaw: Flaw::Unsupported { what: "distances" },
            at: formation.at.clone(),
        });
    };
    let exprs: Vec<&Expr> = match slots {
        Slots::List(list) => list.iter().collect(),
        Slots::Rule(rule) => vec![rule; count],
    };
    if exprs.len() != count {
        return Err(SimError::SlotsOfFormation {
            formation: formation.name.clone(),
            slots: exprs.len(),
            group: layout.world.groups[formation.group].name.clone(),
            members: count,
            at: formation.at.clone(),
        });
    }
    let displacement = |(k, expr): (usize, &&Expr)| {
        let scope = Scope { slot: Some((k + 1, count)), ..Scope::default() };
        Compiler::new(layout, scope).vector(expr).map_err(|flaw| SimError::Expression {
            what: format!("slot {} of formation `{}`", k + 1, formation.name),
            flaw,
            at: formation.at.clone(),
        })
    };
    let displacements = exprs.iter().enumerate().map(displacement).collect::<Result<_, _>>()?;
    Ok(Shape { about, first: members.start, displacements })
}

fn start_of(
    layout: &Layout,
    group: &plan::Group,
    start: &Expr,
    agent: usize,
    placed: &[bool],
) -> Result<Vector, SimError> {
    let scope = Scope { member: Some(agent), draws: true, placed: Some(placed), ..Scope::default() };
    Compiler::new(layout, scope).vector(start).map_err(|flaw| SimError::Expression {
        what: format!("the start of `{}`", group.name),
        flaw,
        at: group.at.clone(),
    })
}

/// The entries of one observation: one, or one for each member of its set.
fn observed(layout: &Layout, observation: &plan::Observation) -> Result<Vec<Observed>, Flaw> {
    let entry = |scope, name| {
        let mut compiler = Compiler::new(layout, scope);
        let value = match observation.vector {
            true => Program::Vector(compiler.vector(&observation.value)?),
            false => Program::Number(compiler.number(&observation.value)?),
        };
        Ok(Observed { name, value })
    };
    let Some(each) = &observation.over else {
        return Ok(vec![entry(Scope::default(), observation.text.clone())?]);
    };
    let mut entries = Vec::new();
    for agent in Compiler::new(layout, Scope::default()).members(&each.set)? {
        let scope = Scope { bound: Some((each.var.id, agent)), ..Scope::default() };
        let kept = match &each.filter {
            None => true,
            Some(filter) => match Compiler::new(layout, scope).truth(filter)? {
                Truth::Constant(kept) => kept,
                _ => return Err(Flaw::ChangingFilter),
            },
        };
        if kept {
            entries.push(entry(scope, format!("{} ({})", observation.text, layout.names[agent]))?);
        }
    }
    Ok(entries)
}

fn compile_end(layout: &Layout, end: &plan::End) -> Result<End, Flaw> {
    let when = Compiler::new(layout, Scope::default()).truth(&end.when)?;
    let cost =
        end.cost.as_ref().map(|cost| Compiler::new(layout, Scope::default()).number(cost)).transpose()?;
    if let Some(Number::Constant(value)) = cost
        && !(value.is_finite() && value >= 0.0)
    {
        return Err(Flaw::BadCost { value });
    }
    Ok(End { name: end.name.clone(), at: end.at.clone(), when, cost })
}
