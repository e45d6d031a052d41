//! Blocks of settings, and items that stand once in a scenario.

use std::collections::BTreeMap;

use super::call::MISPLACED_DRAW;
use super::fits::{Wanted, What};
use super::{Checker, Scope};
use crate::ast::{Assignment, Item, Name, Span};
use crate::hir::{Expr, Parameter, Type};
use crate::problem::{Code, Problem};
use crate::resolve::listed;

impl<'a> Checker<'a> {
    /// The only item of a kind; others of the kind are reported.
    pub fn only<T>(&mut self, what: &str, pick: impl Fn(&'a Item) -> Option<T>) -> Option<(T, Span)> {
        let mut found = self.main_items().filter_map(|(_, item)| Some((pick(&item.node)?, item.span)));
        let first = found.next()?;
        let others: Vec<Span> = found.map(|(_, span)| span).collect();
        for other in others {
            self.report(
                Problem::error(&GIVEN_TWICE, format!("a scenario has one `{what}`"))
                    .at(other, "a second one")
                    .with(first.1, "the first"),
            );
        }
        Some(first)
    }

    /// Reports what the scenario as a whole lacks, unless it may stand in an item with a syntax error.
    pub fn missing(&mut self, problem: Problem) {
        if self.program.main().is_some_and(|main| !main.broken) {
            self.report(problem);
        }
    }

    /// Where to point at when something is missing in the scenario as a whole.
    pub fn anywhere(&self) -> Span {
        let named = self.main_items().find_map(|(_, item)| match &item.node {
            Item::Scenario(name) => Some(name.span),
            _ => None,
        });
        named.or_else(|| self.main_items().next().map(|(_, item)| item.span)).unwrap_or_default()
    }

    /// Each setting of a block by its name, which must be one of those known.
    /// A misspelt one is taken for what was likely meant, so that this is not reported as missing.
    pub fn settings<'k>(
        &mut self,
        of: &str,
        all: &'a [Assignment],
        known: &[&'k str],
    ) -> BTreeMap<&'k str, &'a Assignment> {
        let mut found: BTreeMap<&str, &Assignment> = BTreeMap::new();
        let key = |name: &str| known.iter().copied().find(|known| *known == name);
        for setting in all {
            let [name] = setting.path.as_slice() else {
                let span = path_span(&setting.path);
                let text = self.sources.text(span).to_owned();
                self.report(
                    Problem::error(&UNKNOWN_SETTING, format!("{of} has no setting `{text}`"))
                        .at(span, "")
                        .help("a setting has a simple name here"),
                );
                continue;
            };
            match key(&name.node) {
                None => {
                    self.unknown_setting(of, name, known);
                    let meant = self.meant(&name.node, known.iter().copied());
                    if let Some(meant) = meant.and_then(|meant| key(&meant)) {
                        found.entry(meant).or_insert(setting);
                    }
                }
                Some(known) => match found.get(known).map(|first| path_span(&first.path)) {
                    Some(first) => self.given_twice(name, first),
                    None => drop(found.insert(known, setting)),
                },
            }
        }
        found
    }

    pub fn unknown_setting(&mut self, of: &str, name: &Name, known: &[&str]) {
        let problem = Problem::error(&UNKNOWN_SETTING, format!("{of} has no setting `{}`", name.node))
            .at(name.span, "");
        self.report(problem.help(match self.meant(&name.node, known.iter().copied()) {
            Some(meant) => format!("did you mean `{meant}`?"),
            None => format!("it has {}", listed(known.iter().copied())),
        }));
    }

    pub fn given_twice(&mut self, name: &Name, first: Span) {
        self.report(
            Problem::error(&GIVEN_TWICE, format!("`{}` is set twice", name.node))
                .at(name.span, "again here")
                .with(first, "first set here"),
        );
    }

    /// The value of a setting that is not drawn.
    pub fn fixed(&mut self, setting: &'a Assignment, type_: &Type) -> Expr {
        let Some(name) = setting.path.last() else { return Expr::poison(setting.value.span) };
        self.undrawn(setting);
        let mut scope = Scope { draws: setting.random, ..Scope::of(self.program.main) };
        let value = self.wanted(&mut scope, &setting.value, type_, &Wanted::by(What::Name(&name.node)));
        if setting.random { Expr::poison(value.span) } else { value }
    }

    /// Refuses `~`.
    pub fn undrawn(&mut self, setting: &'a Assignment) {
        if setting.random {
            let path = path_span(&setting.path);
            let name = self.sources.text(path);
            let problem = Problem::error(&MISPLACED_DRAW, format!("`{name}` is not drawn"))
                .at(path, "the same in all episodes")
                .help(format!("give it a fixed value: `{name} = …`"));
            self.report(problem);
        }
    }

    /// A value for a parameter of something that Rust provides.
    pub fn setting(&mut self, setting: &'a Assignment, param: &Parameter, module: usize) -> Expr {
        self.undrawn(setting);
        let mut scope = Scope { draws: setting.random, ..Scope::of(module) };
        let why = Wanted::declared(What::Name(&param.name), param.span);
        let value = self.wanted(&mut scope, &setting.value, &param.type_, &why);
        if setting.random {
            return Expr::poison(value.span);
        }
        self.bound(param, &value);
        value
    }
}

/// All of `a.b.c`.
pub fn path_span(path: &[Name]) -> Span {
    match (path.first(), path.last()) {
        (Some(first), Some(last)) => first.span.to(last.span),
        _ => Span::default(),
    }
}

pub const UNKNOWN_SETTING: Code = Code {
    name: "unknown-setting",
    explain: "\
A block sets something that does not exist there.

    world { dt = 0.1 s, horizen = 200 steps }       // wrong
    world { dt = 0.1 s, horizon = 200 steps }       // right",
};

pub const GIVEN_TWICE: Code = Code {
    name: "given-twice",
    explain: "\
Something that can be said once is said twice, and the two may differ.

    world { dt = 0.1 s, dt = 0.2 s }        // wrong",
};

pub const MISSING: Code = Code {
    name: "missing",
    explain: "\
A scenario needs a name, `world` with `dt`, at least one group with `control = learned`, `observe`, `reward` and
`learn`. Each group needs `speed`, something that moves it, and a `start`, unless its motion gives positions.",
};
