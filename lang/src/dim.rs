//! Dimensions of quantities: products of base dimensions with rational exponents.

use std::collections::BTreeMap;
use std::sync::Arc;

/// A fraction in lowest terms with a positive denominator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Ratio {
    num: i64,
    den: i64,
}

impl Ratio {
    pub const ONE: Ratio = Ratio { num: 1, den: 1 };

    /// `None` for a zero denominator and for numbers too large.
    pub fn new(num: i64, den: i64) -> Option<Ratio> {
        if den == 0 || num == i64::MIN || den == i64::MIN {
            return None;
        }
        let divisor = gcd(num.unsigned_abs(), den.unsigned_abs()) as i64 * den.signum();
        Some(Ratio { num: num / divisor, den: den / divisor })
    }

    /// Numerator and denominator.
    pub fn parts(self) -> (i64, i64) {
        (self.num, self.den)
    }

    pub fn is_zero(self) -> bool {
        self.num == 0
    }

    pub fn value(self) -> f64 {
        self.num as f64 / self.den as f64
    }

    pub fn plus(self, other: Ratio) -> Option<Ratio> {
        let left = self.num.checked_mul(other.den)?;
        let right = other.num.checked_mul(self.den)?;
        Ratio::new(left.checked_add(right)?, self.den.checked_mul(other.den)?)
    }

    pub fn times(self, other: Ratio) -> Option<Ratio> {
        Ratio::new(self.num.checked_mul(other.num)?, self.den.checked_mul(other.den)?)
    }

    pub fn negated(self) -> Ratio {
        Ratio { num: -self.num, den: self.den }
    }

    /// 1 / self; `None` for zero.
    pub fn inverse(self) -> Option<Ratio> {
        Ratio::new(self.den, self.num)
    }
}

fn gcd(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { gcd(b, a % b) }
}

impl std::fmt::Display for Ratio {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.den {
            1 => write!(f, "{}", self.num),
            _ => write!(f, "({}/{})", self.num, self.den),
        }
    }
}

/// A product of powers of named dimensions, by name; no entry has exponent zero, so equal dimensions are equal values.
/// The names are base dimensions or the dimension variables of the function around.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Dim(Arc<[(Arc<str>, Ratio)]>);

impl Dim {
    /// Of plain numbers.
    pub fn none() -> Dim {
        Dim::default()
    }

    pub fn base(name: &str) -> Dim {
        Dim(Arc::new([(name.into(), Ratio::ONE)]))
    }

    pub fn is_none(&self) -> bool {
        self.0.is_empty()
    }

    /// Each name with its exponent, by name.
    pub fn factors(&self) -> impl Iterator<Item = (&str, Ratio)> {
        self.0.iter().map(|(name, exponent)| (&**name, *exponent))
    }

    /// `None`, as for the other operations, if an exponent gets too large.
    pub fn mul(&self, other: &Dim) -> Option<Dim> {
        if self.is_none() || other.is_none() {
            return Some(if self.is_none() { other } else { self }.clone());
        }
        let mut factors = self.0.to_vec();
        for (name, exponent) in other.0.iter() {
            match factors.binary_search_by(|(known, _)| known.cmp(name)) {
                Ok(at) => {
                    let (_, known) = factors.get_mut(at)?;
                    *known = known.plus(*exponent)?;
                }
                Err(at) => factors.insert(at, (name.clone(), *exponent)),
            }
        }
        factors.retain(|(_, exponent)| !exponent.is_zero());
        Some(Dim(factors.into()))
    }

    pub fn div(&self, other: &Dim) -> Option<Dim> {
        self.mul(&other.pow(Ratio::ONE.negated())?)
    }

    pub fn pow(&self, exponent: Ratio) -> Option<Dim> {
        if exponent.is_zero() {
            return Some(Dim::none());
        }
        if exponent == Ratio::ONE {
            return Some(self.clone());
        }
        let powers = self.0.iter().map(|(name, e)| Some((name.clone(), e.times(exponent)?)));
        powers.collect::<Option<_>>().map(Dim)
    }
}

/// What the dimension variables of a called function stand for.
#[derive(Debug, Default)]
pub struct Substitution(BTreeMap<String, Dim>);

impl Substitution {
    /// Replaces the variables that are known. `generics` names the variables.
    pub fn apply(&self, pattern: &Dim, generics: &[String]) -> Option<Dim> {
        if generics.is_empty() {
            return Some(pattern.clone());
        }
        let mut result = Dim::none();
        for (name, exponent) in pattern.factors() {
            let factor = match self.0.get(name).filter(|_| generics.iter().any(|g| g == name)) {
                Some(known) => known.pow(exponent)?,
                None => Dim::base(name).pow(exponent)?,
            };
            result = result.mul(&factor)?;
        }
        Some(result)
    }

    /// Whether a pattern has a variable that nothing is known of.
    pub fn has_free(&self, pattern: &Dim, generics: &[String]) -> bool {
        pattern.factors().any(|(name, _)| generics.iter().any(|g| g == name) && !self.0.contains_key(name))
    }

    /// Makes `pattern`, a dimension with variables, equal to `actual` by choosing at most one variable that is
    /// still free. False if that cannot be done.
    pub fn unify(&mut self, pattern: &Dim, actual: &Dim, generics: &[String]) -> bool {
        self.try_unify(pattern, actual, generics).unwrap_or(false)
    }

    fn try_unify(&mut self, pattern: &Dim, actual: &Dim, generics: &[String]) -> Option<bool> {
        if generics.is_empty() {
            return Some(pattern == actual);
        }
        let mut known = Dim::none();
        let mut free = None;
        for (name, exponent) in pattern.factors() {
            let generic = generics.iter().any(|g| g == name);
            match self.0.get(name).filter(|_| generic) {
                Some(dim) => known = known.mul(&dim.pow(exponent)?)?,
                None if !generic => known = known.mul(&Dim::base(name).pow(exponent)?)?,
                None if free.is_none() => free = Some((name.to_owned(), exponent)),
                None => return Some(false),
            }
        }
        let Some((name, exponent)) = free else { return Some(known == *actual) };
        let value = actual.div(&known)?.pow(exponent.inverse()?)?;
        self.0.insert(name, value);
        Some(true)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ratio(num: i64, den: i64) -> Ratio {
        Ratio::new(num, den).expect("a fraction")
    }

    fn dim(factors: &[(&str, i64, i64)]) -> Dim {
        let each =
            factors.iter().map(|&(name, num, den)| Dim::base(name).pow(ratio(num, den)).expect("small"));
        each.fold(Dim::none(), |product, factor| product.mul(&factor).expect("small"))
    }

    #[test]
    fn fractions_are_canonical() {
        assert_eq!(ratio(2, -4), ratio(-1, 2));
        assert_eq!(ratio(1, 2).plus(ratio(1, 3)), Some(ratio(5, 6)));
        assert_eq!(ratio(1, 2).plus(ratio(-1, 2)), Some(ratio(0, 7)));
        assert_eq!(ratio(2, 3).times(ratio(3, 2)), Some(Ratio::ONE));
        assert_eq!(Ratio::new(1, 0), None);
        assert_eq!(ratio(0, 1).inverse(), None);
        assert_eq!(ratio(i64::MAX, 2).plus(ratio(1, 3)), None);
        assert_eq!(ratio(-3, 2).to_string(), "(-3/2)");
    }

    #[test]
    fn dimensions_form_a_group_with_powers() {
        let (length, time) = (dim(&[("length", 1, 1)]), dim(&[("time", 1, 1)]));
        let speed = length.div(&time).expect("small");
        for (a, b) in [(&length, &time), (&speed, &length), (&speed, &speed)] {
            assert_eq!(a.mul(b), b.mul(a));
            assert_eq!(a.mul(b).and_then(|ab| ab.div(b)).as_ref(), Some(a));
            let (half, two) = (ratio(1, 2), ratio(2, 1));
            assert_eq!(a.pow(half).and_then(|root| root.pow(two)).as_ref(), Some(a));
            assert_eq!(a.mul(b).and_then(|ab| ab.pow(half)), a.pow(half).and_then(|x| x.mul(&b.pow(half)?)));
        }
        assert!(speed.div(&speed).expect("small").is_none());
        assert_eq!(speed.pow(ratio(0, 1)), Some(Dim::none()));
    }

    #[test]
    fn exponents_that_overflow_are_told() {
        let mut dim = Dim::base("length");
        let huge = (0..70).try_for_each(|_| {
            dim = dim.pow(ratio(7, 3))?;
            Some(())
        });
        assert_eq!(huge, None);
    }

    #[test]
    fn variables_are_solved_for() {
        let generics = ["A".to_owned(), "D".to_owned()];
        let area = dim(&[("length", 2, 1)]);
        let length = dim(&[("length", 1, 1)]);

        let mut found = Substitution::default();
        assert!(found.unify(&dim(&[("D", 2, 1)]), &area, &generics));
        assert_eq!(found.apply(&dim(&[("D", 1, 1)]), &generics), Some(length.clone()));
        assert!(found.unify(&dim(&[("D", 1, 1)]), &length, &generics));
        assert!(!found.unify(&dim(&[("D", 1, 1)]), &area, &generics));
        // A * D with D known leaves A.
        assert!(found.unify(&dim(&[("A", 1, 1), ("D", 1, 1)]), &area, &generics));
        assert_eq!(found.apply(&dim(&[("A", 1, 1)]), &generics), Some(length.clone()));

        assert!(!found.has_free(&dim(&[("A", 1, 1), ("length", 1, 1)]), &generics));
        assert!(!found.has_free(&dim(&[("B", 1, 1)]), &generics));
        let nothing = Substitution::default();
        assert!(nothing.has_free(&dim(&[("length", 1, 1), ("D", 1, 1)]), &generics));
        assert!(!nothing.has_free(&dim(&[("length", 1, 1)]), &generics));

        // Two free variables at once cannot be told apart.
        assert!(!Substitution::default().unify(&dim(&[("A", 1, 1), ("D", 1, 1)]), &area, &generics));
        // The caller's own variable of the same name is another one.
        let mut found = Substitution::default();
        assert!(found.unify(&dim(&[("D", 2, 1)]), &dim(&[("D", 4, 1)]), &generics));
        assert_eq!(found.apply(&dim(&[("D", 1, 1)]), &generics), Some(dim(&[("D", 2, 1)])));
        // Fixed dimensions only compare.
        assert!(!Substitution::default().unify(&length, &area, &generics));
    }
}
