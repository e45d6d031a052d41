//! A first look at a file, before the grammar: what may not be in it, its tokens, and where its items begin and
//! end, so that each can be parsed, and fail, by itself.

use crate::ast::Span;
use crate::problem::{Code, Problem, Problems};

use super::MAX_DEPTH;

pub(crate) const FORBIDDEN_CHARACTER: Code = Code {
    name: "forbidden-character",
    explain: "\
A file may not hold control characters (except tab and line end), a carriage return without a line feed, or the
characters that reverse the direction of writing: they look like nothing, or make the text look like something
else than it is. The message tells the byte at which the character stands. Delete it and type the line anew.",
};

pub(crate) const UNBALANCED_BRACKETS: Code = Code {
    name: "unbalanced-brackets",
    explain: "\
Each `(`, `[` and `{` needs its `)`, `]` and `}`, in the reverse order.

    start ~ near(F[i], 0.2 m        // wrong: the `(` is never closed
    start ~ near(F[i], 0.2 m)       // right",
};

pub(crate) const NESTED_TOO_DEEPLY: Code = Code {
    name: "nested-too-deeply",
    explain: "\
Brackets, bars and `if`s may be nested 128 levels deep, and a formula may have a chain of as many operators.
Give a part of the formula a name with `let`, or make it a `fn`.",
};

pub(crate) const MISPLACED_DOC_COMMENT: Code = Code {
    name: "misplaced-doc-comment",
    explain: "\
A comment with three slashes describes what comes after it, and stands on a line of its own. It becomes part of the
report. Any other remark is written with two slashes.

    param side = 0.4 m    /// edge of the square      // wrong: after what it describes

    /// Edge of the square.
    param side = 0.4 m                                // right",
};

/// The words that begin an item.
pub(crate) const ITEM_WORDS: &[&str] = &[
    "agent",
    "agents",
    "compare",
    "dimension",
    "dist",
    "end",
    "evaluate",
    "expect",
    "extern",
    "fn",
    "formation",
    "landmark",
    "landmarks",
    "learn",
    "let",
    "localiser",
    "motion",
    "observe",
    "obstacle",
    "obstacles",
    "param",
    "preset",
    "randomise",
    "recording",
    "require",
    "reward",
    "scenario",
    "seeds",
    "stage",
    "sweep",
    "test",
    "unit",
    "use",
    "variant",
    "world",
];

/// The words after which, or with which, an item goes on.
pub(crate) const CONNECTIVES: &[&str] = &[
    "about", "and", "at", "beats", "costs", "else", "for", "if", "in", "not", "of", "on", "or", "over",
    "then", "until", "via", "when", "with", "within",
];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Word,
    Number,
    /// `(`, `[` or `{`.
    Open,
    Close,
    /// `///` up to the line's end.
    Doc,
    /// `//` or `//!` up to the line's end.
    Comment,
    Symbol,
    /// `"…"`
    Text,
}

/// Bytes `start..end` of the file; `first` on its line.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Token {
    pub kind: Kind,
    pub start: usize,
    pub end: usize,
    pub first: bool,
}

/// The text of one item: tokens `tokens` of the file. Broken: a problem has been told already.
#[derive(Clone, Debug)]
pub(crate) struct Piece {
    pub tokens: std::ops::Range<usize>,
    pub broken: bool,
}

/// Tells of the first character that no file may hold.
pub(crate) fn forbidden(text: &str, file: usize, problems: &mut Problems) -> bool {
    let bad = text.char_indices().find(|&(at, character)| match character {
        '\t' | '\n' => false,
        '\r' => text.as_bytes().get(at + 1) != Some(&b'\n'),
        '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' => true,
        _ => character.is_control(),
    });
    let Some((at, character)) = bad else { return false };
    let what = match character {
        '\0' => "a NUL character".to_owned(),
        '\r' => "a carriage return without a line feed".to_owned(),
        '\u{202a}'..='\u{2069}' => format!("the writing direction control U+{:04X}", character as u32),
        _ => format!("the control character U+{:04X}", character as u32),
    };
    problems.push(
        Problem::error(&FORBIDDEN_CHARACTER, format!("{what} stands at byte {at}"))
            .at(Span { file, start: at, end: at + character.len_utf8() }, "here")
            .help("delete it; typing the line anew is the surest way"),
    );
    true
}

/// Cuts a file into tokens without comments; also gives the text of its `//!` comment.
pub(crate) fn tokens(text: &str) -> (Vec<Token>, String) {
    let all = with_comments(text);
    let head = all.iter().take_while(|token| token.kind == Kind::Comment);
    let head = head.filter_map(|token| text[token.start..token.end].strip_prefix("//!"));
    let doc = head.map(|line| line.strip_prefix(' ').unwrap_or(line)).collect::<Vec<_>>().join("\n");
    let tokens = all.into_iter().filter(|token| token.kind != Kind::Comment).collect();
    (tokens, doc.trim_end().to_owned())
}

/// Cuts a file into tokens.
pub(crate) fn with_comments(text: &str) -> Vec<Token> {
    let bytes = text.as_bytes();
    let run = |from: usize, holds: fn(u8) -> bool| {
        bytes[from..].iter().position(|&byte| !holds(byte)).map_or(bytes.len(), |length| from + length)
    };
    let word = |byte: u8| byte.is_ascii_alphanumeric() || byte == b'_';
    let (mut tokens, mut first, mut at) = (Vec::new(), true, 0);
    while let Some(&byte) = bytes.get(at) {
        let rest = &text[at..];
        let (kind, end) = match byte {
            b'\n' => {
                first = true;
                at += 1;
                continue;
            }
            b' ' | b'\t' | b'\r' => {
                at += 1;
                continue;
            }
            b'/' if rest.starts_with("//") => {
                let end = run(at, |byte| byte != b'\n' && byte != b'\r');
                let doc = rest.starts_with("///") && !rest.starts_with("////");
                (if doc { Kind::Doc } else { Kind::Comment }, end)
            }
            b'0'..=b'9' => (Kind::Number, number_end(bytes, at)),
            byte if word(byte) => (Kind::Word, run(at, |byte| byte.is_ascii_alphanumeric() || byte == b'_')),
            b'"' => {
                let line = run(at, |byte| byte != b'\n' && byte != b'\r');
                let closing = text[at + 1..line].find('"').map(|length| at + 1 + length + 1);
                match closing {
                    Some(end) => (Kind::Text, end),
                    None => (Kind::Symbol, at + 1),
                }
            }
            b'(' | b'[' | b'{' => (Kind::Open, at + 1),
            b')' | b']' | b'}' => (Kind::Close, at + 1),
            _ => {
                let double = ["<=", ">=", "==", "!=", "->", "..", "&&", "**"];
                let double = double.iter().any(|symbol| rest.starts_with(symbol));
                let length = rest.chars().next().map_or(1, char::len_utf8);
                (Kind::Symbol, at + if double { 2 } else { length })
            }
        };
        tokens.push(Token { kind, start: at, end, first });
        first = false;
        at = end;
    }
    tokens
}

/// The end of the number that begins at a byte: digits, a fraction, an exponent.
fn number_end(bytes: &[u8], start: usize) -> usize {
    let digits = |from: usize| {
        bytes[from..]
            .iter()
            .position(|byte| !byte.is_ascii_digit())
            .map_or(bytes.len(), |length| from + length)
    };
    let is_digit = |at: usize| bytes.get(at).is_some_and(u8::is_ascii_digit);
    let mut end = digits(start);
    if bytes.get(end) == Some(&b'.') && is_digit(end + 1) {
        end = digits(end + 1);
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        if is_digit(end + 1 + sign) {
            end = digits(end + 1 + sign);
        }
    }
    end
}

/// Cuts the tokens into items and tells of brackets without a partner.
pub(crate) fn pieces(text: &str, tokens: &[Token], file: usize, problems: &mut Problems) -> Vec<Piece> {
    let at = |index: usize| tokens.get(index).map_or("", |token| &text[token.start..token.end]);
    let span = |index: usize| {
        let token = tokens.get(index);
        Span { file, start: token.map_or(0, |token| token.start), end: token.map_or(0, |token| token.end) }
    };
    let balanced = balanced(text, tokens);
    let mut pieces: Vec<Piece> = Vec::new();
    let mut nesting = Nesting::default();
    let mut only_docs = false;
    for (index, token) in tokens.iter().enumerate() {
        let column_0 = token.start == 0 || text.as_bytes().get(token.start - 1) == Some(&b'\n');
        let continued = !column_0 && index > 0 && wants_more(tokens[index - 1].kind, at(index - 1));
        let item_word = token.kind == Kind::Word && ITEM_WORDS.contains(&at(index)) && at(index + 1) != ".";
        let word = column_0 && token.kind == Kind::Word && !CONNECTIVES.contains(&at(index));
        let inside = nesting.brackets.first().copied();
        let begins = match inside {
            None => token.kind == Kind::Doc || (item_word && !continued) || word,
            Some(_) => !balanced && column_0 && item_word,
        };
        if pieces.is_empty() || (begins && token.first && !only_docs) {
            if let (Some(bracket), Some(piece)) = (inside, pieces.last_mut()) {
                let problem =
                    unclosed(at(bracket), span(bracket)).with(span(index), "a new item begins here");
                piece.tell(problem, problems);
            }
            nesting = Nesting::default();
            pieces.push(Piece { tokens: index..index, broken: false });
            only_docs = true;
        }
        only_docs &= token.kind == Kind::Doc;
        let Some(piece) = pieces.last_mut() else { continue };
        piece.tokens.end = index + 1;
        if token.kind == Kind::Doc && !token.first {
            let problem =
                Problem::error(&MISPLACED_DOC_COMMENT, "a `///` comment stands after what it describes")
                    .at(span(index), "this describes what comes next")
                    .help("move it to a line of its own, before; or write `//` for a plain remark");
            piece.tell(problem, problems);
        }
        match nesting.follow(index, token.kind, at) {
            None => {}
            Some(Fault::TooDeep) => piece.tell(too_deep(span(index)), problems),
            Some(Fault::Unclosed(opening)) => {
                let text = format!("this `{}` comes before its `{}`", at(index), partner(at(opening)));
                piece.tell(unclosed(at(opening), span(opening)).with(span(index), text), problems);
            }
            Some(Fault::Unopened) => {
                let problem =
                    Problem::error(&UNBALANCED_BRACKETS, format!("this `{}` closes nothing", at(index)))
                        .at(span(index), "nothing is open here")
                        .help("delete it, or look above for the bracket that is missing");
                piece.tell(problem, problems);
            }
        }
    }
    if let (Some(&bracket), Some(piece)) = (nesting.brackets.first(), pieces.last_mut()) {
        piece.tell(unclosed(at(bracket), span(bracket)), problems);
    }
    pieces
}

impl Piece {
    /// One problem of this kind is enough for an item.
    fn tell(&mut self, problem: Problem, problems: &mut Problems) {
        if !self.broken {
            problems.push(problem);
        }
        self.broken = true;
    }
}

/// What is open at a token of an item.
#[derive(Default)]
struct Nesting {
    open: Vec<Opened>,
    /// The tokens of the brackets among them.
    brackets: Vec<usize>,
    /// How many of them are `(`, `[` and `{`.
    counts: [usize; 3],
    /// Whether the last token ends an operand.
    operand: bool,
}

#[derive(Clone, Copy, PartialEq)]
enum Opened {
    Bracket,
    Bar,
    If,
}

/// What is wrong at a token.
enum Fault {
    /// The bracket of that token has another partner, or none.
    Unclosed(usize),
    Unopened,
    TooDeep,
}

impl Nesting {
    fn follow<'a>(&mut self, index: usize, kind: Kind, at: impl Fn(usize) -> &'a str) -> Option<Fault> {
        let before = std::mem::replace(&mut self.operand, ends_operand(kind, at(index)));
        let last = self.open.last().copied();
        match (kind, at(index)) {
            (Kind::Close, closing) => return self.close(closing, at),
            (Kind::Word, "else") if last == Some(Opened::If) => self.open.truncate(self.open.len() - 1),
            (Kind::Symbol, "|") if last == Some(Opened::Bar) && before => {
                self.open.truncate(self.open.len() - 1)
            }
            (Kind::Open, bracket) => {
                self.open.push(Opened::Bracket);
                self.brackets.push(index);
                self.counts[shape(bracket)] += 1;
            }
            (Kind::Word, "if") if !before => self.open.push(Opened::If),
            (Kind::Symbol, "|") => {
                self.open.push(Opened::Bar);
                self.operand = false;
            }
            _ => {}
        }
        (self.open.len() > MAX_DEPTH).then_some(Fault::TooDeep)
    }

    /// Closes what is open up to the partner of a bracket; up to the last bracket if it has none.
    fn close<'a>(&mut self, closing: &str, at: impl Fn(usize) -> &'a str) -> Option<Fault> {
        let mut fault = None;
        while let Some(opened) = self.open.pop() {
            if opened != Opened::Bracket {
                continue;
            }
            let opening = self.brackets.pop()?;
            self.counts[shape(at(opening))] -= 1;
            if partner(at(opening)) == closing {
                return fault;
            }
            fault.get_or_insert(Fault::Unclosed(opening));
            if self.counts[shape(closing)] == 0 {
                return fault;
            }
        }
        fault.or(Some(Fault::Unopened))
    }
}

/// 0, 1 or 2 for round, square and curly brackets.
fn shape(bracket: &str) -> usize {
    match bracket {
        "(" | ")" => 0,
        "[" | "]" => 1,
        _ => 2,
    }
}

pub(crate) fn too_deep(span: Span) -> Problem {
    Problem::error(&NESTED_TOO_DEEPLY, format!("this is nested more than {MAX_DEPTH} levels deep"))
        .at(span, "the limit is passed here")
        .help("give a part of it a name with `let`, or make it a `fn`")
}

fn unclosed(bracket: &str, span: Span) -> Problem {
    Problem::error(&UNBALANCED_BRACKETS, format!("this `{bracket}` is never closed"))
        .at(span, format!("its `{}` is missing", partner(bracket)))
        .help(format!("add a `{}` where it should end", partner(bracket)))
}

fn balanced(text: &str, tokens: &[Token]) -> bool {
    let mut open = Vec::new();
    tokens.iter().all(|token| match (token.kind, &text[token.start..token.end]) {
        (Kind::Open, bracket) => {
            open.push(partner(bracket));
            true
        }
        (Kind::Close, bracket) => open.pop() == Some(bracket),
        _ => true,
    }) && open.is_empty()
}

fn partner(bracket: &str) -> &'static str {
    match bracket {
        "(" => ")",
        "[" => "]",
        _ => "}",
    }
}

/// Whether a token can be the last of an operand.
fn ends_operand(kind: Kind, text: &str) -> bool {
    match kind {
        Kind::Word => !CONNECTIVES.contains(&text),
        Kind::Number | Kind::Close | Kind::Text => true,
        Kind::Symbol => matches!(text, "|" | "%"),
        Kind::Open | Kind::Doc | Kind::Comment => false,
    }
}

/// Whether something must follow a token.
fn wants_more(kind: Kind, text: &str) -> bool {
    match kind {
        Kind::Word => CONNECTIVES.contains(&text),
        Kind::Symbol => !matches!(text, "|" | "%"),
        Kind::Open => true,
        Kind::Number | Kind::Close | Kind::Doc | Kind::Comment | Kind::Text => false,
    }
}
