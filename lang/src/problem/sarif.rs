//! Problems as SARIF 2.1.0, the form in which code hosts and editors exchange the findings of tools.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use super::json::Region;
use super::{Code, Problem, Problems};
use crate::ast::Span;
use crate::source::Sources;

/// One log of the problems of several compilations.
pub fn render_sarif(all: &[(&Problems, &Sources)]) -> String {
    let found = || all.iter().flat_map(|(problems, sources)| problems.iter().map(move |it| (it, *sources)));
    let codes: BTreeMap<&str, &Code> =
        found().map(|(problem, _)| (problem.code.name, problem.code)).collect();
    let index: BTreeMap<&str, usize> = codes.keys().enumerate().map(|(index, name)| (*name, index)).collect();
    let results: Vec<Value> =
        found().map(|(problem, sources)| result(problem, index.get(problem.code.name), sources)).collect();
    let log = json!({
        "$schema": "https://json.schemastore.org/sarif-2.1.0.json",
        "version": "2.1.0",
        "runs": [{
            "tool": { "driver": {
                "name": "mpgx",
                "version": env!("CARGO_PKG_VERSION"),
                "rules": codes.values().map(|code| rule(code)).collect::<Vec<_>>(),
            } },
            "columnKind": "unicodeCodePoints",
            "results": results,
        }],
    });
    serde_json::to_string_pretty(&log).unwrap_or_default() + "\n"
}

fn rule(code: &Code) -> Value {
    json!({ "id": code.name, "fullDescription": text(code.explain), "help": text(code.explain) })
}

fn result(problem: &Problem, rule: Option<&usize>, sources: &Sources) -> Value {
    let place = |span: Span| json!({ "physicalLocation": physical(span, sources) });
    let labels = problem.labels.iter().filter(|label| !label.text.is_empty() && !label.primary);
    let related: Vec<Value> = labels
        .enumerate()
        .map(|(id, label)| {
            json!({
                "id": id,
                "physicalLocation": physical(label.span, sources),
                "message": text(&label.text),
            })
        })
        .collect();
    let mut result = json!({
        "ruleId": problem.code.name,
        "ruleIndex": rule,
        "level": problem.severity.name(),
        "message": text(&problem.told()),
        "locations": problem.span().map(place).into_iter().collect::<Vec<_>>(),
        "relatedLocations": related,
    });
    if let Some((span, replacement)) = &problem.fix {
        let change = json!({
            "artifactLocation": artifact(*span, sources),
            "replacements": [{ "deletedRegion": region(*span, sources), "insertedContent": text(replacement) }],
        });
        let why = problem.help.as_deref().unwrap_or(&problem.message);
        result["fixes"] = json!([{ "description": text(why), "artifactChanges": [change] }]);
    }
    result
}

fn text(text: &str) -> Value {
    json!({ "text": text })
}

fn physical(span: Span, sources: &Sources) -> Value {
    json!({ "artifactLocation": artifact(span, sources), "region": region(span, sources) })
}

fn region(span: Span, sources: &Sources) -> Value {
    let at = Region::of(span, sources);
    json!({
        "startLine": at.line,
        "startColumn": at.column,
        "endLine": at.end_line,
        "endColumn": at.end_column,
    })
}

/// The file's path as a URI: absolute ones with their scheme, others relative.
fn artifact(span: Span, sources: &Sources) -> Value {
    let mut uri = String::new();
    for byte in sources.file(span.file).name.bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'/' | b'.' | b'-' | b'_' | b'~' => {
                uri.push(byte as char)
            }
            _ => uri += &format!("%{byte:02X}"),
        }
    }
    json!({ "uri": if uri.starts_with('/') { format!("file://{uri}") } else { uri } })
}
