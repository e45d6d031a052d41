//! `parse`: text in, syntax tree out, and every syntax problem of the file.
//!
//! The file is cut into items first ([`scan`]); each is parsed by the grammar `scn.pest` and fails by itself.

mod expr;
mod items;
pub(crate) mod scan;
mod study;
mod syntax;

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::num::NonZeroUsize;
use std::sync::Once;

use pest::Parser;
use pest_derive::Parser;

use crate::ast::{File, Item, Span, Spanned};
use crate::problem::{Code, Problem, Problems};
use crate::source::Sources;

pub(crate) use expr::{CHAINED_COMPARISON, NUMBER_TOO_LARGE};
pub(crate) use items::{FUNCTION_BODY, MISSING_SEPARATOR};
pub(crate) use scan::{FORBIDDEN_CHARACTER, MISPLACED_DOC_COMMENT, NESTED_TOO_DEEPLY, UNBALANCED_BRACKETS};
pub(crate) use syntax::{RESERVED_WORD, SYNTAX, TOO_COMPLEX, UNKNOWN_ITEM};

/// Bytes of a file.
pub const MAX_BYTES: usize = 1 << 20;
/// Levels of nesting, and of a syntax tree.
pub const MAX_DEPTH: usize = 128;
/// Calls that the grammar may make for one item.
const MAX_CALLS: NonZeroUsize = NonZeroUsize::MIN.saturating_add(999_999);

pub(crate) const FILE_TOO_LARGE: Code = Code {
    name: "file-too-large",
    explain: "\
A file may have 1 MiB. Scenarios are a page or two long, so a larger file is likely not a scenario. A long one can
be cut into several: put functions, motions and formations into files beside it and `use` them.",
};

#[derive(Parser)]
#[grammar = "scn.pest"]
struct Grammar;

type Node<'a> = pest::iterators::Pair<'a, Rule>;

/// The item being parsed: where its text begins in the file, and what was wrong with it.
struct Context<'a> {
    file: usize,
    offset: usize,
    text: &'a str,
    problems: RefCell<&'a mut Problems>,
}

impl Context<'_> {
    fn problem(&self, problem: Problem) {
        self.problems.borrow_mut().push(problem);
    }

    /// The span of a node that ends with a token.
    fn span(&self, node: &Node) -> Span {
        self.range(node.as_span().start(), end_of(node))
    }

    /// The span of bytes of the item.
    fn range(&self, start: usize, end: usize) -> Span {
        Span { file: self.file, start: self.offset + start, end: self.offset + end }
    }
}

/// Where a node's last token ends: a rule that allows white space takes in what its missing last part may follow.
fn end_of(node: &Node) -> usize {
    let span = node.as_span();
    // White space and comments end in a blank or a line end, for the item does not end with them.
    if !span.as_str().ends_with([' ', '\t', '\n']) {
        return span.end();
    }
    let exact = matches!(node.as_rule(), Rule::number | Rule::unit | Rule::unit_factor | Rule::exponent);
    match node.clone().into_inner().next_back().filter(|_| !exact) {
        Some(last) => end_of(&last),
        None => span.end(),
    }
}

/// Parses a file of `sources`. Never fails: items with errors are left out.
pub fn parse(sources: &Sources, file: usize, problems: &mut Problems) -> File {
    let text = sources.file(file).text.as_str();
    let unreadable = || File { broken: vec![Span { file, start: 0, end: text.len() }], ..File::default() };
    if text.len() > MAX_BYTES {
        let problem = Problem::error(
            &FILE_TOO_LARGE,
            format!("this file has {} bytes, the limit is {MAX_BYTES}", text.len()),
        );
        problems.push(problem.help("cut it into several files and `use` them"));
        return unreadable();
    }
    if scan::forbidden(text, file, problems) {
        return unreadable();
    }
    let (tokens, doc) = scan::tokens(text);
    let (mut items, mut broken) = (Vec::new(), Vec::new());
    for piece in scan::pieces(text, &tokens, file, problems) {
        let tokens = tokens.get(piece.tokens).unwrap_or_default();
        let (Some(first), Some(last)) = (tokens.first(), tokens.last()) else { continue };
        let start = tokens.iter().find(|token| token.kind != scan::Kind::Doc).map_or(0, |token| token.start);
        let span = Span { file, start, end: last.end };
        if piece.broken || !syntax::begins_an_item(text, tokens, file, problems) {
            broken.push(span);
            continue;
        }
        let context = Context { file, offset: first.start, text, problems: RefCell::new(problems) };
        match item(&context, last.end) {
            Ok(Some(node)) => items.push(Spanned { node, span }),
            Ok(None) => broken.push(span),
            Err(error) => {
                context.problem(syntax::problem(&context, tokens, *error));
                broken.push(span);
            }
        }
    }
    File { doc, items, broken }
}

/// Parses the item of a context, which ends at a byte of the file; `None` if its problems were told.
fn item(context: &Context, end: usize) -> Result<Option<Item>, Box<pest::error::Error<Rule>>> {
    static LIMIT: Once = Once::new();
    LIMIT.call_once(|| pest::set_call_limit(Some(MAX_CALLS)));
    let text = context.text.get(context.offset..end).unwrap_or_default();
    let mut nodes = Grammar::parse(Rule::item, text)?;
    Ok(nodes.next().and_then(|node| items::item(context, node)))
}

/// Parses bytes of a file that are one item without errors.
pub(crate) fn sound_item(text: &str, file: usize, bytes: std::ops::Range<usize>) -> Option<Item> {
    let mut problems = Problems::default();
    let context = Context { file, offset: bytes.start, text, problems: RefCell::new(&mut problems) };
    item(&context, bytes.end).ok().flatten()
}

/// Where the number that begins at a byte ends, its unit included.
pub(crate) fn number_end(text: &str, start: usize) -> usize {
    let rest = text.get(start..).unwrap_or_default();
    let number = Grammar::parse(Rule::number, rest).ok().and_then(|mut nodes| nodes.next());
    number.map_or(start, |number| start + number.as_span().end())
}

/// The words that the grammar has a `kw_` rule for.
pub(crate) fn keywords() -> BTreeSet<String> {
    let rules = Rule::all_rules().iter().map(|rule| format!("{rule:?}"));
    rules.filter_map(|rule| Some(rule.strip_prefix("kw_")?.to_owned())).collect()
}

#[cfg(test)]
mod tests;
