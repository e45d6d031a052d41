//! Dimensions and units by name, as the `dimension` and `unit` items declare them.

use std::collections::BTreeMap;

use crate::ast::{BinaryOp, DimExpr, Expr, ExprAt, Item, Name, Span, UnitExpr};
use crate::dim::{Dim, Ratio};
use crate::problem::{Code, Problem, Problems, did_you_mean};
use crate::resolve::{Program, Space, listed};
use crate::stdlib::Declaration;

/// All units and dimensions of a compilation.
#[derive(Debug, Default)]
pub struct Units {
    units: BTreeMap<String, (f64, Dim)>,
    dimensions: BTreeMap<String, Dim>,
    /// Named dimensions and SI units in the order of their declarations.
    names: Vec<(String, Dim)>,
    si: Vec<(String, Dim)>,
}

impl Units {
    /// Reads the declarations of all modules; each may use those before it.
    pub fn new(program: &Program, problems: &mut Problems) -> Units {
        let mut units = Units::default();
        let measures = |declared: &Declaration| matches!(declared.space, Space::Dimension | Space::Unit);
        let library = program.library().filter(|(_, declared)| measures(declared));
        let library = library.filter_map(|(_, declared)| declared.item());
        for item in library.chain(program.written().map(|(_, item)| item)) {
            match &item.node {
                Item::Dimension { name, value, .. } => {
                    let dim = units.dim(&value.node, &[]).unwrap_or_else(|problem| {
                        problems.push(*problem);
                        Dim::none()
                    });
                    units.names.push((name.node.clone(), dim.clone()));
                    units.dimensions.insert(name.node.clone(), dim);
                }
                Item::Unit { name, dimension, value, .. } => {
                    let found = match (dimension, value) {
                        (Some(dimension), None) => units.si_unit(name, &dimension.node),
                        (_, Some(value)) => units.definition(value),
                        (None, None) => {
                            Err(Box::new(Problem::error(&BAD_UNIT, "a unit needs a value").at(name.span, "")))
                        }
                    };
                    match found {
                        Ok(unit) => units.declare(&name.node, unit),
                        Err(problem) => problems.push(*problem),
                    }
                }
                _ => {}
            }
        }
        units
    }

    fn declare(&mut self, name: &str, unit: (f64, Dim)) {
        if unit.0 == 1.0 {
            self.si.push((name.to_owned(), unit.1.clone()));
        }
        self.units.insert(name.to_owned(), unit);
    }

    /// `unit m : length`, which also makes `length` a base dimension.
    fn si_unit(&mut self, name: &Name, dimension: &DimExpr) -> Result<(f64, Dim), Box<Problem>> {
        if let [(base, (1, 1))] = dimension.factors.as_slice()
            && !self.dimensions.contains_key(&base.node)
        {
            let dim = Dim::base(&base.node);
            self.names.push((base.node.clone(), dim.clone()));
            self.dimensions.insert(base.node.clone(), dim);
        }
        self.dim(dimension, &[])
            .map(|dim| (1.0, dim))
            .map_err(|problem| Box::new(problem.with(name.span, "the unit of")))
    }

    /// `1000 m`, `1 / s`
    fn definition(&self, value: &ExprAt) -> Result<(f64, Dim), Box<Problem>> {
        let bad = || {
            Box::new(
                Problem::error(&BAD_UNIT, "this does not define a unit")
                    .at(value.span, "")
                    .help("write a number and other units, for example `unit inch = 0.0254 m`"),
            )
        };
        let unit = match &value.node {
            Expr::Number { value, unit: None } => (*value, Dim::none()),
            Expr::Number { value, unit: Some(unit) } => {
                let (factor, dim) = self.unit(&unit.node)?;
                (value * factor, dim)
            }
            Expr::Name(name) => self.named(name, value.span)?,
            Expr::Binary { op, left, right, .. } => {
                let (left, right) = (self.definition(left)?, self.definition(right)?);
                match op {
                    BinaryOp::Mul => (left.0 * right.0, left.1.mul(&right.1).ok_or_else(bad)?),
                    BinaryOp::Div => (left.0 / right.0, left.1.div(&right.1).ok_or_else(bad)?),
                    _ => return Err(bad()),
                }
            }
            _ => return Err(bad()),
        };
        if unit.0.is_finite() && unit.0 > 0.0 { Ok(unit) } else { Err(bad()) }
    }

    fn named(&self, name: &str, at: Span) -> Result<(f64, Dim), Box<Problem>> {
        let key = if name == "%" { "percent" } else { name };
        self.units.get(key).cloned().ok_or_else(|| {
            let problem = Problem::error(&UNKNOWN_UNIT, format!("there is no unit `{name}`")).at(at, "");
            Box::new(problem.help(match did_you_mean(name, self.units.keys().map(String::as_str)) {
                Some(meant) => format!("did you mean `{meant}`?"),
                None => format!("known units are {}", listed(self.units.keys().map(String::as_str))),
            }))
        })
    }

    pub fn has_unit(&self, name: &str) -> bool {
        self.units.contains_key(name)
    }

    /// SI value of one of a unit, and its dimension.
    pub fn unit(&self, unit: &UnitExpr) -> Result<(f64, Dim), Box<Problem>> {
        if let [(name, (1, 1))] = unit.factors.as_slice() {
            return self.named(&name.node, name.span);
        }
        let (mut factor, mut dim) = (1.0, Dim::none());
        for (name, (num, den)) in &unit.factors {
            let (value, of) = self.named(&name.node, name.span)?;
            let power = Ratio::new((*num).into(), (*den).into());
            let power = power.and_then(|exponent| Some((exponent, of.pow(exponent)?)));
            let product = power.and_then(|(exponent, of)| Some((exponent, dim.mul(&of)?)));
            let (exponent, product) = product.ok_or_else(|| too_large(name.span))?;
            factor *= match exponent.value() {
                1.0 => value,
                -1.0 => 1.0 / value,
                exponent => libm::pow(value, exponent),
            };
            dim = product;
        }
        Ok((factor, dim))
    }

    /// `length / time^2`; `generics` are the dimension variables of the function around.
    pub fn dim(&self, written: &DimExpr, generics: &[String]) -> Result<Dim, Box<Problem>> {
        let mut dim = Dim::none();
        for (name, (num, den)) in &written.factors {
            let base = if generics.contains(&name.node) {
                Dim::base(&name.node)
            } else if name.node == "number" {
                Dim::none()
            } else {
                self.dimensions.get(&name.node).cloned().ok_or_else(|| self.unknown(name))?
            };
            let power = Ratio::new((*num).into(), (*den).into()).and_then(|exponent| base.pow(exponent));
            dim = power.and_then(|power| dim.mul(&power)).ok_or_else(|| too_large(name.span))?;
        }
        Ok(dim)
    }

    fn unknown(&self, name: &Name) -> Box<Problem> {
        const TYPES: [&str; 9] =
            ["number", "bool", "agent", "point", "area", "list", "count", "vec", "range"];
        let known = || self.dimensions.keys().map(String::as_str).chain(TYPES);
        let problem =
            Problem::error(&UNKNOWN_DIMENSION, format!("there is no dimension or type `{}`", name.node));
        Box::new(problem.at(name.span, "").help(match did_you_mean(&name.node, known()) {
            Some(meant) => format!("did you mean `{meant}`?"),
            None => format!("known are {}", listed(known())),
        }))
    }

    /// A dimension that the prelude declares; plain numbers if it does not.
    pub fn base(&self, name: &str) -> Dim {
        self.dimensions.get(name).cloned().unwrap_or_default()
    }

    /// The dimension in words: `length`, `length/time^2`, `number`.
    pub fn name(&self, dim: &Dim) -> String {
        if dim.is_none() {
            return "number".to_owned();
        }
        let declared = self.names.iter().find(|(_, declared)| declared == dim);
        declared.map_or_else(|| product(dim, |base| base.to_owned()), |(name, _)| name.clone())
    }

    /// With its article: `a length`, `a plain number`.
    pub fn people(&self, dim: &Dim) -> String {
        if dim.is_none() {
            return "a plain number".to_owned();
        }
        if dim.factors().all(|(base, _)| base == "steps") && self.name(dim) == "steps" {
            return "a number of steps".to_owned();
        }
        match self.names.iter().find(|(_, declared)| declared == dim) {
            Some((name, _)) => with_article(name),
            None => format!("a quantity of dimension {}", self.name(dim)),
        }
    }

    /// A number as it would be written with its SI unit; `None` for the dimension variables of a function.
    pub fn example(&self, number: &str, dim: &Dim) -> Option<String> {
        if dim.is_none() {
            return Some(number.to_owned());
        }
        if !dim.factors().all(|(base, _)| self.dimensions.contains_key(base)) {
            return None;
        }
        let unit = self.si(dim);
        match unit.strip_prefix("1/") {
            None => Some(format!("{number} {unit}")),
            Some(_) => Some(format!("{number} / {}", self.example("1", &Dim::none().div(dim)?)?)),
        }
    }

    /// The SI unit, for people; empty for plain numbers.
    pub fn si(&self, dim: &Dim) -> String {
        if dim.is_none() {
            return String::new();
        }
        let declared = self.si.iter().find(|(_, declared)| declared == dim);
        declared.map_or_else(
            || {
                product(dim, |base| {
                    let unit = self.si.iter().find(|(_, declared)| *declared == Dim::base(base));
                    unit.map_or(base, |(unit, _)| unit).to_owned()
                })
            },
            |(name, _)| name.clone(),
        )
    }
}

/// `a`, or `an` before a vowel.
pub fn with_article(noun: &str) -> String {
    let article = if noun.starts_with(['a', 'e', 'i', 'o']) { "an" } else { "a" };
    format!("{article} {noun}")
}

/// `x/y^2` from the factors of a dimension.
fn product(dim: &Dim, name: impl Fn(&str) -> String) -> String {
    let factor = |base: &str, exponent: Ratio| match exponent == Ratio::ONE {
        true => name(base),
        false => format!("{}^{exponent}", name(base)),
    };
    let above: Vec<_> = dim.factors().filter(|f| f.1.value() > 0.0).map(|f| factor(f.0, f.1)).collect();
    let below: Vec<_> =
        dim.factors().filter(|f| f.1.value() < 0.0).map(|f| factor(f.0, f.1.negated())).collect();
    let above = if above.is_empty() { "1".to_owned() } else { above.join("*") };
    std::iter::once(above).chain(below).collect::<Vec<_>>().join("/")
}

fn too_large(at: Span) -> Box<Problem> {
    Box::new(Problem::error(&BAD_UNIT, "this exponent is not a fraction of small numbers").at(at, ""))
}

pub const UNKNOWN_UNIT: Code = Code {
    name: "unknown-unit",
    explain: "\
A number is followed by a unit that is not declared.

    param side = 0.4 metre      // wrong
    param side = 0.4 m          // right

A scenario may declare its own: unit inch = 0.0254 m",
};

pub const UNKNOWN_DIMENSION: Code = Code {
    name: "unknown-dimension",
    explain: "\
A type names a dimension that is not declared.

    fn far(x: lenght) -> bool = x > 1 m      // wrong
    fn far(x: length) -> bool = x > 1 m      // right

A scenario may declare its own: dimension area_density = number / length^2",
};

pub const BAD_UNIT: Code = Code {
    name: "bad-unit",
    explain: "\
A unit is a positive number times other units.

    unit inch = 1 m + 2 cm      // wrong
    unit inch = 0.0254 m        // right",
};
