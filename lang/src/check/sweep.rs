//! Sweeps: every combination of the values of some axes, as a variant each.

use super::value::OUT_OF_RANGE;
use super::{Checker, Scope};
use crate::ast::{self, Assignment, Axis, Call, ExprAt, Name, Span, Spanned, UnitExpr};
use crate::change::dotted;
use crate::check::cases::{Chosen, VARIANTS};
use crate::check::settings::path_span;
use crate::dim::{Dim, Substitution};
use crate::hir::{Parameter, Type};
use crate::problem::{Code, Problem};

/// What an axis sets at one of its points.
struct Point {
    /// Each with its value as text.
    settings: Vec<(Assignment, String)>,
}

/// A value on an axis and its text.
type Value = (ExprAt, String);

impl<'a> Checker<'a> {
    /// The points of a sweep in the order of a counter whose last axis turns fastest. More than `room` of them are
    /// refused.
    pub fn sweep(&mut self, axes: &'a [Axis], item: Span, room: usize) -> Vec<Chosen> {
        let mut points: Vec<Vec<Point>> = Vec::new();
        for axis in axes {
            let Some(axis) = self.axis(axis, room) else { return Vec::new() };
            points.push(axis);
        }
        let all = points.iter().try_fold(1_usize, |all, axis| all.checked_mul(axis.len()));
        if all.is_none_or(|all| all > room) || axes.is_empty() {
            let (first, last) = (axes.first().map(|axis| &axis.values), axes.last().map(|axis| &axis.values));
            let at = first.zip(last).map_or(item, |(first, last)| first.span.to(last.span));
            match all {
                _ if axes.is_empty() => self.bad_sweep(
                    "this sweep sets nothing",
                    item,
                    "write for example `sweep { side in [0.2 m, 0.4 m] }`",
                ),
                all => drop(self.few("variants", all.unwrap_or(usize::MAX), VARIANTS, at)),
            }
            return Vec::new();
        }
        (0..all.unwrap_or(0)).map(|number| combination(&points, number, item)).collect()
    }

    fn axis(&mut self, axis: &'a Axis, room: usize) -> Option<Vec<Point>> {
        let values = match &axis.values.node {
            ast::Expr::List(all) => {
                let values: Vec<_> = all.iter().map(|value| self.tied(axis, value)).collect();
                values.into_iter().collect::<Option<Vec<_>>>()?
            }
            ast::Expr::Call(call) if matches!(call.name.node.as_str(), "range" | "log_range") => {
                if axis.paths.len() > 1 {
                    let help = "write each combination: `(a, b) in [(1, 2 m), (3, 4 m)]`";
                    self.bad_sweep("names that change together need a list", axis.values.span, help);
                    return None;
                }
                let values = self.spread(call, axis.values.span, room)?;
                values.into_iter().map(|value| vec![value]).collect()
            }
            _ => {
                let help = "write a list, `range(low, high, count)` or `log_range(low, high, count)`";
                self.bad_sweep("a sweep runs over several values", axis.values.span, help);
                return None;
            }
        };
        if values.is_empty() {
            self.bad_sweep("this list is empty", axis.values.span, "write for example `[0.2 m, 0.4 m]`");
            return None;
        }
        let point = |values: Vec<Value>| {
            let setting = |(path, (value, text)): (&Vec<Name>, Value)| {
                (Assignment { path: path.clone(), random: false, value }, text)
            };
            Point { settings: axis.paths.iter().zip(values).map(setting).collect() }
        };
        Some(values.into_iter().map(point).collect())
    }

    /// The values of one point: of several names, one each.
    fn tied(&mut self, axis: &Axis, value: &ExprAt) -> Option<Vec<Value>> {
        let values: Vec<&ExprAt> = match &value.node {
            _ if axis.paths.len() == 1 => vec![value],
            ast::Expr::Vector(x, y) => vec![x, y],
            ast::Expr::Tuple(all) => all.iter().collect(),
            _ => vec![value],
        };
        if values.len() != axis.paths.len() {
            let (names, given) = (axis.paths.len(), values.len());
            let paths = axis.paths.first().zip(axis.paths.last());
            let names_at = paths.map_or(value.span, |(first, last)| path_span(first).to(path_span(last)));
            let label = format!("{given} value{} here", if given == 1 { "" } else { "s" });
            let problem = Problem::error(
                &BAD_SWEEP,
                format!("{names} names change together, so each point has {names} values"),
            );
            let names: Vec<String> = axis.paths.iter().map(|path| dotted(path)).collect();
            let example = format!("`({}) in [({}), …]`", names.join(", "), vec!["…"; names.len()].join(", "));
            self.report(
                problem.at(value.span, label).with(names_at, "these").help(format!("write {example}")),
            );
            return None;
        }
        Some(values.into_iter().map(|value| (value.clone(), self.one_line(value.span))).collect())
    }

    /// `range(low, high, count)`: evenly, both ends included. `log_range`: by the same factor.
    fn spread(&mut self, call: &'a Call, at: Span, room: usize) -> Option<Vec<Value>> {
        let generics = ["D".to_owned()];
        let parameter = |name: &str, type_: Type| Parameter {
            name: name.to_owned(),
            doc: String::new(),
            type_,
            default: None,
            range: None,
            span: call.name.span,
        };
        let end = || Type::Number(Dim::base("D"));
        let params = [parameter("low", end()), parameter("high", end()), parameter("count", Type::Count)];
        let mut solved = Substitution::default();
        let mut scope = Scope::of(self.program.main);
        let args = self.bind(&mut scope, call, at, &params, (&generics, &mut solved));
        let [low, high, count] = args.as_slice() else { return None };
        let Type::Number(dim) = low.type_.clone() else { return None };
        let ends = (self.constant(low, &"an end of a range"), self.constant(high, &"an end of a range"));
        let count = self.whole(count, &"the number of values", 2.0)?;
        let (low_value, high_value) = ends.0.zip(ends.1)?;
        if count > room {
            self.few("variants", count, VARIANTS, at);
            return None;
        }
        let log = call.name.node == "log_range";
        if log && (low_value <= 0.0 || high_value <= 0.0) {
            let wrong = if low_value <= 0.0 { low.span } else { high.span };
            let problem = Problem::error(&OUT_OF_RANGE, "`log_range` multiplies, so both ends are above 0");
            self.report(
                problem.at(wrong, "not above 0").help("write `range(low, high, count)` for even steps"),
            );
            return None;
        }
        let unit = call
            .args
            .first()
            .and_then(|low| unit_of(&low.value))
            .filter(|_| call.args.iter().all(|a| a.name.is_none()));
        let (factor, unit, unit_text) = match unit {
            Some(unit) => {
                let factor = self.units.unit(&unit.node).map_or(1.0, |(factor, _)| factor);
                (factor, Some(unit.clone()), self.one_line(unit.span))
            }
            None => (1.0, self.si_unit(&dim, at), self.units.si(&dim)),
        };
        let value = |k: usize| {
            let share = k as f64 / (count - 1) as f64;
            let si = match log {
                true => low_value * libm::pow(high_value / low_value, share),
                false => low_value + (high_value - low_value) * share,
            };
            let number = rounded(si / factor);
            let text = format!("{} {unit_text}", written(number)).trim_end().to_owned();
            (Spanned { node: ast::Expr::Number { value: number, unit: unit.clone() }, span: at }, text)
        };
        Some((0..count).map(value).collect())
    }

    /// The SI unit of a dimension, as if it stood at a place.
    fn si_unit(&self, dim: &Dim, at: Span) -> Option<Spanned<UnitExpr>> {
        let factor = |(base, exponent): (&str, crate::dim::Ratio)| {
            let (num, den) = exponent.parts();
            let name = Name { node: self.units.si(&Dim::base(base)), span: at };
            Some((name, (num.try_into().ok()?, den.try_into().ok()?)))
        };
        let factors: Vec<_> = dim.factors().map(factor).collect::<Option<_>>()?;
        (!factors.is_empty()).then_some(Spanned { node: UnitExpr { factors }, span: at })
    }

    fn bad_sweep(&mut self, message: &str, at: Span, help: &str) {
        self.report(Problem::error(&BAD_SWEEP, message).at(at, "").help(help));
    }
}

fn combination(axes: &[Vec<Point>], number: usize, item: Span) -> Chosen {
    let mut rest = number;
    let mut chosen: Vec<&Point> = Vec::new();
    for axis in axes.iter().rev() {
        chosen.extend(axis.get(rest % axis.len()));
        rest /= axis.len();
    }
    let settings: Vec<&(Assignment, String)> =
        chosen.iter().rev().flat_map(|point| &point.settings).collect();
    let each = |between: &str, text: fn(&str) -> String| {
        let parts = settings.iter().map(|(setting, value)| dotted(&setting.path) + between + &text(value));
        parts.collect::<Vec<_>>()
    };
    Chosen {
        name: each("=", in_a_name).join(","),
        text: each(" = ", str::to_owned).join(", "),
        at: settings.first().map_or(item, |(setting, _)| setting.value.span),
        item,
        observe: Vec::new(),
        settings: settings.into_iter().map(|(setting, _)| setting.clone()).collect(),
    }
}

/// The unit of a number literal.
fn unit_of(at: &ExprAt) -> Option<&Spanned<UnitExpr>> {
    match &at.node {
        ast::Expr::Number { unit, .. } => unit.as_ref(),
        ast::Expr::Unary(ast::UnaryOp::Neg, operand) => unit_of(operand),
        _ => None,
    }
}

/// To twelve digits: 0.3, not 0.30000000000000004.
fn rounded(number: f64) -> f64 {
    format!("{number:.11e}").parse().unwrap_or(number)
}

fn written(number: f64) -> String {
    let size = number.abs();
    if size == 0.0 || (1e-4..1e6).contains(&size) { number.to_string() } else { format!("{number:e}") }
}

/// A value as part of the name of a folder.
fn in_a_name(text: &str) -> String {
    let mut name = String::new();
    for letter in text.chars() {
        match letter {
            '%' => name.push_str("pct"),
            '+' => {}
            _ if letter.is_whitespace() => {}
            _ if letter.is_ascii_alphanumeric() || "=.,_-".contains(letter) => name.push(letter),
            _ => name.push('-'),
        }
    }
    name.trim_end_matches('-').to_owned()
}

pub const BAD_SWEEP: Code = Code {
    name: "bad-sweep",
    explain: "\
Each axis of a sweep has a list of values, or a range; names in parentheses change together. Every combination of the
axes becomes a variant.

    sweep { side in 0.2 m }                         // wrong: one value
    sweep { side in [0.2 m, 0.4 m] }                // right
    sweep { side in range(0.2 m, 0.6 m, 3) }        // 0.2 m, 0.4 m and 0.6 m
    sweep { k_o in log_range(0.1, 10, 3) }          // 0.1, 1 and 10
    sweep { (side, k_o) in [(0.2 m, 1), (0.4 m, 2)] }",
};
