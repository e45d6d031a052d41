//! Typed expressions to expressions of the Plan: calls, lets and arguments are replaced by what they stand for.

use std::cell::Cell;
use std::collections::BTreeMap;

use crate::ast::Span;
use crate::hir::{Draw, Expr, Function, Kind, OwnSetting, Part, World};
use crate::plan::{self, AgentRef, Binder, Distribution, GroupId, IndexSet, ParamId, VarId};

/// Nodes of all expressions together after inlining, at most.
const LARGEST: usize = 1_000_000;

/// What an expression comes to.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    Expr(plan::Expr),
    Agent(AgentRef, Option<GroupId>),
    Range(plan::Expr, plan::Expr),
    /// Left, right, bottom, top.
    Area(Box<[plan::Expr; 4]>),
    List(Vec<plan::Expr>),
    Word(String),
}

impl Value {
    fn exprs(&self) -> Vec<&plan::Expr> {
        match self {
            Value::Expr(expr) => vec![expr],
            Value::Range(low, high) => vec![low, high],
            Value::Area(sides) => sides.iter().collect(),
            Value::List(all) => all.iter().collect(),
            Value::Agent(..) | Value::Word(_) => Vec::new(),
        }
    }
}

fn nodes(expr: &plan::Expr) -> usize {
    1 + expr.parts().into_iter().map(nodes).sum::<usize>()
}

/// Why there is no value.
#[derive(Clone, Debug, PartialEq)]
pub enum Refusal {
    /// A problem was reported for a part of it.
    Poison,
    /// Too many nodes.
    TooLarge,
    /// The slot of an agent that is not in the formation.
    ForeignSlot(Span),
}

/// Inlines expressions that belong together: their variables and draws are numbered through.
pub struct Inliner<'h> {
    world: &'h World,
    /// Parameters to be replaced by numbers.
    folded: &'h BTreeMap<ParamId, f64>,
    vars: BTreeMap<VarId, (VarId, Option<GroupId>)>,
    next_var: VarId,
    next_site: usize,
    /// Nodes so far, also of other inliners.
    spent: &'h Cell<usize>,
}

impl<'h> Inliner<'h> {
    pub fn new(world: &'h World, folded: &'h BTreeMap<ParamId, f64>, spent: &'h Cell<usize>) -> Self {
        Inliner { world, folded, vars: BTreeMap::new(), next_var: 0, next_site: 0, spent }
    }

    /// An expression that is a number, a vector or a truth value.
    pub fn expr(&mut self, expr: &Expr, args: &[Value]) -> Result<plan::Expr, Refusal> {
        match self.value(expr, args)? {
            Value::Expr(expr) => Ok(expr),
            _ => Err(Refusal::Poison),
        }
    }

    fn boxed(&mut self, expr: &Expr, args: &[Value]) -> Result<Box<plan::Expr>, Refusal> {
        self.expr(expr, args).map(Box::new)
    }

    /// The arguments of a call made where `args` are the arguments.
    pub fn all(&mut self, exprs: &[Expr], args: &[Value]) -> Result<Vec<Value>, Refusal> {
        exprs.iter().map(|expr| self.value(expr, args)).collect()
    }

    /// Any expression. `args` are those of the function, motion or shape around.
    pub fn value(&mut self, expr: &Expr, args: &[Value]) -> Result<Value, Refusal> {
        self.spend(1)?;
        use plan::Expr as E;
        Ok(Value::Expr(match &expr.kind {
            Kind::Poison => return Err(Refusal::Poison),
            Kind::Number(value) => E::Number(*value),
            Kind::Truth(truth) => E::Truth(*truth),
            Kind::Word(word) => return Ok(Value::Word(word.clone())),
            Kind::Param(id) => self.folded.get(id).map_or(E::Param(*id), |&value| E::Number(value)),
            Kind::Let(value) => return self.value(value, args),
            Kind::Argument(k) => return self.argument(args.get(*k)),
            Kind::State(k) => E::State(*k),
            Kind::SlotNumber => E::SlotNumber,
            Kind::SlotCount => E::SlotCount,
            Kind::Time => E::Time,
            Kind::World(constant) => E::World(*constant),
            Kind::Setting(group, which) => {
                let group = self.world.groups.get(*group).ok_or(Refusal::Poison)?;
                let setting = match which {
                    OwnSetting::Arena => &group.arena,
                    OwnSetting::Speed => &group.speed,
                };
                return self.value(setting.as_ref().ok_or(Refusal::Poison)?, args);
            }
            Kind::Member(group) => return Ok(Value::Agent(AgentRef::Member, Some(*group))),
            Kind::Fixed(group, member) => {
                let first: usize = self.world.groups.iter().take(*group).map(|group| group.size).sum();
                return Ok(Value::Agent(AgentRef::Fixed(first + member), Some(*group)));
            }
            Kind::Var(id) => {
                let &(id, group) = self.vars.get(id).ok_or(Refusal::Poison)?;
                return Ok(Value::Agent(AgentRef::Var(id), group));
            }
            Kind::Vector(x, y) => E::Vector(self.boxed(x, args)?, self.boxed(y, args)?),
            Kind::List(all) => {
                let all = all.iter().map(|expr| self.expr(expr, args)).collect::<Result<_, _>>()?;
                return Ok(Value::List(all));
            }
            Kind::Range(low, high) => return Ok(Value::Range(self.expr(low, args)?, self.expr(high, args)?)),
            Kind::Area(x, y) => {
                let (Value::Range(left, right), Value::Range(bottom, top)) =
                    (self.value(x, args)?, self.value(y, args)?)
                else {
                    return Err(Refusal::Poison);
                };
                return Ok(Value::Area(Box::new([left, right, bottom, top])));
            }
            Kind::Part(part, whole) => self.part(*part, whole, args)?,
            Kind::Unary(op, operand) => match (op, self.expr(operand, args)?) {
                (plan::UnaryOp::Neg, E::Number(value)) => E::Number(-value),
                (_, operand) => E::Unary(*op, Box::new(operand)),
            },
            Kind::Binary(op, left, right) => {
                E::Binary(*op, self.boxed(left, args)?, self.boxed(right, args)?)
            }
            Kind::BuiltIn(function, of) => {
                E::Call(*function, of.iter().map(|expr| self.expr(expr, args)).collect::<Result<_, _>>()?)
            }
            Kind::Call(function, of) => return self.call(function, of, args),
            Kind::If { condition, then, otherwise } => E::If {
                condition: self.boxed(condition, args)?,
                then: self.boxed(then, args)?,
                otherwise: self.boxed(otherwise, args)?,
            },
            Kind::Agent(quantity, agent) => E::Agent(*quantity, self.agent(agent, args)?.0),
            Kind::Slot(formation, agent) => {
                let (agent, group) = self.agent(agent, args)?;
                let of = self.world.formations.get(*formation).ok_or(Refusal::Poison)?.group;
                if group != Some(of) {
                    return Err(Refusal::ForeignSlot(expr.span));
                }
                E::Slot(*formation, agent)
            }
            Kind::Reduce { op, over, body } => {
                let (vars, filter) = self.over(over, args)?;
                let body = self.boxed(body, args)?;
                E::Reduce { op: *op, vars, over: over.set.clone(), filter, body }
            }
            Kind::Draw(draw, of) => {
                let mut of =
                    of.iter().map(|expr| self.boxed(expr, args)).collect::<Result<Vec<_>, _>>()?.into_iter();
                let mut next = || of.next().ok_or(Refusal::Poison);
                let distribution = match draw {
                    Draw::Uniform => Distribution::Uniform { low: next()?, high: next()? },
                    Draw::Normal => Distribution::Normal { mean: next()?, deviation: next()? },
                    Draw::UnitDisc => Distribution::UnitDisc,
                };
                let site = self.next_site;
                self.next_site += 1;
                E::Draw { distribution, site }
            }
        }))
    }

    fn spend(&self, nodes: usize) -> Result<(), Refusal> {
        self.spent.set(self.spent.get().saturating_add(nodes));
        if self.spent.get() > LARGEST { Err(Refusal::TooLarge) } else { Ok(()) }
    }

    fn argument(&mut self, value: Option<&Value>) -> Result<Value, Refusal> {
        let value = value.ok_or(Refusal::Poison)?;
        self.spend(value.exprs().into_iter().map(nodes).sum())?;
        Ok(value.clone())
    }

    fn call(&mut self, function: &Function, of: &[Expr], args: &[Value]) -> Result<Value, Refusal> {
        let of = self.all(of, args)?;
        self.value(&function.body, &of)
    }

    /// `vars in set if filter`; the variables stay bound for what is inlined next.
    pub fn over(
        &mut self,
        over: &crate::hir::Over,
        args: &[Value],
    ) -> Result<(Vec<Binder>, Option<Box<plan::Expr>>), Refusal> {
        let group = group_of(&over.set);
        let mut binders = Vec::new();
        for (id, name) in &over.vars {
            self.vars.insert(*id, (self.next_var, group));
            binders.push(Binder { id: self.next_var, name: name.clone() });
            self.next_var += 1;
        }
        let filter = over.filter.as_deref().map(|filter| self.boxed(filter, args)).transpose()?;
        Ok((binders, filter))
    }

    fn agent(&mut self, expr: &Expr, args: &[Value]) -> Result<(AgentRef, Option<GroupId>), Refusal> {
        match self.value(expr, args)? {
            Value::Agent(agent, group) => Ok((agent, group)),
            _ => Err(Refusal::Poison),
        }
    }

    fn part(&mut self, part: Part, whole: &Expr, args: &[Value]) -> Result<plan::Expr, Refusal> {
        Ok(match (part, self.value(whole, args)?) {
            (Part::Low, Value::Range(low, _)) => low,
            (Part::High, Value::Range(_, high)) => high,
            (part, Value::Area(area)) => {
                let [left, right, bottom, top] = *area;
                match part {
                    Part::Left => left,
                    Part::Right => right,
                    Part::Bottom => bottom,
                    _ => top,
                }
            }
            _ => return Err(Refusal::Poison),
        })
    }
}

/// The group that all members of a set belong to, if there is one.
pub fn group_of(set: &IndexSet) -> Option<GroupId> {
    match set {
        IndexSet::All | IndexSet::Obstacles | IndexSet::Edges(_) => None,
        IndexSet::Nearest { among, .. } => group_of(among),
        IndexSet::Group(group) => Some(*group),
        IndexSet::Pairs(set) => group_of(set),
    }
}
