//! All values that an expression can have: of numbers an interval, of vectors a box and the lengths, of truth values
//! whether it can hold and whether it can fail.

use super::interval::Interval;
use crate::plan::{BinaryOp, Function};

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    Number(Interval),
    Vector(Plane),
    Truth(Truth),
}

/// Vectors: those in the box of `x` and `y` whose length lies in `length`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    pub x: Interval,
    pub y: Interval,
    pub length: Interval,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Truth {
    pub can_hold: bool,
    pub can_fail: bool,
}

impl Truth {
    pub const UNKNOWN: Truth = Truth { can_hold: true, can_fail: true };
    pub const YES: Truth = Truth { can_hold: true, can_fail: false };
    pub const NO: Truth = Truth { can_hold: false, can_fail: true };

    pub fn known(truth: bool) -> Truth {
        if truth { Truth::YES } else { Truth::NO }
    }

    pub fn and(self, other: Truth) -> Truth {
        Truth { can_hold: self.can_hold && other.can_hold, can_fail: self.can_fail || other.can_fail }
    }

    pub fn or(self, other: Truth) -> Truth {
        !(!self).and(!other)
    }

    pub fn certain(self) -> bool {
        !self.can_fail
    }
}

impl std::ops::Not for Truth {
    type Output = Truth;
    fn not(self) -> Truth {
        Truth { can_hold: self.can_fail, can_fail: self.can_hold }
    }
}

impl Plane {
    pub const ALL: Plane = Plane { x: Interval::ALL, y: Interval::ALL, length: Interval::NOT_NEGATIVE };
    pub const ZERO: Plane = Plane { x: Interval::ZERO, y: Interval::ZERO, length: Interval::ZERO };

    /// A box.
    pub fn new(x: Interval, y: Interval) -> Plane {
        Plane { x, y, length: (x.square() + y.square()).sqrt() }
    }

    /// All vectors that are not longer.
    pub fn disc(radius: f64) -> Plane {
        let side = Interval::around_zero(radius);
        Plane { length: Interval::new(0.0, radius), ..Plane::new(side, side) }
    }

    /// A box of which something is known about the lengths, up to the rounding of numbers as large as `scale`.
    fn with_length(self, length: Interval, scale: f64) -> Plane {
        let slack = 8.0 * f64::EPSILON * scale;
        let slack = if slack.is_finite() { slack } else { 0.0 };
        let length = self.length.meet(length.wider(slack).at_least(0.0));
        let side = Interval::around_zero(length.high);
        Plane { x: self.x.meet(side), y: self.y.meet(side), length }
    }

    pub fn hull(self, other: Plane) -> Plane {
        let length = self.length.hull(other.length);
        Plane { x: self.x.hull(other.x), y: self.y.hull(other.y), length }
    }

    /// What lies in both boxes.
    pub fn meet(self, other: Plane) -> Plane {
        let (x, y) = (self.x.meet(other.x), self.y.meet(other.y));
        Plane { length: self.length.meet(other.length), ..Plane::new(x, y) }
    }

    /// From any of these vectors to any other.
    pub fn spread(self) -> Plane {
        let other = self;
        self - other
    }

    pub fn covers(self, other: Plane) -> bool {
        self.x.covers(other.x) && self.y.covers(other.y)
    }

    pub fn is_finite(self) -> bool {
        self.x.is_finite() && self.y.is_finite()
    }

    pub fn constant(self) -> Option<(f64, f64)> {
        Some((self.x.constant()?, self.y.constant()?))
    }

    pub fn scaled(self, by: Interval) -> Plane {
        let length = self.length * by.abs();
        Plane::new(self.x * by, self.y * by).with_length(length, length.high)
    }

    pub fn over(self, by: Interval) -> Plane {
        let length = self.length / by.abs();
        Plane::new(self.x / by, self.y / by).with_length(length, length.high)
    }

    pub fn dot(self, other: Plane) -> Interval {
        let most = self.length.high * other.length.high;
        let bound = Interval::around_zero(most * (1.0 + 16.0 * f64::EPSILON));
        (self.x * other.x + self.y * other.y).meet(bound)
    }

    pub fn cross(self, other: Plane) -> Interval {
        let most = self.length.high * other.length.high;
        let bound = Interval::around_zero(most * (1.0 + 16.0 * f64::EPSILON));
        (self.x * other.y - self.y * other.x).meet(bound)
    }

    pub fn rotated(self, angle: Interval) -> Plane {
        let (sin, cos) = (angle.sin(), angle.cos());
        let x = (self.x * cos - self.y * sin).rounded();
        let y = (self.x * sin + self.y * cos).rounded();
        Plane::new(x, y).with_length(self.length, self.length.high)
    }

    pub fn unit(self) -> Plane {
        let (least, one) = (if self.length.low > 0.0 { 1.0 } else { 0.0 }, 1.0);
        let side = |side: Interval| {
            Interval::new(if side.low >= 0.0 { 0.0 } else { -1.0 }, if side.high <= 0.0 { 0.0 } else { 1.0 })
                .rounded()
        };
        Plane::new(side(self.x), side(self.y)).with_length(Interval::new(least, one), 1.0)
    }
}

impl std::ops::Neg for Plane {
    type Output = Plane;
    fn neg(self) -> Plane {
        Plane { x: -self.x, y: -self.y, length: self.length }
    }
}

impl std::ops::Add for Plane {
    type Output = Plane;
    fn add(self, other: Plane) -> Plane {
        let (a, b) = (self.length, other.length);
        let apart = (a.low - b.high).max(b.low - a.high).max(0.0);
        let length = Interval::new(apart, a.high + b.high);
        Plane::new(self.x + other.x, self.y + other.y).with_length(length, length.high)
    }
}

impl std::ops::Sub for Plane {
    type Output = Plane;
    fn sub(self, other: Plane) -> Plane {
        self + -other
    }
}

impl Value {
    /// Any number; of something else, nothing is known.
    pub fn number(self) -> Interval {
        if let Value::Number(number) = self { number } else { Interval::ALL }
    }

    pub fn vector(self) -> Plane {
        if let Value::Vector(vector) = self { vector } else { Plane::ALL }
    }

    pub fn truth(self) -> Truth {
        if let Value::Truth(truth) = self { truth } else { Truth::UNKNOWN }
    }

    pub fn hull(self, other: Value) -> Value {
        match (self, other) {
            (Value::Number(a), Value::Number(b)) => Value::Number(a.hull(b)),
            (Value::Vector(a), Value::Vector(b)) => Value::Vector(a.hull(b)),
            (Value::Truth(a), Value::Truth(b)) => {
                Value::Truth(Truth { can_hold: a.can_hold || b.can_hold, can_fail: a.can_fail || b.can_fail })
            }
            _ => Value::Number(Interval::ALL),
        }
    }
}

pub fn negated(value: Value) -> Value {
    match value {
        Value::Vector(v) => Value::Vector(-v),
        other => Value::Number(-other.number()),
    }
}

pub fn binary(op: BinaryOp, left: Value, right: Value) -> Value {
    let (a, b) = (left.number(), right.number());
    match op {
        BinaryOp::Add | BinaryOp::Sub => match (left, right) {
            (Value::Vector(a), Value::Vector(b)) => {
                Value::Vector(if op == BinaryOp::Add { a + b } else { a - b })
            }
            _ => Value::Number(if op == BinaryOp::Add { a + b } else { a - b }),
        },
        BinaryOp::Mul => match (left, right) {
            (Value::Vector(v), _) => Value::Vector(v.scaled(b)),
            (_, Value::Vector(v)) => Value::Vector(v.scaled(a)),
            _ => Value::Number(a * b),
        },
        BinaryOp::Div => match left {
            Value::Vector(v) => Value::Vector(v.over(b)),
            _ => Value::Number(a / b),
        },
        BinaryOp::Pow => Value::Number(a.power(b)),
        BinaryOp::Less => Value::Truth(below(a, b)),
        BinaryOp::LessEq => Value::Truth(!below(b, a)),
        BinaryOp::Greater => Value::Truth(below(b, a)),
        BinaryOp::GreaterEq => Value::Truth(!below(a, b)),
        BinaryOp::Equal => Value::Truth(equal(left, right)),
        BinaryOp::NotEqual => Value::Truth(!equal(left, right)),
        BinaryOp::And => Value::Truth(left.truth().and(right.truth())),
        BinaryOp::Or => Value::Truth(left.truth().or(right.truth())),
    }
}

fn below(a: Interval, b: Interval) -> Truth {
    Truth { can_hold: a.low < b.high, can_fail: a.high >= b.low }
}

fn equal(left: Value, right: Value) -> Truth {
    match (left, right) {
        (Value::Number(a), Value::Number(b)) => {
            Truth { can_hold: a.low <= b.high && b.low <= a.high, can_fail: a.constant().is_none() || a != b }
        }
        _ => Truth::UNKNOWN,
    }
}

pub fn call(function: Function, args: &[Value]) -> Value {
    let arg = |k: usize| args.get(k).copied().unwrap_or(Value::Number(Interval::ALL));
    let (number, vector) = (|k| arg(k).number(), |k| arg(k).vector());
    Value::Number(match function {
        Function::Norm => vector(0).length,
        Function::Abs => number(0).abs(),
        Function::X => vector(0).x,
        Function::Y => vector(0).y,
        Function::Dot => vector(0).dot(vector(1)),
        Function::Cross => vector(0).cross(vector(1)),
        Function::Rotate => return Value::Vector(vector(0).rotated(number(1))),
        Function::Unit => return Value::Vector(vector(0).unit()),
        Function::Sqrt => number(0).sqrt(),
        Function::Sin => number(0).sin(),
        Function::Cos => number(0).cos(),
        Function::Tan => number(0).tan(),
        Function::Atan2 => number(0).atan2(number(1)),
        Function::Exp => number(0).exp(),
        Function::Ln => number(0).ln(),
        Function::Tanh => number(0).tanh(),
        Function::Floor => number(0).floor(),
        Function::Mod => number(0).modulo(number(1)),
        Function::Sign => number(0).sign(),
        Function::Min => number(0).min(number(1)),
        Function::Max => number(0).max(number(1)),
        Function::Clamp => number(0).max(number(1)).min(number(2)),
    })
}
