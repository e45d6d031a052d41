//! What the policy sees: observations, their noise and their delay.

mod lanes;

use mpgx_lang::plan::{self, Binder, GroupId, IndexSet};
use mpgx_random::Purpose;

use crate::episode::Episode;
use crate::error::Flaw;
use crate::program::{Agents, Compiler, Each, Layout, Number, Program, Scene, Scope, Varies};
use crate::task::Task;

/// Late values that an episode keeps, at most.
const MOST_LATE: usize = 1 << 24;

/// One item of the learner's state: a number or a vector, for each member of a set.
#[derive(Clone, Debug)]
pub(crate) struct Observed {
    /// Of each entry, without its axis.
    names: Vec<String>,
    value: Program,
    each: Option<Each>,
    /// Standard deviation on each axis.
    noise: Option<Number>,
    /// Steps by which it is late.
    delay: usize,
}

impl Observed {
    /// Compiles an observation; `member` is the variable of a shared policy and its group.
    pub fn new(
        layout: &Layout,
        observation: &plan::Observation,
        member: Option<(&Binder, GroupId)>,
    ) -> Result<Observed, Flaw> {
        let mut compiler = compiler_of(layout, member)?;
        let mut each = match &observation.over {
            None => None,
            Some(each) => Some(compiler.open(std::slice::from_ref(&each.var), &each.set)?),
        };
        let filter = observation.over.as_ref().and_then(|each| each.filter.as_deref());
        if let (Some(each), Some(filter)) = (&mut each, filter) {
            compiler.varies = Varies::Never;
            let filter = compiler.truth(filter)?;
            let allowed = if each.is_nearest() { Varies::Never } else { Varies::WithMembers };
            if compiler.varies > allowed {
                return Err(Flaw::ChangingFilter);
            }
            each.filter = Some(filter);
        }
        let value = match observation.vector {
            true => Program::Vector(compiler.vector(&observation.value)?),
            false => Program::Number(compiler.number(&observation.value)?),
        };
        let noise = observation.noise.as_ref().map(|noise| compiler.number(noise)).transpose()?;
        if let Some(Number::Constant(value)) = noise
            && !(value.is_finite() && value >= 0.0)
        {
            return Err(Flaw::Negative { value });
        }
        let names = match &each {
            None => vec![observation.text.clone()],
            Some(each) => names(layout, &observation.text, each, member.map(|(_, group)| group))?,
        };
        let observed = Observed { names, value, each, noise, delay: observation.delay };
        let kept = observed.delay.checked_add(1).and_then(|rows| rows.checked_mul(observed.width().max(1)));
        match kept {
            Some(kept) if kept <= MOST_LATE => Ok(observed),
            _ => Err(Flaw::TooLate { delay: observed.delay }),
        }
    }

    fn axes(&self) -> usize {
        if matches!(self.value, Program::Vector(_)) { 2 } else { 1 }
    }

    /// Entries of the state.
    pub fn width(&self) -> usize {
        self.axes() * self.names.len()
    }

    /// Late values that are kept for each member.
    pub fn late(&self) -> usize {
        if self.delay > 0 { (self.delay + 1) * self.width() } else { 0 }
    }

    pub fn entries(&self) -> impl Iterator<Item = String> {
        let axes: &[&str] = if self.axes() == 2 { &[" x", " y"] } else { &[""] };
        self.names.iter().flat_map(|name| axes.iter().map(move |axis| format!("{name}{axis}")))
    }

    fn visit(&self, scene: &mut Scene, mut visit: impl FnMut(&mut Scene)) {
        match &self.each {
            None => visit(scene),
            Some(each) => each.visit(scene, |scene| {
                visit(scene);
                true
            }),
        }
    }
}

/// A compiler in whose scope the first variable stands for the member of a shared policy.
pub(crate) fn compiler_of<'a>(
    layout: &'a Layout<'a>,
    member: Option<(&Binder, GroupId)>,
) -> Result<Compiler<'a>, Flaw> {
    let mut compiler = Compiler::new(layout, Scope::default());
    if let Some((var, group)) = member {
        compiler.open(std::slice::from_ref(var), &IndexSet::Group(group))?;
    }
    Ok(compiler)
}

/// The name of each entry. With a shared policy each member must have as many.
fn names(layout: &Layout, text: &str, each: &Each, shared: Option<GroupId>) -> Result<Vec<String>, Flaw> {
    let members = shared.map_or(Ok(0..1), |group| layout.group(group))?;
    let lists = members.clone().map(|member| entries(layout, each, member));
    let mut first: Option<Vec<usize>> = None;
    let mut alike = true;
    for (member, list) in members.clone().zip(lists) {
        let first = first.get_or_insert_with(|| list.clone());
        alike &= *first == list;
        if first.len() != list.len() {
            let name = |member: usize| &layout.names[member];
            let (a, b) = (name(members.start), name(member));
            let found = format!("{a} has {} and {b} has {}", first.len(), list.len());
            return Err(Flaw::UnequalStates { found });
        }
    }
    let first = first.unwrap_or_default();
    let name = |(k, agent): (usize, &usize)| match alike && !each.is_nearest() {
        _ if each.is_nearest() => format!("{text} (nearest {})", k + 1),
        true => format!("{text} ({})", layout.names[*agent]),
        false => format!("{text} ({} of {})", k + 1, first.len()),
    };
    Ok(first.iter().enumerate().map(name).collect())
}

/// The agents that a set has for the member of a shared policy; of the nearest any, as many as there can be.
fn entries(layout: &Layout, each: &Each, member: usize) -> Vec<usize> {
    let nobody = Agents::default();
    let mut scene = Scene::new(&layout.model, &nobody, &[], 0.0);
    scene.bind(member);
    let mut entries = Vec::new();
    each.list(&mut scene, &mut entries);
    entries
}

impl Task {
    /// What each entry of the state is, as written: `F[i] - p[i] (follower[2]) x`.
    pub fn observation_names(&self) -> Vec<String> {
        self.observed.iter().flat_map(Observed::entries).collect()
    }

    /// Writes the learner's state, SI values in the Plan's order; of a shared policy that of the first member.
    ///
    /// # Panics
    /// If `out` is not of length [`Task::state_len`], or if the episode is of another task.
    pub fn observe(&self, episode: &Episode, out: &mut [f32]) {
        self.observe_member(episode, 0, out);
    }

    /// Writes the state of a member of a shared policy; without one, member 0 is the learner.
    ///
    /// # Panics
    /// As [`Task::observe`].
    pub fn observe_member(&self, episode: &Episode, member: usize, out: &mut [f32]) {
        assert_eq!(out.len(), self.state_len, "length of the state");
        let mut scene = self.scene(episode);
        self.bind(&mut scene, member);
        let step = episode.step as u64;
        let mut noise = self.noisy.then(|| episode.key.address(Purpose::Sensor, member, step).stream());
        let (mut next, mut kept) = (0, 0);
        for observed in &self.observed {
            let vector = matches!(observed.value, Program::Vector(_));
            let first = next;
            let late = &episode.late[self.row(observed, kept, episode.step + 1, member)];
            kept += observed.late();
            observed.visit(&mut scene, |scene| {
                let [mut x, mut y] = match late.get(next - first) {
                    None => observed.value.eval(scene),
                    Some(x) => [*x, late.get(next - first + 1).copied().unwrap_or_default()],
                };
                if let (Some(deviation), Some(stream)) = (&observed.noise, &mut noise) {
                    let deviation = deviation.eval(scene);
                    x += deviation * stream.normal();
                    if vector {
                        y += deviation * stream.normal();
                    }
                }
                out[next] = x as f32;
                next += 1;
                if vector {
                    out[next] = y as f32;
                    next += 1;
                }
            });
        }
    }

    /// Where the values of a step lie in [`Episode::late`]: those of `kept` values of each member come before.
    fn row(&self, observed: &Observed, kept: usize, step: usize, member: usize) -> std::ops::Range<usize> {
        if observed.delay == 0 {
            return 0..0;
        }
        let row = step % (observed.delay + 1);
        let first = kept * self.members() + (row * self.members() + member) * observed.width();
        first..first + observed.width()
    }

    /// Keeps the values of the start as if they had been there long before.
    pub(crate) fn remember_start(&self, episode: &mut Episode) {
        self.remember(episode);
        let mut first = 0;
        for observed in &self.observed {
            let row = observed.width() * self.members();
            let end = first + observed.late() * self.members();
            for to in (first..end).step_by(row.max(1)).skip(1) {
                episode.late.copy_within(first..first + row, to);
            }
            first = end;
        }
    }

    /// Keeps the present values of what is observed late.
    pub(crate) fn remember(&self, episode: &mut Episode) {
        if episode.late.is_empty() {
            return;
        }
        let mut late = std::mem::take(&mut episode.late);
        let mut kept = 0;
        for observed in self.observed.iter().filter(|observed| observed.delay > 0) {
            for member in 0..self.members() {
                let mut scene = self.scene(episode);
                self.bind(&mut scene, member);
                let mut row = late[self.row(observed, kept, episode.step, member)].iter_mut();
                observed.visit(&mut scene, |scene| {
                    let value = observed.value.eval(scene);
                    for (x, kept) in value[..observed.axes()].iter().zip(row.by_ref()) {
                        *kept = *x;
                    }
                });
            }
            kept += observed.late();
        }
        episode.late = late;
    }
}

#[cfg(test)]
mod tests;
