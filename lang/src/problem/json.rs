//! Problems as JSON, one a line, for editors and scripts. New keys may come; none changes its meaning.

use serde::Serialize;

use super::{Problem, Problems};
use crate::ast::Span;
use crate::source::Sources;

#[derive(Serialize)]
struct Line<'a> {
    code: &'static str,
    severity: &'static str,
    message: &'a str,
    /// Where it is; missing if it is nowhere in particular.
    #[serde(flatten)]
    at: Option<Region<'a>>,
    labels: Vec<Labelled<'a>>,
    notes: &'a [String],
    help: Option<&'a str>,
    fix: Option<Replacement<'a>>,
}

#[derive(Serialize)]
struct Labelled<'a> {
    #[serde(flatten)]
    at: Region<'a>,
    text: &'a str,
    primary: bool,
}

#[derive(Serialize)]
struct Replacement<'a> {
    #[serde(flatten)]
    at: Region<'a>,
    replacement: &'a str,
}

/// Lines and columns from 1, columns in characters; the end is the first place after.
#[derive(Serialize)]
pub(super) struct Region<'a> {
    pub file: &'a str,
    pub line: usize,
    pub column: usize,
    pub end_line: usize,
    pub end_column: usize,
}

impl<'a> Region<'a> {
    pub fn of(span: Span, sources: &'a Sources) -> Region<'a> {
        let file = sources.file(span.file);
        let ((line, column), (end_line, end_column)) =
            (file.line_column(span.start), file.line_column(span.end));
        Region { file: &file.name, line, column, end_line, end_column }
    }
}

/// One object a line.
pub fn render_json(problems: &Problems, sources: &Sources) -> String {
    let line = |problem: &Problem| serde_json::to_string(&line(problem, sources)).unwrap_or_default() + "\n";
    problems.iter().map(line).collect()
}

fn line<'a>(problem: &'a Problem, sources: &'a Sources) -> Line<'a> {
    let labels = problem.labels.iter().map(|label| Labelled {
        at: Region::of(label.span, sources),
        text: &label.text,
        primary: label.primary,
    });
    Line {
        code: problem.code.name,
        severity: problem.severity.name(),
        message: &problem.message,
        at: problem.span().map(|span| Region::of(span, sources)),
        labels: labels.collect(),
        notes: &problem.notes,
        help: problem.help.as_deref(),
        fix: problem
            .fix
            .as_ref()
            .map(|(span, text)| Replacement { at: Region::of(*span, sources), replacement: text }),
    }
}
