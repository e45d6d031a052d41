//! The reference of a module, made from its declarations and their doc comments.

use std::fmt::Write;

use crate::ast::{ExprAt, File, Item, Parameter, Span, Spanned};
use crate::parse::parse;
use crate::problem::Problems;
use crate::source::Sources;

/// Something that a module declares.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// `motion`, `fn`, `algorithm`, …
    pub kind: &'static str,
    pub name: String,
    /// The declaration without its body and its comments.
    pub signature: String,
    /// Its doc comment without the example.
    pub doc: String,
    /// What is indented below a line `Example:` of the comment.
    pub example: Option<String>,
    pub parameters: Vec<Field>,
}

/// A parameter of an entry; type, default and range as written, empty if they are not.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    pub name: String,
    pub type_: String,
    pub default: String,
    pub range: String,
    pub doc: String,
}

/// All entries of a text, in its order, and the text's own comment.
pub fn entries(text: &str) -> (String, Vec<Entry>) {
    let (mut sources, mut problems) = (Sources::default(), Problems::default());
    let file = sources.add("", text.to_owned());
    let File { doc, items, .. } = parse(&sources, file, &mut problems);
    (doc, items.iter().filter_map(|item| entry(item, &sources)).collect())
}

/// The reference of a text as Markdown.
pub fn markdown(name: &str, text: &str) -> String {
    let (doc, entries) = entries(text);
    let mut out = format!("# {name}\n\n{}\n", doc.trim());
    for entry in &entries {
        let _ = write!(out, "\n## {} `{}`\n\n```\n{}\n```\n", entry.kind, entry.name, entry.signature);
        if !entry.doc.is_empty() {
            let _ = write!(out, "\n{}\n", entry.doc);
        }
        let says_more = |it: &&Field| !(it.doc.is_empty() && it.default.is_empty() && it.range.is_empty());
        let mut fields = entry.parameters.iter().filter(says_more).peekable();
        if fields.peek().is_some() {
            out += "\n| parameter | type | default | range | |\n|---|---|---|---|---|\n";
        }
        for Field { name, type_, default, range, doc } in fields {
            let cells = [code(name), code(type_), code(default), code(range), cell(doc)];
            let _ = writeln!(out, "| {} |", cells.join(" | "));
        }
        if let Some(example) = &entry.example {
            let _ = write!(out, "\n```\n{example}\n```\n");
        }
    }
    out
}

/// A list of modules, each with its entries.
pub fn index(modules: &[(&str, &str)]) -> String {
    let mut out = "# The standard library\n\nMade by `mpgx doc --out docs/reference`.\n".to_owned();
    for (name, text) in modules {
        let (doc, entries) = entries(text);
        let names: Vec<String> = entries.iter().map(|entry| format!("`{}`", entry.name)).collect();
        let first = doc.lines().next().unwrap_or_default();
        let _ = write!(out, "\n## [{name}]({name}.md)\n\n{first}\n\n{}\n", names.join(", "));
    }
    out
}

fn code(text: &str) -> String {
    if text.is_empty() { String::new() } else { format!("`{}`", cell(text)) }
}

fn cell(text: &str) -> String {
    text.replace('\n', " ").replace('|', "\\|")
}

fn entry(item: &Spanned<Item>, sources: &Sources) -> Option<Entry> {
    let (kind, doc, name, parameters): (_, _, _, &[Parameter]) = match &item.node {
        Item::Dimension { doc, name, .. } => ("dimension", doc, name, &[]),
        Item::Unit { doc, name, .. } => ("unit", doc, name, &[]),
        Item::Let(it) => ("let", &it.doc, &it.name, &[]),
        Item::Param(it) => ("param", &it.doc, &it.name, &[]),
        Item::Function(it) if it.random => ("dist", &it.doc, &it.name, &it.params),
        Item::Function(it) => ("fn", &it.doc, &it.name, &it.params),
        Item::Motion(it) => ("motion", &it.doc, &it.name, &it.params),
        Item::Shape(it) => ("formation", &it.doc, &it.name, &it.params),
        Item::Extern(it) => (it.kind.word(), &it.doc, &it.name, &it.params),
        Item::Preset { doc, name, .. } => ("preset", doc, name, &[]),
        _ => return None,
    };
    let end = match &item.node {
        Item::Function(it) => Some(it.result.span.end),
        _ => None,
    };
    let written = sources.text(Span { end: end.unwrap_or(item.span.end), ..item.span });
    let (doc, example) = without_example(doc);
    Some(Entry {
        kind,
        name: name.node.clone(),
        signature: if kind == "preset" { written.to_owned() } else { signature(written) },
        doc,
        example,
        parameters: parameters.iter().map(|parameter| field(parameter, sources)).collect(),
    })
}

/// Longest signature that is shown with its parameters, characters.
const LONGEST: usize = 100;

/// The head of a declaration on one line.
fn signature(written: &str) -> String {
    let code = written.lines().map(|line| line.split("//").next().unwrap_or_default());
    let code = code.flat_map(str::split_whitespace).collect::<Vec<_>>().join(" ");
    let mut depth = 0_usize;
    let end = code.find(|character| {
        depth += usize::from(character == '(');
        depth = depth.saturating_sub(usize::from(character == ')'));
        depth == 0 && character == '{'
    });
    let head = code[..end.unwrap_or(code.len())].trim().replace("( ", "(").replace(", )", ")");
    match (head.find('('), head.rfind(')')) {
        (Some(open), Some(close)) if head.chars().count() > LONGEST => {
            format!("{}…{}", &head[..=open], &head[close..])
        }
        _ => head,
    }
}

fn field(it: &Parameter, sources: &Sources) -> Field {
    let text = |expr: &ExprAt| sources.text(expr.span).to_owned();
    Field {
        name: it.name.node.clone(),
        type_: it.type_.as_ref().map_or(String::new(), |type_| sources.text(type_.span).to_owned()),
        default: it.default.as_ref().map_or(String::new(), text),
        range: it
            .range
            .as_ref()
            .map_or(String::new(), |(low, high)| format!("{} .. {}", text(low), text(high))),
        doc: it.doc.clone(),
    }
}

/// A comment, and what is indented below its line `Example:`.
fn without_example(doc: &str) -> (String, Option<String>) {
    let lines: Vec<&str> = doc.lines().collect();
    let Some(at) = lines.iter().position(|line| line.trim() == "Example:") else {
        return (doc.trim_end().to_owned(), None);
    };
    let (before, after) = (&lines[..at], &lines[at + 1..]);
    let inside = |line: &&&str| line.is_empty() || line.starts_with("    ");
    let length = after.iter().take_while(inside).count();
    let example = after[..length].iter().map(|line| line.strip_prefix("    ").unwrap_or(line));
    let example = example.collect::<Vec<_>>().join("\n");
    let rest = [before, &after[length..]].concat().join("\n");
    (rest.trim_end().to_owned(), Some(example.trim_end().to_owned()))
}
