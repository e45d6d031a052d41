//! All values that an expression of the Plan can have in a scene.

use super::interval::Interval;
use super::scene::Scene;
use super::value::{Plane, Truth, Value, binary, call, negated};
use crate::plan::{
    AgentId, AgentRef, Constraint, Distribution, Expr, Frame, GroupId, IndexSet, Quantity, Reduction, Slots,
    Solid, UnaryOp, VarId, WorldConstant,
};

/// Who an agent can be: any member of some groups, or one of them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Who {
    pub groups: Vec<GroupId>,
    pub agent: Option<AgentId>,
}

/// What an expression is evaluated for.
pub struct Eval<'s> {
    pub scene: &'s Scene<'s>,
    pub vars: Vec<(VarId, Who)>,
    /// Whose start or motion it is.
    pub member: Option<Who>,
    /// States of the motion around.
    pub states: Vec<Value>,
    /// k and n of the slot around.
    pub slot: Option<(Interval, Interval)>,
    /// Whether agents stand where they start.
    pub at_start: bool,
    /// Nodes that may still be looked at; after that, nothing is known of an expression.
    pub patience: usize,
}

/// Nodes of an expression that are looked at, at most.
const PATIENCE: usize = 20_000;
/// Combinations of groups that a reduction is split into, at most.
const COMBINATIONS: usize = 36;

impl Who {
    pub fn group(group: GroupId) -> Who {
        Who { groups: vec![group], agent: None }
    }

    fn union(all: &[Who]) -> Who {
        let mut groups: Vec<GroupId> = all.iter().flat_map(|who| who.groups.iter().copied()).collect();
        groups.sort_unstable();
        groups.dedup();
        Who { groups, agent: None }
    }
}

impl<'s> Eval<'s> {
    pub fn new(scene: &'s Scene<'s>) -> Eval<'s> {
        Eval {
            scene,
            vars: Vec::new(),
            member: None,
            states: Vec::new(),
            slot: None,
            at_start: false,
            patience: PATIENCE,
        }
    }

    pub fn bind(mut self, var: VarId, who: Who) -> Eval<'s> {
        self.vars.push((var, who));
        self
    }

    pub fn number(&mut self, expr: &Expr) -> Interval {
        self.value(expr).number()
    }

    pub fn vector(&mut self, expr: &Expr) -> Plane {
        self.value(expr).vector()
    }

    pub fn truth(&mut self, expr: &Expr) -> Truth {
        self.value(expr).truth()
    }

    pub fn value(&mut self, expr: &Expr) -> Value {
        let Some(left) = self.patience.checked_sub(1) else { return Value::Number(Interval::ALL) };
        self.patience = left;
        let world = self.scene.world;
        Value::Number(match expr {
            Expr::Number(value) => Interval::point(*value),
            Expr::Truth(truth) => return Value::Truth(Truth::known(*truth)),
            Expr::Param(id) => self.scene.params.get(*id).copied().unwrap_or(Interval::ALL),
            Expr::World(constant) => Interval::point(match constant {
                WorldConstant::Dt => world.dt_s,
                WorldConstant::Safety => world.safety_m,
                WorldConstant::Horizon => world.horizon as f64,
            }),
            Expr::Time if self.at_start => Interval::ZERO,
            Expr::Time => Interval::new(0.0, world.horizon as f64 * world.dt_s),
            Expr::State(k) => return self.states.get(*k).copied().unwrap_or(Value::Number(Interval::ALL)),
            Expr::SlotNumber => self.slot.map_or(Interval::ALL, |slot| slot.0),
            Expr::SlotCount => self.slot.map_or(Interval::ALL, |slot| slot.1),
            Expr::Vector(x, y) => return Value::Vector(Plane::new(self.number(x), self.number(y))),
            Expr::Unary(UnaryOp::Neg, operand) => return negated(self.value(operand)),
            Expr::Unary(UnaryOp::Not, operand) => return Value::Truth(!self.truth(operand)),
            Expr::Binary(op, left, right) => return binary(*op, self.value(left), self.value(right)),
            Expr::Call(function, args) => {
                let args: Vec<Value> = args.iter().map(|arg| self.value(arg)).collect();
                return call(*function, &args);
            }
            Expr::If { condition, then, otherwise } => {
                let condition = self.truth(condition);
                return match (condition.can_hold, condition.can_fail) {
                    (true, true) => self.value(then).hull(self.value(otherwise)),
                    (true, false) => self.value(then),
                    _ => self.value(otherwise),
                };
            }
            Expr::Agent(quantity, agent) => return self.quantity(*quantity, agent),
            Expr::Slot(formation, agent) => return Value::Vector(self.place(*formation, agent)),
            Expr::Rest(formation, ..) => self.rest(*formation),
            Expr::Clearance(a, b) => self.clearance(a, b),
            Expr::Same(a, b) => return Value::Truth(self.same(a, b)),
            Expr::MemberNumber(agent) => self.member_number(agent),
            Expr::Element(list, number) => return self.element(list, number),
            Expr::Track(track, _) => {
                return self.scene.plan.tracks.get(*track).map_or(Value::Vector(Plane::ALL), |track| {
                    let points = track.p_m.iter().map(|&(x, y)| point(x, y));
                    // Joined by lines, which may round beyond their ends.
                    points.reduce(Plane::hull).map_or(Value::Vector(Plane::ALL), |hull| {
                        Value::Vector(Plane::new(hull.x.rounded(), hull.y.rounded()))
                    })
                });
            }
            Expr::Measured(_) => Interval::ALL,
            Expr::Reduce { op, vars, over, filter, body } => {
                let vars: Vec<VarId> = vars.iter().map(|var| var.id).collect();
                return self.reduce(*op, &vars, over, filter.as_deref(), body);
            }
            Expr::Draw { distribution, .. } => return self.draw(distribution),
        })
    }

    /// Who an agent can be; any if it is not known.
    pub fn who(&self, agent: &AgentRef) -> Who {
        let any = || Who { groups: (0..self.scene.world.groups.len()).collect(), agent: None };
        match agent {
            AgentRef::Fixed(id) => {
                let group = self.scene.group_of(*id);
                Who { groups: group.into_iter().collect(), agent: Some(*id) }
            }
            AgentRef::Member => self.member.clone().unwrap_or_else(any),
            AgentRef::Var(var) => {
                let bound = self.vars.iter().rev().find(|(id, _)| id == var);
                bound.map_or_else(any, |(_, who)| who.clone())
            }
        }
    }

    /// Where an agent can be.
    pub fn position(&self, agent: &AgentRef) -> Plane {
        match self.quantity(Quantity::Position, agent) {
            Value::Vector(position) => position,
            _ => Plane::ALL,
        }
    }

    fn quantity(&self, quantity: Quantity, agent: &AgentRef) -> Value {
        let who = self.who(agent);
        let each = who.groups.iter().filter_map(|group| self.scene.groups.get(*group));
        let each = each.map(|group| match quantity {
            Quantity::Position if self.at_start => Value::Vector(group.start),
            Quantity::Position => Value::Vector(group.position),
            Quantity::Velocity => Value::Vector(group.velocity),
            Quantity::Heading => Value::Number(Interval::TURN.rounded()),
            Quantity::Command => Value::Vector(group.command),
            Quantity::CommandChange => Value::Vector(group.command.spread().hull(Plane::ZERO)),
            Quantity::Outside => Value::Truth(group.outside),
        });
        each.reduce(Value::hull).unwrap_or(Value::Number(Interval::ALL))
    }

    fn place(&mut self, formation: usize, agent: &AgentRef) -> Plane {
        let Some(about) = self.scene.world.formations.get(formation).and_then(|it| it.about) else {
            return Plane::ALL;
        };
        self.position(&AgentRef::Fixed(about)) + self.displacement(formation, agent)
    }

    /// From `about` to the place of an agent.
    pub fn displacement(&mut self, formation: usize, agent: &AgentRef) -> Plane {
        let Some(it) = self.scene.world.formations.get(formation) else { return Plane::ALL };
        let Constraint::Displacements { slots, frame } = &it.constraint else { return Plane::ALL };
        let size = self.scene.world.groups.get(it.group).map_or(0, |group| group.size);
        let member = self.who(agent).agent.and_then(|id| id.checked_sub(self.scene.world.first_of(it.group)));
        let displacement = match (slots, member) {
            (Slots::List(all), Some(k)) => all.get(k).map_or(Plane::ALL, |slot| self.vector(slot)),
            (Slots::List(_), None) => self.scene.slots.get(formation).copied().unwrap_or(Plane::ALL),
            (Slots::Rule(rule), member) => {
                let numbers = match member {
                    Some(k) => Interval::point((k + 1) as f64),
                    None => Interval::new(1.0, size as f64),
                };
                let outer = self.slot.replace((numbers, Interval::point(size as f64)));
                let displacement = self.vector(rule);
                self.slot = outer;
                displacement
            }
        };
        match frame {
            Frame::Global => displacement,
            Frame::Heading => displacement.rotated(Interval::TURN),
        }
    }

    fn rest(&mut self, formation: usize) -> Interval {
        let Some(it) = self.scene.world.formations.get(formation) else { return Interval::ALL };
        match &it.constraint {
            Constraint::Distances(all) => {
                let all = all.iter().map(|distance| self.number(distance));
                all.reduce(Interval::hull).unwrap_or(Interval::ALL)
            }
            Constraint::Displacements { .. } => {
                let slot = self.scene.slots.get(formation).copied().unwrap_or(Plane::ALL);
                // Also from and to `about`, which is at zero.
                let places = Plane::new(slot.x, slot.y).hull(Plane::ZERO);
                places.spread().length
            }
        }
    }

    /// From outline to outline; the outline of an obstacle lies in the box around it.
    fn clearance(&mut self, a: &AgentRef, b: &AgentRef) -> Interval {
        let between = self.position(a) - self.position(b);
        let (a, b) = (self.who(a), self.who(b));
        let both = a.groups.iter().flat_map(|&a| b.groups.iter().map(move |&b| (a, b)));
        let groups = &self.scene.world.groups;
        let each = both.filter_map(|(a, b)| {
            let (a, b) = (groups.get(a)?, groups.get(b)?);
            let radii = Interval::point(a.radius_m) + Interval::point(b.radius_m);
            let solid = a.solid.as_ref().or(b.solid.as_ref());
            if a.solid.is_some() && b.solid.is_some() {
                return Some(Interval::ALL);
            }
            Some(match solid {
                None => between.length - radii,
                Some(Solid::Disc { radius_m }) => between.length - radii - Interval::point(*radius_m),
                Some(solid) => {
                    let outline = outline(solid);
                    let from_obstacle = if a.solid.is_some() { -between } else { between };
                    let apart = (from_obstacle - outline).length;
                    let depth = match solid {
                        Solid::Polygon { .. } if apart.low == 0.0 => width(outline) / 2.0,
                        _ => 0.0,
                    };
                    Interval::new(apart.low - depth, apart.high) - radii
                }
            })
        });
        let hull = each.reduce(Interval::hull).unwrap_or(Interval::ALL);
        // The simulator may take the distance in another way.
        let scale = between.length.high.abs() + hull.magnitude();
        if scale.is_finite() { hull.wider(16.0 * f64::EPSILON * scale) } else { hull }
    }

    fn same(&self, a: &AgentRef, b: &AgentRef) -> Truth {
        if let (AgentRef::Var(a), AgentRef::Var(b)) = (a, b)
            && a == b
        {
            return Truth::YES;
        }
        let (a, b) = (self.who(a), self.who(b));
        match (a.agent, b.agent) {
            (Some(a), Some(b)) => Truth::known(a == b),
            _ if a.groups.iter().all(|group| !b.groups.contains(group)) => Truth::NO,
            _ if a == b && self.size(&a) == 1 => Truth::YES,
            _ => Truth::UNKNOWN,
        }
    }

    fn size(&self, who: &Who) -> usize {
        let groups = who.groups.iter().filter_map(|group| self.scene.world.groups.get(*group));
        groups.map(|group| group.size).sum()
    }

    fn member_number(&self, agent: &AgentRef) -> Interval {
        let who = self.who(agent);
        if let (Some(id), [group]) = (who.agent, who.groups.as_slice()) {
            return Interval::point((id + 1).saturating_sub(self.scene.world.first_of(*group)) as f64);
        }
        let groups = who.groups.iter().filter_map(|group| self.scene.world.groups.get(*group));
        Interval::new(1.0, groups.map(|group| group.size).max().unwrap_or(1) as f64)
    }

    fn element(&mut self, list: &[Expr], number: &Expr) -> Value {
        let number = self.number(number).floor();
        let last = list.len().saturating_sub(1);
        let index = |x: f64| ((x - 1.0).max(0.0) as usize).min(last);
        let entries = list.get(index(number.low)..=index(number.high)).unwrap_or(list);
        let entries = entries.iter().map(|entry| self.value(entry));
        entries.reduce(Value::hull).unwrap_or(Value::Number(Interval::ALL))
    }

    fn draw(&mut self, distribution: &Distribution) -> Value {
        match distribution {
            Distribution::Uniform { low, high } => {
                let (low, high) = (self.value(low), self.value(high));
                // low + (high − low) u, which can round beyond high.
                let any = |low: Interval, high: Interval| {
                    let all = low.hull(high);
                    if low.constant() == Some(0.0) { all } else { all.rounded() }
                };
                match (low, high) {
                    (Value::Vector(low), Value::Vector(high)) => {
                        Value::Vector(Plane::new(any(low.x, high.x), any(low.y, high.y)))
                    }
                    _ => Value::Number(any(low.number(), high.number())),
                }
            }
            Distribution::Normal { mean, deviation } => {
                let (mean, deviation) = (self.value(mean), self.value(deviation));
                let spread = |x: Interval| if x == Interval::ZERO { x } else { Interval::ALL };
                match (mean, deviation) {
                    (Value::Vector(mean), Value::Vector(by)) => {
                        Value::Vector(mean + Plane::new(spread(by.x), spread(by.y)))
                    }
                    _ => Value::Number(mean.number() + spread(deviation.number())),
                }
            }
            Distribution::UnitDisc => Value::Vector(Plane::disc(1.0 + 16.0 * f64::EPSILON)),
        }
    }

    /// What a set's members can be, with their number, split by groups where that is not too much.
    pub fn members(&self, set: &IndexSet) -> Vec<(Vec<Who>, usize)> {
        let world = self.scene.world;
        let size = |group: GroupId| world.groups.get(group).map_or(0, |group| group.size);
        let groups = |solid: bool| {
            let all = world.groups.iter().enumerate();
            all.filter(move |(_, group)| group.solid.is_some() == solid).map(|(id, _)| id)
        };
        let singles = |groups: &mut dyn Iterator<Item = GroupId>| {
            groups.map(|group| (vec![Who::group(group)], size(group))).collect::<Vec<_>>()
        };
        let mut choices = match set {
            IndexSet::All => singles(&mut groups(false)),
            IndexSet::Obstacles => singles(&mut groups(true)),
            IndexSet::Group(group) => singles(&mut std::iter::once(*group)),
            IndexSet::Pairs(of) => {
                let of = self.members(of);
                let mut pairs = Vec::new();
                for (k, (a, m)) in of.iter().enumerate() {
                    let who = [a.as_slice(), a.as_slice()].concat();
                    pairs.push((who, m * m.saturating_sub(1) / 2));
                    pairs.extend(of.iter().skip(k + 1).map(|(b, n)| ([a.as_slice(), b].concat(), m * n)));
                }
                pairs
            }
            IndexSet::Edges(formation) => world.formations.get(*formation).map_or(Vec::new(), |it| {
                let about = it.about.and_then(|about| self.scene.group_of(about));
                let node = Who::union(&[
                    Who::group(it.group),
                    Who { groups: about.into_iter().collect(), agent: None },
                ]);
                vec![(vec![node.clone(), node], world.edges(it))]
            }),
            IndexSet::Nearest { count, among, .. } => {
                let among = self.members(among);
                let all: Vec<Who> = among.iter().flat_map(|(who, _)| who.clone()).collect();
                let size: usize = among.iter().map(|(_, size)| size).sum();
                vec![(vec![Who::union(&all)], size.min(*count))]
            }
        };
        choices.retain(|(_, count)| *count > 0);
        if choices.len() > COMBINATIONS {
            let binders = choices.first().map_or(0, |(who, _)| who.len());
            let all: Vec<Who> = choices.iter().flat_map(|(who, _)| who.clone()).collect();
            let count = choices.iter().map(|(_, count)| count).sum();
            choices = vec![(vec![Who::union(&all); binders], count)];
        }
        choices
    }

    fn reduce(
        &mut self,
        op: Reduction,
        vars: &[VarId],
        over: &IndexSet,
        filter: Option<&Expr>,
        body: &Expr,
    ) -> Value {
        let mut parts = Vec::new();
        for (who, count) in self.members(over) {
            let outer = self.vars.len();
            self.vars.extend(vars.iter().copied().zip(who));
            let kept = filter.map_or(Truth::YES, |filter| self.truth(filter));
            if kept.can_hold {
                parts.push((self.value(body), kept.certain(), count));
            }
            self.vars.truncate(outer);
        }
        fold(op, &parts)
    }
}

/// Puts together the values of a body, each with whether it is surely there, and how often.
fn fold(op: Reduction, parts: &[(Value, bool, usize)]) -> Value {
    let least = |certain: bool, count: usize| if certain { count } else { 0 };
    let numbers = || parts.iter().map(|(value, certain, count)| (value.number(), *certain, *count));
    let truths = || parts.iter().map(|(value, certain, _)| (value.truth(), *certain));
    let total: usize = parts.iter().map(|(.., count)| count).sum();
    Value::Number(match op {
        Reduction::Sum => {
            let sums = numbers().map(|(body, certain, count)| body.summed(least(certain, count), count));
            let sum = sums.fold(Interval::ZERO, |a, b| a + b);
            if parts.len() > 1 { keep_sign(sum, sum.rounded()) } else { sum }
        }
        Reduction::Mean => {
            let hull = numbers().map(|(body, ..)| body).reduce(Interval::hull).unwrap_or(Interval::ZERO);
            let slack = 2.0 * f64::EPSILON * total as f64 * hull.magnitude();
            let mean = if total > 1 && slack.is_finite() { hull.wider(slack) } else { hull };
            let mean = keep_sign(hull, mean);
            if numbers().any(|(_, certain, _)| certain) { mean } else { mean.hull(Interval::ZERO) }
        }
        Reduction::Min => {
            let low = numbers().map(|(body, ..)| body.low).fold(f64::INFINITY, f64::min);
            let sure = numbers().filter(|(_, certain, _)| *certain);
            Interval::new(low, sure.map(|(body, ..)| body.high).fold(f64::INFINITY, f64::min))
        }
        Reduction::Max => {
            let high = numbers().map(|(body, ..)| body.high).fold(f64::NEG_INFINITY, f64::max);
            let sure = numbers().filter(|(_, certain, _)| *certain);
            Interval::new(sure.map(|(body, ..)| body.low).fold(f64::NEG_INFINITY, f64::max), high)
        }
        Reduction::Count => {
            let counts = parts.iter().map(|(value, certain, count)| {
                let (truth, count) = (value.truth(), *count as f64);
                let always = *certain && truth.certain();
                Interval::new(if always { count } else { 0.0 }, if truth.can_hold { count } else { 0.0 })
            });
            counts.fold(Interval::ZERO, |a, b| a + b)
        }
        Reduction::Any | Reduction::All => {
            let meant = |truth: Truth| if op == Reduction::Any { truth } else { !truth };
            let mut any = Truth::NO;
            for (truth, certain) in truths() {
                let truth = meant(truth);
                any = any.or(Truth { can_fail: truth.can_fail || !certain, ..truth });
            }
            return Value::Truth(meant(any));
        }
    })
}

fn keep_sign(exact: Interval, wide: Interval) -> Interval {
    let low = if exact.low >= 0.0 { wide.low.max(0.0) } else { wide.low };
    Interval::new(low, if exact.high <= 0.0 { wide.high.min(0.0) } else { wide.high })
}

fn point(x: f64, y: f64) -> Plane {
    Plane::new(Interval::point(x), Interval::point(y))
}

/// The box around an obstacle, relative to its position.
pub fn outline(solid: &Solid) -> Plane {
    match solid {
        Solid::Disc { radius_m } => {
            Plane::new(Interval::around_zero(*radius_m), Interval::around_zero(*radius_m))
        }
        Solid::Segment { to_m } => Plane::ZERO.hull(point(to_m.0, to_m.1)),
        Solid::Polygon { corners_m } => {
            let corners = corners_m.iter().map(|&(x, y)| point(x, y));
            // The lengths of corners are not those of what lies between them.
            corners.reduce(Plane::hull).map_or(Plane::ZERO, |hull| Plane::new(hull.x, hull.y))
        }
    }
}

/// The shorter side of a box.
fn width(of: Plane) -> f64 {
    (of.x.high - of.x.low).min(of.y.high - of.y.low)
}
