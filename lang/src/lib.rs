//! The scenario language of mpgx: source text in, a [`plan::Plan`] and [`problem::Problems`] out.
//!
//! No IO, no threads, no clock. One pass a module, each a verb that returns the noun it makes:
//!
//! ```text
//! .scn text ──parse──▶ Ast ──resolve──▶ Program ──check──▶ Hir ──lower──▶ Plan ──analyse──▶ Analysis
//! ```

// What pest derives names it.
extern crate alloc;

pub mod analyse;
pub mod ast;
mod case;
mod change;
pub mod check;
pub mod codes;
mod constant;
pub mod describe;
pub mod diff;
pub mod dim;
pub mod document;
pub mod format;
pub mod hash;
pub mod hir;
mod inline;
pub mod lower;
pub mod parse;
pub mod plan;
pub mod print;
pub mod problem;
pub mod recording;
pub mod render;
pub mod resolve;
pub mod source;
pub mod stdlib;

pub use hash::meaning_hash;

/// `--set NAME=VALUE`: another value for a `param`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Override {
    pub name: String,
    /// As it would stand in the scenario: `0.5m`.
    pub value: String,
}

/// What came of a compilation.
pub struct Compilation {
    /// The scenario first.
    pub sources: source::Sources,
    pub problems: problem::Problems,
    /// As far as no problem was found.
    pub hir: hir::Hir,
    pub units: check::units::Units,
    /// `None` if there are errors.
    pub plan: Option<plan::Plan>,
    /// Empty without a Plan.
    pub analysis: analyse::Analysis,
}

/// Compiles a scenario. `name` is what problems call its file; `loader` finds the files it uses.
pub fn compile(name: &str, text: String, overrides: &[Override], loader: &dyn source::Loader) -> Compilation {
    let mut sources = source::Sources::default();
    let mut problems = problem::Problems::default();

    let file = sources.add(name, text);
    let main = parse::parse(&sources, file, &mut problems);
    let overrides = parse_overrides(overrides, &mut sources, &mut problems);
    let program = resolve::resolve(main, loader, &mut sources, &mut problems);
    let (hir, units) = check::check(&program, &overrides, &sources, &mut problems);
    let plan = match problems.has_errors() {
        true => None,
        false => lower::lower(&hir, &units, &sources, &mut problems),
    };
    let analysis = match &plan {
        Some(plan) => analyse::analyse(plan, &hir, &units, &mut problems),
        None => analyse::Analysis::default(),
    };
    let plan = plan.filter(|_| !problems.has_errors());
    Compilation { sources, problems, hir, units, plan, analysis }
}

/// Each override is read like a `param` of a file of its own, so that problems can show it.
fn parse_overrides(
    overrides: &[Override],
    sources: &mut source::Sources,
    problems: &mut problem::Problems,
) -> Vec<check::Override> {
    let mut parsed = Vec::new();
    for Override { name, value } in overrides {
        let file = sources.add(&format!("--set {name}"), format!("param {name} = {value}"));
        let mut items = parse::parse(sources, file, problems).items.into_iter();
        match (items.next().map(|item| item.node), items.next()) {
            (
                Some(ast::Item::Param(ast::Parameter { name, default: Some(value), range: None, .. })),
                None,
            ) => {
                parsed.push(check::Override { name, value });
            }
            (None, _) => {}
            _ => {
                let all = ast::Span { file, start: 0, end: sources.file(file).text.len() };
                problems.push(
                    problem::Problem::error(
                        &check::declare::UNKNOWN_OVERRIDE,
                        "this does not set a parameter",
                    )
                    .at(all, "")
                    .help("write a name and a value: `--set side=0.5m`"),
                );
            }
        }
    }
    parsed
}
