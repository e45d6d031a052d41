//! Formations: compiled, and how far a world is from them.

use std::ops::Range;

use mpgx_lang::plan::{self, Expr, FormationId, Frame, Slots};

use super::Task;
use crate::episode::Episode;
use crate::error::{Flaw, SimError};
use crate::maths::distance;
use crate::program::{Compiler, Constraint, Formation, Layout, Scope};

/// Compiles a formation.
pub(super) fn formation(
    layout: &Layout,
    id: FormationId,
    formation: &plan::Formation,
) -> Result<Formation, SimError> {
    let (name, at) = (|| formation.name.clone(), || formation.at.clone());
    let missing = |what, id| SimError::BadFormation { formation: name(), what, id, at: at() };
    let members =
        layout.groups.get(formation.group).cloned().ok_or_else(|| missing("group", formation.group))?;
    if let Some(about) = formation.about.filter(|about| *about >= layout.names.len()) {
        return Err(missing("agent", about));
    }
    let flawed = |what: String, flaw| SimError::Expression { what, flaw, at: at() };
    let constraint = match &formation.constraint {
        plan::Constraint::Displacements { slots, frame } => {
            let about = layout.about(formation);
            let about = about.map_err(|flaw| flawed(format!("formation `{}`", formation.name), flaw))?;
            let exprs = places(layout, formation, slots, &members)?;
            let place = |(k, expr): (usize, &&Expr)| {
                let scope = Scope { slot: Some((k + 1, members.len())), formation: true, ..Scope::default() };
                let what = || format!("slot {} of formation `{}`", k + 1, formation.name);
                Compiler::new(layout, scope).vector(expr).map_err(|flaw| flawed(what(), flaw))
            };
            let displacements = exprs.iter().enumerate().map(place).collect::<Result<_, _>>()?;
            Constraint::Displacements { about, displacements, turned: *frame == Frame::Heading }
        }
        plan::Constraint::Distances(exprs) => {
            let what = || format!("formation `{}`", formation.name);
            let edges = layout.edges(id).map_err(|flaw| flawed(what(), flaw))?;
            if exprs.len() != 1 && exprs.len() != edges.len() || exprs.is_empty() {
                let (distances, edges) = (exprs.len(), edges.len());
                return Err(SimError::DistancesOfFormation { formation: name(), distances, edges, at: at() });
            }
            let length = |expr| {
                let scope = Scope { formation: true, ..Scope::default() };
                Compiler::new(layout, scope).number(expr).map_err(|flaw: Flaw| flawed(what(), flaw))
            };
            Constraint::Distances { lengths: exprs.iter().map(length).collect::<Result<_, _>>()?, edges }
        }
    };
    let (about, graph) = (formation.about, formation.graph.clone());
    Ok(Formation { first: members.start, members: members.len(), about, graph, constraint })
}

/// One expression for each member.
fn places<'a>(
    layout: &Layout,
    formation: &plan::Formation,
    slots: &'a Slots,
    members: &Range<usize>,
) -> Result<Vec<&'a Expr>, SimError> {
    let exprs: Vec<&Expr> = match slots {
        Slots::List(list) => list.iter().collect(),
        Slots::Rule(rule) => vec![rule; members.len()],
    };
    if exprs.len() == members.len() {
        return Ok(exprs);
    }
    Err(SimError::SlotsOfFormation {
        formation: formation.name.clone(),
        slots: exprs.len(),
        group: layout.world.groups[formation.group].name.clone(),
        members: members.len(),
        at: formation.at.clone(),
    })
}

impl Task {
    pub(crate) fn refresh_slots(&self, episode: &mut Episode) {
        let mut slots = std::mem::take(&mut episode.slots);
        let mut scene = self.scene(episode);
        let mut places = slots.iter_mut();
        for (k, formation) in self.model.formations.iter().enumerate() {
            for (member, slot) in places.by_ref().take(formation.places()).enumerate() {
                *slot = scene.slot(k, formation.first + member);
            }
        }
        episode.slots = slots;
    }

    /// Mean over the members that have a place, of their distance from it, and the neighbours whose distance is
    /// prescribed, of what theirs differs from it, m.
    pub(crate) fn error_m(&self, episode: &Episode) -> f64 {
        let position = &episode.agents.position;
        let mut slots = episode.slots.iter();
        let (mut sum, mut count) = (0.0, episode.slots.len());
        for (k, formation) in self.model.formations.iter().enumerate() {
            let members = &position[formation.first..];
            let places = slots.by_ref().take(formation.places());
            sum += members.iter().zip(places).map(|(p, f)| distance(*p, *f)).sum::<f64>();
            if !formation.edges().is_empty() {
                let mut scene = self.scene(episode);
                for (edge, &[a, b]) in formation.edges().iter().enumerate() {
                    sum += (distance(position[a], position[b]) - scene.rest(k, edge, [a, b])).abs();
                }
                count += formation.edges().len();
            }
        }
        sum / count.max(1) as f64
    }
}

#[cfg(test)]
mod tests;
