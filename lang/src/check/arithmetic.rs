//! Operators, and the dimensions of what they give.

use super::fits::{UNIT_MISMATCH, Wanted};
use super::{Checker, Scope};
use crate::ast::{ExprAt, Span};
use crate::dim::{Dim, Ratio};
use crate::hir::{Expr, Kind, Type};
use crate::plan::{BinaryOp, Function, UnaryOp};
use crate::print::operator;
use crate::problem::{Code, Problem};

impl<'a> Checker<'a> {
    pub fn unary(&mut self, scope: &mut Scope, op: UnaryOp, operand: &'a ExprAt, at: Span) -> Expr {
        let operand = match op {
            UnaryOp::Not => self.wanted(scope, operand, &Type::Truth, &Wanted::by("the operand of `not`")),
            UnaryOp::Neg => self.expr(scope, operand),
        };
        match (op, &operand.type_) {
            (_, Type::Poison) => Expr::poison(at),
            (UnaryOp::Not, _) | (_, Type::Number(_) | Type::Vector(_)) => {
                let type_ = operand.type_.clone();
                self.make(Kind::Unary(op, Box::new(operand)), type_, at)
            }
            (_, other) => {
                let have = self.describe(other);
                let problem = Problem::error(&BAD_OPERANDS, format!("{have} cannot be negated"));
                self.poison(at, problem.at(operand.span, format!("this is {have}")))
            }
        }
    }

    pub fn binary(
        &mut self,
        scope: &mut Scope,
        op: BinaryOp,
        op_span: Span,
        (left, right): (&'a ExprAt, &'a ExprAt),
        at: Span,
    ) -> Expr {
        if op == BinaryOp::Pow {
            return self.power(scope, left, right, at);
        }
        if matches!(op, BinaryOp::And | BinaryOp::Or) {
            let why = Wanted::by(format!("each side of `{}`", operator(op)));
            let left = self.wanted(scope, left, &Type::Truth, &why);
            let right = self.wanted(scope, right, &Type::Truth, &why);
            return self.combined(op, left, right, Some(Type::Truth), at);
        }
        let (left, right) = (self.expr(scope, left), self.expr(scope, right));
        if left.is_poison() || right.is_poison() {
            return Expr::poison(at);
        }
        match op {
            BinaryOp::Mul | BinaryOp::Div => self.product(op, op_span, left, right, at),
            BinaryOp::Add | BinaryOp::Sub => match self.alike(op, op_span, &left, &right) {
                Ok(type_) => self.combined(op, left, right, Some(type_), at),
                Err(problem) => self.poison(at, *problem),
            },
            BinaryOp::Equal | BinaryOp::NotEqual
                if matches!((&left.type_, &right.type_), (Type::Agent(_), Type::Agent(_))) =>
            {
                let same = self.make(Kind::Same(Box::new([left, right])), Type::Truth, at);
                match op {
                    BinaryOp::Equal => same,
                    _ => self.make(Kind::Unary(UnaryOp::Not, Box::new(same)), Type::Truth, at),
                }
            }
            _ => match self.alike(op, op_span, &left, &right) {
                Ok(_) => self.combined(op, left, right, Some(Type::Truth), at),
                Err(problem) => self.poison(at, *problem),
            },
        }
    }

    fn combined(&mut self, op: BinaryOp, left: Expr, right: Expr, type_: Option<Type>, at: Span) -> Expr {
        match type_ {
            Some(type_) if !left.is_poison() && !right.is_poison() => {
                self.make(Kind::Binary(op, Box::new(left), Box::new(right)), type_, at)
            }
            _ => Expr::poison(at),
        }
    }

    /// The common type of two things that are added or compared.
    fn alike(&self, op: BinaryOp, op_span: Span, left: &Expr, right: &Expr) -> Result<Type, Box<Problem>> {
        let ordered = !matches!(op, BinaryOp::Equal | BinaryOp::NotEqual);
        let adds = matches!(op, BinaryOp::Add | BinaryOp::Sub);
        match (&left.type_, &right.type_) {
            (Type::Number(a), Type::Number(b)) if a == b => Ok(left.type_.clone()),
            (Type::Vector(a), Type::Vector(b)) if a == b && adds => Ok(left.type_.clone()),
            (Type::Truth, Type::Truth) if !ordered => Ok(Type::Truth),
            (Type::Number(a), Type::Number(b)) => {
                Err(Box::new(self.unlike(op, op_span, (left, a), (right, b))))
            }
            (Type::Vector(a), Type::Vector(b)) if adds => {
                Err(Box::new(self.unlike(op, op_span, (left, a), (right, b))))
            }
            _ => Err(Box::new(self.bad_operands(op, op_span, left, right))),
        }
    }

    /// Two dimensions that cannot be added or compared.
    fn unlike(&self, op: BinaryOp, op_span: Span, left: (&Expr, &Dim), right: (&Expr, &Dim)) -> Problem {
        let (a, b) = (self.units.people(left.1), self.units.people(right.1));
        let problem = Problem::error(&UNIT_MISMATCH, format!("{a} and {b} cannot be {}", done(op)))
            .at(op_span, "")
            .with(left.0.span, format!("this is {a}"))
            .with(right.0.span, format!("this is {b}"));
        // A literal is changed before anything else; then what has no dimension, which is likely to miss one.
        let literal = |side: (&Expr, &Dim)| matches!(side.0.kind, Kind::Number(_));
        let (wrong, other) =
            if literal(left) || left.1.is_none() && !literal(right) { (left, right) } else { (right, left) };
        self.with_unit_remedy(problem, wrong.0, wrong.1, other.1)
    }

    fn bad_operands(&self, op: BinaryOp, op_span: Span, left: &Expr, right: &Expr) -> Problem {
        let (a, b) = (self.describe(&left.type_), self.describe(&right.type_));
        let problem = Problem::error(&BAD_OPERANDS, format!("{a} and {b} cannot be {}", done(op)))
            .at(op_span, "")
            .with(left.span, format!("this is {a}"))
            .with(right.span, format!("this is {b}"));
        let (l, r) = (self.sources.text(left.span), self.sources.text(right.span));
        match (op, &left.type_, &right.type_) {
            (BinaryOp::Mul, Type::Vector(_), Type::Vector(_)) => problem.help(format!(
                "`dot({l}, {r})` is their scalar product, `cross({l}, {r})` their cross product"
            )),
            (BinaryOp::Div, _, Type::Vector(_)) => problem.help(format!("divide by its length: `|{r}|`")),
            (_, Type::Vector(_), Type::Vector(_)) => {
                problem.help(format!("compare their lengths: `|{l}| {} |{r}|`", operator(op)))
            }
            (_, Type::Vector(_), Type::Number(_)) => problem.help(format!("`|{l}|` is the vector's length")),
            (_, Type::Number(_), Type::Vector(_)) => problem.help(format!("`|{r}|` is the vector's length")),
            (_, Type::Agent(_), Type::Agent(_)) => {
                problem.help(format!("two agents are the same or not: `{l} == {r}`, `{l} != {r}`"))
            }
            (_, Type::Agent(_), Type::Number(_)) => {
                problem.help(format!("the number of an agent in its group is `number({l})`"))
            }
            (_, Type::Number(_), Type::Agent(_)) => {
                problem.help(format!("the number of an agent in its group is `number({r})`"))
            }
            (_, Type::Truth, Type::Number(_)) if done(op) == "compared" => {
                let count = format!("`(count(…) {l}) {} {r}`", operator(op));
                problem.help(format!("to compare how many there are, put the count in parentheses: {count}"))
            }
            (_, Type::Truth, Type::Number(_)) => problem.help(format!("`if {l} then 1 else 0` is a number")),
            (_, Type::Number(_), Type::Truth) => problem.help(format!("`if {r} then 1 else 0` is a number")),
            _ => problem,
        }
    }

    fn product(&mut self, op: BinaryOp, op_span: Span, left: Expr, right: Expr, at: Span) -> Expr {
        let combine = |a: &Dim, b: &Dim| if op == BinaryOp::Mul { a.mul(b) } else { a.div(b) };
        let dim = match (&left.type_, &right.type_) {
            (Type::Number(a), Type::Number(b)) => combine(a, b).map(Type::Number),
            (Type::Vector(a), Type::Number(b)) => combine(a, b).map(Type::Vector),
            (Type::Number(a), Type::Vector(b)) if op == BinaryOp::Mul => combine(a, b).map(Type::Vector),
            _ => {
                let problem = self.bad_operands(op, op_span, &left, &right);
                return self.poison(at, problem);
            }
        };
        match dim {
            Some(_) => self.combined(op, left, right, dim, at),
            None => self.poison(at, exponent_too_large(at)),
        }
    }

    fn power(&mut self, scope: &mut Scope, base: &'a ExprAt, exponent: &'a ExprAt, at: Span) -> Expr {
        let (base, exponent) = (self.expr(scope, base), self.expr(scope, exponent));
        let (Type::Number(dim), Type::Number(of)) = (&base.type_, &exponent.type_) else {
            if base.is_poison() || exponent.is_poison() {
                return Expr::poison(at);
            }
            let wrong = if matches!(base.type_, Type::Number(_)) { &exponent } else { &base };
            let have = self.describe(&wrong.type_);
            let problem = Problem::error(&BAD_OPERANDS, "only a number can be raised to a number")
                .at(wrong.span, format!("this is {have}"));
            return self.poison(at, problem);
        };
        if !of.is_none() {
            let have = self.units.people(of);
            let problem =
                Problem::error(&UNIT_MISMATCH, format!("an exponent is a plain number, not {have}"))
                    .at(exponent.span, format!("this is {have}"));
            return self.poison(at, problem);
        }
        let ratio = fraction(&exponent);
        let raised = match ratio {
            _ if dim.is_none() => Some(Dim::none()),
            Some(ratio) => dim.pow(ratio),
            None => {
                let have = self.units.people(dim);
                let problem =
                    Problem::error(&BAD_EXPONENT, format!("{have} needs an exponent written as a number"))
                        .at(exponent.span, "the dimension of the result depends on it")
                        .with(base.span, format!("this is {have}"))
                        .help("write a whole number or a fraction: `x^2`, `x^(1/2)`");
                return self.poison(at, problem);
            }
        };
        let Some(raised) = raised else { return self.poison(at, exponent_too_large(at)) };
        let exponent = match ratio {
            Some(ratio) => self.make(Kind::Number(ratio.value()), Type::Number(Dim::none()), exponent.span),
            None => match self.constant(&exponent, &"an exponent") {
                Some(value) => self.make(Kind::Number(value), Type::Number(Dim::none()), exponent.span),
                None => return Expr::poison(at),
            },
        };
        self.combined(BinaryOp::Pow, base, exponent, Some(Type::Number(raised)), at)
    }

    /// `|x|`
    pub fn bars(&mut self, scope: &mut Scope, of: &'a ExprAt, at: Span) -> Expr {
        let of = self.expr(scope, of);
        let (function, type_) = match &of.type_ {
            Type::Poison => return Expr::poison(at),
            Type::Number(dim) => (Function::Abs, Type::Number(dim.clone())),
            Type::Vector(dim) => (Function::Norm, Type::Number(dim.clone())),
            other => {
                let have = self.describe(other);
                let problem = Problem::error(&BAD_OPERANDS, "`|…|` is the size of a number or a vector");
                return self.poison(at, problem.at(of.span, format!("this is {have}")));
            }
        };
        self.make(Kind::BuiltIn(function, vec![of]), type_, at)
    }

    pub fn if_(
        &mut self,
        scope: &mut Scope,
        condition: &'a ExprAt,
        (then, otherwise): (&'a ExprAt, &'a ExprAt),
        at: Span,
    ) -> Expr {
        let condition = self.wanted(scope, condition, &Type::Truth, &Wanted::by("the condition of `if`"));
        let then = self.expr(scope, then);
        let why = Wanted::like("what follows `else`", then.span);
        let type_ = then.type_.clone();
        let otherwise = self.expr(scope, otherwise);
        let otherwise = self.fits(otherwise, &type_, &why, &[], &mut Default::default());
        if condition.is_poison() || then.is_poison() || otherwise.is_poison() {
            return Expr::poison(at);
        }
        if !type_.is_plain() {
            let have = self.describe(&type_);
            let problem = Problem::error(&BAD_OPERANDS, format!("`if` cannot choose {have}"));
            return self.poison(at, problem.at(then.span, format!("this is {have}")));
        }
        let kind =
            Kind::If { condition: Box::new(condition), then: Box::new(then), otherwise: Box::new(otherwise) };
        self.make(kind, type_, at)
    }
}

/// A fraction of whole literals.
fn fraction(expr: &Expr) -> Option<Ratio> {
    match &expr.kind {
        Kind::Number(value) if value.fract() == 0.0 && value.abs() <= 1e6 => Ratio::new(*value as i64, 1),
        Kind::Number(value) if (value * 1000.0).fract() == 0.0 && value.abs() <= 1e3 => {
            Ratio::new((value * 1000.0) as i64, 1000)
        }
        Kind::Unary(UnaryOp::Neg, operand) => fraction(operand).map(Ratio::negated),
        Kind::Binary(BinaryOp::Div, left, right) => fraction(left)?.times(fraction(right)?.inverse()?),
        _ => None,
    }
}

fn exponent_too_large(at: Span) -> Problem {
    Problem::error(&BAD_EXPONENT, "the exponents of this dimension get too large").at(at, "")
}

/// "a and b cannot be …"
fn done(op: BinaryOp) -> &'static str {
    match op {
        BinaryOp::Add => "added",
        BinaryOp::Sub => "subtracted",
        BinaryOp::Mul => "multiplied",
        BinaryOp::Div => "divided",
        _ => "compared",
    }
}

pub const BAD_OPERANDS: Code = Code {
    name: "bad-operands",
    explain: "\
An operator was given things it cannot work with. Numbers add and multiply; vectors add, and are multiplied and
divided by numbers; truth values are joined by `and`, `or` and `not`.

    p[i] * v[i]                 // wrong: two vectors
    dot(p[i], v[i])             // right",
};

pub const BAD_EXPONENT: Code = Code {
    name: "bad-exponent",
    explain: "\
The dimension of x^n depends on n, so n is written as a number wherever x has a dimension.

    |p[i]|^k                    // wrong: a length to a power that is not written here
    |p[i]|^2                    // right
    |p[i]|^(1/2)                // right",
};
