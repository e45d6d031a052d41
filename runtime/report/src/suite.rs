//! The report of a suite: published tables with our results beside them, from summaries alone.

use minijinja::value::Serde;
use minijinja::{Value, context};
use mpgx_lang::plan::{Method, Plan};
use mpgx_study::suite::{Row, Suite, Table};
use mpgx_study::summary::{Statistic, Summary};
use serde::Serialize;

use crate::text::{Format, duration, plural};
use crate::{Page, ReportError, Section, page, render};

/// A finished study of a suite.
pub struct Member<'a> {
    pub plan: &'a Plan,
    /// Empty: the scenario itself.
    pub variant: &'a str,
    /// Where its own report lies, relative to that of the suite.
    pub report: String,
    pub summary: &'a Summary,
}

impl Member<'_> {
    pub(crate) fn name(&self) -> String {
        let variant = if self.variant.is_empty() { String::new() } else { format!(", {}", self.variant) };
        format!("{}{variant}", self.plan.name)
    }
}

/// One line beside a published value.
#[derive(Serialize)]
pub(crate) struct Line<'a> {
    pub name: &'a str,
    study: String,
    link: &'a str,
    pub published: Option<String>,
    /// By method, in the order of [`Beside::methods`].
    pub ours: Vec<Option<Cell>>,
    pub over_published: Option<String>,
    over_oracle: Option<String>,
    pub unit: &'static str,
    pub metric: String,
    pub note: &'a str,
}

#[derive(Serialize)]
pub(crate) struct Cell {
    pub value: String,
    pub interval: Option<String>,
}

/// A published table with ours.
#[derive(Serialize)]
pub(crate) struct Beside<'a> {
    pub title: &'a str,
    pub source: &'a str,
    pub note: &'a str,
    pub methods: Vec<&'a str>,
    pub lines: Vec<Line<'a>>,
}

/// The page as HTML text. Rows whose study is not among the members stay empty; the order of the members
/// changes nothing.
///
/// # Errors
/// [`ReportError`], if a template does not fit.
pub fn suite_html(suite: &Suite, members: &[Member]) -> Result<String, ReportError> {
    let tables = besides(suite, members);
    let members = &sorted(members);
    let sections = [
        Section::still(
            "verdict",
            "Verdict",
            render("suite", include_str!("suite/verdict.html"), verdict(suite, members))?,
        ),
        Section::still(
            "tables",
            "Beside the paper",
            render("suite", include_str!("suite/tables.html"), context! { tables => Serde(tables) })?,
        ),
        Section::still(
            "studies",
            "Studies",
            render("suite", include_str!("suite/studies.html"), studies(members))?,
        ),
    ];
    let version = members.first().map_or("", |member| &member.summary.version);
    page(&Page { name: &suite.title, about: suite.about.trim(), version, sections: &sections })
}

/// All published tables with ours.
pub(crate) fn besides<'a>(suite: &'a Suite, members: &'a [Member]) -> Vec<Beside<'a>> {
    let members = sorted(members);
    suite.tables.iter().map(|table| beside(table, &members)).collect()
}

fn sorted<'m, 'a>(members: &'m [Member<'a>]) -> Vec<&'m Member<'a>> {
    let mut members: Vec<&Member> = members.iter().collect();
    members.sort_by(|a, b| a.report.cmp(&b.report));
    members
}

fn verdict(suite: &Suite, members: &[&Member]) -> Value {
    let claims = || members.iter().flat_map(|member| &member.summary.expect);
    let held = claims().filter(|claim| claim.holds).count();
    let failures: usize = members.iter().map(|member| member.summary.failures.len()).sum();
    let fewest = members.iter().map(|member| member.summary.seeds).min().unwrap_or(0);
    context! {
        studies => match members.len() { 1 => "1 study".to_string(), n => format!("{n} studies") },
        scenarios => plural(suite.scenarios.len(), "scenario"),
        seeds => plural(fewest, "seed"),
        claims => claims().count(),
        held => held,
        failed => (failures > 0).then(|| plural(failures, "seed")),
    }
}

#[derive(Serialize)]
struct Study<'a> {
    name: String,
    link: &'a str,
    doc: &'a str,
    seeds: usize,
    failed: usize,
    time: String,
    hash: &'a str,
    /// Text, whether it holds, and why.
    claims: Vec<(&'a str, bool, &'a str)>,
}

fn studies(members: &[&Member]) -> Value {
    let of = |member: &&Member| {
        let summary = member.summary;
        let seconds: f64 = summary.training.values().flat_map(|training| &training.seconds_per_seed).sum();
        let claims = summary.expect.iter().map(|it| (it.text.as_str(), it.holds, it.because.as_str()));
        Serde(Study {
            name: member.name(),
            link: &member.report,
            doc: member.plan.doc.trim().lines().next().unwrap_or(""),
            seeds: summary.seeds,
            failed: summary.failures.len(),
            time: duration(seconds),
            hash: summary.study_hash.get(..12).unwrap_or(&summary.study_hash),
            claims: claims.collect(),
        })
        .into()
    };
    let studies: Vec<Value> = members.iter().map(of).collect();
    context! { studies }
}

pub(crate) fn beside<'a>(table: &'a Table, members: &[&'a Member<'a>]) -> Beside<'a> {
    let member = |row: &Row| {
        members.iter().copied().find(|it| it.plan.name == row.scenario && it.variant == row.variant)
    };
    let mut methods: Vec<&str> = Vec::new();
    for member in table.rows.iter().filter_map(member) {
        let labels = all(member.plan).map(|method| method.label.as_str());
        labels.for_each(|label| {
            if !methods.contains(&label) {
                methods.push(label);
            }
        });
    }
    let lines = table.rows.iter().map(|row| line(row, member(row), &methods)).collect();
    Beside { title: &table.title, source: &table.source, note: &table.note, methods, lines }
}

fn all(plan: &Plan) -> impl Iterator<Item = &Method> {
    plan.learners.iter().chain(&plan.controllers)
}

fn line<'a>(row: &'a Row, member: Option<&'a Member>, methods: &[&str]) -> Line<'a> {
    let statistic = |method: &str, metric: &str| -> Option<&Statistic> {
        member?.summary.protocols.get(&row.protocol)?.get(method)?.get(metric)
    };
    let first = member.and_then(|member| member.plan.learners.first()).map(|method| method.label.as_str());
    let ours = first.and_then(|first| statistic(first, &row.metric)).map(|it| it.iqm);
    let format = format(&row.metric, ours.or(row.published).unwrap_or(0.0));
    let cell = |method: &&str| {
        let it = statistic(method, &row.metric)?;
        Some(Cell { value: format.plain(it.iqm), interval: format.interval(it.lo, it.hi) })
    };
    let ratio = |value: f64| Format::ratio().plain(value);
    Line {
        name: &row.name,
        study: member.map_or_else(|| format!("{}: not run", row.scenario), Member::name),
        link: member.map_or("", |member| &member.report),
        published: row.published.map(|value| format.at(value).plain(value)),
        ours: methods.iter().map(cell).collect(),
        over_published: ours.zip(row.published).map(|(ours, theirs)| ratio(ours / theirs)),
        over_oracle: first
            .filter(|_| row.metric == "error_m")
            .and_then(|first| statistic(first, "error_over_oracle"))
            .map(|it| ratio(it.iqm)),
        unit: format.unit,
        metric: metric(&row.metric),
        note: &row.note,
    }
}

pub(crate) fn format(metric: &str, size: f64) -> Format {
    match metric {
        "error_m" => Format::length(size),
        "error_over_oracle" => Format::ratio(),
        name if name.ends_with("_episodes") => Format::percent(0.01),
        _ => Format::number(size),
    }
}

/// What a metric measures, in a word or two.
pub(crate) fn metric(name: &str) -> String {
    match name {
        "error_m" => "distance".into(),
        "error_over_oracle" => "distance over the oracle’s".into(),
        "return" => "return".into(),
        name => name.trim_end_matches("_episodes").replace("reward/", "reward, ").replace('_', " "),
    }
}
