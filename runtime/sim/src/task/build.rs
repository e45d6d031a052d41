//! From the Plan to the Task.

use mpgx_lang::plan::{self, Control, Expr, MotionOutput, Place, Plan, Solid, World};

use super::formation::formation;
use super::{Agent, End, Randomised, Task, Term};
use crate::body::Body;
use crate::error::{Flaw, SimError};
use crate::filter::{Barrier, Guard};
use crate::observe::{Observed, compiler_of};
use crate::outline::Outline;
use crate::program::{Compiler, Layout, Model, Number, Scope, Track, Vector};
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
        let bodies =
            world.groups.iter().map(|group| body(group, world.dt_s)).collect::<Result<Vec<_>, _>>()?;
        let layout = Layout::new(&plan.params, world, model(plan, world, &bodies)?);
        let stopped = stopped(&layout)?;
        let mut task = Task {
            dt_s: world.dt_s,
            horizon: world.horizon,
            safety_m: world.safety_m,
            agents: Vec::new(),
            everyone: layout.everyone.clone(),
            obstacles: layout.obstacles.clone(),
            barred: barred(&layout, &stopped),
            stopped,
            learned: world.learned(),
            uncommanded: Vec::new(),
            guards: Vec::new(),
            scripts: Vec::new(),
            model: Model::default(),
            randomised: randomised(&layout)?,
            require: Vec::new(),
            shared: None,
            observed: Vec::new(),
            state_len: 0,
            noisy: world.observe.iter().any(|observation| observation.noise.is_some()),
            terms: Vec::new(),
            rewarded: false,
            ends: Vec::new(),
        };
        let formations = world.formations.iter().enumerate();
        let formations = formations.map(|(k, it)| formation(&layout, k, it)).collect::<Result<_, _>>()?;
        task.add_agents(&layout, &bodies)?;
        task.guards = guards(&task);
        for (k, expr) in world.require.iter().enumerate() {
            let requirement = Compiler::new(&layout, Scope::default()).truth(expr);
            let place = task.agents.last().map(|agent| &agent.at);
            task.require.push(requirement.map_err(|flaw| SimError::Expression {
                what: format!("requirement {}", k + 1),
                flaw,
                at: place.cloned().unwrap_or_default(),
            })?);
        }
        task.add_policy(&layout)?;
        for end in &world.ends {
            task.ends.push(compile_end(&layout, end).map_err(|flaw| SimError::Expression {
                what: format!("end `{}`", end.name),
                flaw,
                at: end.at.clone(),
            })?);
        }
        task.model = Model { formations, ..layout.model };
        Ok(task)
    }

    /// What the learner sees and is rewarded for.
    fn add_policy(&mut self, layout: &Layout) -> Result<(), SimError> {
        let world = layout.world;
        let shared = world.shared.as_ref();
        if let Some(shared) = shared {
            let members = layout.groups.get(shared.group).cloned().unwrap_or_default();
            if members.is_empty() || !self.learned.iter().copied().eq(members.clone()) {
                let group = world.groups.get(shared.group);
                let what = "a policy of its own beside other learned agents, or without any".into();
                let (group, at) = group.map(|it| (it.name.clone(), it.at.clone())).unwrap_or_default();
                return Err(SimError::BadGroup { group, what, at });
            }
            self.shared = Some(members);
            self.rewarded = shared.rewarded.is_some();
        }
        let member = shared.map(|shared| (&shared.var, shared.group));
        for observation in &world.observe {
            let observed =
                Observed::new(layout, observation, member).map_err(|flaw| SimError::Expression {
                    what: format!("observation `{}`", observation.text),
                    flaw,
                    at: observation.at.clone(),
                })?;
            self.state_len += observed.width();
            self.observed.push(observed);
        }
        let member = shared.and_then(|shared| Some((shared.rewarded.as_ref()?, shared.group)));
        for term in &world.reward {
            let value = compiler_of(layout, member).and_then(|mut compiler| compiler.number(&term.value));
            let what = format!("reward term `{}`", term.name);
            let value = value.map_err(|flaw| SimError::Expression { what, flaw, at: term.at.clone() })?;
            self.terms.push(Term { name: term.name.clone(), at: term.at.clone(), value });
        }
        Ok(())
    }

    fn add_agents(&mut self, layout: &Layout, bodies: &[Body]) -> Result<(), SimError> {
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
        for ((group, agents), body) in world.groups.iter().zip(&layout.groups).zip(bodies) {
            let filter = group.filter.as_ref().map(|filter| Barrier::new(filter, &group.at)).transpose()?;
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
                let commanded = match &group.control {
                    Control::Still => false,
                    Control::Learned => true,
                    Control::Motion(motion) => matches!(motion.output, MotionOutput::Velocity(_)),
                };
                self.uncommanded.extend((!commanded).then_some(agent));
                placed[agent] = true;
                self.agents.push(Agent {
                    name: layout.names[agent].clone(),
                    group: group.name.clone(),
                    at: group.at.clone(),
                    body: *body,
                    arena: group.arena,
                    speed_mps: group.speed_mps,
                    filter,
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
        check_outline(group)?;
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

fn check_outline(group: &plan::Group) -> Result<(), SimError> {
    let bad = |what: &str| {
        Err(SimError::BadGroup { group: group.name.clone(), what: what.into(), at: group.at.clone() })
    };
    let length = |x: f64| x.is_finite() && x >= 0.0;
    match &group.solid {
        _ if !length(group.radius_m) => bad("a radius that is negative or not finite"),
        None => Ok(()),
        Some(_) if group.control == Control::Learned => bad("an outline and be learned"),
        Some(Solid::Disc { radius_m }) if !length(*radius_m) => {
            bad("a disc whose radius is negative or not finite")
        }
        Some(Solid::Segment { to_m: (x, y) }) if !(x.is_finite() && y.is_finite()) => {
            bad("a segment that is not finite")
        }
        Some(Solid::Polygon { corners_m }) if corners_m.len() < 3 => {
            bad("a polygon of less than three corners")
        }
        Some(Solid::Polygon { corners_m })
            if !corners_m.iter().all(|(x, y)| x.is_finite() && y.is_finite()) =>
        {
            bad("a polygon that is not finite")
        }
        Some(_) => Ok(()),
    }
}

/// Obstacles move as they are told.
fn body(group: &plan::Group, dt_s: f64) -> Result<Body, SimError> {
    if group.solid.is_some() { Ok(Body::POINT) } else { Body::new(&group.body, dt_s, &group.at) }
}

/// What expressions look at; without formations.
fn model(plan: &Plan, world: &World, bodies: &[Body]) -> Result<Model, SimError> {
    let mut model =
        Model { tracks: plan.tracks.iter().map(track).collect::<Result<_, _>>()?, ..Model::default() };
    for (group, body) in world.groups.iter().zip(bodies) {
        let outline = group.solid.as_ref().map_or(Outline::Disc(group.radius_m), Outline::new);
        for member in 1..=group.size {
            model.outlines.push(outline.clone());
            model.radii.push(if group.solid.is_some() { 0.0 } else { group.radius_m });
            model.numbers.push(member as f64);
            model.headed.push(body.has_heading());
        }
    }
    Ok(model)
}

fn track(track: &plan::Track) -> Result<Track, SimError> {
    let rising = track.t_s.windows(2).all(|pair| pair[0] < pair[1]);
    let finite = track.t_s.iter().chain(track.p_m.iter().flat_map(|(x, y)| [x, y])).all(|x| x.is_finite());
    let flaw = match track {
        _ if track.t_s.is_empty() || track.t_s.len() != track.p_m.len() => "needs a position for each time",
        _ if !finite => "has a number that is not finite",
        _ if !rising => "has times that do not rise",
        _ => {
            let p_m = track.p_m.iter().map(|&p| p.into()).collect();
            return Ok(Track { t_s: track.t_s.clone(), p_m });
        }
    };
    Err(SimError::BadTrack { track: track.name.clone(), flaw, at: track.at.clone() })
}

/// Each agent that obstacles stop, with them.
fn stopped(layout: &Layout) -> Result<Vec<(usize, Vec<usize>)>, SimError> {
    let mut stopped: Vec<(usize, Vec<usize>)> = Vec::new();
    for (group, obstacles) in layout.world.groups.iter().zip(&layout.groups) {
        for &of in &group.stops {
            let agents = layout.groups.get(of).filter(|_| group.solid.is_some());
            let agents =
                agents.filter(|agents| (*agents).clone().all(|agent| layout.everyone.contains(&agent)));
            let Some(agents) = agents else {
                let what = format!("group {of} to stop: obstacles stop agents");
                return Err(SimError::BadGroup { group: group.name.clone(), what, at: group.at.clone() });
            };
            for agent in agents.clone() {
                match stopped.iter_mut().find(|(known, _)| *known == agent) {
                    Some((_, by)) => by.extend(obstacles.clone()),
                    None => stopped.push((agent, obstacles.clone().collect())),
                }
            }
        }
    }
    Ok(stopped)
}

/// Which agent may not be in which obstacle.
fn barred(layout: &Layout, stopped: &[(usize, Vec<usize>)]) -> Vec<(usize, usize)> {
    let mut barred = Vec::new();
    for &obstacle in layout.obstacles.iter() {
        let before = barred.len();
        let by_it = stopped.iter().filter(|(_, by)| by.contains(&obstacle));
        barred.extend(by_it.map(|(agent, _)| (*agent, obstacle)));
        if barred.len() == before {
            barred.extend(layout.everyone.iter().map(|agent| (*agent, obstacle)));
        }
    }
    barred
}

/// What each learned agent with a filter keeps clear of.
fn guards(task: &Task) -> Vec<Guard> {
    let of = |(learner, &agent): (usize, &usize)| {
        let obstacles = task.barred.iter().filter(|(barred, _)| *barred == agent);
        let obstacles = obstacles.map(|(_, obstacle)| *obstacle).collect();
        Some(Guard { learner, agent, barrier: task.agents[agent].filter?, obstacles })
    };
    task.learned.iter().enumerate().filter_map(of).collect()
}

fn randomised(layout: &Layout) -> Result<Vec<Randomised>, SimError> {
    let nobody = vec![false; layout.names.len()];
    let compiled = |(k, it): (usize, &plan::Randomised)| {
        let name = layout.params.get(it.param).map(|param| param.name.clone()).unwrap_or_default();
        let scope = Scope { draws: true, placed: Some(&nobody), drawn: Some(k), ..Scope::default() };
        let value = match layout.params.get(it.param) {
            Some(_) => Compiler::new(layout, scope).number(&it.value),
            None => Err(Flaw::UnknownParam { id: it.param }),
        };
        let what = format!("parameter `{name}`");
        let value = value.map_err(|flaw| SimError::Expression { what, flaw, at: it.at.clone() })?;
        Ok(Randomised { name, at: it.at.clone(), value })
    };
    layout.world.randomise.iter().enumerate().map(compiled).collect()
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

fn compile_end(layout: &Layout, end: &plan::End) -> Result<End, Flaw> {
    let when = Compiler::new(layout, Scope::default()).truth(&end.when)?;
    let cost =
        end.cost.as_ref().map(|cost| Compiler::new(layout, Scope::default()).number(cost)).transpose()?;
    if let Some(Number::Constant(value)) = cost
        && !(value.is_finite() && value >= 0.0)
    {
        return Err(Flaw::Negative { value });
    }
    Ok(End { name: end.name.clone(), at: end.at.clone(), when, cost })
}
