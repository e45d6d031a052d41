//! Expressions, dimensions and types from what the grammar found.

use std::sync::LazyLock;

use pest::pratt_parser::{Assoc, Op, PrattParser};

use crate::ast::{
    Argument, BinaryOp, Call, DimExpr, Expr, ExprAt, Name, Over, Reduction, Span, Spanned, TypeExpr, UnaryOp,
    UnitExpr,
};
use crate::problem::{Code, Problem};

use super::items::Parts;
use super::{Context, MAX_DEPTH, Node, Rule, scan};

pub(crate) const NUMBER_TOO_LARGE: Code = Code {
    name: "number-too-large",
    explain: "\
A number must fit into a 64-bit floating point number, at most about 1.8e308, and an exponent of a unit into a small
whole number. Use a larger unit, or check the exponent: `1e400 m` was likely meant to be something else.",
};

pub(crate) const CHAINED_COMPARISON: Code = Code {
    name: "chained-comparison",
    explain: "\
A comparison has two sides and gives true or false, which cannot be compared again.

    0 m < x < 1 m                // wrong
    0 m < x and x < 1 m          // right

`count`, `any` and `all` take the comparison after them as their body. To compare the count itself, put it in
parentheses: `(count(i in follower) outside(i)) > 1`.",
};

/// Precedences, from loose to tight.
static PRATT: LazyLock<PrattParser<Rule>> = LazyLock::new(|| {
    let left = |rule| Op::infix(rule, Assoc::Left);
    PrattParser::new()
        .op(left(Rule::dots))
        .op(Op::prefix(Rule::if_))
        .op(left(Rule::kw_or))
        .op(left(Rule::kw_and))
        .op(Op::prefix(Rule::kw_not) | Op::prefix(Rule::tally))
        .op(left(Rule::comparison))
        .op(left(Rule::plus_minus))
        .op(Op::prefix(Rule::fold))
        .op(left(Rule::times_over))
        .op(Op::prefix(Rule::negative))
        .op(Op::infix(Rule::power, Assoc::Right))
        .op(Op::postfix(Rule::index) | Op::postfix(Rule::member))
});

/// An expression and the height of its tree.
type Tall = (ExprAt, usize);

pub(super) fn expr(context: &Context, node: Node) -> Option<ExprAt> {
    tall(context, node).map(|(expr, _)| expr)
}

fn tall(context: &Context, node: Node) -> Option<Tall> {
    let span = context.span(&node);
    // Each of these makes the Pratt parser call itself.
    let recursive = |part: &Node| {
        let rule = part.as_rule();
        matches!(rule, Rule::negative | Rule::kw_not | Rule::if_ | Rule::fold | Rule::tally | Rule::power)
    };
    if node.clone().into_inner().filter(recursive).count() > MAX_DEPTH {
        context.problem(scan::too_deep(span));
        return None;
    }
    if chained(context, &node) {
        return None;
    }
    let (expr, height) = PRATT
        .map_primary(|node| atom(context, node))
        .map_prefix(|op, body| prefix(context, op, body?))
        .map_postfix(|operand, op| postfix(context, operand?, op))
        .map_infix(|left, op, right| infix(context, left?, op, right?))
        .parse(node.into_inner())?;
    if height > MAX_DEPTH {
        context.problem(scan::too_deep(span));
        return None;
    }
    Some((expr, height))
}

/// Whether two comparisons of one level follow each other; tells of it.
fn chained(context: &Context, node: &Node) -> bool {
    let (mut first, mut tally): (Option<Node>, Option<Node>) = (None, None);
    for part in node.clone().into_inner() {
        match part.as_rule() {
            Rule::comparison => match first {
                Some(ref first) => {
                    let help = match tally {
                        Some(tally) => {
                            let tally = tally.as_str();
                            format!(
                                "to compare what `{tally} …` gives, put it in parentheses: `({tally} …) {} …`",
                                part.as_str()
                            )
                        }
                        None => "write `a < b and b < c`, or put one of them in parentheses".to_owned(),
                    };
                    context.problem(
                        Problem::error(&CHAINED_COMPARISON, "comparisons do not chain")
                            .at(context.span(&part), "a second comparison")
                            .with(context.span(first), "the first one ends in true or false")
                            .help(help),
                    );
                    return true;
                }
                None => first = Some(part),
            },
            Rule::tally => tally = Some(part),
            Rule::kw_and | Rule::kw_or | Rule::dots => (first, tally) = (None, None),
            _ => {}
        }
    }
    false
}

fn prefix(context: &Context, op: Node, (body, height): Tall) -> Option<Tall> {
    let span = context.span(&op).to(body.span);
    let (node, height) = match op.as_rule() {
        Rule::negative => (Expr::Unary(UnaryOp::Neg, Box::new(body)), height),
        Rule::kw_not => (Expr::Unary(UnaryOp::Not, Box::new(body)), height),
        Rule::if_ => {
            let mut parts = Parts::of(op);
            let (condition, height_1) = tall(context, parts.of_rule(Rule::expr)?)?;
            let (then, height_2) = tall(context, parts.of_rule(Rule::expr)?)?;
            let parts =
                Expr::If { condition: Box::new(condition), then: Box::new(then), otherwise: Box::new(body) };
            (parts, height.max(height_1).max(height_2))
        }
        _ => {
            let mut parts = Parts::of(op);
            let word = parts.next()?;
            let op = Spanned { node: reduction(word.as_str())?, span: context.span(&word) };
            let over = over(context, Parts::of(parts.next()?).next()?)?;
            (Expr::Reduce { op, over, body: Box::new(body) }, height)
        }
    };
    Some((Spanned { node, span }, height + 1))
}

fn reduction(word: &str) -> Option<Reduction> {
    Some(match word {
        "sum" => Reduction::Sum,
        "mean" => Reduction::Mean,
        "min" => Reduction::Min,
        "max" => Reduction::Max,
        "count" => Reduction::Count,
        "any" => Reduction::Any,
        "all" => Reduction::All,
        _ => return None,
    })
}

pub(super) fn over(context: &Context, node: Node) -> Option<Over> {
    let mut parts = Parts::of(node);
    let mut vars = Vec::new();
    while let Some(var) = parts.of_rule(Rule::new_name) {
        vars.push(name(context, var));
    }
    let set = Box::new(expr(context, parts.of_rule(Rule::expr)?)?);
    let filter = match parts.of_rule(Rule::filter) {
        Some(filter) => Some(Box::new(expr(context, Parts::of(filter).next()?)?)),
        None => None,
    };
    Some(Over { vars, set, filter })
}

fn postfix(context: &Context, (operand, height): Tall, op: Node) -> Option<Tall> {
    let span = operand.span.to(context.span(&op));
    let (rule, mut parts) = (op.as_rule(), Parts::of(op));
    let inner = parts.next()?;
    let (node, height) = if rule == Rule::index {
        let (mut index, mut height_1) = tall(context, inner)?;
        if let Some(second) = parts.next() {
            let (second, height_2) = tall(context, second)?;
            let span = index.span.to(second.span);
            index = Spanned { node: Expr::Vector(Box::new(index), Box::new(second)), span };
            height_1 = height_1.max(height_2) + 1;
        }
        (Expr::Index(Box::new(operand), Box::new(index)), height.max(height_1))
    } else {
        (Expr::Member(Box::new(operand), name(context, inner)), height)
    };
    Some((Spanned { node, span }, height + 1))
}

fn infix(context: &Context, (left, height_1): Tall, op: Node, (right, height_2): Tall) -> Option<Tall> {
    let (span, op_span) = (left.span.to(right.span), context.span(&op));
    let (left, right) = (Box::new(left), Box::new(right));
    let op = match op.as_str() {
        ".." => None,
        "or" => Some(BinaryOp::Or),
        "and" => Some(BinaryOp::And),
        "<" => Some(BinaryOp::Less),
        "<=" => Some(BinaryOp::LessEq),
        ">" => Some(BinaryOp::Greater),
        ">=" => Some(BinaryOp::GreaterEq),
        "==" => Some(BinaryOp::Equal),
        "!=" => Some(BinaryOp::NotEqual),
        "+" => Some(BinaryOp::Add),
        "-" => Some(BinaryOp::Sub),
        "*" => Some(BinaryOp::Mul),
        "/" => Some(BinaryOp::Div),
        _ => Some(BinaryOp::Pow),
    };
    let node = match op {
        Some(op) => Expr::Binary { op, op_span, left, right },
        None => Expr::Range(left, right),
    };
    Some((Spanned { node, span }, height_1.max(height_2) + 1))
}

fn atom(context: &Context, node: Node) -> Option<Tall> {
    let span = context.span(&node);
    let (node, height) = match node.as_rule() {
        Rule::number => (number(context, node)?, 0),
        Rule::truth => (Expr::Truth(node.as_str() == "true"), 0),
        Rule::call if node.clone().into_inner().len() == 1 => (Expr::Name(node.as_str().to_owned()), 0),
        Rule::call => {
            let (call, height) = call(context, node)?;
            (Expr::Call(call), height)
        }
        Rule::bars => {
            let (inner, height) = tall(context, Parts::of(node).next()?)?;
            (Expr::Bars(Box::new(inner)), height)
        }
        Rule::list => {
            let values: Vec<Tall> =
                Parts::of(node).map(|value| tall(context, value)).collect::<Option<_>>()?;
            let height = values.iter().map(|(_, height)| *height).max().unwrap_or(0);
            (Expr::List(values.into_iter().map(|(value, _)| value).collect()), height)
        }
        _ => {
            let mut parts = Parts::of(node);
            let (x, height) = tall(context, parts.next()?)?;
            let Some(y) = parts.next() else { return Some((Spanned { node: x.node, span }, height)) };
            let mut values = vec![(x, height), tall(context, y)?];
            for value in parts {
                values.push(tall(context, value)?);
            }
            let height = values.iter().map(|(_, height)| *height).max().unwrap_or(0);
            let values: Vec<ExprAt> = values.into_iter().map(|(value, _)| value).collect();
            match <[ExprAt; 2]>::try_from(values) {
                Ok([x, y]) => (Expr::Vector(Box::new(x), Box::new(y)), height),
                Err(values) => (Expr::Tuple(values), height),
            }
        }
    };
    Some((Spanned { node, span }, height + 1))
}

fn number(context: &Context, node: Node) -> Option<Expr> {
    let mut parts = Parts::of(node);
    let literal = parts.of_rule(Rule::literal)?;
    let value: f64 = literal.as_str().parse().ok()?;
    if value.is_infinite() {
        let message = format!("{} is too large for a number", literal.as_str());
        context.problem(
            Problem::error(&NUMBER_TOO_LARGE, message)
                .at(context.span(&literal), "at most about 1.8e308")
                .help("check the exponent"),
        );
        return None;
    }
    let unit = match parts.next() {
        Some(unit) if unit.as_rule() == Rule::percent => {
            let span = context.span(&unit);
            let factors = vec![(Spanned { node: "percent".to_owned(), span }, (1, 1))];
            Some(Spanned { node: UnitExpr { factors }, span })
        }
        Some(unit) => {
            Some(Spanned { span: context.span(&unit), node: UnitExpr { factors: factors(context, unit)? } })
        }
        None => None,
    };
    Some(Expr::Number { value, unit })
}

/// Names with exponents, joined by `*` and `/`.
fn factors(context: &Context, node: Node) -> Option<Vec<(Name, (i32, i32))>> {
    let (mut factors, mut sign) = (Vec::new(), 1);
    for part in node.into_inner() {
        match part.as_rule() {
            Rule::times_over => sign = if part.as_str() == "/" { -1 } else { 1 },
            _ => {
                let mut parts = Parts::of(part);
                let base = parts.next()?;
                let exponent = match parts.of_rule(Rule::exponent) {
                    Some(node) => exponent(context, node)?,
                    None => (1, 1),
                };
                if base.as_rule() == Rule::name {
                    factors.push((name(context, base), (sign * exponent.0, exponent.1)));
                }
            }
        }
    }
    Some(factors)
}

/// A fraction with a small numerator and a small denominator above 0.
fn exponent(context: &Context, node: Node) -> Option<(i32, i32)> {
    let span = context.span(&node);
    let negative = node.as_str().contains('-');
    let mut parts = node.into_inner().filter(|part| part.as_rule() == Rule::integer);
    let mut small = |or: i32| match parts.next() {
        Some(part) => part.as_str().parse().ok().filter(|value| (0..=1000).contains(value)),
        None => Some(or),
    };
    match (small(1), small(1)) {
        (Some(top), Some(bottom)) if bottom > 0 => Some((if negative { -top } else { top }, bottom)),
        _ => {
            context.problem(
                Problem::error(&NUMBER_TOO_LARGE, "this exponent cannot be used")
                    .at(span, "a whole number up to 1000, or a fraction of such numbers")
                    .help("for example `m^2`, `m^-1` or `m^(1/2)`"),
            );
            None
        }
    }
}

/// `name(arguments)` or `name`, and the height of the tallest argument.
fn call(context: &Context, node: Node) -> Option<(Call, usize)> {
    let mut parts = Parts::of(node);
    let name_node = parts.of_rule(Rule::name)?;
    let (mut args, mut height) = (Vec::new(), 0);
    for argument in parts.next().map(Parts::of).into_iter().flatten() {
        let mut parts = Parts::of(argument);
        let label = parts.of_rule(Rule::name).map(|node| name(context, node));
        let (value, height_1) = tall(context, parts.next()?)?;
        args.push(Argument { name: label, value });
        height = height.max(height_1);
    }
    Some((Call { name: name(context, name_node), args }, height))
}

pub(super) fn use_of(context: &Context, node: Node) -> Option<Call> {
    call(context, node).map(|(call, _)| call)
}

pub(super) fn name(context: &Context, node: Node) -> Name {
    Spanned { span: context.span(&node), node: node.as_str().to_owned() }
}

pub(super) fn dimensions(context: &Context, node: Node) -> Option<Spanned<DimExpr>> {
    let span = context.span(&node);
    Some(Spanned { node: DimExpr { factors: factors(context, node)? }, span })
}

pub(super) fn type_(context: &Context, node: Node) -> Option<Spanned<TypeExpr>> {
    let span: Span = context.span(&node);
    let inner = Parts::of(node).next()?;
    let node = match inner.as_rule() {
        Rule::dimensions => TypeExpr::Dim(dimensions(context, inner)?.node),
        Rule::vec_of => TypeExpr::Vector(dimensions(context, Parts::of(inner).next()?)?.node),
        Rule::range_of => TypeExpr::Range(dimensions(context, Parts::of(inner).next()?)?.node),
        _ => TypeExpr::OneOf(Parts::of(Parts::of(inner).next()?).map(|word| name(context, word)).collect()),
    };
    Some(Spanned { node, span })
}
