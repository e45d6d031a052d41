//! Syntax errors in words.

use pest::error::{Error, ErrorVariant, InputLocation};

use crate::ast::Span;
use crate::problem::{Code, Problem, Problems, did_you_mean};

use super::scan::{ITEM_WORDS, Kind, Token};
use super::{Context, Rule};

pub(crate) const SYNTAX: Code = Code {
    name: "syntax",
    explain: "\
The text does not follow the grammar of the language. The message tells what was found and what could stand there.
Every item begins on a line of its own with its word; entries of a block are separated by commas or line ends:

    param side = 0.4 m

    reward {
        gap = -sum(i in follower) |p[i] - F[i]|
    }",
};

pub(crate) const UNKNOWN_ITEM: Code = Code {
    name: "unknown-item",
    explain: "\
Every item of a file begins with a word that tells what it is: scenario, use, param, let, fn, dist, motion, formation,
world, agent, agents, require, observe, reward, end, learn, compare, seeds, evaluate, expect, preset, extern, unit
or dimension.

    wrold { dt = 0.1 s }      // wrong
    world { dt = 0.1 s }      // right",
};

pub(crate) const RESERVED_WORD: Code = Code {
    name: "reserved-word",
    explain: "\
Words of the language cannot be names: those that begin an item (`world`, `reward`, `motion`, …) and those that stand
inside formulas (`if`, `in`, `when`, `at`, …). Choose another name.

    param end = 3 s           // wrong
    param end_time = 3 s      // right",
};

pub(crate) const TOO_COMPLEX: Code = Code {
    name: "too-complex",
    explain: "\
One item of the file takes more work to read than any written by a person would. Cut it into several with `let`, `fn`
or several files.",
};

/// Whether the first word of some tokens begins an item; tells of it if not.
pub(crate) fn begins_an_item(text: &str, tokens: &[Token], file: usize, problems: &mut Problems) -> bool {
    let span = |token: &Token| Span { file, start: token.start, end: token.end };
    let Some(first) = tokens.iter().find(|token| token.kind != Kind::Doc) else {
        let Some(doc) = tokens.last() else { return false };
        problems.push(
            Problem::error(&SYNTAX, "this comment describes nothing")
                .at(span(doc), "nothing follows")
                .help("write `//` for a plain remark"),
        );
        return false;
    };
    let word = &text[first.start..first.end];
    if ITEM_WORDS.contains(&word) {
        return true;
    }
    let problem = Problem::error(&UNKNOWN_ITEM, format!("{} does not begin anything", quoted(word)));
    let problem = problem.at(span(first), "expected an item, such as `param` or `reward`");
    let next = tokens.get(1).map_or("", |token| &text[token.start..token.end]);
    problems.push(match did_you_mean(word, ITEM_WORDS.iter().copied()) {
        Some(near) => problem.help(format!("did you mean `{near}`?")),
        None if next == "=" => {
            problem.help(format!("a value that can be changed is a parameter: `param {word} = …`"))
        }
        None => problem.note(format!("items begin with {}", ITEM_WORDS.join(", "))),
    });
    false
}

/// The problem of a text that the grammar refused.
pub(crate) fn problem(context: &Context, tokens: &[Token], error: Error<Rule>) -> Problem {
    let position = match error.location {
        InputLocation::Pos(at) | InputLocation::Span((at, _)) => context.offset + at,
    };
    let index = tokens.iter().position(|token| token.end > position);
    let found = |index: usize| tokens.get(index).map_or("", |token| &context.text[token.start..token.end]);
    let (word, before) = match index {
        Some(index) => (found(index), if index > 0 { found(index - 1) } else { "" }),
        None => ("", tokens.last().map_or("", |token| &context.text[token.start..token.end])),
    };
    let end = tokens.last().map_or(position, |token| token.end);
    let span = match index.and_then(|index| tokens.get(index)) {
        Some(token) => Span { file: context.file, start: token.start, end: token.end },
        None => Span { file: context.file, start: end, end },
    };
    let expected = match &error.variant {
        ErrorVariant::ParsingError { positives, .. } => expected(positives),
        ErrorVariant::CustomError { .. } => {
            let problem = Problem::error(&TOO_COMPLEX, "this item is too complex");
            return problem.at(span, "given up here").help("cut it into several with `let` or `fn`");
        }
    };
    let names = |rules: &[Rule]| rules.iter().any(|rule| matches!(rule, Rule::name | Rule::new_name));
    let name_wanted =
        matches!(&error.variant, ErrorVariant::ParsingError { positives, .. } if names(positives));
    if name_wanted && is_word(word) {
        return Problem::error(
            &RESERVED_WORD,
            format!("{} is a word of the language and cannot be a name", quoted(word)),
        )
        .at(span, format!("expected {expected}"))
        .help(format!("choose another name, for example `{word}_1`"));
    }
    let what = if word.is_empty() { "the end of this item".to_owned() } else { quoted(word) };
    let problem = Problem::error(&SYNTAX, format!("expected {expected}, found {what}"));
    let problem = problem.at(span, format!("expected {expected}"));
    match hint(before, word) {
        Some(hint) => problem.help(hint),
        None => problem,
    }
}

/// What to do about a token that cannot stand after the one before it.
fn hint(before: &str, found: &str) -> Option<String> {
    let operand =
        before.ends_with(|last: char| last.is_alphanumeric() || matches!(last, ')' | ']' | '_' | '|' | '%'));
    let begins_operand =
        found.starts_with(|first: char| first.is_ascii_alphanumeric() || matches!(first, '(' | '_'));
    Some(match found {
        "&&" => "write `and`".to_owned(),
        "&" => "write `and`".to_owned(),
        "!" => "write `not`".to_owned(),
        "**" => "a power is written `x^2`".to_owned(),
        "*" if before == "*" => "a power is written `x^2`".to_owned(),
        "=" if before == "=" || operand => "to compare two values, write `==`".to_owned(),
        "==" => "to give a value, write `=`".to_owned(),
        "." if !operand => "write the zero before the decimal point: `0.5`".to_owned(),
        ";" => "entries are separated by commas or line ends".to_owned(),
        "\"" | "'" | "“" | "”" => {
            "the language has no text in quotes; names stand as they are".to_owned()
        }
        "−" | "–" | "—" => "write the minus as `-`".to_owned(),
        "×" | "·" | "⋅" => "write `*` to multiply".to_owned(),
        "÷" => "write `/` to divide".to_owned(),
        "≤" => "write `<=`".to_owned(),
        "≥" => "write `>=`".to_owned(),
        "≠" => "write `!=`".to_owned(),
        "°" => "write `deg`".to_owned(),
        ":" => "a setting is written `name = value`".to_owned(),
        "[" if before != "]" && is_name(before) => {
            "several of a kind are declared with `agents`, for example `agents follower[3] : point`"
                .to_owned()
        }
        _ if !found.is_ascii() => "names are made of the letters a to z, digits and `_`".to_owned(),
        _ if operand && begins_operand && !is_word(found) => "to multiply, write `*` between them".to_owned(),
        _ => return None,
    })
}

fn is_name(text: &str) -> bool {
    text.starts_with(|first: char| first.is_ascii_alphabetic() || first == '_')
}

/// Whether a word is one of the language, which no name may be.
fn is_word(word: &str) -> bool {
    const INNER: &[&str] = &[
        "and", "at", "costs", "else", "false", "for", "if", "in", "let", "not", "or", "then", "true", "when",
    ];
    ITEM_WORDS.contains(&word) || INNER.contains(&word)
}

fn quoted(word: &str) -> String {
    format!("`{word}`")
}

/// `a`, `a or b`, `a, b or c`: what the grammar would have taken, in words.
fn expected(rules: &[Rule]) -> String {
    let mut words: Vec<(u8, &str)> = rules.iter().filter_map(|rule| describe(*rule)).collect();
    words.sort_unstable();
    words.dedup();
    let words: Vec<&str> = words.into_iter().map(|(_, word)| word).collect();
    match words.split_last() {
        None => "something else".to_owned(),
        Some((last, [])) => (*last).to_owned(),
        Some((last, others)) => format!("{} or {last}", others.join(", ")),
    }
}

/// A rule in words, and how far back in a list of what was expected it stands. `None` for what is never missed.
fn describe(rule: Rule) -> Option<(u8, &'static str)> {
    Some(match rule {
        Rule::name | Rule::new_name | Rule::path | Rule::names | Rule::use_of | Rule::parameter => {
            (0, "a name")
        }
        Rule::setting | Rule::term | Rule::ending | Rule::output => (0, "a name"),
        Rule::EOI => (8, "the end of the item"),
        _ => return None,
    })
}
