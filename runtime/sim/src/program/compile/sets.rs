//! Agents, index variables and the sets they run over.

use std::sync::Arc;

use mpgx_lang::plan::{AgentRef, Binder, Expr, IndexSet, Reduction};

use super::{Bound, Compiler, Varies};
use crate::error::Flaw;
use crate::program::each::{Each, Fold, Over};
use crate::program::{MOST_VARIABLES, Number, Program, Rest, Truth, Vector, Who};

impl Compiler<'_> {
    /// Binds index variables to the members of a set; [`Compiler::close`] ends it.
    pub fn open(&mut self, binders: &[Binder], set: &IndexSet) -> Result<Each, Flaw> {
        let variable = self.loops;
        let mut edge = None;
        let (over, members) = match set {
            IndexSet::Pairs(of) => (Over::Pairs, self.members(of)?),
            IndexSet::Edges(formation) => {
                edge = Some((*formation, variable + 2));
                (Over::Edges(self.layout.edges(*formation)?), self.layout.nodes(*formation)?.into())
            }
            IndexSet::Nearest { count, to, among } => {
                let (to, _) = self.who(*to)?;
                let members = self.members(among)?;
                self.must_be_placed(&members)?;
                (Over::Nearest { count: *count, to }, members)
            }
            single => (Over::Members, self.members(single)?),
        };
        let (expected, taken) = match over {
            Over::Members | Over::Nearest { .. } => (1, 1),
            Over::Pairs => (2, 2),
            Over::Edges(_) => (2, 3),
        };
        if binders.len() != expected {
            return Err(Flaw::Binders { expected, found: binders.len() });
        }
        if variable + taken > MOST_VARIABLES {
            return Err(Flaw::TooManyVariables { most: MOST_VARIABLES });
        }
        for (k, binder) in binders.iter().enumerate() {
            let variable = variable + k;
            self.variables.push(Bound { id: binder.id, variable, agents: members.clone(), edge });
        }
        self.loops += taken;
        Ok(Each { members, over, variable, filter: None })
    }

    /// Ends the scope of the variables of a set.
    pub fn close(&mut self, each: &Each) {
        self.loops = each.variable;
        self.variables.retain(|bound| bound.variable < each.variable);
    }

    pub(super) fn reduce(
        &mut self,
        op: Reduction,
        binders: &[Binder],
        set: &IndexSet,
        filter: Option<&Expr>,
        body: &Expr,
    ) -> Result<Program, Flaw> {
        let mut each = Box::new(self.open(binders, set)?);
        each.filter = filter.map(|filter| self.truth(filter)).transpose()?;
        let fold = match op {
            Reduction::Sum => Some(Fold::Sum),
            Reduction::Mean => Some(Fold::Mean),
            Reduction::Min => Some(Fold::Min),
            Reduction::Max => Some(Fold::Max),
            Reduction::Count | Reduction::Any | Reduction::All => None,
        };
        let program = if let Some(fold) = fold {
            let body = Box::new(self.number(body)?);
            self.close(&each);
            Program::Number(Number::Fold(fold, each, body))
        } else {
            let body = Box::new(self.truth(body)?);
            self.close(&each);
            match op {
                Reduction::Count => Program::Number(Number::Count(each, body)),
                Reduction::Any => Program::Truth(Truth::Any(each, body)),
                _ => Program::Truth(Truth::All(each, body)),
            }
        };
        Ok(program)
    }

    /// The members of a set of single agents.
    fn members(&self, set: &IndexSet) -> Result<Arc<[usize]>, Flaw> {
        let layout = self.layout;
        match set {
            IndexSet::All => Ok(layout.everyone.clone()),
            IndexSet::Obstacles => Ok(layout.obstacles.clone()),
            IndexSet::Group(id) => Ok(layout.group(*id)?.collect()),
            IndexSet::Pairs(_) => Err(Flaw::SetInSet { inner: "pairs" }),
            IndexSet::Edges(_) => Err(Flaw::SetInSet { inner: "edges" }),
            IndexSet::Nearest { .. } => Err(Flaw::SetInSet { inner: "the nearest" }),
        }
    }

    /// An agent whose state is looked at.
    pub(super) fn who(&mut self, agent: AgentRef) -> Result<(Who, Arc<[usize]>), Flaw> {
        let (who, agents) = self.known(agent)?;
        self.varies = Varies::InTime;
        self.must_be_placed(&agents)?;
        Ok((who, agents))
    }

    pub(super) fn known(&mut self, agent: AgentRef) -> Result<(Who, Arc<[usize]>), Flaw> {
        let fixed = |agent| (Who::Agent(agent), Arc::from([agent]));
        match agent {
            AgentRef::Fixed(id) if id < self.layout.names.len() => Ok(fixed(id)),
            AgentRef::Fixed(id) => Err(Flaw::UnknownAgent { id }),
            AgentRef::Member => self.scope.member.map(fixed).ok_or(Flaw::NoMember),
            AgentRef::Var(id) => {
                self.varies = self.varies.max(Varies::WithMembers);
                let bound = self.bound(id)?;
                Ok((Who::Variable(bound.variable), bound.agents.clone()))
            }
        }
    }

    fn bound(&self, id: usize) -> Result<&Bound, Flaw> {
        self.variables.iter().rev().find(|bound| bound.id == id).ok_or(Flaw::UnboundVariable { id })
    }

    pub(super) fn must_be_placed(&self, agents: &[usize]) -> Result<(), Flaw> {
        let Some(placed) = self.scope.placed else { return Ok(()) };
        match agents.iter().find(|&&agent| placed.get(agent) != Some(&true)) {
            None => Ok(()),
            Some(&agent) => Err(Flaw::NotYetPlaced { agent: self.layout.names[agent].clone() }),
        }
    }

    /// A place in a formation.
    pub(super) fn slot_of(&mut self, formation: usize, agent: AgentRef) -> Result<Vector, Flaw> {
        let about = self.layout.about(self.formation(formation)?)?;
        self.must_be_placed(&[about])?;
        let (who, agents) = self.known(agent)?;
        let members = self.layout.group(self.layout.world.formations[formation].group)?;
        if let Some(&stranger) = agents.iter().find(|&agent| !members.contains(agent)) {
            return Err(Flaw::NotInFormation { agent: self.layout.names[stranger].clone() });
        }
        self.varies = Varies::InTime;
        Ok(Vector::Slot(formation, who))
    }

    /// The distance that two neighbours should have.
    pub(super) fn rest(&mut self, formation: usize, a: AgentRef, b: AgentRef) -> Result<Number, Flaw> {
        self.formation(formation)?;
        let edges = self.layout.edges(formation)?;
        let edge = match (a, b) {
            (AgentRef::Var(a), AgentRef::Var(b)) => {
                let (a, b) = (self.bound(a)?, self.bound(b)?);
                let (of, numbered) = a.edge.filter(|_| a.id != b.id && a.edge == b.edge).unzip();
                numbered.filter(|_| of == Some(formation)).map(Who::Variable)
            }
            (a, b) => match (self.known(a)?.0, self.known(b)?.0) {
                (Who::Agent(a), Who::Agent(b)) => {
                    edges.iter().position(|&edge| edge == [a, b] || edge == [b, a]).map(Who::Agent)
                }
                _ => None,
            },
        };
        self.varies = Varies::InTime;
        let edge = edge.ok_or(Flaw::NoNeighbours)?;
        Ok(Number::Rest(Box::new(Rest { formation, edges, edge })))
    }

    fn formation(&self, id: usize) -> Result<&mpgx_lang::plan::Formation, Flaw> {
        match self.layout.world.formations.get(id) {
            _ if self.scope.formation => Err(Flaw::FormationInFormation),
            Some(formation) => Ok(formation),
            None => Err(Flaw::UnknownFormation { id }),
        }
    }

    /// At least one of the two must be an agent; it is put first.
    pub(super) fn clearance(&mut self, a: AgentRef, b: AgentRef) -> Result<Number, Flaw> {
        let ((a, first), (b, second)) = (self.who(a)?, self.who(b)?);
        let obstacles = |all: &[usize]| all.iter().any(|agent| self.layout.obstacles.contains(agent));
        match (obstacles(&first), obstacles(&second)) {
            (true, true) => Err(Flaw::NoClearance),
            (true, false) => Ok(Number::Clearance(Box::new([b, a]))),
            (false, _) => Ok(Number::Clearance(Box::new([a, b]))),
        }
    }
}
