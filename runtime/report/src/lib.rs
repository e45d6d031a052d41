//! The report of a study: one HTML file that opens from disk, loads nothing and runs no string of a scenario.
//!
//! A report is a function of data: the Plan, its source, the records and their summary. Equal input gives
//! equal bytes. Each part of the page is a panel, registered in `panels.rs`.

use std::collections::BTreeMap;

use minijinja::value::Serde;
use minijinja::{Environment, UndefinedBehavior, Value, context};
use mpgx_lang::plan::Plan;
use mpgx_study::record::{CellRecord, Timing};
use mpgx_study::summary::Summary;
use serde::{Deserialize, Serialize};

mod band;
mod compare;
mod grid;
mod import;
mod lines;
mod panels;
pub mod picture;
mod profile;
mod strips;
mod suite;
mod svg;
mod symbols;
mod tables;
mod text;
mod tracks;
mod view;

pub use compare::{Compared, Side, compare_html};
pub use import::import_html;
pub use suite::{Member, suite_html};
pub use tables::{Document, compare_tables, study_tables, suite_tables};

use panels::{Content, PANELS};
use view::View;

/// What a report is made of.
pub struct Input<'a> {
    pub plan: &'a Plan,
    /// Name and text of each file of the scenario, the scenario itself first.
    pub source: &'a [(String, String)],
    /// By cell.
    pub records: &'a BTreeMap<String, CellRecord>,
    /// By cell.
    pub timings: &'a BTreeMap<String, Timing>,
    pub summary: &'a Summary,
    pub provenance: Provenance,
}

/// How the study was made, as text for people: all that may differ between two equal studies.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Provenance {
    pub command: String,
    pub cpu: String,
    pub threads: String,
    pub duration: String,
}

#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// A template and its panel disagree; no input leads here.
    #[error("cannot fill in the template of panel `{panel}`: {source}")]
    Template { panel: &'static str, source: minijinja::Error },
    #[error("cannot embed the data of panel `{panel}`: {source}")]
    Data { panel: &'static str, source: serde_json::Error },
}

/// A panel on its way to the page.
#[derive(Serialize)]
struct Section {
    id: &'static str,
    title: &'static str,
    body: Value,
    data: Option<Value>,
    script: Option<Value>,
}

impl Section {
    /// Without data and script.
    fn still(id: &'static str, title: &'static str, body: String) -> Section {
        Section { id, title, body: Value::from_safe_string(body), data: None, script: None }
    }
}

/// What every page has.
struct Page<'a> {
    name: &'a str,
    about: &'a str,
    version: &'a str,
    sections: &'a [Section],
}

/// The page as HTML text.
///
/// # Errors
/// [`ReportError`], if a template does not fit its panel.
pub fn html(input: &Input) -> Result<String, ReportError> {
    let view = View::new(input);
    let mut sections = Vec::new();
    for panel in PANELS {
        let Some(Content { context, data }) = (panel.content)(&view) else { continue };
        let data = data
            .map(|data| embed(&data))
            .transpose()
            .map_err(|source| ReportError::Data { panel: panel.id, source })?;
        let script = panel.script.map(|script| Value::from_safe_string(script.into()));
        let body = render(panel.id, panel.template, context)?;
        sections.push(Section { data, script, ..Section::still(panel.id, panel.title, body) });
    }
    page(&Page {
        name: &input.plan.name,
        about: input.plan.doc.trim(),
        version: &input.summary.version,
        sections: &sections,
    })
}

fn page(page: &Page) -> Result<String, ReportError> {
    let context = context! {
        scenario => page.name,
        doc => page.about,
        version => page.version,
        style => Value::from_safe_string(include_str!("style.css").into()),
        script => Value::from_safe_string(include_str!("page.js").into()),
        sections => Serde(page.sections),
    };
    render("page", include_str!("page.html"), context)
}

/// Fills a template in; everything in the context is escaped.
fn render(panel: &'static str, template: &str, context: Value) -> Result<String, ReportError> {
    let mut environment = Environment::new();
    environment.set_undefined_behavior(UndefinedBehavior::Strict);
    let shared = [
        ("lines.html", include_str!("lines.html")),
        ("profile.html", include_str!("profile.html")),
        ("strips.html", include_str!("strips.html")),
    ];
    let filled = shared
        .into_iter()
        .try_for_each(|(name, figure)| environment.add_template(name, figure))
        .and_then(|()| environment.render_named_str("panel.html", template, context));
    filled.map_err(|source| ReportError::Template { panel, source })
}

/// JSON that is safe inside a script element: nothing in it can end the element.
fn embed(data: &serde_json::Value) -> Result<Value, serde_json::Error> {
    let text = serde_json::to_string(data)?;
    Ok(Value::from_safe_string(text.replace('<', "\\u003c").replace('>', "\\u003e").replace('&', "\\u0026")))
}
