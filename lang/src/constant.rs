//! The value of expressions that are the same in every episode and at every step.

use crate::plan::{BinaryOp, Expr, Function, UnaryOp, WorldConstant};

/// The constants that an expression may refer to; `None` where they are not known.
#[derive(Clone, Debug, Default)]
pub struct Constants {
    pub params: Vec<Option<f64>>,
    pub dt_s: Option<f64>,
    pub safety_m: Option<f64>,
    pub horizon: Option<f64>,
    /// Number and count of the slot at hand.
    pub slot: Option<(f64, f64)>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Constant {
    Number(f64),
    Vector(f64, f64),
    Truth(bool),
}

impl Constants {
    pub fn number(&self, expr: &Expr) -> Option<f64> {
        match self.value(expr)? {
            Constant::Number(value) => Some(value),
            _ => None,
        }
    }

    pub fn vector(&self, expr: &Expr) -> Option<(f64, f64)> {
        match self.value(expr)? {
            Constant::Vector(x, y) => Some((x, y)),
            _ => None,
        }
    }

    pub fn value(&self, expr: &Expr) -> Option<Constant> {
        use Constant::{Number, Truth, Vector};
        Some(match expr {
            Expr::Number(value) => Number(*value),
            Expr::Truth(truth) => Truth(*truth),
            Expr::Param(id) => Number((*self.params.get(*id)?)?),
            Expr::World(constant) => Number(match constant {
                WorldConstant::Dt => self.dt_s?,
                WorldConstant::Safety => self.safety_m?,
                WorldConstant::Horizon => self.horizon?,
            }),
            Expr::SlotNumber => Number(self.slot?.0),
            Expr::SlotCount => Number(self.slot?.1),
            Expr::Vector(x, y) => Vector(self.number(x)?, self.number(y)?),
            Expr::Unary(op, operand) => match (op, self.value(operand)?) {
                (UnaryOp::Neg, Number(x)) => Number(-x),
                (UnaryOp::Neg, Vector(x, y)) => Vector(-x, -y),
                (UnaryOp::Not, Truth(truth)) => Truth(!truth),
                _ => return None,
            },
            Expr::Binary(op, left, right) => binary(*op, self.value(left)?, self.value(right)?)?,
            Expr::Call(function, args) => {
                let args = args.iter().map(|arg| self.value(arg)).collect::<Option<Vec<_>>>()?;
                call(*function, &args)?
            }
            Expr::If { condition, then, otherwise } => match self.value(condition)? {
                Truth(true) => self.value(then)?,
                Truth(false) => self.value(otherwise)?,
                _ => return None,
            },
            Expr::Element(list, number) => {
                let number = self.number(number)?.floor().max(1.0) as usize;
                self.value(list.get(number - 1).or(list.last())?)?
            }
            Expr::Time | Expr::State(_) | Expr::Agent(..) | Expr::Slot(..) | Expr::Rest(..) => return None,
            Expr::Reduce { .. } | Expr::Draw { .. } | Expr::Track(..) | Expr::Measured(_) => return None,
            Expr::Clearance(..) | Expr::Same(..) | Expr::MemberNumber(_) => return None,
        })
    }
}

fn binary(op: BinaryOp, left: Constant, right: Constant) -> Option<Constant> {
    use Constant::{Number, Truth, Vector};
    Some(match (op, left, right) {
        (BinaryOp::Add, Number(a), Number(b)) => Number(a + b),
        (BinaryOp::Sub, Number(a), Number(b)) => Number(a - b),
        (BinaryOp::Mul, Number(a), Number(b)) => Number(a * b),
        (BinaryOp::Div, Number(a), Number(b)) => Number(a / b),
        (BinaryOp::Pow, Number(a), Number(b)) => Number(libm::pow(a, b)),
        (BinaryOp::Add, Vector(a, b), Vector(c, d)) => Vector(a + c, b + d),
        (BinaryOp::Sub, Vector(a, b), Vector(c, d)) => Vector(a - c, b - d),
        (BinaryOp::Mul, Vector(x, y), Number(a)) | (BinaryOp::Mul, Number(a), Vector(x, y)) => {
            Vector(x * a, y * a)
        }
        (BinaryOp::Div, Vector(x, y), Number(a)) => Vector(x / a, y / a),
        (BinaryOp::Less, Number(a), Number(b)) => Truth(a < b),
        (BinaryOp::LessEq, Number(a), Number(b)) => Truth(a <= b),
        (BinaryOp::Greater, Number(a), Number(b)) => Truth(a > b),
        (BinaryOp::GreaterEq, Number(a), Number(b)) => Truth(a >= b),
        (BinaryOp::Equal, a, b) => Truth(a == b),
        (BinaryOp::NotEqual, a, b) => Truth(a != b),
        (BinaryOp::And, Truth(a), Truth(b)) => Truth(a && b),
        (BinaryOp::Or, Truth(a), Truth(b)) => Truth(a || b),
        _ => return None,
    })
}

fn call(function: Function, args: &[Constant]) -> Option<Constant> {
    use Constant::{Number, Vector};
    Some(match (function, args) {
        (Function::Norm, [Vector(x, y)]) => Number((x * x + y * y).sqrt()),
        (Function::Abs, [Number(x)]) => Number(x.abs()),
        (Function::X, [Vector(x, _)]) => Number(*x),
        (Function::Y, [Vector(_, y)]) => Number(*y),
        (Function::Dot, [Vector(a, b), Vector(c, d)]) => Number(a * c + b * d),
        (Function::Cross, [Vector(a, b), Vector(c, d)]) => Number(a * d - b * c),
        (Function::Rotate, [Vector(x, y), Number(angle)]) => {
            let (sin, cos) = libm::sincos(*angle);
            Vector(cos * x - sin * y, sin * x + cos * y)
        }
        (Function::Unit, [Vector(x, y)]) => {
            let length = (x * x + y * y).sqrt();
            if length > 0.0 { Vector(x / length, y / length) } else { Vector(0.0, 0.0) }
        }
        (Function::Sqrt, [Number(x)]) => Number(x.sqrt()),
        (Function::Sin, [Number(x)]) => Number(libm::sin(*x)),
        (Function::Cos, [Number(x)]) => Number(libm::cos(*x)),
        (Function::Tan, [Number(x)]) => Number(libm::tan(*x)),
        (Function::Atan2, [Number(y), Number(x)]) => Number(libm::atan2(*y, *x)),
        (Function::Exp, [Number(x)]) => Number(libm::exp(*x)),
        (Function::Ln, [Number(x)]) => Number(libm::log(*x)),
        (Function::Tanh, [Number(x)]) => Number(libm::tanh(*x)),
        (Function::Floor, [Number(x)]) => Number(x.floor()),
        (Function::Mod, [Number(x), Number(y)]) => Number(x - y * (x / y).floor()),
        (Function::Sign, [Number(x)]) => Number(if *x > 0.0 {
            1.0
        } else if *x < 0.0 {
            -1.0
        } else {
            0.0
        }),
        (Function::Min, [Number(a), Number(b)]) => Number(a.min(*b)),
        (Function::Max, [Number(a), Number(b)]) => Number(a.max(*b)),
        (Function::Clamp, [Number(x), Number(low), Number(high)]) => Number(x.max(*low).min(*high)),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_never_changes_has_a_value() {
        let known = Constants { params: vec![Some(2.0), None], dt_s: Some(0.1), ..Constants::default() };
        let times = |left, right| Expr::Binary(BinaryOp::Mul, Box::new(left), Box::new(right));
        let dt = Expr::World(WorldConstant::Dt);
        assert_eq!(known.number(&times(Expr::Param(0), dt.clone())), Some(0.2));
        assert_eq!(known.number(&times(Expr::Param(1), dt.clone())), None);
        assert_eq!(known.number(&times(Expr::Time, dt)), None);
        assert_eq!(known.number(&Expr::Param(7)), None);
    }

    /// By hand, with numbers that tell each operator from every other. `mod` is never negative; a quarter turn turns left.
    #[test]
    fn operators_and_functions_mean_what_they_do_in_mathematics() {
        use Constant::{Number, Truth, Vector};
        use std::f64::consts::{FRAC_PI_2, LN_2, SQRT_2};
        let (three, four) = (Number(3.0), Number(4.0));
        let (a, b) = (Vector(3.0, 4.0), Vector(-1.0, 5.0));
        let (yes, no) = (Truth(true), Truth(false));
        for (op, left, right, wanted) in [
            (BinaryOp::Add, three, four, Number(7.0)),
            (BinaryOp::Sub, three, four, Number(-1.0)),
            (BinaryOp::Mul, three, four, Number(12.0)),
            (BinaryOp::Div, three, four, Number(0.75)),
            (BinaryOp::Pow, three, four, Number(81.0)),
            (BinaryOp::Add, a, b, Vector(2.0, 9.0)),
            (BinaryOp::Sub, a, b, Vector(4.0, -1.0)),
            (BinaryOp::Mul, a, three, Vector(9.0, 12.0)),
            (BinaryOp::Mul, three, a, Vector(9.0, 12.0)),
            (BinaryOp::Div, a, Number(2.0), Vector(1.5, 2.0)),
        ] {
            assert_eq!(binary(op, left, right), Some(wanted), "{op:?} {left:?} {right:?}");
        }
        // Of 3 and 4, 4 and 3, 3 and 3.
        for (op, wanted) in [
            (BinaryOp::Less, [true, false, false]),
            (BinaryOp::LessEq, [true, false, true]),
            (BinaryOp::Greater, [false, true, false]),
            (BinaryOp::GreaterEq, [false, true, true]),
            (BinaryOp::Equal, [false, false, true]),
            (BinaryOp::NotEqual, [true, true, false]),
        ] {
            let pairs = [(three, four), (four, three), (three, three)];
            assert_eq!(
                pairs.map(|(a, b)| binary(op, a, b)),
                wanted.map(|truth| Some(Truth(truth))),
                "{op:?}"
            );
        }
        let pairs = [(yes, yes), (yes, no), (no, yes), (no, no)];
        let all = |op| pairs.map(|(a, b)| binary(op, a, b) == Some(yes));
        assert_eq!(all(BinaryOp::And), [true, false, false, false]);
        assert_eq!(all(BinaryOp::Or), [true, true, true, false]);
        assert_eq!(binary(BinaryOp::Add, three, yes), None);

        for (function, args, wanted) in [
            (Function::Norm, vec![a], Number(5.0)),
            (Function::Abs, vec![Number(-3.0)], three),
            (Function::X, vec![a], three),
            (Function::Y, vec![a], four),
            (Function::Dot, vec![a, b], Number(17.0)),
            (Function::Cross, vec![a, b], Number(19.0)),
            (Function::Rotate, vec![a, Number(FRAC_PI_2)], Vector(-4.0, 3.0)),
            (Function::Rotate, vec![a, Number(FRAC_PI_2 / 2.0)], Vector(-1.0 / SQRT_2, 7.0 / SQRT_2)),
            (Function::Unit, vec![a], Vector(0.6, 0.8)),
            (Function::Unit, vec![Vector(0.0, 0.0)], Vector(0.0, 0.0)),
            (Function::Sqrt, vec![four], Number(2.0)),
            (Function::Sin, vec![Number(FRAC_PI_2 / 3.0)], Number(0.5)),
            (Function::Cos, vec![Number(2.0 * FRAC_PI_2 / 3.0)], Number(0.5)),
            (Function::Tan, vec![Number(FRAC_PI_2 / 2.0)], Number(1.0)),
            (Function::Atan2, vec![Number(1.0), Number(0.0)], Number(FRAC_PI_2)),
            (Function::Exp, vec![Number(LN_2)], Number(2.0)),
            (Function::Ln, vec![Number(2.0)], Number(LN_2)),
            (Function::Tanh, vec![Number(LN_2)], Number(0.6)),
            (Function::Floor, vec![Number(-1.5)], Number(-2.0)),
            (Function::Mod, vec![Number(-1.0), four], three),
            (Function::Mod, vec![Number(9.0), four], Number(1.0)),
            (Function::Sign, vec![three], Number(1.0)),
            (Function::Sign, vec![Number(-3.0)], Number(-1.0)),
            (Function::Sign, vec![Number(0.0)], Number(0.0)),
            (Function::Min, vec![three, four], three),
            (Function::Max, vec![three, four], four),
            (Function::Clamp, vec![Number(5.0), three, four], four),
            (Function::Clamp, vec![Number(2.0), three, four], three),
        ] {
            let numbers = |constant: Option<Constant>| match constant {
                Some(Number(x)) => [x, 0.0],
                Some(Vector(x, y)) => [x, y],
                _ => [f64::NAN; 2],
            };
            let (found, wanted) = (call(function, &args), Some(wanted));
            let near = numbers(found).iter().zip(numbers(wanted)).all(|(a, b)| (a - b).abs() < 1e-15);
            assert!(near, "{function:?} {args:?}: {found:?}");
        }
    }

    /// Numbers of elements begin at 1; those beyond the ends give the first and the last.
    #[test]
    fn lists_and_choices_have_values() {
        let known = Constants::default();
        let list = || (1..=3).map(|it| Expr::Number(f64::from(it) * 10.0)).collect::<Vec<_>>();
        let element = |number: f64| known.number(&Expr::Element(list(), Box::new(Expr::Number(number))));
        assert_eq!([-1.0, 1.0, 2.5, 3.0, 9.0].map(element), [10.0, 10.0, 20.0, 30.0, 30.0].map(Some));
        let choice = |truth| Expr::If {
            condition: Box::new(Expr::Unary(UnaryOp::Not, Box::new(Expr::Truth(truth)))),
            then: Box::new(Expr::Number(1.0)),
            otherwise: Box::new(Expr::Number(2.0)),
        };
        assert_eq!([true, false].map(|truth| known.number(&choice(truth))), [Some(2.0), Some(1.0)]);
        let negative = |expr| known.value(&Expr::Unary(UnaryOp::Neg, Box::new(expr)));
        assert_eq!(negative(Expr::Number(2.0)), Some(Constant::Number(-2.0)));
        let vector = Expr::Vector(Box::new(Expr::Number(1.0)), Box::new(Expr::Number(-2.0)));
        assert_eq!(known.vector(&vector), Some((1.0, -2.0)));
        assert_eq!(negative(vector), Some(Constant::Vector(-1.0, 2.0)));
    }
}
