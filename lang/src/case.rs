//! What a scenario's expressions come to in one kind of episode: those of training, of an evaluation or of a stage.

use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};

use crate::constant::{Constant, Constants};
use crate::hir::{Expr, Hir, Kind, Landmark, Param, Slots, Track, World};
use crate::inline::{Inliner, Refusal, Value, group_of as group_of_set};
use crate::plan::{self, AgentRef, Area, GroupId, IndexSet, ParamId, Quantity, Schedule, Setting, VarId};

pub struct Case<'s> {
    pub world: &'s World,
    pub constants: Constants,
    tracks: &'s [Track],
    /// Parameters that differ from those of the Plan.
    pub folded: BTreeMap<ParamId, f64>,
    /// Nodes inlined so far, over all cases.
    spent: &'s Cell<usize>,
}

impl<'s> Case<'s> {
    /// `plan`: the parameters that the Plan lists. What is drawn for each episode has no value.
    pub fn of(hir: &'s Hir, plan: &[Param], spent: &'s Cell<usize>) -> Case<'s> {
        let mut params: Vec<Option<f64>> = hir.params.iter().map(|param| param.value).collect();
        for drawn in &hir.world.randomise {
            params.iter_mut().skip(drawn.param).take(1).for_each(|value| *value = None);
        }
        Case::with(hir, plan, params, spent)
    }

    /// With these values of the parameters.
    pub fn with(hir: &'s Hir, plan: &[Param], params: Vec<Option<f64>>, spent: &'s Cell<usize>) -> Case<'s> {
        let differing = params.iter().zip(plan).enumerate().filter_map(|(id, (value, param))| {
            value.filter(|_| *value != param.value).map(|value| (id, value))
        });
        let folded = differing.collect();
        let constants = Constants { params, ..Constants::default() };
        let mut case = Case { world: &hir.world, tracks: &hir.tracks, constants, folded, spent };
        let numbers = |expr: &Option<Expr>| expr.as_ref().and_then(|expr| case.number(expr));
        let world = case.world;
        let (dt, safety, horizon) = (numbers(&world.dt), numbers(&world.safety), numbers(&world.horizon));
        case.constants =
            Constants { dt_s: dt, safety_m: safety, horizon, ..std::mem::take(&mut case.constants) };
        case
    }

    pub fn inliner(&self) -> Inliner<'_> {
        Inliner::new(self.world, self.tracks, &self.folded, self.spent)
    }

    /// With other parameters replaced by numbers.
    pub fn inliner_with<'c>(&'c self, folded: &'c BTreeMap<ParamId, f64>) -> Inliner<'c> {
        Inliner::new(self.world, self.tracks, folded, self.spent)
    }

    pub fn value(&self, expr: &Expr) -> Result<Value, Refusal> {
        self.inliner().value(expr, &[])
    }

    /// The value of a constant, finite number.
    pub fn number(&self, expr: &Expr) -> Option<f64> {
        let number = match &expr.kind {
            Kind::Number(number) => Some(*number),
            _ => match self.value(expr).ok()? {
                Value::Expr(expr) => self.constants.number(&expr),
                _ => None,
            },
        };
        number.filter(|number| number.is_finite())
    }

    fn finite(&self, expr: &plan::Expr) -> Option<f64> {
        self.constants.number(expr).filter(|number| number.is_finite())
    }

    pub fn range(&self, expr: &Expr) -> Option<(f64, f64)> {
        match self.value(expr).ok()? {
            Value::Range(low, high) => Some((self.finite(&low)?, self.finite(&high)?)),
            _ => None,
        }
    }

    pub fn area(&self, expr: &Expr) -> Option<Area> {
        let Value::Area(sides) = self.value(expr).ok()? else { return None };
        let [left, right, bottom, top] = *sides;
        let x_m = (self.finite(&left)?, self.finite(&right)?);
        Some(Area { x_m, y_m: (self.finite(&bottom)?, self.finite(&top)?) })
    }

    /// The value of something that Rust reads.
    pub fn setting(&self, expr: &Expr) -> Option<Setting> {
        Some(match self.value(expr).ok()? {
            Value::Word(word) => Setting::Word(word),
            Value::Range(low, high) => Setting::Range(self.finite(&low)?, self.finite(&high)?),
            Value::List(all) => {
                Setting::List(all.iter().map(|entry| self.finite(entry)).collect::<Option<_>>()?)
            }
            Value::Expr(value) => match self.constants.value(&value)? {
                Constant::Truth(truth) => Setting::Truth(truth),
                Constant::Number(number) if number.is_finite() => Setting::Number(number),
                _ => return None,
            },
            Value::Schedule(curve, parts) => {
                let [from, to, begin, end] = *parts;
                let [from, to] = [self.finite(&from)?, self.finite(&to)?];
                let [begin, end] = [self.finite(&begin)?, self.finite(&end)?];
                Setting::Schedule(Schedule { curve, from, to, begin, end })
            }
            Value::Agent(..) | Value::Area(_) => return None,
            Value::Formation(_) | Value::Group(_) | Value::Track(_) => return None,
        })
    }

    /// The value of a constant, finite vector.
    pub fn point(&self, expr: &Expr) -> Option<(f64, f64)> {
        match self.value(expr).ok()? {
            Value::Expr(expr) => self.finite_point(&expr),
            _ => None,
        }
    }

    /// The value of a constant list of vectors.
    pub fn points(&self, expr: &Expr) -> Option<Vec<(f64, f64)>> {
        match self.value(expr).ok()? {
            Value::List(all) => all.iter().map(|point| self.finite_point(point)).collect(),
            _ => None,
        }
    }

    fn finite_point(&self, expr: &plan::Expr) -> Option<(f64, f64)> {
        self.constants.vector(expr).filter(|(x, y)| x.is_finite() && y.is_finite())
    }

    /// How many entries a constant list has.
    pub fn length(&self, expr: &Expr) -> Option<usize> {
        match self.value(expr).ok()? {
            Value::List(all) => Some(all.len()),
            _ => None,
        }
    }

    /// Position (m) and heading (rad) of each of some landmarks.
    pub fn landmarks(&self, landmark: &Landmark) -> Option<Vec<((f64, f64), f64)>> {
        let of = |expr: &Expr, number: usize| -> Option<Constant> {
            match self.value(expr).ok()? {
                Value::List(all) => self.constants.value(all.get(number)?),
                Value::Expr(rule) => {
                    let slot = Some((number as f64 + 1.0, landmark.count() as f64));
                    Constants { slot, ..self.constants.clone() }.value(&rule)
                }
                _ => None,
            }
        };
        let placed = |number: usize| {
            let heading = match &landmark.heading {
                Some(heading) => of(heading, number)?,
                None => Constant::Number(0.0),
            };
            match (of(&landmark.at, number)?, heading) {
                (Constant::Vector(x, y), Constant::Number(heading))
                    if [x, y, heading].iter().all(|value| value.is_finite()) =>
                {
                    Some(((x, y), heading))
                }
                _ => None,
            }
        };
        (0..landmark.count()).map(placed).collect()
    }

    /// The groups whose positions an expression in the settings of a group depends on.
    pub fn groups_in(&self, expr: &plan::Expr, member_of: GroupId, found: &mut BTreeSet<GroupId>) {
        match expr {
            plan::Expr::Agent(_, agent) => found.extend(self.group_of_agent(*agent, member_of)),
            plan::Expr::Clearance(a, b) => {
                found.extend([a, b].into_iter().filter_map(|agent| self.group_of_agent(*agent, member_of)));
            }
            plan::Expr::Slot(formation, _) => {
                found.extend(self.world.formations.get(*formation).and_then(|formation| formation.about));
            }
            plan::Expr::Reduce { over, .. } => found.extend(self.groups_of(over)),
            _ => {}
        }
        expr.parts().into_iter().for_each(|part| self.groups_in(part, member_of, found));
    }

    /// The groups whose members an expression asks whether they are outside.
    pub fn asked_outside(
        &self,
        expr: &plan::Expr,
        vars: &mut BTreeMap<VarId, Vec<GroupId>>,
        found: &mut BTreeSet<GroupId>,
    ) {
        match expr {
            plan::Expr::Agent(Quantity::Outside, AgentRef::Fixed(agent)) => {
                found.extend(self.group_of(*agent))
            }
            plan::Expr::Agent(Quantity::Outside, AgentRef::Var(var)) => {
                found.extend(vars.get(var).into_iter().flatten());
            }
            plan::Expr::Reduce { vars: bound, over, .. } => {
                vars.extend(bound.iter().map(|var| (var.id, self.groups_of(over))));
            }
            _ => {}
        }
        expr.parts().into_iter().for_each(|part| self.asked_outside(part, vars, found));
    }

    /// Variables are of a set, which is seen where they are bound.
    fn group_of_agent(&self, agent: AgentRef, member_of: GroupId) -> Option<GroupId> {
        match agent {
            AgentRef::Member => Some(member_of),
            AgentRef::Fixed(agent) => self.group_of(agent),
            AgentRef::Var(_) => None,
        }
    }

    fn group_of(&self, agent: usize) -> Option<GroupId> {
        let mut next = 0;
        self.world.groups.iter().position(|group| {
            next += group.size;
            agent < next
        })
    }

    fn groups_of(&self, set: &IndexSet) -> Vec<GroupId> {
        let all = |obstacles: bool| {
            let groups = self.world.groups.iter().enumerate();
            groups.filter(|(_, group)| group.obstacle == obstacles).map(|(id, _)| id).collect()
        };
        match (group_of_set(set), set) {
            (Some(group), _) => vec![group],
            (None, IndexSet::Obstacles) => all(true),
            (None, IndexSet::Edges(formation)) => {
                let formation = self.world.formations.get(*formation);
                formation.into_iter().flat_map(|it| it.about.into_iter().chain([it.group])).collect()
            }
            (None, IndexSet::Pairs(of)) => self.groups_of(of),
            (None, IndexSet::Nearest { among, .. }) => self.groups_of(among),
            (None, _) => all(false),
        }
    }

    /// Displacements of a formation's members, where they are constant.
    pub fn slots(&self, formation: usize) -> Option<Vec<(f64, f64)>> {
        let formation = self.world.formations.get(formation)?;
        let shape = formation.shape.as_ref()?;
        let mut inliner = self.inliner();
        let args = inliner.all(&shape.args, &[]).ok()?;
        match &shape.what.slots {
            Slots::List(all) => {
                all.iter().map(|slot| self.constants.vector(&inliner.expr(slot, &args).ok()?)).collect()
            }
            Slots::Rule(rule) => {
                let rule = inliner.expr(rule, &args).ok()?;
                let size = self.world.groups.get(formation.group)?.size;
                let constants =
                    |k: usize| Constants { slot: Some((k as f64, size as f64)), ..self.constants.clone() };
                (1..=size).map(|k| constants(k).vector(&rule)).collect()
            }
            Slots::Edges(_) | Slots::Graph(..) => None,
        }
    }
}
