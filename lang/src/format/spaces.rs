//! Which tokens have a space between them, and which go on with what stands before.

use std::collections::BTreeSet;

use super::Atom;
use crate::parse::keywords;
use crate::parse::scan::{CONNECTIVES, ITEM_WORDS, Kind};

/// Sets the gap before each atom; tells for each whether it goes on with what stands before it.
pub(super) fn spaces(atoms: &mut [Atom]) -> Vec<bool> {
    let keywords = keywords();
    let nothing = Before::NOTHING;
    let mut walk = Walk { atoms, keywords: &keywords, open: Vec::new(), before: nothing, last: nothing };
    let steps: Vec<(usize, bool)> = (0..walk.atoms.len()).map(|at| walk.step(at)).collect();
    for (atom, (gap, _)) in atoms.iter_mut().zip(&steps) {
        atom.gap = *gap;
    }
    steps.into_iter().map(|(_, continued)| continued).collect()
}

/// The words before `(i in …)`.
const FOLDS: &[&str] = &["sum", "mean", "min", "max", "count", "any", "all"];

/// What is open around a token.
enum Open {
    Bracket {
        /// Round or square, and closed on its line.
        short: bool,
        /// `sum(i in …)`: what follows the bracket is its body.
        binds: bool,
        /// Without spaces at its edges: `{a, b}` of a `use`.
        tight: bool,
        /// Without spaces at all: `(1/2)` of an exponent.
        exponent: bool,
    },
    Bar,
    /// `<D>`
    Generics,
}

/// The token before.
#[derive(Clone, Copy)]
struct Before<'a> {
    text: &'a str,
    kind: Kind,
    /// It ends an operand.
    operand: bool,
    /// No space comes after it.
    hugs: bool,
    /// The word of an item or entry.
    heads: bool,
}

impl Before<'_> {
    const NOTHING: Before<'static> =
        Before { text: "", kind: Kind::Open, operand: false, hugs: true, heads: false };

    /// Something must follow.
    fn wants_more(&self) -> bool {
        let open = matches!(self.kind, Kind::Symbol | Kind::Word | Kind::Close) && !self.operand;
        open && !self.heads && self.text != ","
    }
}

struct Walk<'a> {
    atoms: &'a [Atom],
    keywords: &'a BTreeSet<String>,
    open: Vec<Open>,
    before: Before<'a>,
    last: Before<'a>,
}

impl Walk<'_> {
    /// The gap before an atom, and whether it goes on with what stands before it.
    fn step(&mut self, at: usize) -> (usize, bool) {
        let atom = &self.atoms[at];
        if atom.is_comment() {
            if atom.kind == Kind::Doc {
                self.before = Before::NOTHING;
            }
            return (2, false);
        }
        let (text, before) = (atom.text.as_str(), self.before);
        let prefix = text == "-" && !before.operand;
        let closes_bar = text == "|" && before.operand && matches!(self.open.last(), Some(Open::Bar));
        let opens_generics = text == "<" && matches!(self.last.text, "fn" | "dist");
        let closes_generics = text == ">" && matches!(self.open.last(), Some(Open::Generics));

        let (short, tight, exponent) = match self.open.last() {
            Some(Open::Bracket { short, tight, exponent, .. }) => (*short, *tight, *exponent),
            _ => (false, false, false),
        };
        let gap = !before.hugs
            && !exponent
            && match text {
                "," | ")" | "]" | "." | "^" => false,
                "}" => !tight,
                "(" => before.kind != Kind::Word || !before.operand,
                "[" => !before.operand,
                "|" => !closes_bar,
                "<" => !opens_generics,
                ">" => !closes_generics,
                ":" => !short,
                _ => true,
            };
        let infix = atom.kind == Kind::Symbol && !prefix && !matches!(text, "|" | ",");
        // Also one that is a keyword elsewhere: the `at` of landmarks.
        let named = self.atoms.get(at + 1).is_some_and(|next| next.is("=") || next.is("~"));
        let connective = !named && CONNECTIVES.contains(&text) && !matches!(text, "if" | "not");
        let goes_on = infix || before.wants_more() || (before.operand && (connective || text == "["));

        let mut this = Before { text, kind: atom.kind, operand: false, hugs: false, heads: false };
        match atom.kind {
            Kind::Open => {
                let bracket = self.opened(at);
                this.hugs = text != "{"
                    || atom.partner == Some(at + 1)
                    || matches!(bracket, Open::Bracket { tight: true, .. });
                self.open.push(bracket);
            }
            Kind::Close => {
                while matches!(self.open.last(), Some(Open::Bar | Open::Generics)) {
                    self.open.pop();
                }
                this.operand = !matches!(self.open.pop(), Some(Open::Bracket { binds: true, .. }));
            }
            Kind::Word => {
                let keyword = !named && self.keywords.contains(text);
                let begins = at == 0 || atom.breaks > 0 || before.text == "{";
                this.heads = begins && (keyword || ITEM_WORDS.contains(&text));
                // Two operands do not stand side by side: a keyword after one joins it to what follows.
                let joins = (!named && CONNECTIVES.contains(&text)) || (keyword && before.operand);
                this.operand = !this.heads && !joins;
            }
            Kind::Symbol if closes_bar => {
                self.open.pop();
                this.operand = true;
            }
            Kind::Symbol if text == "|" => {
                self.open.push(Open::Bar);
                this.hugs = true;
            }
            Kind::Symbol if opens_generics => {
                self.open.push(Open::Generics);
                this.hugs = true;
            }
            Kind::Symbol if closes_generics => {
                self.open.pop();
                this.hugs = true;
            }
            Kind::Symbol => this.hugs = prefix || matches!(text, "." | "^"),
            _ => this.operand = true,
        }
        (self.last, self.before) = (before, this);
        (usize::from(gap), goes_on)
    }

    fn opened(&self, at: usize) -> Open {
        let closing = self.atoms[at].partner.unwrap_or(at);
        let inside = self.atoms.get(at + 1..closing).unwrap_or_default();
        let (mut depth, mut has_in) = (0_usize, false);
        for atom in inside {
            match atom.kind {
                Kind::Open => depth += 1,
                Kind::Close => depth = depth.saturating_sub(1),
                _ => has_in |= depth == 0 && atom.is("in"),
            }
        }
        let plain = |atom: &Atom| atom.kind == Kind::Number || atom.is("/") || atom.is("-");
        Open::Bracket {
            short: !self.atoms[at].is("{") && inside.iter().all(|atom| atom.breaks == 0),
            binds: has_in && FOLDS.contains(&self.before.text),
            tight: self.before.text == ".",
            exponent: self.before.text == "^" && inside.iter().all(plain),
        }
    }
}
