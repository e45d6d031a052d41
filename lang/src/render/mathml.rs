//! Formulas as presentation MathML.

use crate::plan::{Expr, Plan, Term, World};

use super::{Math, layout, symbol};

/// `name = formula`, as a `<math>` element.
pub fn term(plan: &Plan, world: &World, term: &Term) -> String {
    let row = Math::Row(vec![symbol(&term.name), Math::Infix("="), layout(plan, world, &term.value)]);
    element(&row)
}

/// The formula of an expression of `world`, as a `<math>` element.
pub fn expr(plan: &Plan, world: &World, expr: &Expr) -> String {
    element(&layout(plan, world, expr))
}

fn element(math: &Math) -> String {
    format!("<math xmlns=\"http://www.w3.org/1998/Math/MathML\" display=\"block\">{}</math>", print(math))
}

fn print(math: &Math) -> String {
    match math {
        Math::Number(text) => format!("<mn>{}</mn>", escape(text)),
        Math::Name(text) => match text.split_once('′') {
            Some((name, primes)) => {
                format!("<msup><mi>{}</mi><mo>′{}</mo></msup>", escape(name), escape(primes))
            }
            None => format!("<mi>{}</mi>", escape(text)),
        },
        Math::Word(text) => format!("<mi mathvariant=\"normal\">{}</mi>", escape(text)),
        Math::Infix(":") => "<mo lspace=\"0.28em\" rspace=\"0.28em\">:</mo>".to_owned(),
        Math::Infix(text) => format!("<mo>{}</mo>", escape(text)),
        Math::Mark("," | ", ") => "<mo separator=\"true\">,</mo>".to_owned(),
        Math::Mark(text) => format!("<mo form=\"prefix\">{}</mo>", escape(text)),
        Math::Row(parts) => format!("<mrow>{}</mrow>", parts.iter().map(print).collect::<String>()),
        Math::Sub(base, below) => format!("<msub>{}{}</msub>", print(base), print(below)),
        Math::Sup(base, above) => format!("<msup>{}{}</msup>", print(base), print(above)),
        Math::Frac(top, bottom) => format!("<mfrac>{}{}</mfrac>", print(inside(top)), print(inside(bottom))),
        Math::Root(of) => format!("<msqrt>{}</msqrt>", print(of)),
        Math::Fence("#{", inner, _) => format!("<mrow><mi>#</mi>{}</mrow>", fenced("{", inner, "}")),
        Math::Fence(open, inner, close) => fenced(open, inner, close),
        Math::Soft(inner) => print(inner),
        Math::Big(mark, below, body) => {
            let mark = format!("<mo movablelimits=\"false\">{}</mo>", escape(mark));
            format!("<mrow><munder>{mark}{}</munder>{}</mrow>", print(below), print(body))
        }
        Math::Cases(cases) => {
            let [then, condition, otherwise] = cases.as_ref();
            let row = |value: &Math, when: String| {
                format!("<mtr><mtd>{}</mtd><mtd>{when}</mtd></mtr>", print(value))
            };
            let first = row(then, format!("<mtext>if\u{a0}</mtext>{}", print(condition)));
            let second = row(otherwise, "<mtext>otherwise</mtext>".to_owned());
            format!("<mrow><mo fence=\"true\" form=\"prefix\">{{</mo><mtable>{first}{second}</mtable></mrow>")
        }
    }
}

fn fenced(open: &str, inner: &Math, close: &str) -> String {
    let mark = |form: &str, text| format!("<mo form=\"{form}\" fence=\"true\">{}</mo>", escape(text));
    format!("<mrow>{}{}{}</mrow>", mark("prefix", open), print(inner), mark("postfix", close))
}

/// Without parentheses that only a single line needs.
fn inside(math: &Math) -> &Math {
    match math {
        Math::Soft(inner) => inner,
        math => math,
    }
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
