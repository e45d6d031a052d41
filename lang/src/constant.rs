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

    #[test]
    fn mod_is_never_negative_and_a_quarter_turn_turns_left() {
        assert_eq!(
            call(Function::Mod, &[Constant::Number(-1.0), Constant::Number(4.0)]),
            Some(Constant::Number(3.0))
        );
        let quarter = Constant::Number(std::f64::consts::FRAC_PI_2);
        let Some(Constant::Vector(x, y)) = call(Function::Rotate, &[Constant::Vector(1.0, 0.0), quarter])
        else {
            panic!("a vector");
        };
        assert!(x.abs() < 1e-15 && (y - 1.0).abs() < 1e-15);
    }
}
