//! Functions and random draws.

use mpgx_lang::plan::{Distribution, Expr, Function};

use super::{Compiler, Varies};
use crate::error::Flaw;
use crate::lanes::{Function1, Function2, OfVectors, lift};
use crate::maths;
use crate::program::draw::{Distribution as Law, Draw, MOST_DRAWS};
use crate::program::{Number, Program, Vector};

impl Compiler<'_> {
    pub(super) fn call(&mut self, function: Function, arguments: &[Expr]) -> Result<Program, Flaw> {
        let arity = |expected| Flaw::Arity {
            function: format!("{function:?}").to_lowercase(),
            expected,
            found: arguments.len(),
        };
        match function {
            Function::Norm | Function::X | Function::Y | Function::Unit => {
                let [v] = arguments else { return Err(arity(1)) };
                let v = Box::new(self.vector(v)?);
                Ok(match function {
                    Function::Norm => Program::Number(Number::OfVector(lift!(map_vector, maths::norm, v), v)),
                    Function::X => Program::Number(Number::OfVector(lift!(map_vector, maths::x, v), v)),
                    Function::Y => Program::Number(Number::OfVector(lift!(map_vector, maths::y, v), v)),
                    _ => Program::Vector(Vector::Unit(v)),
                })
            }
            Function::Dot | Function::Cross => {
                let [a, b] = arguments else { return Err(arity(2)) };
                let operands = Box::new([self.vector(a)?, self.vector(b)?]);
                let formula: OfVectors = match function {
                    Function::Dot => lift!(map_vectors, maths::dot, a, b),
                    _ => lift!(map_vectors, maths::cross, a, b),
                };
                Ok(Program::Number(Number::OfVectors(formula, operands)))
            }
            Function::Rotate => {
                let [v, angle] = arguments else { return Err(arity(2)) };
                Ok(Program::Vector(Vector::Rotate(Box::new((self.vector(v)?, self.number(angle)?)))))
            }
            Function::Atan2 | Function::Mod | Function::Min | Function::Max => {
                let [a, b] = arguments else { return Err(arity(2)) };
                let formula: Function2 = match function {
                    Function::Atan2 => lift!(map2, libm::atan2, a, b),
                    Function::Mod => lift!(map2, maths::modulo, a, b),
                    Function::Min => lift!(map2, maths::lesser, a, b),
                    _ => lift!(map2, maths::greater, a, b),
                };
                self.function2(formula, a, b)
            }
            Function::Clamp => {
                let [x, low, high] = arguments else { return Err(arity(3)) };
                let operands = [self.number(x)?, self.number(low)?, self.number(high)?];
                Ok(Program::Number(Number::Clamp(Box::new(operands))))
            }
            Function::Abs
            | Function::Sqrt
            | Function::Sin
            | Function::Cos
            | Function::Tan
            | Function::Exp
            | Function::Ln
            | Function::Tanh
            | Function::Floor
            | Function::Sign => {
                let [x] = arguments else { return Err(arity(1)) };
                let formula: Function1 = match function {
                    Function::Abs => lift!(map, f64::abs, x),
                    Function::Sqrt => lift!(map, f64::sqrt, x),
                    Function::Sin => lift!(map, libm::sin, x),
                    Function::Cos => lift!(map, libm::cos, x),
                    Function::Tan => lift!(map, libm::tan, x),
                    Function::Exp => lift!(map, libm::exp, x),
                    Function::Ln => lift!(map, libm::log, x),
                    Function::Tanh => lift!(map, libm::tanh, x),
                    Function::Floor => lift!(map, f64::floor, x),
                    _ => lift!(map, maths::sign, x),
                };
                Ok(Program::Number(Number::Function1(formula, Box::new(self.number(x)?))))
            }
        }
    }

    pub(super) fn function2(&mut self, formula: Function2, a: &Expr, b: &Expr) -> Result<Program, Flaw> {
        let operands = Box::new([self.number(a)?, self.number(b)?]);
        Ok(Program::Number(Number::Function2(formula, operands)))
    }

    pub(super) fn draw(&mut self, distribution: &Distribution, site: usize) -> Result<Program, Flaw> {
        if !self.scope.draws {
            return Err(Flaw::NoDraw);
        }
        let (from, vector) = match distribution {
            Distribution::UnitDisc => (Law::UnitDisc, true),
            Distribution::Uniform { low: a, high: b } | Distribution::Normal { mean: a, deviation: b } => {
                let uniform = matches!(distribution, Distribution::Uniform { .. });
                match (self.program(a)?, self.program(b)?) {
                    (Program::Number(a), Program::Number(b)) if uniform => (Law::Uniform([a, b]), false),
                    (Program::Number(a), Program::Number(b)) => (Law::Normal([a, b]), false),
                    (Program::Vector(a), Program::Vector(b)) if uniform => (Law::UniformAxes([a, b]), true),
                    (Program::Vector(a), Program::Vector(b)) => (Law::NormalAxes([a, b]), true),
                    (a, b) => return Err(Flaw::Kind { expected: a.kind(), found: b.kind() }),
                }
            }
        };
        self.varies = Varies::InTime;
        let draw = Box::new(Draw { from, memory: self.memory(site)? });
        Ok(if vector { Program::Vector(Vector::Draw(draw)) } else { Program::Number(Number::Draw(draw)) })
    }

    /// Where the draw of a site is kept. In a reduction it is drawn for each member, and kept nowhere.
    fn memory(&mut self, site: usize) -> Result<Option<usize>, Flaw> {
        let looped = self.loops > 0;
        match self.sites.iter().position(|&(known, _)| known == site) {
            Some(memory) if !looped && !self.sites[memory].1 => Ok(Some(memory)),
            Some(_) => Err(Flaw::DrawInReduction),
            None if self.sites.len() == MOST_DRAWS => Err(Flaw::TooManyDraws { most: MOST_DRAWS }),
            None => {
                self.sites.push((site, looped));
                Ok((!looped).then_some(self.sites.len() - 1))
            }
        }
    }
}
