//! `fmt`: the one way a file is laid out. It works on tokens, so that new grammar needs no new code here.
//!
//! The author's lines stay lines. Indentation follows brackets, four spaces a level, one more where an item or entry
//! goes on; spaces stand around operators, never inside a unit; of blank lines at most one stays, none at the edges of
//! a block. In consecutive lines of one kind the `=`, `~`, `:`, `when` or `{` after the names stand below each other, and
//! so do the comments at the ends of lines.

mod align;
mod lines;
mod spaces;

use std::collections::BTreeSet;

use crate::parse::scan::{self, Kind};
use crate::parse::{self, number_end};
use crate::print;
use crate::problem::Problems;
use crate::source::Sources;

/// A token, a number together with its unit, or a comment.
struct Atom {
    kind: Kind,
    text: String,
    /// Lines that end before it; 2: a blank line.
    breaks: usize,
    /// Spaces before it, on its line.
    gap: usize,
    /// The first of a top-level item.
    item: bool,
    /// The other bracket.
    partner: Option<usize>,
}

impl Atom {
    fn is(&self, text: &str) -> bool {
        self.text == text && !self.is_comment()
    }

    fn is_comment(&self) -> bool {
        matches!(self.kind, Kind::Comment | Kind::Doc)
    }
}

/// Atoms `start..end`, indented by `level` steps.
struct Line {
    level: usize,
    start: usize,
    end: usize,
}

/// The text of a file as it should be laid out; `None`, and the problems, if its syntax is wrong.
pub fn format(sources: &Sources, file: usize, problems: &mut Problems) -> Option<String> {
    let errors = problems.errors();
    let tree = parse::parse(sources, file, problems);
    if problems.errors() > errors {
        return None;
    }
    let before = sources.file(file).text.as_str();
    let after = laid_out(before);
    // A formatter does not change what is said, whatever it does not know.
    let mut again = Sources::default();
    let file = again.add("", after.clone());
    let same = print::file(&parse::parse(&again, file, &mut Problems::default())) == print::file(&tree);
    Some(if same { after } else { before.to_owned() })
}

fn laid_out(text: &str) -> String {
    let mut atoms = atoms(text);
    lines::breaks(&mut atoms);
    let continued = spaces::spaces(&mut atoms);
    let lines = lines::lines(&atoms, &continued);
    align::align(&mut atoms, &lines);
    let mut out = String::new();
    for line in &lines {
        let atoms = atoms.get(line.start..line.end).unwrap_or_default();
        for (index, atom) in atoms.iter().enumerate() {
            if index == 0 {
                out += "\n".repeat(atom.breaks).as_str();
                out += "    ".repeat(line.level).as_str();
            } else {
                out += " ".repeat(atom.gap).as_str();
            }
            out += &atom.text;
        }
    }
    out + if lines.is_empty() { "" } else { "\n" }
}

fn atoms(text: &str) -> Vec<Atom> {
    let (tokens, _) = scan::tokens(text);
    let pieces = scan::pieces(text, &tokens, 0, &mut Problems::default());
    let items: BTreeSet<usize> =
        pieces.iter().filter_map(|piece| Some(tokens.get(piece.tokens.start)?.start)).collect();
    let (mut atoms, mut open, mut end): (Vec<Atom>, Vec<usize>, usize) = (Vec::new(), Vec::new(), 0);
    let mut documented = false;
    for token in scan::with_comments(text) {
        if token.start < end {
            continue; // inside the unit of a number
        }
        let breaks = text[end..token.start].matches('\n').count().min(2);
        let (mut text_of, mut partner) = (text[token.start..token.end].trim_end().to_owned(), None);
        end = token.end;
        match token.kind {
            Kind::Number => {
                end = number_end(text, token.start).max(token.end);
                let unit = text[token.end..end].trim();
                text_of += if unit.is_empty() || unit == "%" { "" } else { " " };
                text_of += unit;
            }
            Kind::Open => open.push(atoms.len()),
            Kind::Close => {
                partner = open.pop();
                let this = atoms.len();
                if let Some(opening) = partner.and_then(|opening| atoms.get_mut(opening)) {
                    opening.partner = Some(this);
                }
            }
            _ => {}
        }
        let item = items.contains(&token.start) || documented;
        if token.kind != Kind::Comment {
            documented = item && token.kind == Kind::Doc;
        }
        atoms.push(Atom { kind: token.kind, text: text_of, breaks, gap: 1, item, partner });
    }
    if let Some(first) = atoms.first_mut() {
        first.breaks = 0;
    }
    atoms
}
