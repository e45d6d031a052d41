//! Expressions: literals, names and what they stand for.

use super::fits::Wanted;
use super::{Checker, Scope};
use crate::ast::{self, ExprAt, Item, Name, Span};
use crate::dim::Dim;
use crate::hir::{Expr, Kind, Part, Type};
use crate::plan::{Function, WorldConstant};
use crate::problem::{Code, Problem};
use crate::resolve::{BUILT_IN, Entry, Space, listed};

impl<'a> Checker<'a> {
    pub fn expr(&mut self, scope: &mut Scope, at: &'a ExprAt) -> Expr {
        let span = at.span;
        self.level += 1;
        let expr = if self.level > super::value::DEEPEST {
            self.too_deep(span)
        } else {
            match &at.node {
                ast::Expr::Number { value, unit } => {
                    let (factor, dim) = match unit.as_ref().map(|unit| self.units.unit(&unit.node)) {
                        None => (1.0, Dim::none()),
                        Some(Ok(unit)) => unit,
                        Some(Err(problem)) => {
                            self.level -= 1;
                            return self.poison(span, *problem);
                        }
                    };
                    self.make(Kind::Number(in_si(*value, factor)), Type::Number(dim), span)
                }
                ast::Expr::Truth(truth) => self.make(Kind::Truth(*truth), Type::Truth, span),
                ast::Expr::Name(name) => self.name(scope, name, span),
                ast::Expr::Member(of, part) => self.member(scope, of, part, span),
                ast::Expr::Index(of, index) => self.index(scope, of, index, span),
                ast::Expr::Call(call) => self.call(scope, call, span),
                ast::Expr::Vector(x, y) => self.vector(scope, x, y, span),
                ast::Expr::List(all) => self.list(scope, all, span),
                ast::Expr::Tuple(_) => {
                    let problem =
                        Problem::error(&WRONG_KIND, "a vector has two parts").at(span, "more than two");
                    self.poison(span, problem.help("several values together stand in a sweep only"))
                }
                ast::Expr::Range(low, high) => self.range(scope, low, high, span),
                ast::Expr::Bars(of) => self.bars(scope, of, span),
                ast::Expr::Unary(op, operand) => self.unary(scope, *op, operand, span),
                ast::Expr::Binary { op, op_span, left, right } => {
                    self.binary(scope, *op, *op_span, (left, right), span)
                }
                ast::Expr::If { condition, then, otherwise } => {
                    self.if_(scope, condition, (then, otherwise), span)
                }
                ast::Expr::Reduce { op, over, body } => self.reduce(scope, op, over, body, span),
            }
        };
        self.level -= 1;
        expr
    }

    fn vector(&mut self, scope: &mut Scope, x: &'a ExprAt, y: &'a ExprAt, at: Span) -> Expr {
        let x = self.expr(scope, x);
        let x = self.any_number(x, &"x of a vector");
        let why = Wanted::like("y of a vector", x.span);
        let y = self.expr(scope, y);
        let y = self.fits(y, &x.type_, &why, &[], &mut Default::default());
        match (&x.type_, y.is_poison()) {
            (Type::Number(dim), false) => {
                let type_ = Type::Vector(dim.clone());
                self.make(Kind::Vector(Box::new(x), Box::new(y)), type_, at)
            }
            _ => Expr::poison(at),
        }
    }

    fn list(&mut self, scope: &mut Scope, all: &'a [ExprAt], at: Span) -> Expr {
        let mut entries: Vec<Expr> = Vec::new();
        for entry in all {
            let value = self.expr(scope, entry);
            let value = match entries.first() {
                Some(first) => {
                    let why = Wanted::like("each entry of a list", first.span);
                    let type_ = first.type_.clone();
                    self.fits(value, &type_, &why, &[], &mut Default::default())
                }
                None if matches!(value.type_, Type::Vector(_)) => value,
                None => self.any_number(value, &"an entry of a list"),
            };
            entries.push(value);
        }
        if entries.iter().any(Expr::is_poison) {
            return Expr::poison(at);
        }
        let of = entries.first().map_or(Type::Poison, |first| first.type_.clone());
        self.make(Kind::List(entries), Type::List(Box::new(of)), at)
    }

    fn range(&mut self, scope: &mut Scope, low: &'a ExprAt, high: &'a ExprAt, at: Span) -> Expr {
        let low = self.expr(scope, low);
        let low = self.any_number(low, &"an end of a range");
        let why = Wanted::like("the other end of a range", low.span);
        let high = self.expr(scope, high);
        let high = self.fits(high, &low.type_, &why, &[], &mut Default::default());
        match (&low.type_, high.is_poison()) {
            (Type::Number(dim), false) => {
                let type_ = Type::Range(dim.clone());
                self.make(Kind::Range(Box::new(low), Box::new(high)), type_, at)
            }
            _ => Expr::poison(at),
        }
    }

    fn name(&mut self, scope: &mut Scope, name: &str, at: Span) -> Expr {
        if let Some((kind, type_)) = scope.local(name) {
            return self.make(kind, type_, at);
        }
        if name == "t" {
            let time = self.units.base("time");
            return self.make(Kind::Time, Type::Number(time), at);
        }
        if BUILT_IN.contains(&name) {
            return self.poison(at, built_in_alone(name, at));
        }
        let Some(entry) = self.find(scope.module, Space::Value, name) else {
            let problem = self.unknown_name(scope, name, at);
            return self.poison(at, problem);
        };
        let Some(item) = self.program.item(entry.id) else { return Expr::poison(at) };
        match &item.node {
            Item::Param(param) => self.param_value(entry, &param.name, at),
            Item::Let(_) => match self.let_value(entry.id) {
                Some(value) => {
                    let type_ = value.type_.clone();
                    self.make(Kind::Let(value), type_, at)
                }
                None => Expr::poison(at),
            },
            Item::Agents(_) | Item::Obstacles(_) => self.group_as_agent(entry.id, name, at),
            Item::Landmarks(_) => {
                let problem = Problem::error(&WRONG_KIND, format!("`{name}` is a landmark"));
                let problem = problem.at(at, "has no value");
                self.poison(at, problem.help("landmarks are only looked at; an `obstacle` has a position"))
            }
            Item::Recording { .. } => {
                let problem = Problem::error(&WRONG_KIND, format!("`{name}` is a recording"))
                    .at(at, "at what time?")
                    .help(format!("`{name}[t]` is the position at time t"));
                self.poison(at, problem)
            }
            Item::Function(function) => {
                let example = if function.params.is_empty() { "" } else { "…" };
                let problem = Problem::error(&WRONG_KIND, format!("`{name}` is a function"))
                    .at(at, "without its arguments")
                    .help(format!("write `{name}({example})`"));
                self.poison(at, problem)
            }
            Item::Formation(_) => {
                let problem = Problem::error(&WRONG_KIND, format!("`{name}` is a formation"))
                    .at(at, "of which member?")
                    .help(format!("`{name}[i]` is the place where member i belongs"));
                self.poison(at, problem)
            }
            _ => Expr::poison(at),
        }
    }

    fn param_value(&mut self, entry: Entry, name: &Name, at: Span) -> Expr {
        self.used.insert(name.span);
        let Some(&id) = self.ids.params.get(&entry.id) else { return Expr::poison(at) };
        match self.hir.params.get(id) {
            Some(param) => {
                let type_ = Type::Number(param.dim.clone());
                if param.default.is_poison() {
                    return Expr::poison(at);
                }
                self.make(Kind::Param(id), type_, at)
            }
            None => {
                let problem = Problem::error(&CIRCULAR, format!("`{}` is not known yet here", name.node))
                    .at(at, "refers to a parameter that comes later")
                    .with(name.span, "declared here")
                    .help("a parameter may refer to those above it");
                self.poison(at, problem)
            }
        }
    }

    /// Finds an item, and remembers that it is used.
    pub fn find(&mut self, module: usize, space: Space, name: &str) -> Option<Entry> {
        let entry = self.program.find(module, space, name)?;
        if module == self.program.main && entry.imported {
            self.used.insert(entry.at);
        }
        Some(entry)
    }

    fn unknown_name(&self, scope: &Scope, name: &str, at: Span) -> Problem {
        let problem = Problem::error(&UNKNOWN_NAME, format!("there is no `{name}` here")).at(at, "");
        let elsewhere = Space::ALL.into_iter().find(|&space| {
            !matches!(space, Space::Value | Space::Protocol | Space::Unit | Space::Dimension)
                && self.program.find(scope.module, space, name).is_some()
        });
        if let Some(space) = elsewhere {
            let how = match space {
                Space::Motion => format!("a group uses it as `motion = {name}(…)`"),
                Space::Shape => format!("use it as `formation F of … = {name}(…) about …`"),
                _ => "it has no value".to_owned(),
            };
            return problem.note(format!("`{name}` is {}, not a value", space.people())).help(how);
        }
        let known =
            scope.locals.names().chain(self.program.names(scope.module, Space::Value)).chain(BUILT_IN);
        match self.meant(name, known) {
            Some(meant) => problem.help(format!("did you mean `{meant}`?")),
            None => match crate::stdlib::home(name, Some(Space::Value)) {
                Some(path) => problem.help(format!("the standard library has one: `use {path}.{name}`")),
                None if self.units.has_unit(name) => {
                    problem.help(format!("`{name}` is a unit, and a unit follows a number: `1 {name}`"))
                }
                None if name.len() == 1 => {
                    let group = self.hir.world.groups.last().map_or("all", |group| group.name.as_str());
                    problem.help(format!("an index runs over a set: `sum({name} in {group}) …`"))
                }
                None if name == "self" => problem.help("`self` is the agent that a `motion` moves"),
                None => problem.help(format!("declare it, for example `param {name} = 1 m`")),
            },
        }
    }

    fn member(&mut self, scope: &mut Scope, of: &'a ExprAt, part: &Name, at: Span) -> Expr {
        if matches!(&of.node, ast::Expr::Name(name) if name == "world") && scope.local("world").is_none() {
            return self.world_constant(part, at);
        }
        if let Some(found) = self.dotted(scope, of, part, at) {
            return found;
        }
        let of = self.expr(scope, of);
        let parts: &[(&str, Part)] = match &of.type_ {
            Type::Poison => return Expr::poison(at),
            Type::Vector(dim) => {
                let function = match part.node.as_str() {
                    "x" => Function::X,
                    "y" => Function::Y,
                    _ => return self.no_member(&of, part, &["x", "y"], at),
                };
                let type_ = Type::Number(dim.clone());
                return self.make(Kind::BuiltIn(function, vec![of]), type_, at);
            }
            Type::Area => &AREA_PARTS,
            Type::Range(_) => &RANGE_PARTS,
            _ => &[],
        };
        let Some((_, found)) = parts.iter().find(|(name, _)| *name == part.node) else {
            let names: Vec<&str> = parts.iter().map(|(name, _)| *name).collect();
            return self.no_member(&of, part, &names, at);
        };
        let dim = if let Type::Range(dim) = &of.type_ { dim.clone() } else { self.units.base("length") };
        self.make(Kind::Part(*found, Box::new(of)), Type::Number(dim), at)
    }

    fn no_member(&mut self, of: &Expr, part: &Name, known: &[&str], at: Span) -> Expr {
        let have = self.describe(&of.type_);
        let problem = Problem::error(&UNKNOWN_NAME, format!("{have} has no `{}`", part.node))
            .at(part.span, "")
            .with(of.span, format!("this is {have}"));
        let problem = match (self.meant(&part.node, known.iter().copied()), known) {
            (Some(meant), _) => problem.help(format!("did you mean `{meant}`?")),
            (None, []) => problem,
            (None, known) => problem.help(format!("it has {}", listed(known.iter().copied()))),
        };
        self.poison(at, problem)
    }

    fn world_constant(&mut self, part: &Name, at: Span) -> Expr {
        let (constant, dim) = match part.node.as_str() {
            "dt" => (WorldConstant::Dt, "time"),
            "safety" => (WorldConstant::Safety, "length"),
            "horizon" => (WorldConstant::Horizon, "steps"),
            other => {
                let known = ["dt", "safety", "horizon"];
                let problem = Problem::error(&UNKNOWN_NAME, format!("`world` has no `{other}`"));
                let problem = problem.at(part.span, "").help(match self.meant(other, known) {
                    Some(meant) => format!("did you mean `{meant}`?"),
                    None => format!("it has {}", listed(known)),
                });
                return self.poison(at, problem);
            }
        };
        let dim = self.units.base(dim);
        self.make(Kind::World(constant), Type::Number(dim), at)
    }
}

/// Units that are a whole part of another are divided by its number: 95% is 0.95, not 0.9500000000000001.
fn in_si(value: f64, factor: f64) -> f64 {
    let parts = factor.recip().round();
    if factor < 1.0 && parts.recip() == factor { value / parts } else { value * factor }
}

const AREA_PARTS: [(&str, Part); 4] =
    [("left", Part::Left), ("right", Part::Right), ("bottom", Part::Bottom), ("top", Part::Top)];
const RANGE_PARTS: [(&str, Part); 2] = [("low", Part::Low), ("high", Part::High)];

fn built_in_alone(name: &str, at: Span) -> Problem {
    let (what, help) = match name {
        "p" => ("the positions of all agents", "`p[i]` is the position of agent i"),
        "v" => ("the velocities of all agents", "`v[i]` is the velocity of agent i"),
        "heading" => ("the headings of all agents", "`heading[i]` is the heading of agent i"),
        "u" => ("the velocity commands of all agents", "`u[i]` is the command of agent i"),
        "du" => ("the changes of all commands", "`du[i]` is by how much the command of agent i changed"),
        "obstacles" => ("a set", "run over it: `sum(i in obstacles) …`"),
        "edges" | "members" => ("a set of a formation", "run over it: `sum(i, j in edges(F)) …`"),
        "nearest" => ("a set", "run over it: `sum(j in nearest(2, i, all)) …`"),
        "size" => ("a function", "write `size(follower)`"),
        "world" => ("no value by itself", "it has `world.dt`, `world.safety` and `world.horizon`"),
        "all" | "pairs" => ("a set", "run over it: `sum(i in all) …`, `count(i, j in pairs(all)) …`"),
        _ => ("a function", "write `box(-1 m .. 1 m, -1 m .. 1 m)`"),
    };
    Problem::error(&WRONG_KIND, format!("`{name}` is {what}")).at(at, "").help(help)
}

pub const UNKNOWN_NAME: Code = Code {
    name: "unknown-name",
    explain: "\
A name that is not declared in this file, not imported by `use`, and no index variable around.

    param side = 0.4 m
    formation F of follower = square(sied) about leader     // wrong
    formation F of follower = square(side) about leader     // right

What the standard library has beyond units and the usual maths is imported by `use`.",
};

pub const WRONG_KIND: Code = Code {
    name: "wrong-kind",
    explain: "\
A name was used as something that it is not: a function without arguments, a formation without a member,
a motion as a number.

    crash = -k_c * collisions       // wrong: a function
    crash = -k_c * collisions()     // right",
};

pub const CIRCULAR: Code = Code {
    name: "circular",
    explain: "\
A value is needed to find itself.

    let a = 2 * b
    let b = a + 1       // wrong: a needs b, b needs a

    fn f(x: number) -> number = f(x - 1)    // wrong: functions cannot call themselves

A parameter may refer to the parameters above it only.",
};
