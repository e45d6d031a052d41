//! Typed expressions to expressions of the Plan: calls, lets and arguments are replaced by what they stand for.

use std::cell::Cell;
use std::collections::BTreeMap;

use crate::ast::Span;
use crate::hir::{Draw, Expr, Function, Kind, OwnSetting, Part, Set, Track, World};
use crate::plan::{
    self, AgentRef, Binder, Distribution, FormationId, GroupId, IndexSet, ParamId, TrackId, VarId,
};

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
    Formation(FormationId),
    Group(IndexSet),
    Track(TrackId),
    /// From, to, begin and end.
    Schedule(plan::Curve, Box<[plan::Expr; 4]>),
}

impl Value {
    fn exprs(&self) -> Vec<&plan::Expr> {
        match self {
            Value::Expr(expr) => vec![expr],
            Value::Range(low, high) => vec![low, high],
            Value::Area(parts) | Value::Schedule(_, parts) => parts.iter().collect(),
            Value::List(all) => all.iter().collect(),
            Value::Agent(..) | Value::Word(_) => Vec::new(),
            Value::Formation(_) | Value::Group(_) | Value::Track(_) => Vec::new(),
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
    /// The distance of two that are no neighbours in the formation.
    NoNeighbours(Span),
    /// The place in a formation of distances.
    NoPlaces(Span),
    /// A set that cannot stand there.
    WrongSet(Span),
}

/// Inlines expressions that belong together: their variables and draws are numbered through.
pub struct Inliner<'h> {
    world: &'h World,
    /// Parameters to be replaced by numbers.
    folded: &'h BTreeMap<ParamId, f64>,
    tracks: &'h [Track],
    /// The group whose member [`Kind::Own`] is.
    own: Option<GroupId>,
    vars: BTreeMap<VarId, Bound>,
    next_var: VarId,
    next_site: usize,
    /// Nodes so far, also of other inliners.
    spent: &'h Cell<usize>,
}

/// An index variable.
#[derive(Clone, Copy)]
struct Bound {
    id: VarId,
    group: Option<GroupId>,
    /// The formation whose edges it runs over, together with the other variable.
    edge_of: Option<(FormationId, VarId)>,
}

impl<'h> Inliner<'h> {
    pub fn new(
        world: &'h World,
        tracks: &'h [Track],
        folded: &'h BTreeMap<ParamId, f64>,
        spent: &'h Cell<usize>,
    ) -> Self {
        Inliner { world, folded, tracks, own: None, vars: BTreeMap::new(), next_var: 0, next_site: 0, spent }
    }

    /// For the motion of a group.
    pub fn moving(self, group: GroupId) -> Self {
        Inliner { own: Some(group), ..self }
    }

    /// Binds a variable that stands for a member of a group.
    pub fn bind(&mut self, (id, name): &(VarId, String), group: GroupId) -> Binder {
        let binder = Binder { id: self.next_var, name: name.clone() };
        self.vars.insert(*id, Bound { id: binder.id, group: Some(group), edge_of: None });
        self.next_var += 1;
        binder
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
            Kind::Own => return Ok(Value::Agent(AgentRef::Member, self.own)),
            Kind::Fixed(group, member) => {
                let first: usize = self.world.groups.iter().take(*group).map(|group| group.size).sum();
                return Ok(Value::Agent(AgentRef::Fixed(first + member), Some(*group)));
            }
            Kind::Var(id) => {
                let bound = self.vars.get(id).ok_or(Refusal::Poison)?;
                return Ok(Value::Agent(AgentRef::Var(bound.id), bound.group));
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
            Kind::Formation(id) => return Ok(Value::Formation(*id)),
            Kind::Slot(formation, agent) => {
                let formation = self.formation(formation, args)?;
                let (agent, group) = self.agent(agent, args)?;
                let of = self.world.formations.get(formation).ok_or(Refusal::Poison)?;
                if of.shape.as_ref().is_some_and(|shape| shape.what.slots.are_distances()) {
                    return Err(Refusal::NoPlaces(expr.span));
                }
                if group != Some(of.group) {
                    return Err(Refusal::ForeignSlot(expr.span));
                }
                E::Slot(formation, agent)
            }
            Kind::Rest(formation, pair) => {
                let formation = self.formation(formation, args)?;
                let [a, b] = self.two(pair, args)?;
                if !self.neighbours(formation, a, b) {
                    return Err(Refusal::NoNeighbours(expr.span));
                }
                E::Rest(formation, a, b)
            }
            Kind::Group(set) => return Ok(Value::Group(self.set(set, args)?)),
            Kind::Size(of) => E::Number(match self.value(of, args)? {
                Value::List(all) => all.len() as f64,
                Value::Group(set) => self.size(&set).ok_or(Refusal::WrongSet(of.span))? as f64,
                _ => return Err(Refusal::Poison),
            }),
            Kind::Clearance(pair) => {
                let [a, b] = self.two(pair, args)?;
                E::Clearance(a, b)
            }
            Kind::Same(pair) => {
                let [a, b] = self.two(pair, args)?;
                E::Same(a, b)
            }
            Kind::MemberNumber(agent) => E::MemberNumber(self.agent(agent, args)?.0),
            Kind::Element(list, number) => {
                let Value::List(all) = self.value(list, args)? else { return Err(Refusal::Poison) };
                match self.expr(number, args)? {
                    // A copy would double the work of lists in lists.
                    E::Number(k) if !all.is_empty() => {
                        let k = (k.floor().max(1.0) as usize).min(all.len());
                        all.into_iter().nth(k - 1).ok_or(Refusal::Poison)?
                    }
                    number => E::Element(all, Box::new(number)),
                }
            }
            Kind::Track(id) => return Ok(Value::Track(*id)),
            Kind::OnTrack(track, time) => {
                let Value::Track(track) = self.value(track, args)? else { return Err(Refusal::Poison) };
                E::Track(track, self.boxed(time, args)?)
            }
            Kind::Duration(track) => {
                let Value::Track(track) = self.value(track, args)? else { return Err(Refusal::Poison) };
                let points = &self.tracks.get(track).ok_or(Refusal::Poison)?.points;
                E::Number(points.last().map_or(0.0, |last| last.0))
            }
            Kind::Reduce { op, over, body } => {
                let (vars, set, filter) = self.over(over, args)?;
                let body = self.boxed(body, args)?;
                E::Reduce { op: *op, vars, over: set, filter, body }
            }
            Kind::Schedule(curve, of) => {
                let of = of.iter().map(|expr| self.expr(expr, args)).collect::<Result<Vec<_>, _>>()?;
                let of = of.try_into().map_err(|_| Refusal::Poison)?;
                return Ok(Value::Schedule(*curve, Box::new(of)));
            }
            Kind::Measured(measure) => E::Measured(*measure),
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
    pub fn over(&mut self, over: &crate::hir::Over, args: &[Value]) -> Result<Running, Refusal> {
        let set = self.set(&over.set, args)?;
        let group = group_of(&set);
        let first = self.next_var;
        let mut binders = Vec::new();
        for (id, name) in &over.vars {
            let edge_of = match &set {
                IndexSet::Edges(formation) => Some((*formation, 2 * first + 1 - self.next_var)),
                _ => None,
            };
            self.vars.insert(*id, Bound { id: self.next_var, group, edge_of });
            binders.push(Binder { id: self.next_var, name: name.clone() });
            self.next_var += 1;
        }
        let filter = over.filter.as_deref().map(|filter| self.boxed(filter, args)).transpose()?;
        Ok((binders, set, filter))
    }

    fn set(&mut self, set: &Set, args: &[Value]) -> Result<IndexSet, Refusal> {
        Ok(match set {
            Set::All => IndexSet::All,
            Set::Obstacles => IndexSet::Obstacles,
            Set::Group(group) => IndexSet::Group(*group),
            Set::Argument(k) => match args.get(*k) {
                Some(Value::Group(set)) => set.clone(),
                _ => return Err(Refusal::Poison),
            },
            Set::Members(formation) => {
                let id = self.formation(formation, args)?;
                IndexSet::Group(self.world.formations.get(id).ok_or(Refusal::Poison)?.group)
            }
            Set::Pairs(of) => IndexSet::Pairs(Box::new(self.set(of, args)?)),
            Set::Edges(formation) => IndexSet::Edges(self.formation(formation, args)?),
            Set::Nearest { count, to, among } => {
                let plan::Expr::Number(number) = self.expr(count, args)? else {
                    return Err(Refusal::WrongSet(count.span));
                };
                let among = Box::new(self.set(among, args)?);
                IndexSet::Nearest { count: number as usize, to: self.agent(to, args)?.0, among }
            }
        })
    }

    /// How many a set has.
    fn size(&self, set: &IndexSet) -> Option<usize> {
        let agents = |obstacles: bool| {
            let groups = self.world.groups.iter().filter(move |group| group.obstacle == obstacles);
            groups.map(|group| group.size).sum::<usize>()
        };
        Some(match set {
            IndexSet::All => agents(false),
            IndexSet::Obstacles => agents(true),
            IndexSet::Group(group) => self.world.groups.get(*group)?.size,
            IndexSet::Pairs(of) => {
                let size = self.size(of)?;
                size * size.saturating_sub(1) / 2
            }
            IndexSet::Edges(_) | IndexSet::Nearest { .. } => return None,
        })
    }

    fn formation(&mut self, expr: &Expr, args: &[Value]) -> Result<FormationId, Refusal> {
        match self.value(expr, args)? {
            Value::Formation(id) => Ok(id),
            _ => Err(Refusal::Poison),
        }
    }

    fn two(&mut self, pair: &[Expr; 2], args: &[Value]) -> Result<[AgentRef; 2], Refusal> {
        let [a, b] = pair;
        Ok([self.agent(a, args)?.0, self.agent(b, args)?.0])
    }

    /// Whether two agents are surely the ends of an edge of a formation.
    fn neighbours(&self, formation: FormationId, a: AgentRef, b: AgentRef) -> bool {
        match (a, b) {
            (AgentRef::Var(a), AgentRef::Var(b)) => {
                self.vars.values().any(|bound| bound.id == a && bound.edge_of == Some((formation, b)))
            }
            (AgentRef::Fixed(a), AgentRef::Fixed(b)) => self.world.edge(formation, a, b),
            _ => false,
        }
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

/// Variables, the set they run over, and a filter.
pub type Running = (Vec<Binder>, IndexSet, Option<Box<plan::Expr>>);

/// The group that all members of a set belong to, if there is one.
pub fn group_of(set: &IndexSet) -> Option<GroupId> {
    match set {
        IndexSet::All | IndexSet::Obstacles | IndexSet::Edges(_) => None,
        IndexSet::Nearest { among, .. } => group_of(among),
        IndexSet::Group(group) => Some(*group),
        IndexSet::Pairs(set) => group_of(set),
    }
}
