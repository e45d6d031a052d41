//! Whether a value is what a place wants, and how to say what is wrong otherwise.

use std::borrow::Cow;
use std::fmt::{self, Display};

use super::{Checker, Scope};
use crate::ast::{self, ExprAt, Span};
use crate::dim::{Dim, Ratio, Substitution};
use crate::hir::{Expr, Kind, Type};
use crate::plan::{BinaryOp, Function, Reduction, UnaryOp};
use crate::problem::{Code, Problem};
use crate::resolve::listed;

/// What wants a value. For people it is the subject of a sentence, which is made only if there is something to say.
#[derive(Clone, Debug)]
pub struct Wanted<'w> {
    what: What<'w>,
    /// Where it is declared, or what it must be like.
    pub declared: Option<Span>,
    like: bool,
}

#[derive(Clone, Debug)]
pub enum What<'w> {
    /// "the filter"
    Words(Cow<'w, str>),
    /// "`radius`"
    Name(&'w str),
    /// "a limit of `radius`"
    Of(&'static str, &'w str),
}

impl fmt::Display for What<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            What::Words(words) => f.write_str(words),
            What::Name(name) => write!(f, "`{name}`"),
            What::Of(what, name) => write!(f, "{what} of `{name}`"),
        }
    }
}

impl<'w> From<&'w str> for What<'w> {
    fn from(words: &'w str) -> Self {
        What::Words(words.into())
    }
}

impl From<String> for What<'_> {
    fn from(words: String) -> Self {
        What::Words(words.into())
    }
}

impl<'w> Wanted<'w> {
    pub fn by(what: impl Into<What<'w>>) -> Self {
        Wanted { what: what.into(), declared: None, like: false }
    }

    pub fn declared(what: impl Into<What<'w>>, at: Span) -> Self {
        Wanted { what: what.into(), declared: Some(at), like: false }
    }

    /// It must be what something beside it is.
    pub fn like(what: impl Into<What<'w>>, other: Span) -> Self {
        Wanted { what: what.into(), declared: Some(other), like: true }
    }

    /// Points at the other place that matters.
    fn show(&self, problem: Problem, wanted: &str) -> Problem {
        match self.declared {
            Some(at) if self.like => problem.with(at, format!("this is {wanted}")),
            Some(at) => problem.with(at, format!("{} is {wanted}", self.what)),
            None => problem,
        }
    }
}

impl<'a> Checker<'a> {
    /// Checks an expression that shall be of a type.
    pub fn wanted(&mut self, scope: &mut Scope, at: &'a ExprAt, type_: &Type, why: &Wanted) -> Expr {
        self.wanted_generic(scope, at, type_, why, &[], &mut Substitution::default())
    }

    /// As [`Checker::wanted`]; the dimension variables `generics` of the type are solved for.
    pub fn wanted_generic(
        &mut self,
        scope: &mut Scope,
        at: &'a ExprAt,
        type_: &Type,
        why: &Wanted,
        generics: &[String],
        solved: &mut Substitution,
    ) -> Expr {
        match type_ {
            Type::Word(words) => return self.word(at, words, why),
            Type::Formation | Type::Track => {
                if let Some(value) = self.item_value(scope, at).or_else(|| self.group_value(scope, at)) {
                    return self.fits(value, type_, why, generics, solved);
                }
            }
            Type::Group => {
                if let Some(value) = self.group_value(scope, at).or_else(|| self.item_value(scope, at)) {
                    return self.fits(value, type_, why, generics, solved);
                }
            }
            _ => {}
        }
        let value = self.expr(scope, at);
        self.fits(value, type_, why, generics, solved)
    }

    fn word(&mut self, at: &ExprAt, words: &[String], why: &Wanted) -> Expr {
        let all = || words.iter().map(String::as_str);
        let problem = match &at.node {
            ast::Expr::Name(name) if words.contains(name) => {
                return self.make(Kind::Word(name.clone()), Type::Word(words.to_vec()), at.span);
            }
            ast::Expr::Name(name) => {
                let problem = Problem::error(&UNKNOWN_WORD, format!("{} cannot be `{name}`", why.what));
                problem.at(at.span, "").help(match self.meant(name, all()) {
                    Some(meant) => format!("did you mean `{meant}`?"),
                    None => format!("it is one of {}", listed(all())),
                })
            }
            _ => Problem::error(&UNKNOWN_WORD, format!("{} is a word", why.what))
                .at(at.span, "this is not")
                .help(format!("write one of {}", listed(all()))),
        };
        let problem = match why.declared {
            Some(declared) => problem.with(declared, "declared here"),
            None => problem,
        };
        self.poison(at.span, problem)
    }

    /// Gives the value if it fits, poison otherwise.
    pub fn fits(
        &mut self,
        value: Expr,
        wanted: &Type,
        why: &Wanted,
        generics: &[String],
        solved: &mut Substitution,
    ) -> Expr {
        let agree = match (&value.type_, wanted) {
            (Type::Poison, _) | (_, Type::Poison) => true,
            (Type::Number(dim), Type::Number(pattern))
            | (Type::Vector(dim), Type::Vector(pattern))
            | (Type::Range(dim), Type::Range(pattern)) => {
                if !solved.unify(pattern, dim, generics) {
                    let wanted = solved.apply(pattern, generics).unwrap_or_default();
                    let problem = self.unit_mismatch(&value, dim, &wanted, why);
                    return self.poison(value.span, problem);
                }
                true
            }
            (Type::Number(dim), Type::Count | Type::Schedule) => {
                if !dim.is_none() {
                    let problem = self.unit_mismatch(&value, dim, &Dim::none(), why);
                    return self.poison(value.span, problem);
                }
                true
            }
            (Type::Agent(_), Type::Agent(None)) => true,
            // An empty list is one of anything.
            (Type::List(of), Type::List(_)) if **of == Type::Poison => true,
            (have, wanted) => have == wanted,
        };
        if agree {
            return value;
        }
        let have = self.describe(&value.type_);
        let want = match (wanted, generics) {
            // Of a dimension that nothing has fixed yet.
            (Type::Number(dim), [_, ..]) if solved.has_free(dim, generics) => "a number".to_owned(),
            (Type::Vector(dim), [_, ..]) if solved.has_free(dim, generics) => "a vector".to_owned(),
            (Type::Number(dim), _) => self.units.people(&solved.apply(dim, generics).unwrap_or_default()),
            _ => self.describe(wanted),
        };
        let problem = Problem::error(&TYPE_MISMATCH, format!("{} must be {want}, not {have}", why.what))
            .at(value.span, format!("this is {have}"));
        let problem = why.show(problem, &want);
        let problem = match self.type_remedy(&value, wanted) {
            Some(help) => problem.help(help),
            None => problem,
        };
        self.poison(value.span, problem)
    }

    fn unit_mismatch(&self, value: &Expr, have: &Dim, wanted: &Dim, why: &Wanted) -> Problem {
        let (have_text, want_text) = (self.units.people(have), self.units.people(wanted));
        let message = format!("{} must be {want_text}, not {have_text}", why.what);
        let problem = Problem::error(&UNIT_MISMATCH, message).at(value.span, format!("this is {have_text}"));
        let problem = why.show(problem, &want_text);
        self.with_unit_remedy(problem, value, have, wanted)
    }

    fn type_remedy(&self, value: &Expr, wanted: &Type) -> Option<String> {
        let text = bare(self.sources.text(value.span));
        match (&value.type_, wanted) {
            (Type::Number(dim), Type::Truth) => {
                let zero = format!("0 {}", self.units.si(dim));
                Some(format!("compare it with something, for example `{text} > {}`", zero.trim_end()))
            }
            (Type::Vector(_), Type::Number(_)) => {
                Some(format!("`|{text}|` is its length, `.x` and `.y` are its parts"))
            }
            (Type::Number(_), Type::Range(_)) => {
                let size = text.trim_start_matches('-');
                Some(format!("write both ends, for example `-{size} .. {size}`"))
            }
            (Type::Number(_), Type::Vector(_)) => Some("a vector is written `(x, y)`".to_owned()),
            (_, Type::Area) => Some("an area is written `box(-1 m .. 1 m, -1 m .. 1 m)`".to_owned()),
            (_, Type::List(of)) => Some(match **of {
                Type::Vector(_) => "a list of points is written `[(0 m, 0 m), (1 m, 0 m)]`".to_owned(),
                _ => "a list is written `[400, 300]`".to_owned(),
            }),
            (Type::Formation, Type::Group) => Some(format!("its members are `members({text})`")),
            (_, Type::Formation) => {
                self.first_of("formation", self.hir.world.formations.iter().map(|f| &f.name))
            }
            (_, Type::Group) => self.first_of("group", self.hir.world.groups.iter().map(|g| &g.name)),
            (_, Type::Track) => Some("a recording is declared by `recording walk = \"walk.csv\"`".to_owned()),
            _ => None,
        }
    }

    fn first_of<'n>(&self, what: &str, names: impl Iterator<Item = &'n String>) -> Option<String> {
        let names: Vec<&str> = names.map(String::as_str).collect();
        (!names.is_empty()).then(|| format!("the scenario has the {what}s {}", listed(names)))
    }

    /// What a type is, in words.
    pub fn describe(&self, type_: &Type) -> String {
        match type_ {
            Type::Number(dim) => self.units.people(dim),
            Type::Vector(dim) if dim.is_none() => "a vector of plain numbers".to_owned(),
            Type::Vector(dim) => format!("a vector ({})", self.units.name(dim)),
            Type::Truth => "true or false".to_owned(),
            Type::Count => "a whole number".to_owned(),
            Type::Agent(group) => match group.and_then(|group| self.hir.world.groups.get(group)) {
                Some(group) => format!("an agent of `{}`", group.name),
                None => "an agent".to_owned(),
            },
            Type::Area => "an area".to_owned(),
            Type::Range(dim) => format!("a range ({})", self.units.name(dim)),
            Type::List(of) => match &**of {
                Type::Vector(dim) if *dim == self.units.base("length") => "a list of points".to_owned(),
                Type::Vector(_) => "a list of vectors".to_owned(),
                Type::Number(dim) if !dim.is_none() => format!("a list ({})", self.units.name(dim)),
                _ => "a list of numbers".to_owned(),
            },
            Type::Formation => "a formation".to_owned(),
            Type::Group => "a group".to_owned(),
            Type::Track => "a recording".to_owned(),
            Type::Schedule => "a schedule".to_owned(),
            Type::Word(words) => format!("one of {}", listed(words.iter().map(String::as_str))),
            Type::Poison => "unknown".to_owned(),
        }
    }

    /// Says how a value of dimension `have` could become one of dimension `wanted`.
    pub fn with_unit_remedy(&self, problem: Problem, value: &Expr, have: &Dim, wanted: &Dim) -> Problem {
        match self.unit_remedy(value, have, wanted) {
            Some((help, Some((span, text)))) => problem.help(help).fix(span, text),
            Some((help, None)) => problem.help(help),
            None => problem,
        }
    }

    /// The help, and what it changes if that is one place.
    fn unit_remedy(
        &self,
        value: &Expr,
        have: &Dim,
        wanted: &Dim,
    ) -> Option<(String, Option<(Span, String)>)> {
        let missing = wanted.div(have)?;
        let mut factors = Vec::new();
        collect_factors(value, Ratio::ONE, &mut factors);
        let whole = |expr: &Expr| expr.span == value.span;
        for (factor, exponent) in &factors {
            let Kind::Param(id) = factor.kind else { continue };
            let param = self.hir.params.get(id)?;
            let dim = param.dim.mul(&missing.pow(exponent.inverse()?)?)?;
            let number = literal(&param.default, self.sources.text(param.default.span));
            let example = self.units.example(number.as_deref().unwrap_or("1"), &dim)?;
            let people = self.units.people(&dim).replace("a plain number", "no unit");
            let help = format!("give `{}` {people}, for example `{example}`", param.name);
            return Some((help, number.map(|_| (param.default.span, example))));
        }
        for (factor, exponent) in &factors {
            let Type::Number(dim) = &factor.type_ else { continue };
            let text = self.sources.text(factor.span);
            let Some(number) = literal(factor, text) else { continue };
            let dim = dim.mul(&missing.pow(exponent.inverse()?)?)?;
            let example = self.units.example(&number, &dim)?;
            let help = match whole(factor) || matches!(value.kind, Kind::Unary(..)) {
                true => format!("write `{}`", self.sources.text(value.span).replacen(text, &example, 1)),
                false => format!("give the factor `{text}` {}: `{example}`", self.units.people(&dim)),
            };
            return Some((help, Some((factor.span, example))));
        }
        let value = if let Kind::Unary(UnaryOp::Neg, positive) = &value.kind { positive } else { value };
        let text = self.sources.text(value.span);
        let sum = matches!(value.kind, Kind::Binary(BinaryOp::Add | BinaryOp::Sub, ..) | Kind::Reduce { .. });
        let (name, factor) = match text.chars().count() {
            0..=30 if sum && bare(text) == text => (format!("`{text}`"), format!("({text})")),
            0..=30 => (format!("`{text}`"), text.to_owned()),
            _ => ("this".to_owned(), "…".to_owned()),
        };
        if missing.factors().all(|(_, exponent)| exponent.value() < 0.0) {
            let inverse = Dim::none().div(&missing)?;
            let (by, example) = (self.units.people(&inverse), self.units.example("1", &inverse)?);
            return Some((format!("divide {name} by {by}, for example `{factor} / {example}`"), None));
        }
        let (by, example) = (self.units.people(&missing), self.units.example("1", &missing)?);
        Some((format!("multiply {name} by {by}, for example `{example} * {factor}`"), None))
    }

    /// A number of any dimension; poison for anything else.
    pub fn any_number(&mut self, value: Expr, what: &dyn Display) -> Expr {
        if matches!(value.type_, Type::Number(_) | Type::Poison) {
            return value;
        }
        let have = self.describe(&value.type_);
        let problem = Problem::error(&TYPE_MISMATCH, format!("{what} must be a number, not {have}"))
            .at(value.span, format!("this is {have}"));
        let text = bare(self.sources.text(value.span));
        let problem = match value.type_ {
            Type::Vector(_) => problem.help(format!("`|{text}|` is the vector's length")),
            Type::Truth => problem.help(format!("`if {text} then 1 else 0` is a number")),
            _ => problem,
        };
        self.poison(value.span, problem)
    }
}

/// Without the parentheses around.
fn bare(text: &str) -> &str {
    let inside = text.strip_prefix('(').and_then(|text| text.strip_suffix(')'));
    inside.filter(|inside| !inside.contains(['(', ')', ','])).unwrap_or(text)
}

/// What a number is multiplied from, with exponents.
fn collect_factors<'e>(expr: &'e Expr, exponent: Ratio, into: &mut Vec<(&'e Expr, Ratio)>) {
    match &expr.kind {
        Kind::Number(_) | Kind::Param(_) => into.push((expr, exponent)),
        Kind::Unary(UnaryOp::Neg, operand) => collect_factors(operand, exponent, into),
        Kind::Binary(BinaryOp::Mul, left, right) => {
            collect_factors(left, exponent, into);
            collect_factors(right, exponent, into);
        }
        Kind::Binary(BinaryOp::Div, left, right) => {
            collect_factors(left, exponent, into);
            collect_factors(right, exponent.negated(), into);
        }
        Kind::BuiltIn(Function::Abs, args) => {
            args.iter().for_each(|arg| collect_factors(arg, exponent, into));
        }
        Kind::Reduce {
            op: Reduction::Sum | Reduction::Mean | Reduction::Min | Reduction::Max, body, ..
        } => {
            collect_factors(body, exponent, into);
        }
        _ => {}
    }
}

/// The number of a literal as it was written, without its unit.
fn literal(expr: &Expr, text: &str) -> Option<String> {
    matches!(expr.kind, Kind::Number(_)).then_some(())?;
    let end = text.find(|c: char| !(c.is_ascii_digit() || matches!(c, '.' | '_'))).unwrap_or(text.len());
    let exponent = text[end..].strip_prefix(['e', 'E']).and_then(|rest| {
        let digits = rest.strip_prefix(['-', '+']).unwrap_or(rest);
        let length = digits.find(|c: char| !c.is_ascii_digit()).unwrap_or(digits.len());
        (length > 0).then_some(end + 1 + (rest.len() - digits.len()) + length)
    });
    let number = &text[..exponent.unwrap_or(end)];
    (!number.is_empty()).then(|| number.to_owned())
}

pub const UNIT_MISMATCH: Code = Code {
    name: "unit-mismatch",
    explain: "\
Every number has a dimension: a length, a time, a speed, or none. Only like can be added, compared or put where
its like is wanted.

    world { dt = 0.1 }          // wrong: a plain number is no time
    world { dt = 0.1 s }        // right

    -|p[i] - p[j]| - n          // wrong: a length less a plain number
    -|p[i] - p[j]| - n * 1 m    // right

Zero needs a unit too: 0 m.",
};

pub const TYPE_MISMATCH: Code = Code {
    name: "type-mismatch",
    explain: "\
A place wants one kind of thing and got another: a number where a vector is wanted, a truth value where a number is.

    start ~ 0.2 m               // wrong: a start is a point
    start ~ near((0 m, 0 m), 0.2 m)     // right",
};

pub const UNKNOWN_WORD: Code = Code {
    name: "unknown-word",
    explain: "\
Some settings are chosen from a few words, which their declaration lists.

    learn mpg { noise_reading = variances }     // wrong
    learn mpg { noise_reading = variance }      // right",
};
