//! A Plan as its smallest parts, each by the path that leads to it.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde_json::{Map, Value};

use crate::hash::{is_binder, is_remark};
use crate::plan::{Expr, Plan, Setting, World};
use crate::render::text;

pub type Path = Vec<String>;
pub type Leaves = BTreeMap<Path, Leaf>;

/// What a part means, and how it is shown.
pub struct Leaf {
    pub meaning: String,
    pub shown: String,
}

/// All parts of a Plan. Of other worlds in it (evaluations, stages) and other Plans (variants), what they have otherwise.
pub fn leaves(plan: &Plan) -> Leaves {
    let mut walk = Walk { plan, world: &plan.world, base: None, leaves: Leaves::new() };
    match serde_json::to_value(plan) {
        Ok(Value::Object(mut fields)) => {
            let world = fields.remove("world");
            walk.fields(&Vec::new(), world.as_ref().and_then(Value::as_object).unwrap_or(&Map::new()));
            let world = walk.leaves;
            let mut walk = Walk { plan, world: &plan.world, base: Some(&world), leaves: Leaves::new() };
            walk.fields(&Vec::new(), &fields);
            let mut leaves = walk.leaves;
            leaves.extend(world);
            leaves
        }
        _ => walk.leaves,
    }
}

/// The units that the names of fields end with.
const UNITS: &[(&str, &str)] = &[("_mps", "m/s"), ("_s", "s"), ("_m", "m")];

/// A field's name without its unit.
pub fn without_unit(field: &str) -> &str {
    UNITS.iter().find_map(|(end, _)| field.strip_suffix(end)).unwrap_or(field)
}

struct Walk<'a> {
    plan: &'a Plan,
    /// Where its expressions are at home.
    world: &'a World,
    /// The world that others are compared with.
    base: Option<&'a Leaves>,
    leaves: Leaves,
}

impl Walk<'_> {
    fn leaf(&mut self, path: &[String], meaning: String, shown: String) {
        self.leaves.insert(path.to_vec(), Leaf { meaning, shown });
    }

    fn same(&mut self, path: &[String], shown: String) {
        self.leaf(path, shown.clone(), shown);
    }

    fn fields(&mut self, path: &[String], fields: &Map<String, Value>) {
        for (field, value) in fields {
            // What stands in the path already.
            let known = matches!(field.as_str(), "name" | "label")
                && value.as_str() == path.last().map(String::as_str);
            if is_remark(field) || known {
                continue;
            }
            let path = [path, std::slice::from_ref(field)].concat();
            match self.named(field, value) {
                Some(name) => self.same(&path, name),
                None => self.value(&path, value),
            }
        }
    }

    fn value(&mut self, path: &[String], value: &Value) {
        let field = path.last().map_or("", String::as_str);
        let unit = UNITS.iter().find(|(end, _)| field.ends_with(end)).map_or("", |(_, unit)| unit);
        match value {
            Value::Null => {}
            Value::String(text) => self.same(path, text.clone()),
            Value::Bool(truth) => self.same(path, truth.to_string()),
            Value::Number(number) => self.same(path, quantity(number.as_f64(), unit)),
            Value::Array(values) => self.array(path, values, unit),
            Value::Object(fields) => {
                if let Ok(setting) = Setting::deserialize(value) {
                    self.same(path, setting.to_string());
                } else if let Some(shown) = self.formula(value) {
                    self.leaf(path, self.nameless(value), shown);
                } else if let Some((tag, inside)) = tag(fields) {
                    let path = [path, &[tag.to_lowercase()]].concat();
                    self.value(&path, inside);
                } else if let ("world", Some(base)) = (field, self.base) {
                    self.other_world(path, value, base);
                } else if let ("plan", Ok(plan)) = (field, Plan::deserialize(value)) {
                    self.other_plan(path, &plan);
                } else {
                    self.fields(path, fields);
                }
            }
        }
    }

    fn array(&mut self, path: &[String], values: &[Value], unit: &str) {
        let numbers: Option<Vec<String>> =
            values.iter().map(|value| Some(quantity(Some(value.as_f64()?), unit))).collect();
        match numbers.as_deref() {
            Some([]) => return,
            Some([low, high]) => return self.same(path, format!("{low} .. {high}")),
            Some(numbers) => return self.same(path, format!("[{}]", numbers.join(", "))),
            None => {}
        }
        let field = path.last().map_or("", String::as_str);
        for (index, value) in values.iter().enumerate() {
            let of = |key: &str| value.get(key).and_then(Value::as_str);
            let here = |name: &str| [path, &[name.to_owned()]].concat();
            match (field, of("text"), of("name").or(of("label"))) {
                ("params", Some(text), Some(name)) => {
                    let meaning = value.get("value").map(Value::to_string).unwrap_or_default();
                    self.leaf(&here(name), meaning, text.to_owned());
                }
                ("observe" | "claims", Some(text), _) => {
                    let said = text.split_whitespace().collect::<Vec<_>>().join(" ");
                    let meaning: String = text.split_whitespace().collect();
                    self.leaf(&here(&meaning), meaning, said);
                }
                ("localised", ..) => {
                    let of = |key: &str| self.named(key, value.get(key)?);
                    let joined = value.get("odometry").map_or("", |_| " with odometry");
                    if let (Some(group), Some(via)) = (of("group"), of("via")) {
                        self.same(&here(&group), format!("via {via}{joined}"));
                    }
                }
                ("require", ..) => {
                    let said = self.formula(value).unwrap_or_default();
                    let meaning = self.nameless(value);
                    self.leaf(&here(&meaning), meaning.clone(), said);
                }
                (_, _, Some(name)) => self.value(&here(name), value),
                _ => self.value(&here(&(index + 1).to_string()), value),
            }
        }
    }

    /// The formula of what is an expression.
    fn formula(&self, value: &Value) -> Option<String> {
        Some(text::expr(self.plan, self.world, &Expr::deserialize(value).ok()?))
    }

    /// The same, however its index variables are called.
    fn nameless(&self, value: &Value) -> String {
        let mut value = value.clone();
        number_indices(&mut value, &mut 0);
        self.formula(&value).unwrap_or_default()
    }

    /// What an index stands for.
    fn named(&self, field: &str, value: &Value) -> Option<String> {
        let index = usize::try_from(value.as_u64()?).ok()?;
        match field {
            "group" => self.world.groups.get(index).map(|group| group.name.clone()),
            "via" => self.plan.localisers.get(index).map(|localiser| localiser.name.clone()),
            "param" => self.plan.params.get(index).map(|param| param.name.clone()),
            "about" | "agent" => Some(self.world.agent_name(index)),
            _ => None,
        }
    }

    fn other_world(&mut self, path: &[String], value: &Value, base: &Leaves) {
        let (Ok(world), Value::Object(fields)) = (World::deserialize(value), value) else { return };
        let mut walk = Walk { plan: self.plan, world: &world, base: None, leaves: Leaves::new() };
        walk.fields(&[], fields);
        let leaves = walk.leaves;
        self.otherwise(path, leaves, base);
    }

    fn other_plan(&mut self, path: &[String], plan: &Plan) {
        self.otherwise(path, leaves(plan), &leaves(&Plan { variants: Vec::new(), ..self.plan.clone() }));
    }

    /// Adds what differs from a base.
    fn otherwise(&mut self, path: &[String], leaves: Leaves, base: &Leaves) {
        let path = path.get(..path.len() - 1).unwrap_or(path);
        for gone in base.keys().filter(|inner| !leaves.contains_key(*inner)) {
            self.same(&[path, gone].concat(), "none".to_owned());
        }
        for (inner, leaf) in leaves {
            if base.get(&inner).is_none_or(|base| base.meaning != leaf.meaning) {
                self.leaves.insert([path, &inner].concat(), leaf);
            }
        }
    }
}

/// Calls each index variable by its number.
fn number_indices(value: &mut Value, number: &mut usize) {
    match value {
        Value::Object(fields) => {
            if let (true, Some(name)) = (is_binder(fields), fields.get_mut("name")) {
                *number += 1;
                *name = number.to_string().into();
            }
            fields.values_mut().for_each(|value| number_indices(value, number));
        }
        Value::Array(values) => values.iter_mut().for_each(|value| number_indices(value, number)),
        _ => {}
    }
}

/// The name of an enum's variant and what is in it.
fn tag(fields: &Map<String, Value>) -> Option<(&str, &Value)> {
    let (tag, inside) = fields.iter().next().filter(|_| fields.len() == 1)?;
    tag.starts_with(|first: char| first.is_ascii_uppercase()).then_some((tag, inside))
}

fn quantity(value: Option<f64>, unit: &str) -> String {
    let number = value.map_or("?".to_owned(), |value| value.to_string());
    if unit.is_empty() { number } else { format!("{number} {unit}") }
}
