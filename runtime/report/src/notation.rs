//! Expressions of the Plan in mathematical notation.

use mpgx_lang::plan::Plan;
use mpgx_lang::plan::{Expr, World};

pub fn mathml(_plan: &Plan, _world: &World, value: &Expr) -> String {
    format!("<math><mtext>{}</mtext></math>", crate::text::escape(&format!("{value:?}")))
}

pub fn latex(_plan: &Plan, _world: &World, value: &Expr) -> String {
    format!("{value:?}")
}
