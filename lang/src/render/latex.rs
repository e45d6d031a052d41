//! Formulas as LaTeX for math mode (with amsmath).

use crate::plan::{Expr, Plan, Term, World};

use super::{Math, layout, symbol};

/// `name = formula`
pub fn term(plan: &Plan, world: &World, term: &Term) -> String {
    tidy(&Math::Row(vec![symbol(&term.name), Math::Infix("="), layout(plan, world, &term.value)]))
}

/// The formula of an expression of `world`.
pub fn expr(plan: &Plan, world: &World, expr: &Expr) -> String {
    tidy(&layout(plan, world, expr))
}

/// With single spaces.
fn tidy(math: &Math) -> String {
    print(math).split_whitespace().collect::<Vec<_>>().join(" ")
}

fn print(math: &Math) -> String {
    match math {
        Math::Number(text) => commands(text),
        Math::Name(text) if text.trim_end_matches('′').chars().count() == 1 => commands(text),
        Math::Name(text) => format!("\\mathrm{{{}}}", commands(text)),
        Math::Word(text)
            if matches!(*text, "sin" | "cos" | "tan" | "exp" | "ln" | "tanh" | "min" | "max") =>
        {
            format!("\\{text}")
        }
        Math::Word("Δ") => "\\Delta ".to_owned(),
        Math::Word(text) => format!("\\operatorname{{{text}}}"),
        Math::Infix(text) => format!(" {} ", commands(text)),
        Math::Mark(text) => commands(text),
        Math::Row(parts) => parts.iter().map(print).collect(),
        Math::Sub(base, below) => format!("{}_{{{}}}", print(base), print(below)),
        Math::Sup(base, above) => format!("{}^{{{}}}", print(base), print(above)),
        Math::Frac(top, bottom) => format!("\\frac{{{}}}{{{}}}", print(top), print(bottom)),
        Math::Root(of) => format!("\\sqrt{{{}}}", print(of)),
        Math::Fence("#{", inner, _) => format!("\\#\\left\\{{{}\\right\\}}", print(inner)),
        Math::Fence(open, inner, close) => {
            format!("\\left{}{}\\right{}", delimiter(open, true), print(inner), delimiter(close, false))
        }
        Math::Soft(inner) => print(inner),
        Math::Big(mark, below, body) => {
            let mark = match *mark {
                "∑" => "\\sum".to_owned(),
                "mean" => "\\operatorname*{mean}".to_owned(),
                mark => format!("\\{mark}"),
            };
            format!("{mark}_{{{}}} {}", print(below), print(body))
        }
        Math::Cases(cases) => {
            let [then, condition, otherwise] = cases.as_ref();
            let (then, condition, otherwise) = (print(then), print(condition), print(otherwise));
            format!(
                "\\begin{{cases}}{then} & \\text{{if }}{condition} \\\\ {otherwise} & \\text{{otherwise}}\\end{{cases}}"
            )
        }
    }
}

fn delimiter(mark: &'static str, left: bool) -> &'static str {
    match (mark, left) {
        ("‖", true) => "\\lVert ",
        ("‖", false) => "\\rVert",
        ("|", true) => "\\lvert ",
        ("|", false) => "\\rvert",
        ("⌊", _) => "\\lfloor ",
        ("⌋", _) => "\\rfloor",
        (mark, _) => mark,
    }
}

/// Characters outside LaTeX's own as commands.
fn commands(text: &str) -> String {
    let mut latex = String::new();
    for character in text.chars() {
        latex += match character {
            '−' => "-",
            '⋅' => "\\cdot",
            '×' => "\\times",
            '≤' => "\\le",
            '≥' => "\\ge",
            '≠' => "\\ne",
            '∈' => "\\in",
            '∉' => "\\notin",
            '∧' => "\\land",
            '∨' => "\\lor",
            '¬' => "\\lnot ",
            '∃' => "\\exists\\, ",
            '∀' => "\\forall\\, ",
            ':' => "\\mid",
            '′' => "'",
            'α' => "\\alpha",
            'β' => "\\beta",
            'γ' => "\\gamma",
            'δ' => "\\delta",
            'ε' => "\\varepsilon",
            'θ' => "\\theta",
            'κ' => "\\kappa",
            'λ' => "\\lambda",
            'μ' => "\\mu",
            'π' => "\\pi",
            'ρ' => "\\rho",
            'σ' => "\\sigma",
            'τ' => "\\tau",
            'φ' => "\\varphi",
            'ψ' => "\\psi",
            'ω' => "\\omega",
            '_' => "\\_",
            other => {
                latex.push(other);
                continue;
            }
        };
    }
    latex
}
