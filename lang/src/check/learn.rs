//! What learns, with which settings, and what it is compared with.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::fits::{Wanted, What};
use super::settings::MISSING;
use super::{Checker, Scope};
use crate::ast::{Assignment, Call, ExternDecl, Item, Name, Span};
use crate::dim::Substitution;
use crate::hir::{Expr, Extern, Kind, Method, Parameter, Type};
use crate::problem::{Code, Problem};
use crate::resolve::{ItemId, Space, listed};

/// Settings that `learn` chooses: those of the preset, then those of its block.
#[derive(Default)]
struct Chosen<'a> {
    /// The algorithms it is for, its settings, and its module.
    preset: Option<(&'a [Name], &'a [Assignment], usize)>,
    own: &'a [Assignment],
}

impl<'a> Checker<'a> {
    pub fn learning(&mut self) {
        self.program.written().for_each(|(id, item)| self.check_preset(id.module, &item.node));
        let main = self.program.main;
        let found = self.only("learn", |item| match item {
            Item::Learn { algorithm, preset, settings } => Some((algorithm, preset, settings)),
            _ => None,
        });
        let mut chosen = Chosen::default();
        match found {
            None => {
                let problem =
                    Problem::error(&MISSING, "nothing is learned").at(self.anywhere(), "no `learn` here");
                self.missing(problem.help("write for example `learn mpg with tuned { steps = 20000 }`"));
            }
            Some(((algorithm, preset, settings), _)) => {
                if let Some(id) = self.item_named(Space::Algorithm, algorithm) {
                    chosen.own = settings;
                    chosen.preset = preset.as_ref().and_then(|preset| self.preset(algorithm, preset));
                    self.known_settings(algorithm, id, settings, main);
                    let learner = self.method(&algorithm.node, algorithm.span, id, &chosen, None);
                    self.hir.learners.extend(learner);
                }
            }
        }
        let mut labels: BTreeMap<&str, Span> = BTreeMap::new();
        if let Some(((algorithm, ..), _)) = found {
            labels.insert(&algorithm.node, algorithm.span);
        }
        let compared = self.only("compare", |item| match item {
            Item::Compare(calls) => Some(calls),
            _ => None,
        });
        for call in compared.map(|(calls, _)| calls).into_iter().flatten() {
            let name = &call.node.name;
            if let Some(first) = labels.get(name.node.as_str()) {
                self.report(
                    Problem::error(&DUPLICATE_METHOD, format!("`{}` is compared already", name.node))
                        .at(name.span, "again here")
                        .with(*first, "first here"),
                );
                continue;
            }
            labels.insert(&name.node, name.span);
            if self.program.find(main, Space::Algorithm, &name.node).is_some() {
                let Some(id) = self.item_named(Space::Algorithm, name) else { continue };
                let learner = self.method(&name.node, name.span, id, &chosen, Some(&call.node));
                self.hir.learners.extend(learner);
            } else if self.program.find(main, Space::Controller, &name.node).is_some() {
                let Some(id) = self.item_named(Space::Controller, name) else { continue };
                let none = Chosen::default();
                let controller = self.method(&name.node, name.span, id, &none, Some(&call.node));
                self.hir.controllers.extend(controller);
            } else {
                self.unknown_method(name);
            }
        }
        self.seeds();
    }

    fn unknown_method(&mut self, name: &Name) {
        let main = self.program.main;
        let known: Vec<&str> = self
            .program
            .names(main, Space::Algorithm)
            .chain(self.program.names(main, Space::Controller))
            .collect();
        let problem = Problem::error(
            &super::expr::UNKNOWN_NAME,
            format!("there is no learning algorithm or controller `{}`", name.node),
        );
        let help = match self.meant(&name.node, known.iter().copied()) {
            Some(meant) => format!("did you mean `{meant}`?"),
            None => format!("there are {}", listed(known)),
        };
        self.report(problem.at(name.span, "").help(help));
    }

    fn seeds(&mut self) {
        let found = self.only("seeds", |item| match item {
            Item::Seeds(seeds) => Some(seeds),
            _ => None,
        });
        let Some((seeds, _)) = found else { return };
        let seeds =
            self.wanted(&mut Scope::of(self.program.main), seeds, &Type::Count, &Wanted::by("`seeds`"));
        if self.whole(&seeds, &"the number of seeds", 1.0).is_some_and(|seeds| seeds > 10_000) {
            let problem = Problem::error(&super::value::OUT_OF_RANGE, "there can be at most 10000 seeds");
            self.report(problem.at(seeds.span, ""));
        }
        self.hir.seeds = Some(seeds);
    }

    /// The parameters of an `extern`, with those of the one it is based on.
    pub fn signature(&mut self, id: ItemId) -> Option<Arc<[Parameter]>> {
        let Item::Extern(decl) = &self.program.item(id)?.node else { return None };
        if let Some(seen) = self.seen.externs.get(&id) {
            return Some(seen.clone());
        }
        self.seen.externs.insert(id, Arc::new([]));
        let params = match &decl.base {
            Some(base) => self.based_on(id, decl, base).unwrap_or_default(),
            None => {
                let mut scope = Scope::of(id.module);
                decl.params.iter().map(|param| self.parameter(&mut scope, param)).collect()
            }
        };
        let params: Arc<[Parameter]> = params.into();
        self.seen.externs.insert(id, params.clone());
        Some(params)
    }

    fn based_on(&mut self, id: ItemId, decl: &'a ExternDecl, base: &'a Call) -> Option<Vec<Parameter>> {
        let entry = self.program.find(id.module, Space::of(decl.kind), &base.name.node)?;
        let params = self.signature(entry.id)?;
        let mut scope = Scope::of(id.module);
        let args = self.bind(&mut scope, base, base.name.span, &params, (&[], &mut Substitution::default()));
        let changed = params.iter().zip(args);
        Some(changed.map(|(param, default)| Parameter { default: Some(default), ..param.clone() }).collect())
    }

    /// Every setting of a preset must be one of each algorithm it is for.
    pub fn check_preset(&mut self, module: usize, item: &'a Item) {
        let Item::Preset { for_, settings, .. } = item else { return };
        for algorithm in for_ {
            match self.find(module, Space::Algorithm, &algorithm.node) {
                Some(entry) => self.known_settings(algorithm, entry.id, settings, module),
                None => drop(self.item_named(Space::Algorithm, algorithm)),
            }
        }
    }

    fn preset(&mut self, algorithm: &Name, preset: &Name) -> Option<(&'a [Name], &'a [Assignment], usize)> {
        let id = self.item_named(Space::Preset, preset)?;
        let Item::Preset { for_, settings, name, .. } = &self.program.item(id)?.node else { return None };
        if !for_.iter().any(|fits| fits.node == algorithm.node) {
            let problem = Problem::error(
                &PRESET_MISMATCH,
                format!("the preset `{}` is not for `{}`", preset.node, algorithm.node),
            )
            .at(preset.span, "")
            .with(name.span, format!("for {}", listed(for_.iter().map(|name| name.node.as_str()))));
            let main = self.program.main;
            let fitting: Vec<&str> = self
                .program
                .names(main, Space::Preset)
                .filter(|preset| self.preset_fits(preset, &algorithm.node))
                .collect();
            self.report(match fitting.is_empty() {
                true => problem.help(format!("there is none for `{}`: leave it out", algorithm.node)),
                false => problem.help(format!("for `{}` there is {}", algorithm.node, listed(fitting))),
            });
            return None;
        }
        Some((for_, settings, id.module))
    }

    fn preset_fits(&self, preset: &str, algorithm: &str) -> bool {
        let entry = self.program.find(self.program.main, Space::Preset, preset);
        let item = entry.and_then(|entry| self.program.item(entry.id));
        matches!(item.map(|item| &item.node), Some(Item::Preset { for_, .. })
            if for_.iter().any(|fits| fits.node == algorithm))
    }

    fn known_settings(&mut self, algorithm: &Name, id: ItemId, settings: &'a [Assignment], module: usize) {
        let Some(params) = self.signature(id) else { return };
        let names: Vec<&str> = params.iter().map(|param| param.name.as_str()).collect();
        let known = self.settings(&format!("`{}`", algorithm.node), settings, &names);
        for (name, setting) in known {
            if let Some(param) = params.iter().find(|param| param.name == name) {
                self.setting(setting, param, module);
            }
        }
    }

    /// A method with all its settings: declared, of the preset, of `learn`, of its own arguments; the last counts.
    fn method(
        &mut self,
        label: &str,
        span: Span,
        id: ItemId,
        chosen: &Chosen<'a>,
        call: Option<&'a Call>,
    ) -> Option<Method> {
        let mut params = self.signature(id)?.to_vec();
        let preset = chosen.preset.filter(|(for_, ..)| for_.iter().any(|name| name.node == label));
        let preset =
            preset.into_iter().flat_map(|(_, settings, module)| settings.iter().map(move |s| (s, module)));
        for (setting, module) in preset.chain(chosen.own.iter().map(|setting| (setting, self.program.main))) {
            if let [name] = setting.path.as_slice()
                && let Some(param) = params.iter_mut().find(|param| param.name == name.node)
            {
                param.default = Some(self.setting(setting, param, module).shared());
            }
        }
        let args = match call {
            Some(call) => {
                let mut scope = Scope::of(self.program.main);
                self.bind(&mut scope, call, span, &params, (&[], &mut Substitution::default()))
            }
            None => {
                let missing = params.iter().find(|param| param.default.is_none());
                if let Some(param) = missing {
                    let problem =
                        Problem::error(&MISSING, format!("`{label}` needs a value for `{}`", param.name));
                    let help = format!("write `learn {label} {{ {} = … }}`", param.name);
                    self.report(
                        problem.at(span, "").with(param.span, "declared without a default").help(help),
                    );
                }
                params
                    .iter()
                    .map(|param| param.default.clone().unwrap_or_else(|| Expr::poison(span)))
                    .collect()
            }
        };
        for (param, value) in params.iter().zip(&args) {
            if !matches!(value.kind, Kind::Number(_)) {
                self.constant_setting(value, &What::Name(&param.name));
            }
        }
        let settings = params.into_iter().map(|param| param.name).zip(args).collect();
        Some(Method { label: label.to_owned(), what: Extern { name: label.to_owned(), settings }, span })
    }
}

pub const PRESET_MISMATCH: Code = Code {
    name: "preset-mismatch",
    explain: "\
A preset is for the algorithms that its declaration lists.

    preset quick for td3 { steps = 1000 }
    learn mpg with quick        // wrong
    learn td3 with quick        // right",
};

pub const DUPLICATE_METHOD: Code = Code {
    name: "duplicate-method",
    explain: "\
A method appears once in a study: in `learn`, or in `compare`.

    learn mpg
    compare { td3, mpg }        // wrong: mpg is there already
    compare { td3 }             // right",
};
