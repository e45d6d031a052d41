//! Where the agents of a world can be, and how fast.
//!
//! Bounds are found from above: at first an agent can be anywhere; then each group's start, motion and way follow
//! from what is known of the others, some rounds long. Whatever is known after any round is true.

use super::eval::{Eval, Who, outline};
use super::interval::Interval;
use super::value::{Plane, Truth, Value};
use crate::plan::{
    AgentId, Area, BinaryOp, Constraint, Control, Expr, Group, GroupId, IndexSet, Motion, MotionOutput, Plan,
    Quantity, Reduction, Setting, Slots, World,
};

/// What episodes are bounded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// Learned agents may leave their arena; ends stop the episode.
    Training,
    /// Learned agents are put back into their arena, and nothing stops the episode.
    Evaluation,
    /// As training, of any length: agents that nothing keeps can be anywhere.
    Endless,
}

/// What is known of each member of a group.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Known {
    pub start: Plane,
    /// From the start on.
    pub position: Plane,
    pub velocity: Plane,
    pub command: Plane,
    /// What a motion asks for, clipped to the limits of the speed.
    pub asked: Plane,
    pub outside: Truth,
}

/// A world and what is known of it.
pub struct Scene<'p> {
    pub plan: &'p Plan,
    pub world: &'p World,
    pub mode: Mode,
    pub params: Vec<Interval>,
    pub groups: Vec<Known>,
    /// The displacements of each formation.
    pub slots: Vec<Plane>,
    /// What the motion of each group gives, where that depends on no agent.
    alone: Vec<Option<Plane>>,
}

/// Enough for places that depend on a leader that depends on another.
const ROUNDS: usize = 3;
/// Steps of a motion that are followed one by one, at most.
const FOLLOWED: usize = 400;
/// Pieces that the states of a motion are looked at in.
const PIECES: usize = 64;
/// Steps after which a motion has settled, if it goes round in a circle.
const SETTLING: usize = 3;

impl<'p> Scene<'p> {
    /// Of whose agents nothing is known yet.
    pub fn unknown(plan: &'p Plan, world: &'p World, mode: Mode) -> Scene<'p> {
        let unknown = Known {
            start: Plane::ALL,
            position: Plane::ALL,
            velocity: Plane::ALL,
            command: Plane::ALL,
            asked: Plane::ALL,
            outside: Truth::UNKNOWN,
        };
        let mut scene = Scene {
            plan,
            world,
            mode,
            params: plan.params.iter().map(|param| Interval::point(param.value)).collect(),
            groups: vec![unknown; world.groups.len()],
            slots: vec![Plane::ALL; world.formations.len()],
            alone: Vec::new(),
        };
        for drawn in &world.randomise {
            let value = Eval::new(&scene).number(&drawn.value);
            scene.params.iter_mut().skip(drawn.param).take(1).for_each(|param| *param = value);
        }
        scene
    }

    pub fn new(plan: &'p Plan, world: &'p World, mode: Mode) -> Scene<'p> {
        let mut scene = Scene::unknown(plan, world, mode);
        let of_group = |(id, group): (GroupId, &Group)| match &group.control {
            Control::Motion(motion) if is_alone(motion) => Some(scene.output(id, motion)),
            _ => None,
        };
        scene.alone = world.groups.iter().enumerate().map(of_group).collect();
        for _ in 0..ROUNDS {
            let before = (scene.groups.clone(), scene.slots.clone());
            for formation in 0..world.formations.len() {
                let slots = scene.all_slots(formation);
                scene.slots.iter_mut().skip(formation).take(1).for_each(|known| *known = slots);
            }
            for (id, group) in world.groups.iter().enumerate() {
                let known = scene.known(id, group);
                scene.groups.iter_mut().skip(id).take(1).for_each(|old| *old = known);
            }
            if before == (scene.groups.clone(), scene.slots.clone()) {
                break;
            }
        }
        scene
    }

    pub fn group_of(&self, agent: AgentId) -> Option<GroupId> {
        let mut next = 0;
        self.world.groups.iter().position(|group| {
            next += group.size;
            agent < next
        })
    }

    /// Evaluates the start or motion of a group.
    pub fn of_member(&self, group: GroupId) -> Eval<'_> {
        Eval { member: Some(Who::group(group)), ..Eval::new(self) }
    }

    fn all_slots(&self, formation: usize) -> Plane {
        let Some(it) = self.world.formations.get(formation) else { return Plane::ALL };
        match &it.constraint {
            Constraint::Displacements { slots: Slots::List(all), .. } => {
                let each = all.iter().map(|slot| Eval::new(self).vector(slot));
                each.reduce(Plane::hull).unwrap_or(Plane::ALL)
            }
            Constraint::Displacements { slots: Slots::Rule(rule), .. } => {
                let size = self.world.groups.get(it.group).map_or(0, |group| group.size) as f64;
                let slot = Some((Interval::new(1.0, size), Interval::point(size)));
                Eval { slot, ..Eval::new(self) }.vector(rule)
            }
            Constraint::Distances(_) => Plane::ALL,
        }
    }

    fn known(&self, id: GroupId, group: &Group) -> Known {
        let speed = Interval::new(group.speed_mps.0, group.speed_mps.1);
        let speeds = Plane::new(speed, speed);
        let (dt, horizon) = (self.world.dt_s, self.world.horizon as f64);
        let start = match &group.start {
            Some(start) => Eval { at_start: true, ..self.of_member(id) }.vector(start),
            None => Plane::ALL,
        };
        let push = self.push(id, group);
        let pushed = push > 0.0;
        let arena = group.arena.map(area);
        let step = grown(way(group) * dt);
        let anywhere_near = |steps: f64| start + Plane::disc(grown((way(group) * dt + push) * steps));
        match &group.control {
            Control::Still => Known {
                start,
                position: if pushed { anywhere_near(horizon) } else { start },
                velocity: if pushed { Plane::disc(grown(push / dt)) } else { Plane::ZERO },
                command: Plane::ZERO,
                asked: Plane::ZERO,
                outside: outside(start, arena, pushed),
            },
            Control::Motion(it @ Motion { output: MotionOutput::Position(_), .. }) => {
                let motion = self.output(id, it);
                let jump = motion.spread().over(Interval::point(dt));
                let velocity = jump.hull(Plane::ZERO);
                let outside = outside(motion, arena, false);
                Known {
                    start: motion,
                    position: motion,
                    velocity,
                    command: velocity,
                    asked: velocity,
                    outside,
                }
            }
            Control::Motion(it @ Motion { output: MotionOutput::Velocity(_), .. }) => {
                let asked = self.output(id, it);
                let clip = |v: Interval| v.max(Interval::point(speed.low)).min(Interval::point(speed.high));
                let asked = Plane::new(clip(asked.x), clip(asked.y));
                let command = if group_is_plain(group) { asked } else { Plane::disc(way(group)) };
                let position = match arena {
                    Some(arena) => start.hull(arena) + Plane::disc(push),
                    None => anywhere_near(horizon),
                };
                let velocity = self.velocity(command, start, arena, position, push);
                let outside = outside(start, arena, pushed);
                Known { start, position, velocity, command: command.hull(Plane::ZERO), asked, outside }
            }
            Control::Learned => {
                let position = match (self.mode, arena) {
                    (Mode::Evaluation, Some(arena)) => start.hull(arena) + Plane::disc(push),
                    (Mode::Training | Mode::Endless, Some(arena)) if self.leaving_ends(id) => {
                        start.hull(arena) + Plane::disc(step + push)
                    }
                    (Mode::Endless, _) => Plane::ALL,
                    _ => anywhere_near(horizon),
                };
                let command = match group_is_plain(group) {
                    true => speeds.hull(Plane::ZERO),
                    false => Plane::disc(way(group)),
                };
                let put_back = if self.mode == Mode::Evaluation { arena } else { None };
                let velocity = self.velocity(command, start, put_back, position, push);
                let outside = if arena.is_some() { Truth::UNKNOWN } else { Truth::NO };
                Known { start, position, velocity, command: speeds.hull(Plane::ZERO), asked: speeds, outside }
            }
        }
    }

    /// Over a step, of an agent that answers `command` and may be put back into an arena.
    fn velocity(
        &self,
        command: Plane,
        start: Plane,
        arena: Option<Plane>,
        position: Plane,
        push: f64,
    ) -> Plane {
        let dt = Interval::point(self.world.dt_s);
        if arena.is_some_and(|arena| !arena.covers(start)) {
            return position.spread().over(dt).hull(Plane::ZERO);
        }
        // (p + v dt − p) / dt loses digits where p is large.
        let lost = 8.0 * f64::EPSILON * position.length.high / self.world.dt_s;
        let slack = if lost.is_finite() { lost } else { 1e-6 };
        command.hull(Plane::ZERO) + Plane::disc(grown(push / self.world.dt_s) + slack)
    }

    /// All that a motion can tell: looked at piece by piece of its states, because what is computed from a state
    /// in two ways is known better where the state is known better.
    fn output(&self, id: GroupId, motion: &Motion) -> Plane {
        if let Some(known) = self.alone.get(id).copied().flatten() {
            return known;
        }
        let (MotionOutput::Velocity(output) | MotionOutput::Position(output)) = &motion.output;
        let states = self.states(id, motion);
        let pieces = match states.len() {
            1 => PIECES,
            2 => PIECES.isqrt(),
            _ => 1,
        };
        let mut cases: Vec<Vec<Value>> = vec![Vec::new()];
        for state in &states {
            let parts = match state {
                Value::Number(number) => number.pieces(pieces).into_iter().map(Value::Number).collect(),
                other => vec![*other],
            };
            let with = |case: &Vec<Value>, part: Value| [case.as_slice(), &[part]].concat();
            cases = cases.iter().flat_map(|case| parts.iter().map(|part| with(case, *part))).collect();
        }
        let each = cases.into_iter().map(|states| Eval { states, ..self.of_member(id) }.vector(output));
        each.reduce(Plane::hull).unwrap_or(Plane::ALL)
    }

    /// All values of a motion's states: the starts, and whatever follows from values that are among them.
    fn states(&self, id: GroupId, motion: &Motion) -> Vec<Value> {
        let mut starts: Vec<Value> = Vec::new();
        for state in &motion.states {
            let mut eval = Eval { at_start: true, states: starts.clone(), ..self.of_member(id) };
            starts.push(eval.value(&state.start));
        }
        let first = starts.clone();
        let after = |states: &[Value]| -> Vec<Value> {
            let all = motion.states.iter().zip(&first);
            all.map(|(state, start)| {
                let next = Eval { states: states.to_vec(), ..self.of_member(id) }.value(&state.next);
                start.hull(next)
            })
            .collect()
        };
        let mut states = starts;
        for round in 0..FOLLOWED.min(self.world.horizon) {
            let next = after(&states);
            if next == states {
                return states;
            }
            // What still moves will go on: see whether something keeps it at last.
            if round == SETTLING
                && let Some(far) = widened(&states, &after)
                && far.iter().all(is_finite)
            {
                return far;
            }
            states = states.iter().zip(&next).map(|(state, next)| state.hull(*next)).collect();
        }
        match self.world.horizon <= FOLLOWED {
            true => states,
            false => widened(&states, &after).unwrap_or_default(),
        }
    }

    /// How far the obstacles that stop a group can push a member in one step, at most, m.
    fn push(&self, id: GroupId, group: &Group) -> f64 {
        let stopping = self.world.groups.iter().enumerate().filter(|(_, other)| other.stops.contains(&id));
        let each = stopping.map(|(other, obstacle)| {
            let size = obstacle.solid.as_ref().map_or(0.0, |solid| {
                let outline = outline(solid);
                outline.spread().length.high
            });
            let moved = self.groups.get(other).map_or(f64::INFINITY, |known| known.velocity.length.high);
            obstacle.size as f64 * (size + 2.0 * group.radius_m + moved * self.world.dt_s)
        });
        grown(each.sum())
    }

    /// Whether an episode ends as soon as any member of a group is outside its arena.
    fn leaving_ends(&self, group: GroupId) -> bool {
        self.world.ends.iter().any(|end| self.follows(&end.when, group, &[]))
    }

    /// Whether a condition holds as soon as any member is outside. `vars` stand for any member.
    fn follows(&self, condition: &Expr, group: GroupId, vars: &[usize]) -> bool {
        use crate::plan::AgentRef::{Fixed, Var};
        let size = self.world.groups.get(group).map_or(0, |group| group.size);
        match condition {
            Expr::Agent(Quantity::Outside, Fixed(agent)) => size == 1 && self.group_of(*agent) == Some(group),
            Expr::Agent(Quantity::Outside, Var(var)) => vars.contains(var),
            Expr::Binary(BinaryOp::Or, a, b) => self.follows(a, group, vars) || self.follows(b, group, vars),
            Expr::Binary(BinaryOp::Greater, count, none) if **none == Expr::Number(0.0) => match &**count {
                Expr::Reduce { op: Reduction::Count, vars, over, filter: None, body } => {
                    self.holds_all(over, group)
                        && vars.first().is_some_and(|var| self.follows(body, group, &[var.id]))
                }
                _ => false,
            },
            Expr::Reduce { op: Reduction::Any, vars, over, filter: None, body } => {
                self.holds_all(over, group)
                    && vars.first().is_some_and(|var| self.follows(body, group, &[var.id]))
            }
            _ => false,
        }
    }

    fn holds_all(&self, set: &IndexSet, group: GroupId) -> bool {
        match set {
            IndexSet::Group(of) => *of == group,
            IndexSet::All => self.world.groups.get(group).is_some_and(|group| group.solid.is_none()),
            _ => false,
        }
    }
}

/// Whether a motion depends on no agent.
fn is_alone(motion: &Motion) -> bool {
    fn alone(expr: &Expr) -> bool {
        let asks = matches!(expr, Expr::Agent(..) | Expr::Slot(..) | Expr::Rest(..) | Expr::Clearance(..));
        !asks && expr.parts().into_iter().all(alone)
    }
    let (MotionOutput::Velocity(output) | MotionOutput::Position(output)) = &motion.output;
    alone(output) && motion.states.iter().all(|state| alone(&state.start) && alone(&state.next))
}

/// The top speed of a group, m/s: no body outruns its command, unless one of its limits does not let it stand still.
pub fn way(group: &Group) -> f64 {
    let fast = group.speed_mps.0.abs().max(group.speed_mps.1.abs());
    let must_move =
        |setting: &Setting| matches!(setting, Setting::Range(low, high) if *low > 0.0 || *high < 0.0);
    match group.body.settings.values().any(must_move) {
        true => f64::INFINITY,
        false => grown(fast * std::f64::consts::SQRT_2),
    }
}

/// Whether a body does on each axis what it is told.
fn group_is_plain(group: &Group) -> bool {
    group.body.settings.values().all(|setting| !matches!(setting, Setting::Range(..)))
}

/// A length, and what rounding may add to it.
fn grown(length: f64) -> f64 {
    length * (1.0 + 1e-9)
}

fn area(area: Area) -> Plane {
    Plane::new(Interval::new(area.x_m.0, area.x_m.1), Interval::new(area.y_m.0, area.y_m.1))
}

fn outside(position: Plane, arena: Option<Plane>, pushed: bool) -> Truth {
    match arena {
        None => Truth::NO,
        Some(arena) if arena.covers(position) && !pushed => Truth::NO,
        Some(_) => Truth::UNKNOWN,
    }
}

fn covers(a: Value, b: Value) -> bool {
    match (a, b) {
        (Value::Number(a), Value::Number(b)) => a.covers(b),
        (Value::Vector(a), Value::Vector(b)) => a.covers(b) && a.length.covers(b.length),
        _ => a == b,
    }
}

fn is_finite(value: &Value) -> bool {
    match value {
        Value::Number(number) => number.is_finite(),
        Value::Vector(vector) => vector.is_finite(),
        Value::Truth(_) => true,
    }
}

/// The least that is known to hold for ever, from `states` on; `None` if nothing is.
fn widened(states: &[Value], after: &dyn Fn(&[Value]) -> Vec<Value>) -> Option<Vec<Value>> {
    let mut states = states.to_vec();
    for _ in 0..4 * states.len() + 1 {
        let next = after(&states);
        if states.iter().zip(&next).all(|(state, next)| covers(*state, *next)) {
            // Twice more, now from above.
            return Some(after(&after(&states)));
        }
        states = states.iter().zip(&next).map(|(state, next)| wide(*state, *next)).collect();
    }
    None
}

/// What grows is not bounded on that side.
fn wide(state: Value, next: Value) -> Value {
    let interval = |a: Interval, b: Interval| {
        let low = if b.low < a.low { f64::NEG_INFINITY } else { a.low };
        Interval::new(low, if b.high > a.high { f64::INFINITY } else { a.high })
    };
    match (state, next) {
        (Value::Number(a), Value::Number(b)) => Value::Number(interval(a, b)),
        (Value::Vector(a), Value::Vector(b)) => {
            let length =
                Interval::new(0.0, if a.length.covers(b.length) { a.length.high } else { f64::INFINITY });
            Value::Vector(Plane { x: interval(a.x, b.x), y: interval(a.y, b.y), length })
        }
        _ => Value::Number(Interval::ALL),
    }
}
