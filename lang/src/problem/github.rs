//! Problems as workflow commands of GitHub Actions, which show them beside the changed lines.

use super::json::Region;
use super::{Problem, Problems};
use crate::source::Sources;

/// One command a line.
pub fn render_github(problems: &Problems, sources: &Sources) -> String {
    problems.iter().map(|problem| command(problem, sources)).collect()
}

fn command(problem: &Problem, sources: &Sources) -> String {
    let mut properties = Vec::new();
    if let Some(at) = problem.span().map(|span| Region::of(span, sources)) {
        properties.push(format!("file={}", property(at.file)));
        properties.push(format!("line={},endLine={},col={}", at.line, at.end_line, at.column));
        // Columns are understood within a line only.
        if at.line == at.end_line {
            properties.push(format!("endColumn={}", at.end_column));
        }
    }
    properties.push(format!("title={}", property(problem.code.name)));
    let (severity, properties) = (problem.severity.name(), properties.join(","));
    format!("::{severity} {properties}::{}\n", data(&problem.told()))
}

fn data(text: &str) -> String {
    text.replace('%', "%25").replace('\r', "%0D").replace('\n', "%0A")
}

fn property(text: &str) -> String {
    data(text).replace(':', "%3A").replace(',', "%2C")
}
