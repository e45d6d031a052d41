//! What the compiler knows about a scenario beyond its types: `Plan → Analysis`, and problems on the way.
//!
//! It works on the finished Plan, so it sees what runs; terms, groups and formations correspond to those of the Hir
//! by index, which tells where they stand in the source.

pub mod bounds;
pub mod embedding;
pub mod eval;
pub mod formations;
pub mod influence;
pub mod interval;
pub mod optimum;
pub mod rigidity;
pub mod scene;
mod shape;
pub mod sizes;
pub mod space;
mod text;
pub mod unbounded;
pub mod value;

use crate::ast::Span;
use crate::check::units::Units;
use crate::hir::Hir;
use crate::plan::{Control, GroupId, Plan};
use crate::problem::{Problem, Problems};

use bounds::{Bounds, bounds};
use scene::{Mode, Scene};
use sizes::{Sizes, sizes};

/// What is known of a scenario.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Analysis {
    /// Of training, of each stage, and of each evaluation.
    pub episodes: Vec<Episodes>,
    pub sizes: Sizes,
    /// SI unit of the reward, for people.
    pub unit: String,
}

/// What is known of a kind of episode.
#[derive(Clone, Debug, PartialEq)]
pub struct Episodes {
    /// `training`, `stage NAME`, `evaluation NAME`
    pub name: String,
    /// Names of the terms.
    pub terms: Vec<String>,
    pub bounds: Bounds,
}

/// Finds out what can be known, and reports what looks wrong.
pub fn analyse(plan: &Plan, hir: &Hir, units: &Units, problems: &mut Problems) -> Analysis {
    let mut ground = Ground::new(plan, hir, problems);
    let training = Scene::new(plan, &plan.world, Mode::Training);
    formations::formations(&training, &mut ground);
    influence::influence(&training, &mut ground);
    unbounded::unbounded(&training, &mut ground);
    space::space(&training, None, &mut ground);

    let mut episodes = vec![Episodes::new("training".to_owned(), &training)];
    for stage in &plan.stages {
        let scene = Scene::new(plan, &stage.world, Mode::Training);
        episodes.push(Episodes::new(format!("stage {}", stage.name), &scene));
    }
    for (k, protocol) in plan.protocols.iter().enumerate() {
        let world = protocol.world.as_deref().unwrap_or(&plan.world);
        let scene = Scene::new(plan, world, Mode::Evaluation);
        if protocol.world.is_some() {
            let span = hir.protocols.get(k).map(|protocol| protocol.span);
            space::space(&scene, span.map(|span| (protocol.name.as_str(), span)), &mut ground);
        }
        episodes.push(Episodes::new(format!("evaluation {}", protocol.name), &scene));
    }
    Analysis { episodes, sizes: sizes(&training), unit: units.si(&hir.reward_dim) }
}

impl Episodes {
    fn new(name: String, scene: &Scene) -> Episodes {
        let terms = scene.world.reward.iter().map(|term| term.name.clone()).collect();
        Episodes { name, terms, bounds: bounds(scene) }
    }
}

/// Where findings are reported.
pub struct Ground<'a> {
    plan: &'a Plan,
    hir: &'a Hir,
    problems: &'a mut Problems,
}

impl<'a> Ground<'a> {
    pub fn new(plan: &'a Plan, hir: &'a Hir, problems: &'a mut Problems) -> Self {
        Ground { plan, hir, problems }
    }

    fn term_name(&self, term: usize) -> &str {
        self.plan.world.reward.get(term).map_or("", |term| term.name.as_str())
    }

    fn group_name(&self, group: GroupId) -> &str {
        self.plan.world.groups.get(group).map_or("", |group| group.name.as_str())
    }

    fn formation_name(&self, formation: usize) -> &str {
        self.plan.world.formations.get(formation).map_or("", |formation| formation.name.as_str())
    }

    fn term_span(&self, term: usize) -> Option<Span> {
        self.hir.world.reward.get(term).map(|term| term.value.span)
    }

    fn group_span(&self, group: GroupId) -> Option<Span> {
        self.hir.world.groups.get(group).map(|group| group.span)
    }

    fn arena_span(&self, group: GroupId) -> Option<Span> {
        self.hir.world.groups.get(group)?.arena.as_ref().map(|arena| arena.span)
    }

    fn speed_span(&self, group: GroupId) -> Option<Span> {
        self.hir.world.groups.get(group)?.speed.as_ref().map(|speed| speed.span)
    }

    fn start_span(&self, group: GroupId) -> Option<Span> {
        self.hir.world.groups.get(group)?.start.as_ref().map(|start| start.span)
    }

    fn formation_span(&self, formation: usize) -> Option<Span> {
        self.hir
            .world
            .formations
            .get(formation)
            .map(|formation| formation.shape.as_ref().map_or(formation.span, |shape| shape.span))
    }

    /// Reports a problem, unless the same stands there already.
    fn tell(&mut self, problem: Problem) {
        let same = |other: &Problem| {
            other.code == problem.code && other.span() == problem.span() && other.message == problem.message
        };
        if !self.problems.iter().any(same) {
            self.problems.push(problem);
        }
    }

    /// The group of learned agents that a message names.
    fn learned(&self) -> Option<GroupId> {
        self.plan.world.groups.iter().position(|group| group.control == Control::Learned)
    }
}
