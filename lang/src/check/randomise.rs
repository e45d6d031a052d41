//! Parameters that are drawn anew for each episode.

use std::fmt::Display;

use super::declare::NOTHING_DRAWN;
use super::expr::{CIRCULAR, UNKNOWN_NAME};
use super::fits::{Wanted, What};
use super::settings::path_span;
use super::{Checker, Scope};
use crate::ast::{Assignment, Item, Span};
use crate::hir::{Bound, Draw, Expr, Kind, Randomised, Type};
use crate::plan::ParamId;
use crate::problem::Problem;
use crate::resolve::{Space, listed};

impl<'a> Checker<'a> {
    /// Which parameters are drawn, before any value is looked at.
    pub fn mark_randomised(&mut self) {
        for (_, item) in self.main_items() {
            let Item::Randomise(settings) = &item.node else { continue };
            for setting in settings {
                if let Some(param) = self.param_of(setting) {
                    self.randomised.entry(param).or_insert(path_span(&setting.path));
                }
            }
        }
    }

    fn param_of(&self, setting: &Assignment) -> Option<ParamId> {
        let [name] = setting.path.as_slice() else { return None };
        let entry = self.program.find(self.program.main, Space::Value, &name.node)?;
        self.ids.params.get(&entry.id).copied()
    }

    pub fn randomise(&mut self) {
        let mut drawn: Vec<ParamId> = Vec::new();
        for (_, item) in self.main_items() {
            let Item::Randomise(settings) = &item.node else { continue };
            for setting in settings {
                let span = path_span(&setting.path);
                let Some(param) = self.param_of(setting) else {
                    self.no_param(setting, span);
                    continue;
                };
                if drawn.contains(&param) {
                    let first = self.randomised.get(&param).copied().unwrap_or_default();
                    if let Some(name) = setting.path.last() {
                        self.given_twice(name, first);
                    }
                    continue;
                }
                drawn.push(param);
                let value = self.drawn_param(setting, param, &drawn);
                self.hir.world.randomise.push(Randomised { param, value, span });
            }
        }
    }

    fn drawn_param(&mut self, setting: &'a Assignment, id: ParamId, drawn: &[ParamId]) -> Expr {
        let Some(param) = self.hir.params.get(id) else { return Expr::poison(setting.value.span) };
        let (name, declared, dim) = (param.name.clone(), param.span, param.dim.clone());
        let mut scope = Scope::of(self.program.main);
        scope.draws = true;
        let value = self.expr(&mut scope, &setting.value);
        let random = scope.drawn && setting.random;
        if !(value.is_poison() || random) {
            let text = self.one_line(setting.value.span);
            let problem = Problem::error(&NOTHING_DRAWN, format!("`{name}` is not drawn here"));
            self.report(match scope.drawn {
                true => problem
                    .at(path_span(&setting.path), "`=` does not draw")
                    .help(format!("write `{name} ~ {text}`")),
                false => problem
                    .at(value.span, "nothing here is random")
                    .with(declared, "a fixed value stands here")
                    .help(format!("draw it, for example `{name} ~ uniform({text}, …)`")),
            });
            return Expr::poison(value.span);
        }
        let why = Wanted::declared(What::Name(&name), declared);
        let value = self.fits(value, &Type::Number(dim), &why, &[], &mut Default::default());
        self.drawn_before(&value, id, drawn);
        self.draw_in_range(&value, declared);
        value
    }

    /// A draw may refer to what is drawn above it.
    fn drawn_before(&mut self, value: &Expr, id: ParamId, drawn: &[ParamId]) {
        let Some((later, at)) = self.find_randomised(value, &|param| param != id && !drawn.contains(&param))
        else {
            return;
        };
        let name = |id: ParamId| self.hir.params.get(id).map_or("", |param| param.name.as_str());
        let problem = Problem::error(&CIRCULAR, format!("`{}` is not drawn yet here", name(later)))
            .at(at, format!("`{}` is drawn first", name(id)));
        let problem = match self.randomised.get(&later) {
            Some(span) => problem.with(*span, "drawn after it"),
            None => problem,
        };
        let help = format!("draw `{}` above `{}`", name(later), name(id));
        self.report(problem.help(help));
    }

    /// The ends of a uniform draw lie in the parameter's range.
    fn draw_in_range(&mut self, value: &Expr, declared: Span) {
        let Kind::Draw(Draw::Uniform, ends) = &value.kind else { return };
        let Some(bound) = self.hir.bounds.iter().find(|bound| bound.declared == declared).cloned() else {
            return;
        };
        let ends = ends.iter().map(|end| Bound { value: end.clone(), ..bound.clone() });
        self.hir.bounds.extend(ends.collect::<Vec<_>>());
    }

    fn no_param(&mut self, setting: &Assignment, span: Span) {
        let text = self.sources.text(span).to_owned();
        if setting
            .path
            .iter()
            .any(|name| self.program.is_unknown(self.program.main, Space::Value, &name.node))
        {
            return;
        }
        let params = || self.hir.params.iter().map(|param| param.name.as_str());
        let problem = Problem::error(&UNKNOWN_NAME, format!("there is no parameter `{text}`")).at(span, "");
        let help = match self.meant(&text, params()) {
            Some(meant) => format!("did you mean `{meant}`?"),
            None => match params().next() {
                None => format!("declare one and use it: `param {} = …`", text.replace('.', "_")),
                Some(_) => format!("parameters are drawn: there is {}", listed(params())),
            },
        };
        self.report(problem.help(help));
    }

    /// A parameter that is drawn for each episode and that an expression depends on, with its place in it.
    pub fn find_randomised(&self, expr: &Expr, which: &dyn Fn(ParamId) -> bool) -> Option<(ParamId, Span)> {
        if self.randomised.is_empty() {
            return None;
        }
        let mut found = None;
        expr.any_inside(&mut |part| {
            if let Kind::Param(id) = part.kind
                && self.randomised.contains_key(&id)
                && which(id)
            {
                found = Some((id, part.span));
            }
            found.is_some()
        });
        found
    }

    /// Reports a value that should be the same in all episodes and is not.
    pub fn changes_with_episodes(&mut self, expr: &Expr, what: &dyn Display) -> bool {
        let Some((id, found)) = self.find_randomised(expr, &|_| true) else { return false };
        let name = self.hir.params.get(id).map_or(String::new(), |param| param.name.clone());
        // Deep inside of what it refers to, its own place says more.
        let at = if within(found, expr.span) { found } else { expr.span };
        let problem =
            Problem::error(&super::value::NOT_CONSTANT, format!("{what} is the same in all episodes"))
                .at(at, format!("`{name}` changes from episode to episode"));
        let problem = match self.randomised.get(&id) {
            Some(drawn) => problem.with(*drawn, "drawn anew for each"),
            None => problem,
        };
        self.report(problem.help(format!("take `{name}` out of `randomise`, or use another parameter here")));
        true
    }
}

fn within(inner: Span, outer: Span) -> bool {
    inner.file == outer.file && outer.start <= inner.start && inner.end <= outer.end
}
