//! The report of a study: one HTML file that opens from disk, loads nothing and runs no string of a scenario.
//!
//! A report is a function of data: the Plan, its source, the records and their summary. Equal input gives
//! equal bytes. Each part of the page is a panel, registered in `panels.rs`.

use std::collections::BTreeMap;

use minijinja::value::Serde;
use minijinja::{Environment, UndefinedBehavior, Value, context};
use mpgx_lang::plan::Plan;
use mpgx_study::record::{CellRecord, LocaliserRecord, Timing};
use mpgx_study::summary::Summary;
use serde::{Deserialize, Serialize};

mod band;
mod compare;
mod course;
mod film;
mod grid;
mod import;
mod lines;
mod origins;
mod panels;
pub mod picture;
mod profile;
mod series;
mod strips;
mod suite;
mod svg;
mod symbols;
mod tables;
mod text;
mod threshold;
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
    /// Networks that tell poses, by name.
    pub localisers: &'a BTreeMap<String, LocaliserRecord>,
    pub summary: &'a Summary,
    pub provenance: Provenance,
    /// Published results of the very scenario, if there are any.
    pub published: Option<Published>,
}

/// Tables of a publication with a row or more for one study.
#[derive(Clone, Debug, PartialEq)]
pub struct Published {
    /// The name of the study among the variants of its scenario; empty: the scenario itself.
    pub variant: String,
    pub tables: Vec<mpgx_study::suite::Table>,
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

/// Bytes of a page without its styles and scripts, which take another 130,000.
const SIZE: usize = 1_820_000;

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
    fn letters(&self) -> usize {
        let of = |value: &Value| value.as_str().map_or(0, str::len);
        of(&self.body) + self.data.as_ref().map_or(0, of)
    }

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
    let mut view = View::new(input);
    let mut sections: Vec<(usize, Section)> = Vec::new();
    let (filling, fixed): (Vec<_>, Vec<_>) = PANELS.iter().enumerate().partition(|(_, panel)| panel.fills);
    for (place, panel) in fixed.into_iter().chain(filling) {
        let taken: usize = sections.iter().map(|(_, section)| section.letters()).sum();
        view.room = SIZE.saturating_sub(taken);
        let Some(Content { context, data }) = (panel.content)(&view) else { continue };
        let data = data
            .map(|data| embed(&data))
            .transpose()
            .map_err(|source| ReportError::Data { panel: panel.id, source })?;
        let script = panel.script.map(|script| Value::from_safe_string(script.into()));
        let body = render(panel.id, panel.template, context)?;
        sections.push((place, Section { data, script, ..Section::still(panel.id, panel.title, body) }));
    }
    sections.sort_by_key(|(place, _)| *place);
    let sections: Vec<_> = sections.into_iter().map(|(_, section)| section).collect();
    page(&Page {
        name: &input.plan.name,
        about: input.plan.doc.trim(),
        version: &input.summary.version,
        sections: &sections,
    })
}

fn page(page: &Page) -> Result<String, ReportError> {
    let live = page.sections.iter().any(|section| section.script.is_some());
    let script = if live { charting() } else { include_str!("script/page.js").into() };
    let style = [include_str!("style.css"), if live { UPLOT_STYLE } else { "" }].concat();
    let last = if live { include_str!("script/save.js") } else { "" };
    let context = context! {
        scenario => page.name,
        doc => page.about,
        version => page.version,
        style => Value::from_safe_string(style),
        script => Value::from_safe_string(script),
        last => Value::from_safe_string(last.into()),
        sections => Serde(page.sections),
    };
    render("page", include_str!("page.html"), context)
}

const UPLOT_STYLE: &str = include_str!("../assets/uPlot.min.css");

/// What the panels' scripts build on: uPlot with its licence in the place of its first line, which has an address.
fn charting() -> String {
    let uplot = include_str!("../assets/uPlot.iife.min.js");
    let code = uplot.split_once("*/").map_or(uplot, |(_, code)| code);
    let licence = include_str!("../assets/uPlot.LICENSE");
    let page =
        [include_str!("script/page.js"), include_str!("script/chart.js"), include_str!("script/still.js")];
    format!("/*! uPlot 1.6.32\n{licence}\n*/{code}\n{}", page.concat())
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
