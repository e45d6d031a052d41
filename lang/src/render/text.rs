//! Formulas on one line: `−k_c ⋅ #{i < j ∈ all : ‖p_i − p_j‖ < C}`.

use crate::plan::{Expr, Plan, Term, World};

use super::{Math, layout};

/// `name = formula`
pub fn term(plan: &Plan, world: &World, term: &Term) -> String {
    format!("{} = {}", term.name, expr(plan, world, &term.value))
}

/// The formula of an expression of `world`.
pub fn expr(plan: &Plan, world: &World, expr: &Expr) -> String {
    print(&layout(plan, world, expr))
}

fn print(math: &Math) -> String {
    match math {
        Math::Number(text) | Math::Name(text) => text.clone(),
        Math::Word(text) | Math::Mark(text) => (*text).to_owned(),
        Math::Infix(text) => format!(" {text} "),
        Math::Row(parts) => parts.iter().map(print).collect(),
        Math::Sub(base, below) => script(print(base), '_', print(below)),
        Math::Sup(base, above) => script(print(base), '^', print(above)),
        Math::Frac(top, bottom) => format!("{} / {}", print(top), print(bottom)),
        Math::Root(of) => format!("√({})", print(of)),
        Math::Fence(open, inner, close) => format!("{open}{}{close}", print(inner)),
        Math::Soft(inner) => format!("({})", print(inner)),
        Math::Big(mark, below, body) => {
            format!("{} {}", script((*mark).to_owned(), '_', print(below)), print(body))
        }
        Math::Cases(cases) => {
            let [then, condition, otherwise] = cases.as_ref();
            format!("{} if {}, else {}", print(then), print(condition), print(otherwise))
        }
    }
}

fn script(base: String, mark: char, script: String) -> String {
    let bare = script.starts_with('(')
        || script.chars().all(|character| character.is_alphanumeric() || character == '′');
    if bare { format!("{base}{mark}{script}") } else { format!("{base}{mark}{{{script}}}") }
}
