//! Interval arithmetic: all values that a number can have.
//!
//! Rounding to nearest is monotone, so bounds that are computed by the very operation of the simulator hold for what
//! it computes; they are widened by a few units in the last place only where an operation is not known to be
//! monotone (the functions of `libm`), or where the simulator computes in another order. Nothing is claimed of
//! values that are not numbers (0/0, the root of a negative number): the simulator refuses an episode with those.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// All numbers from `low` to `high`; a bound may be infinite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    pub low: f64,
    pub high: f64,
}

impl Interval {
    pub const ALL: Interval = Interval { low: f64::NEG_INFINITY, high: f64::INFINITY };
    pub const ZERO: Interval = Interval { low: 0.0, high: 0.0 };
    pub const NOT_NEGATIVE: Interval = Interval { low: 0.0, high: f64::INFINITY };
    /// What angles lie in.
    pub const TURN: Interval = Interval { low: -PI, high: PI };

    /// From one number to another. A bound that is not a number is no bound.
    pub fn new(low: f64, high: f64) -> Interval {
        Interval {
            low: if low.is_nan() { f64::NEG_INFINITY } else { low },
            high: if high.is_nan() { f64::INFINITY } else { high },
        }
    }

    pub fn point(value: f64) -> Interval {
        Interval::new(value, value)
    }

    /// −size to size.
    pub fn around_zero(size: f64) -> Interval {
        Interval::new(-size, size)
    }

    /// The smallest interval with all of these numbers in it.
    fn of(values: &[f64]) -> Interval {
        if values.iter().any(|value| value.is_nan()) {
            return Interval::ALL;
        }
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        Interval::new(low, values.iter().copied().fold(f64::NEG_INFINITY, f64::max))
    }

    /// The only number in it, if there is only one.
    pub fn constant(self) -> Option<f64> {
        (self.low == self.high && self.low.is_finite()).then_some(self.low)
    }

    pub fn is_finite(self) -> bool {
        self.low.is_finite() && self.high.is_finite()
    }

    pub fn contains(self, value: f64) -> bool {
        self.low <= value && value <= self.high
    }

    /// Whether all of `other` lies in it.
    pub fn covers(self, other: Interval) -> bool {
        self.low <= other.low && other.high <= self.high
    }

    pub fn magnitude(self) -> f64 {
        self.low.abs().max(self.high.abs())
    }

    pub fn hull(self, other: Interval) -> Interval {
        Interval::new(self.low.min(other.low), self.high.max(other.high))
    }

    /// What lies in both; `self` if nothing does, which only rounding can bring about.
    pub fn meet(self, other: Interval) -> Interval {
        let (low, high) = (self.low.max(other.low), self.high.min(other.high));
        if low <= high { Interval { low, high } } else { self }
    }

    pub fn at_least(self, low: f64) -> Interval {
        Interval::new(self.low.max(low), self.high.max(low))
    }

    /// In equal pieces, one after the other: none holds the number that the next begins with.
    pub fn pieces(self, count: usize) -> Vec<Interval> {
        let cut = |k: usize| match k {
            0 => self.low,
            k => self.low + (self.high - self.low) * k as f64 / count as f64,
        };
        let piece = |k: usize| match k + 1 < count {
            true => Interval::new(cut(k), cut(k + 1).next_down().max(cut(k))),
            false => Interval::new(cut(k), self.high),
        };
        match self.is_finite() && self.low < self.high {
            true => (0..count).map(piece).collect(),
            false => vec![self],
        }
    }

    /// Wider by `by` on both sides.
    pub fn wider(self, by: f64) -> Interval {
        Interval::new(self.low - by, self.high + by)
    }

    /// Wider by a few units in the last place.
    pub fn rounded(self) -> Interval {
        const ULPS: f64 = 8.0 * f64::EPSILON;
        let finite = |x: f64| if x.is_finite() { x.abs() * ULPS } else { 0.0 };
        Interval::new(self.low - finite(self.low), self.high + finite(self.high))
    }

    pub fn square(self) -> Interval {
        let magnitude = self.magnitude();
        let least = if self.contains(0.0) { 0.0 } else { self.low.abs().min(self.high.abs()) };
        Interval::new(least * least, magnitude * magnitude)
    }

    pub fn abs(self) -> Interval {
        let least = if self.contains(0.0) { 0.0 } else { self.low.abs().min(self.high.abs()) };
        Interval::new(least, self.magnitude())
    }

    pub fn min(self, other: Interval) -> Interval {
        Interval::new(self.low.min(other.low), self.high.min(other.high))
    }

    pub fn max(self, other: Interval) -> Interval {
        Interval::new(self.low.max(other.low), self.high.max(other.high))
    }

    pub fn sqrt(self) -> Interval {
        Interval::new(self.low.max(0.0).sqrt(), self.high.max(0.0).sqrt())
    }

    pub fn floor(self) -> Interval {
        Interval::new(self.low.floor(), self.high.floor())
    }

    pub fn sign(self) -> Interval {
        let sign = |x: f64| if x == 0.0 { 0.0 } else { x.signum() };
        Interval::new(sign(self.low), sign(self.high))
    }

    /// x mod y = x − y ⌊x/y⌋: of the sign of y, and not greater, but for what is lost of large x.
    pub fn modulo(self, y: Interval) -> Interval {
        if self.low >= 0.0 && self.high < y.low {
            return self;
        }
        let slack = 4.0 * f64::EPSILON * (self.magnitude() + y.magnitude());
        if slack.is_finite() { y.hull(Interval::ZERO).wider(slack) } else { Interval::ALL }
    }

    /// To a power, which must be constant to tell anything.
    pub fn power(self, exponent: Interval) -> Interval {
        let Some(y) = exponent.constant() else { return Interval::ALL };
        let whole = y.fract() == 0.0;
        if y < 0.0 {
            return Interval::point(1.0) / self.power(Interval::point(-y)).rounded();
        }
        let base = match (whole, whole && y % 2.0 == 0.0) {
            (true, true) => self.abs(),
            (true, false) => self,
            (false, _) => self.at_least(0.0),
        };
        let raised = Interval::new(libm::pow(base.low, y), libm::pow(base.high, y)).rounded();
        if base.low >= 0.0 { raised.at_least(0.0) } else { raised }
    }

    pub fn exp(self) -> Interval {
        Interval::new(libm::exp(self.low), libm::exp(self.high)).rounded().at_least(0.0)
    }

    pub fn ln(self) -> Interval {
        Interval::new(libm::log(self.low.max(0.0)), libm::log(self.high.max(0.0))).rounded()
    }

    pub fn tanh(self) -> Interval {
        let unit = Interval::around_zero(1.0);
        Interval::new(libm::tanh(self.low), libm::tanh(self.high)).rounded().meet(unit)
    }

    pub fn sin(self) -> Interval {
        (self - Interval::point(FRAC_PI_2)).wave(self.magnitude())
    }

    pub fn cos(self) -> Interval {
        self.wave(self.magnitude())
    }

    /// Cosine; `size` is that of the numbers it comes from.
    fn wave(self, size: f64) -> Interval {
        let unit = Interval::around_zero(1.0);
        let slack = 4.0 * f64::EPSILON * (1.0 + size);
        let angles = self.wider(slack);
        if !angles.is_finite() || angles.high - angles.low >= TAU {
            return unit;
        }
        // The first multiple of 2π from `phase` on that is not below the interval.
        let meets = |phase: f64| {
            let turns = ((angles.low - phase) / TAU - slack).ceil();
            phase + TAU * turns <= angles.high + slack
        };
        let (a, b) = (libm::cos(angles.low), libm::cos(angles.high));
        let low = if meets(PI) { -1.0 } else { a.min(b) - slack };
        let high = if meets(0.0) { 1.0 } else { a.max(b) + slack };
        Interval::new(low, high).meet(unit)
    }

    pub fn tan(self) -> Interval {
        match self.cos().contains(0.0) {
            true => Interval::ALL,
            false => Interval::new(libm::tan(self.low), libm::tan(self.high)).rounded(),
        }
    }

    /// The angle of the points with `self` as y.
    pub fn atan2(self, x: Interval) -> Interval {
        let y = self;
        let apart_from_cut = x.low > 0.0 || y.low > 0.0 || y.high < 0.0;
        if !apart_from_cut || !x.is_finite() || !y.is_finite() {
            return Interval::TURN.rounded();
        }
        let corners = [(y.low, x.low), (y.low, x.high), (y.high, x.low), (y.high, x.high)];
        Interval::of(&corners.map(|(y, x)| libm::atan2(y, x))).rounded()
    }

    /// The sum of from `least` to `most` numbers of the interval, in any order.
    pub fn summed(self, least: usize, most: usize) -> Interval {
        let times = |count: usize| self * Interval::point(count as f64);
        let sum = times(least).hull(times(most));
        if most <= 1 {
            return sum;
        }
        let slack = 2.0 * f64::EPSILON * most as f64 * sum.magnitude();
        let wide = sum.wider(if slack.is_finite() { slack } else { 0.0 });
        // A sum of numbers of one sign has it.
        let low = if sum.low >= 0.0 { wide.low.max(0.0) } else { wide.low };
        Interval::new(low, if sum.high <= 0.0 { wide.high.min(0.0) } else { wide.high })
    }
}

impl std::ops::Neg for Interval {
    type Output = Interval;
    fn neg(self) -> Interval {
        Interval::new(-self.high, -self.low)
    }
}

impl std::ops::Add for Interval {
    type Output = Interval;
    fn add(self, other: Interval) -> Interval {
        Interval::new(self.low + other.low, self.high + other.high)
    }
}

impl std::ops::Sub for Interval {
    type Output = Interval;
    fn sub(self, other: Interval) -> Interval {
        Interval::new(self.low - other.high, self.high - other.low)
    }
}

impl std::ops::Mul for Interval {
    type Output = Interval;
    fn mul(self, other: Interval) -> Interval {
        // A bound of infinity stands for numbers as large as you like, not for infinity.
        let times = |a: f64, b: f64| if a == 0.0 || b == 0.0 { 0.0 } else { a * b };
        let (a, b) = (self, other);
        Interval::of(&[
            times(a.low, b.low),
            times(a.low, b.high),
            times(a.high, b.low),
            times(a.high, b.high),
        ])
    }
}

impl std::ops::Div for Interval {
    type Output = Interval;
    fn div(self, by: Interval) -> Interval {
        if by.low < 0.0 && by.high > 0.0 || by == Interval::ZERO {
            return Interval::ALL;
        }
        // A bound of 0 is approached from within.
        let (low, high) = match by.low >= 0.0 {
            true => (by.low.abs(), by.high),
            false => (by.low, -by.high.abs()),
        };
        let over = |a: f64, b: f64| if a == 0.0 || b.is_infinite() { 0.0 } else { a / b };
        let a = self;
        Interval::of(&[over(a.low, low), over(a.low, high), over(a.high, low), over(a.high, high)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ENDS: [f64; 9] = [-7.0, -4.0, -1.5, -0.5, 0.0, 0.5, 2.0, 3.0, 6.5];
    const POINTS: usize = 40;

    fn intervals() -> impl Iterator<Item = Interval> + Clone {
        let pairs = ENDS.into_iter().flat_map(|low| ENDS.into_iter().map(move |high| (low, high)));
        pairs.filter(|(low, high)| low <= high).map(|(low, high)| Interval::new(low, high))
    }

    fn points(of: Interval) -> impl Iterator<Item = f64> + Clone {
        (0..=POINTS).map(move |k| of.low + (of.high - of.low) * k as f64 / POINTS as f64)
    }

    /// What is found holds for all `values`, and where it should be `tight` little else.
    fn holds(what: &str, found: Interval, values: impl Iterator<Item = f64>, tight: bool) {
        let values: Vec<f64> = values.filter(|value| value.is_finite()).collect();
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        assert!(
            values.iter().all(|&value| found.contains(value)),
            "{what}: {found:?} is not {least}..{most}"
        );
        if tight {
            let slack = 0.02 * (1.0 + found.magnitude());
            assert!(
                least - found.low < slack && found.high - most < slack,
                "{what}: {found:?}, {least}..{most}"
            );
        }
    }

    /// Functions of one number on numbers drawn evenly from intervals.
    #[test]
    fn bounds_of_one_number_are_right_and_tight() {
        type Of = (&'static str, fn(Interval) -> Interval, fn(f64) -> f64);
        let all: [Of; 9] = [
            ("abs", Interval::abs, f64::abs),
            ("floor", Interval::floor, f64::floor),
            ("sign", Interval::sign, |x| if x == 0.0 { 0.0 } else { x.signum() }),
            ("exp", Interval::exp, libm::exp),
            ("ln", Interval::ln, libm::log),
            ("tanh", Interval::tanh, libm::tanh),
            ("sin", Interval::sin, libm::sin),
            ("cos", Interval::cos, libm::cos),
            ("tan", Interval::tan, libm::tan),
        ];
        for (name, bound, value) in all {
            for x in intervals() {
                let tight = bound(x).is_finite();
                holds(&format!("{name} {x:?}"), bound(x), points(x).map(value), tight);
            }
        }
        for exponent in [-2.0, -1.0, 0.5, 1.0, 2.0, 3.0] {
            for x in intervals() {
                let found = x.power(Interval::point(exponent));
                let values = points(x).map(|x| libm::pow(x, exponent));
                holds(
                    &format!("{x:?} ^ {exponent}"),
                    found,
                    values,
                    found.is_finite() && (x.low >= 0.0 || exponent != 0.5),
                );
            }
        }
    }

    #[test]
    fn bounds_of_two_numbers_are_right_and_tight() {
        type Of = (&'static str, fn(Interval, Interval) -> Interval, fn(f64, f64) -> f64);
        let all: [Of; 6] = [
            ("+", |x, y| x + y, |x, y| x + y),
            ("-", |x, y| x - y, |x, y| x - y),
            ("*", |x, y| x * y, |x, y| x * y),
            ("/", |x, y| x / y, |x, y| x / y),
            ("mod", Interval::modulo, |x, y| x - y * (x / y).floor()),
            ("atan2", Interval::atan2, libm::atan2),
        ];
        for (name, bound, value) in all {
            for (x, y) in intervals().flat_map(|x| intervals().map(move |y| (x, y))) {
                let found = bound(x, y);
                let tight = match name {
                    "mod" => x.low >= 0.0 && x.high < y.low,
                    "atan2" => y.low > 0.0 || x.low > 0.0 || x.high < 0.0,
                    _ => found.is_finite(),
                };
                let values = points(x).flat_map(|x| points(y).map(move |y| value(x, y)));
                holds(&format!("{x:?} {name} {y:?}"), found, values, tight);
            }
        }
    }

    /// By hand: two or three numbers of −1..2.
    #[test]
    fn sums_are_of_as_many_numbers_as_there_may_be() {
        let found = Interval::new(-1.0, 2.0).summed(2, 3);
        assert!((found.low + 3.0).abs() < 1e-9 && (found.high - 6.0).abs() < 1e-9, "{found:?}");
        let found = Interval::new(1.0, 2.0).summed(2, 3);
        assert!((found.low - 2.0).abs() < 1e-9 && (found.high - 6.0).abs() < 1e-9, "{found:?}");
        assert_eq!(Interval::new(1.0, 2.0).summed(0, 1), Interval::new(0.0, 2.0));
    }

    /// Seen to fail when one of the two is enough: finite, or longer than a point.
    #[test]
    fn points_and_endless_intervals_stay_whole() {
        for whole in [Interval::point(1.0), Interval::ALL, Interval::new(0.0, f64::INFINITY)] {
            assert_eq!(whole.pieces(3), [whole]);
        }
        let thirds = Interval::new(0.0, 3.0).pieces(3);
        assert_eq!([thirds[0].low, thirds[1].low, thirds[2].low, thirds[2].high], [0.0, 1.0, 2.0, 3.0]);
        assert!(thirds[0].high < 1.0 && thirds[1].high < 2.0);
    }
}
