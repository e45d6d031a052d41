//! Declarations: parameters, lets and functions.

use std::sync::Arc;

use super::call::{Action, Callable};
use super::expr::CIRCULAR;
use super::fits::{Wanted, What};
use super::{Checker, Override, Scope};
use crate::ast::{self, FunctionDecl, Item, LetDecl, Spanned, TypeExpr};
use crate::dim::Dim;
use crate::hir::{self, Draw, Expr, Kind, Parameter, Type};
use crate::plan::{Curve, Function as BuiltIn, Quantity};
use crate::problem::{Code, Problem};
use crate::resolve::{ItemId, Space};

/// Parameters or states of a declaration, groups and formations of a scenario, at most.
pub const MOST: usize = 1000;

impl<'a> Checker<'a> {
    /// The scenario's parameters, with the values that overrides give them.
    pub fn params(&mut self, overrides: &'a [Override]) {
        let main = self.program.main;
        for (_, item) in self.main_items() {
            let Item::Param(param) = &item.node else { continue };
            let mut scope = Scope::of(main);
            let checked = self.parameter(&mut scope, param);
            let name = &param.name;
            let mut told = checked.type_ == Type::Poison;
            let dim = match &checked.type_ {
                Type::Number(dim) => dim.clone(),
                Type::Count | Type::Poison => Dim::none(),
                other => {
                    let have = self.describe(other);
                    self.report(
                        Problem::error(&super::fits::TYPE_MISMATCH, "a parameter is a number")
                            .at(name.span, format!("this is {have}"))
                            .help(format!("for anything else write `let {} = …`", name.node)),
                    );
                    told = true;
                    Dim::none()
                }
            };
            let mut default = checked.default.clone().unwrap_or_else(|| {
                let written = self.sources.text(item.span).to_owned();
                let example = self.units.example("1", &dim).unwrap_or_else(|| "1".to_owned());
                let problem = Problem::error(&MISSING_VALUE, format!("`{}` needs a value", name.node));
                let problem = problem.at(name.span, "has none");
                self.poison(
                    name.span,
                    match checked.range {
                        None => problem.help(format!("write for example `{written} = {example}`")),
                        Some(_) => problem.help(format!("give it one before `in`: `= {example} in …`")),
                    },
                )
            });
            if told {
                default = Expr::poison(default.span);
            }
            let chosen = overrides.iter().rev().find(|chosen| chosen.name.node == name.node);
            if let Some(chosen) = chosen.filter(|_| !default.is_poison()) {
                let why = Wanted::declared(What::Name(&name.node), name.span);
                default = self.wanted(&mut scope, &chosen.value, &checked.type_, &why);
            }
            let value = self.constant(&default, &What::Name(&name.node));
            if value.is_none() {
                default = Expr::poison(default.span);
            }
            self.bound(&checked, &default);
            let id = self.hir.params.len();
            self.constants.params.push(value.filter(|_| !self.randomised.contains_key(&id)));
            self.hir.params.push(hir::Param {
                name: name.node.clone(),
                doc: param.doc.clone(),
                dim,
                default,
                value,
                span: name.span,
            });
        }
        for chosen in overrides {
            if !self.hir.params.iter().any(|param| param.name == chosen.name.node) {
                let names = self.hir.params.iter().map(|param| param.name.as_str());
                let problem = Problem::error(
                    &UNKNOWN_OVERRIDE,
                    format!("the scenario has no parameter `{}`", chosen.name.node),
                )
                .at(chosen.name.span, "");
                let help = match self.meant(&chosen.name.node, names.clone()) {
                    Some(meant) => format!("did you mean `{meant}`?"),
                    None if self.hir.params.is_empty() => "it has none at all".to_owned(),
                    None => format!("it has {}", crate::resolve::listed(names)),
                };
                self.report(problem.help(help));
            }
        }
    }

    /// Checks whatever the files declare, used or not; of the standard library only what they use is looked at.
    pub fn declarations(&mut self) {
        self.program.written().for_each(|(id, item)| self.declaration(id, &item.node));
    }

    pub fn declaration(&mut self, id: ItemId, item: &Item) {
        match item {
            Item::Let(_) => drop(self.let_value(id)),
            Item::Function(_) => drop(self.callable(id)),
            Item::Motion(_) => drop(self.motion(id)),
            Item::Shape(_) => drop(self.shape(id)),
            Item::Extern(_) => drop(self.signature(id)),
            _ => {}
        }
    }

    /// A parameter of anything. Its type is the declared one, else that of its default.
    pub fn parameter(&mut self, scope: &mut Scope, param: &'a ast::Parameter) -> Parameter {
        let name = &param.name;
        let declared = param.type_.as_ref().map(|type_| self.type_(type_, &scope.generics));
        let why = Wanted::declared(What::Name(&name.node), name.span);
        let default = param.default.as_ref().map(|default| match &declared {
            Some(type_) => self.wanted(scope, default, type_, &why),
            None => self.expr(scope, default),
        });
        let default = default.map(Expr::shared);
        let type_ = match (declared, &default) {
            (Some(type_), _) => type_,
            (None, Some(default)) => default.type_.clone(),
            (None, None) => Type::Poison,
        };
        let limit = match &type_ {
            Type::Range(dim) | Type::Vector(dim) => Type::Number(dim.clone()),
            Type::Count | Type::Schedule => Type::Number(Dim::none()),
            other => other.clone(),
        };
        let range = param.range.as_ref().map(|(low, high)| {
            let why = Wanted::declared(What::Of("a limit", &name.node), name.span);
            let mut limit = |at| self.wanted(scope, at, &limit, &why).shared();
            (limit(low), limit(high))
        });
        let checked = Parameter {
            name: name.node.clone(),
            doc: param.doc.clone(),
            type_,
            default,
            range,
            span: name.span,
        };
        if let Some(default) = &checked.default {
            self.bound(&checked, default);
        }
        checked
    }

    pub fn parameters(&mut self, scope: &mut Scope, params: &'a [ast::Parameter]) -> Vec<Parameter> {
        let mut checked: Vec<Parameter> = Vec::new();
        let mut outside = scope.clone();
        if let Some(last) = params.last()
            && !self.few("parameters", params.len(), MOST, last.name.span)
        {
            return checked;
        }
        for (number, param) in params.iter().enumerate() {
            let name = &param.name;
            if let Some(first) = checked.iter().find(|first| first.name == name.node) {
                let problem = Problem::error(
                    &crate::resolve::DUPLICATE_NAME,
                    format!("two parameters are called `{}`", name.node),
                );
                self.report(problem.at(name.span, "again here").with(first.span, "first declared here"));
            }
            let param = self.parameter(&mut outside, param);
            let inside =
                if param.type_ == Type::Count { Type::Number(Dim::none()) } else { param.type_.clone() };
            let kind = match inside {
                Type::Group => Kind::Group(hir::Set::Argument(number)),
                _ => Kind::Argument(number),
            };
            scope.add(&name.node, kind, inside);
            checked.push(param);
        }
        checked
    }

    fn type_(&mut self, type_: &Spanned<TypeExpr>, generics: &[String]) -> Type {
        let found = match &type_.node {
            TypeExpr::OneOf(words) => Ok(Type::Word(words.iter().map(|word| word.node.clone()).collect())),
            TypeExpr::Vector(dim) => self.units.dim(dim, generics).map(Type::Vector),
            TypeExpr::Range(dim) => self.units.dim(dim, generics).map(Type::Range),
            TypeExpr::Dim(dim) => match dim.factors.as_slice() {
                [(name, (1, 1))] => match name.node.as_str() {
                    "bool" => Ok(Type::Truth),
                    "agent" => Ok(Type::Agent(None)),
                    "point" => Ok(Type::Vector(self.units.base("length"))),
                    "area" => Ok(Type::Area),
                    "list" => Ok(Type::List(Box::new(Type::Number(Dim::none())))),
                    "points" => Ok(Type::List(Box::new(Type::Vector(self.units.base("length"))))),
                    "formation" => Ok(Type::Formation),
                    "group" => Ok(Type::Group),
                    "track" => Ok(Type::Track),
                    "count" => Ok(Type::Count),
                    "schedule" => Ok(Type::Schedule),
                    _ => self.units.dim(dim, generics).map(Type::Number),
                },
                _ => self.units.dim(dim, generics).map(Type::Number),
            },
        };
        found.unwrap_or_else(|problem| {
            self.report(*problem);
            Type::Poison
        })
    }

    /// The value of a top-level `let`; `None` if it has none.
    pub fn let_value(&mut self, id: ItemId) -> Option<Arc<Expr>> {
        let Item::Let(decl) = &self.program.item(id)?.node else { return None };
        match self.seen.lets.get(&id) {
            Some(Some(value)) => return Some(value.clone()).filter(|value| !value.is_poison()),
            Some(None) => {
                self.report(
                    Problem::error(&CIRCULAR, format!("`{}` is needed to find itself", decl.name.node))
                        .at(decl.name.span, "its value refers, over others or directly, to itself"),
                );
                self.seen.lets.insert(id, Some(Arc::new(Expr::poison(decl.name.span))));
                return None;
            }
            None => {}
        }
        self.seen.lets.insert(id, None);
        let value = self.expr(&mut Scope::of(id.module), &decl.value);
        let told = matches!(self.seen.lets.get(&id), Some(Some(_)));
        let value = Arc::new(if told { Expr::poison(value.span) } else { value });
        self.seen.lets.insert(id, Some(value.clone()));
        Some(value).filter(|value| !value.is_poison())
    }

    pub fn local_let(&mut self, scope: &mut Scope, decl: &'a LetDecl) {
        let value = self.expr(scope, &decl.value);
        let type_ = value.type_.clone();
        scope.add(&decl.name.node, Kind::Let(Arc::new(value)), type_);
    }

    /// A function or distribution; `None` while its own body is being checked.
    pub fn callable(&mut self, id: ItemId) -> Option<Arc<Callable>> {
        let Item::Function(decl) = &self.program.item(id)?.node else { return None };
        if let Some(seen) = self.seen.functions.get(&id) {
            return seen.clone();
        }
        self.seen.functions.insert(id, None);
        let function = Arc::new(self.function(id, decl));
        self.seen.functions.insert(id, Some(function.clone()));
        Some(function)
    }

    fn function(&mut self, id: ItemId, decl: &'a FunctionDecl) -> Callable {
        let mut scope = Scope::of(id.module);
        scope.generics = decl.generics.iter().map(|name| name.node.clone()).collect();
        let params = self.parameters(&mut scope, &decl.params);
        let result = self.result(decl, &scope.generics);
        let action = match &decl.body {
            None => match built_in(&decl.name.node) {
                Some(action) => action,
                None => {
                    let problem =
                        Problem::error(&NOT_PROVIDED, format!("nothing provides `{}`", decl.name.node));
                    if self.program.modules.get(id.module).is_some_and(|module| module.is_standard()) {
                        self.report(problem.at(decl.name.span, "declared `extern`"));
                    }
                    Action::Poison
                }
            },
            Some(body) => {
                for decl in &body.lets {
                    self.local_let(&mut scope, decl);
                }
                scope.draws = decl.random;
                let why = Wanted::declared(What::Of("the result", &decl.name.node), decl.result.span);
                let value = self.wanted(&mut scope, &body.value, &result, &why);
                if decl.random && !scope.drawn && !value.is_poison() {
                    self.report(
                        Problem::error(&NOTHING_DRAWN, format!("`{}` draws nothing", decl.name.node))
                            .at(body.value.span, "nothing here is random")
                            .help("declare it as `fn`"),
                    );
                }
                match value.is_poison() {
                    true => Action::Poison,
                    false => {
                        Action::Body(Arc::new(hir::Function { name: decl.name.node.clone(), body: value }))
                    }
                }
            }
        };
        Callable { generics: scope.generics, params, result, random: decl.random, action }
    }

    fn result(&mut self, decl: &FunctionDecl, generics: &[String]) -> Type {
        let result = self.type_(&decl.result, generics);
        let schedule = result == Type::Schedule && decl.body.is_none();
        if result.is_plain() && result != Type::Count || schedule || result == Type::Poison {
            return result;
        }
        let have = self.describe(&result);
        self.report(
            Problem::error(&super::fits::TYPE_MISMATCH, format!("a function cannot give {have}"))
                .at(decl.result.span, "")
                .help("it gives a number, a vector or a truth value"),
        );
        Type::Poison
    }

    /// The value of `name = …` (nothing is drawn) or `name ~ …` (something is).
    pub fn assigned(&mut self, scope: &mut Scope, name: &str, random: bool, at: &'a ast::ExprAt) -> Expr {
        let outer = (scope.draws, scope.drawn, scope.target.take());
        (scope.draws, scope.drawn) = (random, false);
        scope.target = (!random).then(|| name.to_owned());
        let value = self.expr(scope, at);
        let drawn = scope.drawn;
        (scope.draws, scope.drawn, scope.target) = outer;
        if random && !drawn && !value.is_poison() {
            let problem = Problem::error(&NOTHING_DRAWN, format!("`{name} ~ …` draws nothing"))
                .at(at.span, "nothing here is random")
                .help(format!("write `{name} = {}`", self.sources.text(at.span)));
            let problem = match self.sources.sign_before('~', at.span) {
                Some(sign) => problem.fix(sign, "="),
                None => problem,
            };
            return self.poison(at.span, problem);
        }
        value
    }

    /// Whether a name is that of a thing of a space, else a problem that says what could be meant.
    pub fn item_named(&mut self, space: Space, name: &ast::Name) -> Option<ItemId> {
        let main = self.program.main;
        if let Some(entry) = self.find(main, space, &name.node) {
            return self.program.item(entry.id).map(|_| entry.id);
        }
        let noun = space.people().trim_start_matches("an ").trim_start_matches("a ").to_owned();
        let problem =
            Problem::error(&super::expr::UNKNOWN_NAME, format!("there is no {noun} `{}`", name.node))
                .at(name.span, "");
        let other =
            Space::ALL.into_iter().find(|&other| self.program.find(main, other, &name.node).is_some());
        let help = match (
            self.meant(&name.node, self.program.names(main, space)),
            crate::stdlib::home(&name.node, Some(space)),
            other,
        ) {
            (_, Some(path), _) => format!("the standard library has one: `use {path}.{}`", name.node),
            (Some(meant), ..) => format!("did you mean `{meant}`?"),
            (None, None, Some(other)) => format!("`{}` is {}", name.node, other.people()),
            (None, None, None) => {
                let known: Vec<&str> = self.program.names(main, space).collect();
                format!("known here: {}", crate::resolve::listed(known))
            }
        };
        self.report(problem.help(help));
        None
    }
}

/// What the runtime provides for an `extern fn` or `extern dist`.
fn built_in(name: &str) -> Option<Action> {
    Some(Action::BuiltIn(match name {
        "sqrt" => BuiltIn::Sqrt,
        "sin" => BuiltIn::Sin,
        "cos" => BuiltIn::Cos,
        "tan" => BuiltIn::Tan,
        "atan2" => BuiltIn::Atan2,
        "exp" => BuiltIn::Exp,
        "ln" => BuiltIn::Ln,
        "tanh" => BuiltIn::Tanh,
        "floor" => BuiltIn::Floor,
        "mod" => BuiltIn::Mod,
        "sign" => BuiltIn::Sign,
        "min" => BuiltIn::Min,
        "max" => BuiltIn::Max,
        "clamp" => BuiltIn::Clamp,
        "dot" => BuiltIn::Dot,
        "cross" => BuiltIn::Cross,
        "rotate" => BuiltIn::Rotate,
        "unit_vector" => BuiltIn::Unit,
        "outside" => return Some(Action::Quantity(Quantity::Outside)),
        "clearance" => {
            return Some(Action::Of(|args| {
                <[Expr; 2]>::try_from(args).map(|pair| Kind::Clearance(Box::new(pair)))
            }));
        }
        "number" => {
            return Some(Action::Of(|args| {
                <[Expr; 1]>::try_from(args).map(|[of]| Kind::MemberNumber(Box::new(of)))
            }));
        }
        "duration" => {
            return Some(Action::Of(|args| {
                <[Expr; 1]>::try_from(args).map(|[of]| Kind::Duration(Box::new(of)))
            }));
        }
        "uniform" => return Some(Action::Draw(Draw::Uniform)),
        "normal" => return Some(Action::Draw(Draw::Normal)),
        "unit_disc" => return Some(Action::Draw(Draw::UnitDisc)),
        "linear" => return Some(Action::Schedule(Curve::Linear)),
        "cosine" => return Some(Action::Schedule(Curve::Cosine)),
        "geometric" => return Some(Action::Schedule(Curve::Geometric)),
        _ => return None,
    }))
}

pub const MISSING_VALUE: Code = Code {
    name: "missing-value",
    explain: "\
A parameter of a scenario needs a value to start from; `--set` changes it.

    param side : length         // wrong
    param side = 0.4 m          // right",
};

pub const UNKNOWN_OVERRIDE: Code = Code {
    name: "unknown-override",
    explain: "\
`--set NAME=VALUE` names something that is no `param` of the scenario. Only parameters can be set from outside.

    param side = 0.4 m
    mpgx run … --set side=0.5m      // right",
};

pub const NOT_PROVIDED: Code = Code {
    name: "not-provided",
    explain: "An `extern` function of the standard library has no implementation. This is a mistake in mpgx.",
};

pub const NOTHING_DRAWN: Code = Code {
    name: "nothing-drawn",
    explain: "\
`~` says that a value is drawn at random, but nothing after it is random.

    start ~ (0 m, 0 m)          // wrong
    start = (0 m, 0 m)          // right
    start ~ near((0 m, 0 m), 0.2 m)     // right",
};
