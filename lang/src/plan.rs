//! The Plan: what the compiler makes and the runtime runs.
//!
//! Plain data, SI numbers, no source text needed. It prints to RON and reads back to the same value.
//! `runtime` runs Plans and nothing else; `lang` knows no algorithm, no body and no controller by name.

mod expr;
mod sight;
mod study;
mod world;

use serde::{Deserialize, Serialize};

pub use expr::{
    AgentRef, BinaryOp, Binder, Distribution, Expr, Function, IndexSet, Measure, Quantity, Reduction,
    UnaryOp, WorldConstant,
};
pub use sight::{Landmark, Localised, Localiser, Scenery};
pub use study::{
    Claim, ClaimKind, Curve, Each, End, Extern, Method, Observation, Protocol, Schedule, Setting, Stage,
    Term, Test, TestStep, Until, Variant,
};
pub use world::{
    Area, Constraint, Control, Formation, Frame, Graph, Group, Motion, MotionOutput, MotionState, Randomised,
    Shared, Slots, Solid, World,
};

/// Index into [`Plan::params`].
pub type ParamId = usize;
/// Index into [`World::groups`].
pub type GroupId = usize;
/// Index into [`World::formations`].
pub type FormationId = usize;
/// Index into [`Plan::tracks`].
pub type TrackId = usize;
/// Flat index of an agent or obstacle: the groups in order, each group's members in order.
pub type AgentId = usize;
/// An index variable; unique within one top-level expression.
pub type VarId = usize;

/// A compiled scenario, all defaults filled in.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// The scenario's name.
    pub name: String,
    /// Its `//!` comment.
    pub doc: String,
    /// Named constants, referred to by [`Expr::Param`].
    pub params: Vec<Param>,
    /// What is trained in.
    pub world: World,
    /// The learners: the one of `learn` first, then the learners of `compare`.
    pub learners: Vec<Method>,
    /// Controllers that need no training, from `compare`.
    pub controllers: Vec<Method>,
    /// The first training seed; the scenario's own begin with 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub first_seed: usize,
    /// Number of training seeds, one after another.
    pub seeds: usize,
    /// Held-out evaluations of the final policy.
    pub protocols: Vec<Protocol>,
    /// Claims to be decided from the evaluated statistics.
    pub claims: Vec<Claim>,
    /// Recorded paths, referred to by [`Expr::Track`].
    pub tracks: Vec<Track>,
    /// A curriculum: training goes through these worlds, in order, before [`Plan::world`].
    pub stages: Vec<Stage>,
    /// The same scenario with something changed, each a study of its own; without variants of their own.
    pub variants: Vec<Variant>,
    /// What must hold of the scenario in situations that it spells out.
    pub tests: Vec<Test>,
    /// How robots tell where they are, where they do not know it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub localisers: Vec<Localiser>,
}

/// Where something stands in the source: 1-based line and column. Not part of the meaning.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Place {
    pub file: String,
    pub line: usize,
    pub column: usize,
}

/// A named constant of the scenario.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Param {
    pub name: String,
    pub doc: String,
    /// SI value.
    pub value: f64,
    /// Dimension as text, for people: `length/time`, `number`.
    pub dimension: String,
    /// The value as written: `0.4 m`.
    pub text: String,
    pub at: Place,
}

/// A recorded path: positions over time, joined by straight lines.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Track {
    pub name: String,
    /// Seconds, rising, at least one.
    pub t_s: Vec<f64>,
    /// One position for each time, metres.
    pub p_m: Vec<(f64, f64)>,
    pub at: Place,
}

fn is_zero(number: &usize) -> bool {
    *number == 0
}

/// Nesting of a Plan in RON, at most; the compiler's limit on expressions stays far below.
const RON_DEPTH: usize = 1000;

impl Plan {
    /// As RON text. [`Plan::from_ron`] reads it back to the same value.
    pub fn to_ron(&self) -> String {
        let options = ron::Options::default().with_recursion_limit(RON_DEPTH);
        let pretty = ron::ser::PrettyConfig::new().new_line("\n".to_owned()).indentor("  ".to_owned());
        options.to_string_pretty(self, pretty).unwrap_or_default()
    }

    /// Reads what [`Plan::to_ron`] wrote. The error says where the text is wrong.
    pub fn from_ron(text: &str) -> Result<Plan, String> {
        let options = ron::Options::default().with_recursion_limit(RON_DEPTH);
        options.from_str(text).map_err(|error| error.to_string())
    }
}
