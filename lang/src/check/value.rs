//! Values that must be known before anything runs.

use std::collections::BTreeMap;
use std::fmt::Display;

use super::Checker;
use crate::ast::Span;
use crate::hir::{Expr, Kind, Type};
use crate::inline::{Inliner, Refusal, Value};
use crate::problem::{Code, Problem};

/// Levels of an expression after inlining, at most.
pub const DEEPEST: usize = 200;

impl Checker<'_> {
    /// An expression of parts that were checked.
    pub fn make(&mut self, kind: Kind, type_: Type, span: Span) -> Expr {
        let mut expr = Expr { kind, type_, span, depth: 1 };
        let depth = match &expr.kind {
            Kind::Call(function, args) => {
                function.body.depth + args.iter().map(|arg| arg.depth).max().unwrap_or(0)
            }
            _ => {
                let mut deepest = 0;
                expr.any_child(&mut |child| {
                    deepest = deepest.max(child.depth);
                    false
                });
                deepest
            }
        };
        expr.depth += depth;
        if expr.depth > DEEPEST {
            return self.too_deep(span);
        }
        expr
    }

    pub fn too_deep(&mut self, span: Span) -> Expr {
        let problem = Problem::error(&TOO_LARGE, "this expression is nested too deeply")
            .at(span, format!("more than {DEEPEST} levels, counting what it refers to"))
            .help("split it, or write it in fewer steps");
        self.poison(span, problem)
    }

    /// What an expression comes to, without its parameters' values filled in.
    pub fn inlined(&mut self, expr: &Expr) -> Option<Value> {
        let nothing = BTreeMap::new();
        match Inliner::new(&self.hir.world, &self.hir.tracks, &nothing, &self.spent).value(expr, &[]) {
            Ok(value) => Some(value),
            Err(Refusal::TooLarge) => {
                self.report(too_large(expr.span));
                None
            }
            Err(_) => None,
        }
    }

    /// The value of a number that must be constant; reports if it is not.
    pub fn constant(&mut self, expr: &Expr, what: &dyn Display) -> Option<f64> {
        let value = if expr.is_poison() { None } else { self.inlined(expr) };
        let number = match &value {
            Some(Value::Expr(value)) => self.constants.number(value).filter(|number| number.is_finite()),
            _ => None,
        };
        if number.is_none() && !self.changes_with_episodes(expr, what) {
            self.report_unknown(value.is_none(), expr, what);
        }
        number
    }

    /// Reports a vector that is not constant.
    pub fn constant_vector(&mut self, expr: &Expr, what: &dyn Display) {
        let value = if expr.is_poison() { None } else { self.inlined(expr) };
        let vector = match &value {
            Some(Value::Expr(value)) => self.constants.vector(value),
            _ => None,
        };
        if vector.is_none_or(|(x, y)| !x.is_finite() || !y.is_finite()) {
            self.report_unknown(value.is_none(), expr, what);
        }
    }

    /// What is unknown since something else is wrong was told there.
    fn report_unknown(&mut self, follows: bool, expr: &Expr, what: &dyn Display) {
        if !(self.problems.has_errors() && (follows || self.refers_to_unknown(expr))) {
            self.report(not_constant(expr.span, what));
        }
    }

    /// Stands for what is asked of agents where they are not known: by a parameter, say. Of several, the first is
    /// told; if there are other errors, one of them may be why.
    pub fn unknown_yet(&mut self, at: Span) -> Expr {
        if !self.problems.has_errors() {
            let text = self.sources.text(at);
            let problem = Problem::error(&NOT_CONSTANT, format!("`{text}` is asked for before it is known"))
                .at(at, "parameters, sizes and the world are read before the agents")
                .help("use numbers, parameters and functions of them only");
            self.report(problem);
        }
        Expr::poison(at)
    }

    /// The value of a whole number from `least`; reports if it is none.
    pub fn whole(&mut self, expr: &Expr, what: &dyn Display, least: f64) -> Option<usize> {
        let number = self.constant(expr, what)?;
        if number < least || number > 1e9 || number.fract() != 0.0 {
            self.report(
                Problem::error(&OUT_OF_RANGE, format!("{what} must be a whole number from {least}"))
                    .at(expr.span, format!("this is {number}")),
            );
            return None;
        }
        Some(number as usize)
    }

    /// Whether a parameter without a value is to blame that there is none, which was told already.
    fn refers_to_unknown(&self, expr: &Expr) -> bool {
        expr.any_inside(&mut |part| match &part.kind {
            Kind::Param(id) => self.constants.params.get(*id).copied().flatten().is_none(),
            Kind::World(_) => true,
            _ => false,
        })
    }
}

pub fn not_constant(at: Span, what: &dyn Display) -> Problem {
    Problem::error(&NOT_CONSTANT, format!("{what} must be known before the episodes begin"))
        .at(at, "this has no fixed, finite value")
        .help("use numbers, parameters and functions of them only")
}

pub fn too_large(at: Span) -> Problem {
    Problem::error(&TOO_LARGE, "this expression is too large")
        .at(at, "with everything that it refers to")
        .help("a `let` or function that refers twice to another doubles the work each time")
}

pub const NOT_CONSTANT: Code = Code {
    name: "not-constant",
    explain: "\
Sizes, limits and settings are the same in all episodes, so they are made of numbers and parameters only, and
must come to a finite number.

    param safe = 0.1 m
    world { dt = 0.1 s, safety = 2 * safe }             // right
    world { dt = 0.1 s, safety = |p[leader]| }          // wrong: changes as the leader moves",
};

pub const OUT_OF_RANGE: Code = Code {
    name: "out-of-range",
    explain: "\
A value lies outside of what its declaration allows.

    param side = 3 m in 0.1 m .. 2 m        // wrong: 3 m is above 2 m
    learn mpg { gamma = 1.5 }               // wrong: gamma is declared in 0 .. 1",
};

pub const TOO_LARGE: Code = Code {
    name: "too-large",
    explain: "\
What an expression stands for, with all lets and functions it refers to, is larger or deeper than the compiler
accepts. This happens when each of many lets refers twice to the one before:

    let b = a + a
    let c = b + b
    let d = c + c       // … and so on: doubles each time",
};
