//! What the symbols of a formula stand for.

use minijinja::Value;
use mpgx_lang::plan::{Distribution, Expr, Plan, World, WorldConstant};
use mpgx_lang::render::mathml;
use serde::Serialize;

/// `k_c = 1 m`
#[derive(Serialize)]
pub struct Symbol {
    pub math: Value,
    pub value: String,
}

/// Parameters and constants of the world in a formula, each once, as they come.
pub fn symbols(plan: &Plan, world: &World, formula: &Expr) -> Vec<Symbol> {
    let mut found: Vec<&Expr> = Vec::new();
    collect(formula, &mut found);
    let symbol = |expr: &Expr| {
        let (value, dimension) = match expr {
            Expr::Param(id) => plan.params.get(*id).map(|param| (param.value, param.dimension.as_str()))?,
            Expr::World(WorldConstant::Dt) => (world.dt_s, "time"),
            Expr::World(WorldConstant::Safety) => (world.safety_m, "length"),
            Expr::World(WorldConstant::Horizon) => (world.horizon as f64, "steps"),
            _ => return None,
        };
        Some(Symbol {
            math: Value::from_safe_string(mathml::expr(plan, world, expr)),
            value: quantity(value, dimension),
        })
    };
    found.into_iter().filter_map(symbol).collect()
}

/// An SI value with the unit of its dimension, where that has a short name.
pub fn quantity(value: f64, dimension: &str) -> String {
    let number = value.to_string().replace('-', "\u{2212}");
    match unit(dimension) {
        Some("") => number,
        Some(unit) => format!("{number}\u{a0}{unit}"),
        None => format!("{number} ({dimension}, SI)"),
    }
}

/// The short name of a dimension's SI unit, empty for plain numbers.
pub fn unit(dimension: &str) -> Option<&'static str> {
    Some(match dimension {
        "number" => "",
        "length" => "m",
        "time" => "s",
        "speed" => "m/s",
        "acceleration" => "m/s²",
        "frequency" => "Hz",
        "steps" => "steps",
        _ => return None,
    })
}

fn collect<'e>(expr: &'e Expr, found: &mut Vec<&'e Expr>) {
    let mut all = |parts: &[&'e Expr]| parts.iter().for_each(|part| collect(part, found));
    match expr {
        Expr::Param(_) | Expr::World(_) => {
            if !found.contains(&expr) {
                found.push(expr);
            }
        }
        Expr::Vector(a, b) | Expr::Binary(_, a, b) => all(&[a, b]),
        Expr::Unary(_, a) => all(&[a]),
        Expr::Call(_, arguments) => arguments.iter().for_each(|argument| collect(argument, found)),
        Expr::Element(list, number) => list.iter().chain([&**number]).for_each(|part| collect(part, found)),
        Expr::Track(_, time) => all(&[time]),
        Expr::If { condition, then, otherwise } => all(&[then, condition, otherwise]),
        Expr::Reduce { filter, body, .. } => {
            all(&[body]);
            if let Some(filter) = filter {
                collect(filter, found);
            }
        }
        Expr::Draw { distribution: Distribution::Uniform { low: a, high: b }, .. }
        | Expr::Draw { distribution: Distribution::Normal { mean: a, deviation: b }, .. } => all(&[a, b]),
        Expr::Draw { distribution: Distribution::UnitDisc, .. }
        | Expr::Number(_)
        | Expr::Truth(_)
        | Expr::Time
        | Expr::State(_)
        | Expr::SlotNumber
        | Expr::SlotCount
        | Expr::Agent(..)
        | Expr::Slot(..)
        | Expr::Rest(..)
        | Expr::Clearance(..)
        | Expr::Same(..)
        | Expr::MemberNumber(_)
        | Expr::Measured(_) => {}
    }
}
