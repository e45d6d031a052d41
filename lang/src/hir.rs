//! The typed scenario: names resolved, every expression with its type, nothing inlined yet.

mod expr;
mod study;
mod world;

use std::sync::Arc;

use crate::ast::Span;
use crate::dim::Dim;
pub use expr::{Bound, Draw, Expr, Function, Kind, Over, OwnSetting, Parameter, Part, Set, Type};
pub use study::{Claim, Localiser, Method, Protocol, Stage, Test, TestStep, Variant};
pub use world::{
    Called, Chosen, Control, Edge, End, Extern, Formation, Group, Landmark, Localised, Motion, Observation,
    Output, Randomised, Shape, Shared, Slots, State, Term, World,
};

#[derive(Clone, Debug)]
pub struct Param {
    pub name: String,
    pub doc: String,
    pub dim: Dim,
    pub default: Expr,
    /// SI value under the overrides; `None` if a problem was reported.
    pub value: Option<f64>,
    pub span: Span,
}

/// A recorded path.
#[derive(Clone, Debug)]
pub struct Track {
    pub name: String,
    /// Seconds and metres.
    pub points: Arc<crate::recording::Points>,
    pub span: Span,
}

#[derive(Clone, Debug, Default)]
pub struct Hir {
    pub name: String,
    pub doc: String,
    pub params: Vec<Param>,
    pub tracks: Vec<Track>,
    pub world: World,
    /// Of all reward terms and costs.
    pub reward_dim: Dim,
    pub localisers: Vec<Localiser>,
    /// The one of `learn` first.
    pub learners: Vec<Method>,
    pub controllers: Vec<Method>,
    pub seeds: Option<Expr>,
    pub protocols: Vec<Protocol>,
    pub stages: Vec<Stage>,
    pub variants: Vec<Variant>,
    pub tests: Vec<Test>,
    pub claims: Vec<Claim>,
    pub bounds: Vec<Bound>,
}
