//! Where the value of a setting comes from: a line of the scenario, a preset of the standard library, or the
//! default of the declaration.

use std::collections::BTreeMap;

use mpgx_lang::source::Loader;
use serde::Serialize;

use crate::view::View;

/// In words: `line 48`, `tuned`, `default`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Origin {
    pub text: String,
    pub link: Option<String>,
}

/// Of each setting of each learner, by label and name, read from the source that the study keeps. Empty where that
/// no longer means the same.
pub fn origins(view: &View) -> BTreeMap<(String, String), Origin> {
    let Some((main, text)) = view.input.source.first() else { return BTreeMap::new() };
    let compilation = mpgx_lang::compile(main, text.clone(), &[], &Files(view.input.source));
    let same = compilation.plan.is_some_and(|plan| {
        let settings = |methods: &[mpgx_lang::plan::Method]| {
            methods.iter().map(|it| (it.label.clone(), it.what.settings.clone())).collect::<Vec<_>>()
        };
        settings(&plan.learners) == settings(&view.input.plan.learners)
    });
    if !same {
        return BTreeMap::new();
    }
    let origin = |span: mpgx_lang::ast::Span| {
        let file = compilation.sources.file(span.file);
        let line = file.line_column(span.start).0;
        if view.input.source.iter().any(|(name, _)| *name == file.name) {
            return Origin { text: format!("line {line}"), link: view.source_link(&file.name, line) };
        }
        let before = file.text.get(..span.start).unwrap_or_default();
        let declaration =
            before.lines().rev().find(|line| line.starts_with("preset ") || line.starts_with("extern "));
        let preset = declaration.and_then(|line| line.strip_prefix("preset "));
        let name = |rest: &str| rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
        Origin { text: preset.map_or_else(|| "default".into(), name), link: None }
    };
    let learners = compilation.hir.learners.iter();
    let settings = learners.flat_map(|learner| {
        let all = learner.what.settings.iter();
        all.map(|(name, value)| ((learner.label.clone(), name.clone()), origin(value.span)))
    });
    settings.collect()
}

/// The files of the study.
struct Files<'a>(&'a [(String, String)]);

impl Loader for Files<'_> {
    fn load(&self, path: &str) -> Result<String, String> {
        let found = self.0.iter().find(|(name, _)| name == path);
        found.map(|(_, text)| text.clone()).ok_or_else(|| format!("`{path}` is not kept"))
    }
}
