//! What is done with a world: learned, evaluated, claimed and tested.

use super::{Expr, Extern, Hir};
use crate::ast::{Span, Spanned};
use crate::plan::{ClaimKind, Until};

#[derive(Clone, Debug)]
pub struct Localiser {
    pub name: String,
    pub what: Option<Extern>,
    pub span: Span,
}

#[derive(Clone, Debug)]
pub struct Method {
    pub label: String,
    pub what: Extern,
    pub span: Span,
}

#[derive(Clone, Debug)]
pub struct Protocol {
    pub name: String,
    pub episodes: Expr,
    /// The scenario with its changes, as far as the world goes; `None`: it changes nothing.
    pub changed: Option<Box<Hir>>,
    pub span: Span,
}

#[derive(Clone, Debug)]
pub struct Stage {
    pub name: String,
    /// The scenario with its changes, as far as the world goes.
    pub changed: Box<Hir>,
    pub until: Option<Until>,
    pub most_steps: Option<usize>,
    pub span: Span,
}

/// The same scenario with changes: a whole study.
#[derive(Clone, Debug)]
pub struct Variant {
    pub name: String,
    /// The changes as written.
    pub text: String,
    pub changed: Box<Hir>,
    pub span: Span,
}

#[derive(Clone, Debug)]
pub struct Test {
    pub name: String,
    pub steps: Vec<Spanned<TestStep>>,
    pub span: Span,
}

#[derive(Clone, Debug)]
pub enum TestStep {
    Place { agent: Expr, position: Expr },
    Turn { agent: Expr, heading: Expr },
    Steer { agent: Expr, velocity: Expr },
    Step(usize),
    Check { text: String, actual: Option<Expr>, holds: Expr },
}

#[derive(Clone, Debug)]
pub struct Claim {
    pub text: String,
    pub kind: ClaimKind,
    pub span: Span,
}

impl Localiser {
    /// Whether it tells poses from images.
    pub fn looks(&self) -> bool {
        self.what.as_ref().is_none_or(|what| what.name != "noisy")
    }
}
