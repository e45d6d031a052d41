//! Calls: which argument belongs to which parameter, functions and draws.

use std::sync::Arc;

use super::fits::{Wanted, What};
use super::{Checker, Scope};
use crate::ast::{Argument, Call, Item, Span};
use crate::dim::{Dim, Substitution};
use crate::hir::{self, Bound, Draw, Expr, Kind, Parameter, Type};
use crate::plan::{Curve, Function as BuiltIn, Quantity};
use crate::problem::{Code, Problem};
use crate::resolve::{Space, listed};

/// A function or distribution as its callers see it.
pub struct Callable {
    pub generics: Vec<String>,
    pub params: Vec<Parameter>,
    pub result: Type,
    pub random: bool,
    pub action: Action,
}

pub enum Action {
    BuiltIn(BuiltIn),
    /// A quantity of the agent that is the only argument.
    Quantity(Quantity),
    Draw(Draw),
    /// An expression of its own, made of the arguments.
    Of(fn(Vec<Expr>) -> Result<Kind, Vec<Expr>>),
    Schedule(Curve),
    Body(Arc<hir::Function>),
    /// A problem was reported.
    Poison,
}

impl<'a> Checker<'a> {
    pub fn call(&mut self, scope: &mut Scope, call: &'a Call, at: Span) -> Expr {
        let name = call.name.node.as_str();
        match name {
            "box" => return self.area(scope, call, at),
            "size" => return self.size(scope, call, at),
            "pairs" | "edges" | "nearest" | "members" => return self.set_alone(name, at),
            _ => {}
        }
        let Some(entry) = self.find(scope.module, Space::Value, name) else {
            let problem = self.unknown_function(scope, call);
            return self.poison(at, problem);
        };
        let Some(item) = self.program.item(entry.id) else { return Expr::poison(at) };
        if !matches!(item.node, Item::Function(_)) {
            let problem = Problem::error(&super::expr::WRONG_KIND, format!("`{name}` is not a function"))
                .at(call.name.span, "called here")
                .with(entry.at, "declared here")
                .help(format!("without arguments: `{name}`"));
            return self.poison(at, problem);
        }
        let Some(function) = self.callable(entry.id) else {
            let problem = Problem::error(&super::expr::CIRCULAR, format!("`{name}` calls itself"))
                .at(call.name.span, "this call closes the circle")
                .help("functions are replaced by their bodies, so none can call itself");
            return self.poison(at, problem);
        };
        if function.random && !scope.draws {
            return self.misplaced_draw(scope, call, at);
        }
        scope.drawn |= function.random;
        let mut solved = Substitution::default();
        let inlined = matches!(function.action, Action::Body(_));
        let outer = (scope.draws, scope.target.take());
        scope.draws &= !inlined;
        let args = self.bind(scope, call, at, &function.params, (&function.generics, &mut solved));
        (scope.draws, scope.target) = outer;
        if args.iter().any(Expr::is_poison) {
            return Expr::poison(at);
        }
        let result = match &function.result {
            Type::Number(dim) => solved.apply(dim, &function.generics).map(Type::Number),
            Type::Vector(dim) => solved.apply(dim, &function.generics).map(Type::Vector),
            other => Some(other.clone()),
        };
        let Some(result) = result else { return Expr::poison(at) };
        let kind = match &function.action {
            Action::BuiltIn(built_in) => Kind::BuiltIn(*built_in, args),
            Action::Draw(draw) => Kind::Draw(*draw, args),
            Action::Schedule(curve) => {
                self.schedule(*curve, &args);
                Kind::Schedule(*curve, args)
            }
            Action::Body(body) => Kind::Call(body.clone(), args),
            Action::Of(make) => match make(args) {
                Ok(kind) => kind,
                Err(_) => return Expr::poison(at),
            },
            Action::Quantity(quantity) => match args.into_iter().next() {
                Some(agent) => Kind::Agent(*quantity, Box::new(agent)),
                None => return Expr::poison(at),
            },
            Action::Poison => return Expr::poison(at),
        };
        self.make(kind, result, at)
    }

    fn unknown_function(&self, scope: &Scope, call: &Call) -> Problem {
        let name = call.name.node.as_str();
        let problem =
            Problem::error(&super::expr::UNKNOWN_NAME, format!("there is no function `{name}` here"))
                .at(call.name.span, "");
        for (space, how) in [
            (Space::Motion, format!("a group uses it as `motion = {name}(…)`")),
            (Space::Shape, format!("use it as `formation F of … = {name}(…) about …`")),
            (Space::Body, format!("a group has it after its name: `agents robot[3] : {name}(…) {{ … }}`")),
        ] {
            if self.program.find(scope.module, space, name).is_some() {
                return problem.note(format!("`{name}` is {}", space.people())).help(how);
            }
        }
        let known = self.program.names(scope.module, Space::Value);
        let functions = known.filter(|known| {
            let entry = self.program.find(scope.module, Space::Value, known);
            let item = entry.and_then(|entry| self.program.item(entry.id));
            item.is_some_and(|item| matches!(item.node, Item::Function(_)))
        });
        match (self.meant(name, functions), crate::stdlib::home(name, Some(Space::Value))) {
            (Some(meant), _) => problem.help(format!("did you mean `{meant}`?")),
            (None, Some(path)) => problem.help(format!("the standard library has one: `use {path}.{name}`")),
            (None, None) => problem,
        }
    }

    fn misplaced_draw(&mut self, scope: &mut Scope, call: &Call, at: Span) -> Expr {
        let name = &call.name.node;
        scope.drawn = true;
        let problem = Problem::error(&MISPLACED_DRAW, format!("`{name}` is random"));
        let problem = match &scope.target {
            Some(target) => problem
                .at(at, "`=` does not draw")
                .help(format!("write `{target} ~ {}`", self.sources.text(at))),
            None => problem
                .at(at, "nothing can be drawn here")
                .help("draw after `~`: in a `start`, in the `state`, `next` or `velocity` of a motion, or in a `dist`"),
        };
        let problem = match self.sources.sign_before('=', at).filter(|_| scope.target.is_some()) {
            Some(sign) => problem.fix(sign, "~"),
            None => problem,
        };
        self.poison(at, problem)
    }

    /// `size(follower)`, `size(points)`
    fn size(&mut self, scope: &mut Scope, call: &'a Call, at: Span) -> Expr {
        let [argument] = call.args.as_slice() else {
            let problem = Problem::error(&BAD_ARGUMENTS, "`size` takes one group or list");
            return self.poison(at, problem.at(at, "").help("write for example `size(follower)`"));
        };
        let of = match self.group_value(scope, &argument.value) {
            Some(group) => group,
            None => self.expr(scope, &argument.value),
        };
        match &of.type_ {
            Type::Poison => Expr::poison(at),
            Type::Group | Type::List(_) => self.make(Kind::Size(Box::new(of)), Type::Number(Dim::none()), at),
            other => {
                let have = self.describe(other);
                let problem = Problem::error(
                    &super::fits::TYPE_MISMATCH,
                    format!("`size` is taken of a group or a list, not of {have}"),
                );
                self.poison(at, problem.at(of.span, format!("this is {have}")))
            }
        }
    }

    fn set_alone(&mut self, name: &str, at: Span) -> Expr {
        let problem = Problem::error(&super::expr::WRONG_KIND, format!("`{name}(…)` is a set, not a value"));
        let text = self.sources.text(at).to_owned();
        self.poison(at, problem.at(at, "").help(format!("run over it: `sum(… in {text}) …`")))
    }

    /// `box(low .. high, low .. high)`
    fn area(&mut self, scope: &mut Scope, call: &'a Call, at: Span) -> Expr {
        let length = self.units.base("length");
        let parameter = |name: &str| Parameter {
            name: name.to_owned(),
            doc: String::new(),
            type_: Type::Range(length.clone()),
            default: None,
            range: None,
            span: call.name.span,
        };
        let params = [parameter("x"), parameter("y")];
        let args = self.bind(scope, call, at, &params, (&[], &mut Substitution::default()));
        match <[Expr; 2]>::try_from(args) {
            Ok([x, y]) if !x.is_poison() && !y.is_poison() => {
                self.make(Kind::Area(Box::new(x), Box::new(y)), Type::Area, at)
            }
            _ => Expr::poison(at),
        }
    }

    /// The arguments of a call in the order of the parameters; poison for those that are missing.
    pub fn bind(
        &mut self,
        scope: &mut Scope,
        call: &'a Call,
        at: Span,
        params: &[Parameter],
        (generics, solved): (&[String], &mut Substitution),
    ) -> Vec<Expr> {
        let what = &call.name.node;
        let mut given: Vec<Option<(Span, Expr)>> = vec![None; params.len()];
        let mut position = 0;
        for argument in &call.args {
            let Some(number) = self.parameter_of(what, argument, params, &mut position) else {
                // Its own problems count, too.
                self.expr(scope, &argument.value);
                continue;
            };
            let Some(param) = params.get(number) else { continue };
            let why = self.argument_wanted(call, param, params, &given);
            let value = self.wanted_generic(scope, &argument.value, &param.type_, &why, generics, solved);
            if let Some((first, _)) = given.get(number).and_then(Option::as_ref) {
                let again = argument.name.as_ref().map_or(argument.value.span, |name| name.span);
                self.problems.push(
                    Problem::error(&BAD_ARGUMENTS, format!("`{}` of `{what}` is given twice", param.name))
                        .at(again, "again here")
                        .with(*first, "first given here"),
                );
                continue;
            }
            self.bound(param, &value);
            if let Some(place) = given.get_mut(number) {
                *place = Some((argument.value.span, value));
            }
        }
        let missing: Vec<&Parameter> = params
            .iter()
            .zip(&given)
            .filter(|(param, given)| given.is_none() && param.default.is_none())
            .map(|(param, _)| param)
            .collect();
        if let [first, ..] = missing.as_slice() {
            let names = listed(missing.iter().map(|param| param.name.as_str()));
            let problem = Problem::error(&BAD_ARGUMENTS, format!("`{what}` needs {names}")).at(
                at,
                format!("{} missing", if missing.len() == 1 { "one argument is" } else { "arguments are" }),
            );
            let problem = match self.shown(first.span, call) {
                Some(declared) => problem.with(declared, "declared here without a default"),
                None => problem,
            };
            let example = params.iter().map(|param| format!("{} = …", param.name)).collect::<Vec<_>>();
            self.report(problem.help(format!("write `{what}({})`", example.join(", "))));
        }
        let filled = params.iter().zip(given).map(|(param, given)| match given {
            Some((_, value)) => value,
            None => param.default.clone().unwrap_or_else(|| Expr::poison(at)),
        });
        filled.collect()
    }

    /// Where the type of an argument comes from: its declaration, or an argument that fixed the dimension before.
    fn argument_wanted<'p>(
        &self,
        call: &Call,
        param: &'p Parameter,
        params: &[Parameter],
        given: &[Option<(Span, Expr)>],
    ) -> Wanted<'p> {
        let what = What::Name(&param.name);
        let generic = |dim: &Dim| dim.factors().any(|(base, _)| self.units.base(base).is_none());
        let earlier =
            params.iter().zip(given).find(|(other, given)| given.is_some() && other.type_ == param.type_);
        match (&param.type_, earlier) {
            (Type::Number(dim) | Type::Vector(dim), Some((_, Some((span, _))))) if generic(dim) => {
                Wanted::like(what, *span)
            }
            _ => match self.shown(param.span, call) {
                Some(declared) => Wanted::declared(what, declared),
                None => Wanted::by(what),
            },
        }
    }

    /// Where a parameter is declared, if that is not the call itself.
    fn shown(&self, declared: Span, call: &Call) -> Option<Span> {
        (declared != call.name.span).then_some(declared)
    }

    fn parameter_of(
        &mut self,
        what: &str,
        argument: &Argument,
        params: &[Parameter],
        position: &mut usize,
    ) -> Option<usize> {
        let names = || params.iter().map(|param| param.name.as_str());
        let problem = match &argument.name {
            Some(name) => {
                if let Some(number) = params.iter().position(|param| param.name == name.node) {
                    return Some(number);
                }
                let problem = Problem::error(&BAD_ARGUMENTS, format!("`{what}` has no `{}`", name.node))
                    .at(name.span, "");
                match (self.meant(&name.node, names()), params) {
                    (Some(meant), _) => problem.help(format!("did you mean `{meant}`?")),
                    (None, []) => problem.help(format!("`{what}` takes no arguments")),
                    (None, _) => problem.help(format!("it has {}", listed(names()))),
                }
            }
            None => {
                *position += 1;
                if *position <= params.len() {
                    return Some(*position - 1);
                }
                Problem::error(&BAD_ARGUMENTS, format!("too many arguments for `{what}`"))
                    .at(argument.value.span, "this one is too many")
                    .help(match params {
                        [] => format!("`{what}` takes none"),
                        _ => format!("it takes {}", listed(names())),
                    })
            }
        };
        self.report(problem);
        None
    }

    /// Remembers that a value must lie in its parameter's range.
    pub fn bound(&mut self, param: &Parameter, value: &Expr) {
        if let Kind::Schedule(_, parts) = &value.kind {
            parts.iter().take(2).for_each(|end| self.bound(param, end));
            return;
        }
        let whole = param.type_ == Type::Count;
        if (whole || param.range.is_some()) && !value.is_poison() {
            self.hir.bounds.push(Bound {
                name: param.name.clone(),
                value: value.clone(),
                range: param.range.clone(),
                whole,
                declared: param.span,
            });
        }
    }
}

pub const MISPLACED_DRAW: Code = Code {
    name: "misplaced-draw",
    explain: "\
`~` draws a value at random, `=` does not. A random thing can stand only after `~`, so that a reader sees at once
what is random.

    start = near(F[i], 0.2 m)       // wrong
    start ~ near(F[i], 0.2 m)       // right

An argument of a function is fixed as well: it may be used more than once inside.",
};

pub const BAD_ARGUMENTS: Code = Code {
    name: "bad-arguments",
    explain: "\
A call does not fit its declaration: an argument is missing, unknown, given twice, or there are too many.
Arguments go by position or by name; those with a default may be left out.

    motion = circle(radus = 0.6 m)      // wrong
    motion = circle(radius = 0.6 m)     // right
    motion = circle(0.6 m)              // right",
};
