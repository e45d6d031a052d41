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
    let problem = Problem::error(&UNKNOWN_ITEM, format!("`{word}` does not begin anything"));
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
    let span = |token: &Token| Span { file: context.file, start: token.start, end: token.end };
    let text = |token: &Token| &context.text[token.start..token.end];
    let before = tokens.iter().take_while(|token| token.end <= position).last().map_or("", text);
    let next = tokens.iter().find(|token| token.end > position);
    let (found, at) = match next {
        Some(token) => (text(token), span(token)),
        None => {
            let end = tokens.last().map_or(position, |token| token.end);
            ("", Span { file: context.file, start: end, end })
        }
    };
    let ErrorVariant::ParsingError { positives, .. } = error.variant else {
        return Problem::error(&TOO_COMPLEX, "this item is too complex")
            .at(at, "given up here")
            .help("cut it into several with `let` or `fn`");
    };
    let expected = expected(&positives);
    let problem = if is_word(found) && expected == "a name" {
        let message = format!("`{found}` is a word of the language and cannot be a name");
        let problem = Problem::error(&RESERVED_WORD, message).at(at, "expected a name");
        problem.help(format!("choose another name, for example `{found}_1`"))
    } else {
        let what = if found.is_empty() { "the end of this item".to_owned() } else { format!("`{found}`") };
        let problem = Problem::error(&SYNTAX, format!("expected {expected}, found {what}"));
        let problem = problem.at(at, "not expected here");
        match hint(&positives, before, found) {
            Some(hint) => problem.help(hint),
            None => problem,
        }
    };
    let item = tokens.iter().find(|token| token.kind != Kind::Doc);
    match item.filter(|item| context.text[item.start..at.start].contains('\n')) {
        Some(item) => problem.with(span(item), format!("in this `{}`", text(item))),
        None => problem,
    }
}

/// What to do about a token, from what could have stood there.
fn hint(positives: &[Rule], before: &str, found: &str) -> Option<String> {
    let wanted = |rule| positives.contains(&rule);
    let after_value = wanted(Rule::comparison);
    let value = found.starts_with(|first: char| first.is_ascii_alphanumeric() || matches!(first, '(' | '_'));
    let hint = match found {
        "&&" | "&" => "write `and`",
        "!" => "write `not`",
        "**" => "a power is written `x^2`",
        ";" => "entries are separated by commas or line ends",
        "\"" | "'" | "“" | "”" if !wanted(Rule::text) => {
            "there is no text in quotes; names stand as they are"
        }
        "−" | "–" | "—" => "write the minus as `-`",
        "×" | "·" | "⋅" => "write `*` to multiply",
        "÷" => "write `/` to divide",
        "≤" => "write `<=`",
        "≥" => "write `>=`",
        "≠" => "write `!=`",
        "°" => "write `deg`",
        "." if !after_value && wanted(Rule::expr) => "write the zero before the decimal point: `0.5`",
        _ if !found.is_ascii() => "names are made of the letters a to z, digits and `_`",
        "=" if after_value => "to compare two values, write `==`",
        "=" if wanted(Rule::kw_of) => "say whose formation it is: `formation F of follower = …`",
        ":" | "==" if wanted(Rule::becomes) || wanted(Rule::equals) => "a value is given with `=`",
        "{" if wanted(Rule::open_paren) => "without parameters, write `()` before it",
        ":" if wanted(Rule::open_bracket) => {
            return Some(format!("say how many there are: `{before}[3] : …`"));
        }
        "\"" if wanted(Rule::text) => "a text ends on its line: `\"walk.csv\"`",
        _ if wanted(Rule::text) => "a text stands in quotes: `\"walk.csv\"`",
        "[" if wanted(Rule::colon) => {
            "several of a kind are declared with `agents`: `agents follower[3] : point`"
        }
        _ if after_value && wanted(Rule::bar) => "a `|` before this is not closed",
        _ if wanted(Rule::kw_in) && wanted(Rule::comma) && !wanted(Rule::colon) => {
            "an index runs over a set: `i in follower`, or `i, j in pairs(all)`"
        }
        _ if after_value && value && !CONTEXTUAL.contains(&found) && before != "," => {
            "to multiply, write `*` between the two"
        }
        _ => return None,
    };
    Some(hint.to_owned())
}

/// Words that continue an item, so that no `*` is missing before them.
const CONTEXTUAL: &[&str] =
    &["about", "at", "beats", "costs", "else", "for", "if", "in", "of", "on", "then", "via", "when", "with"];

/// Whether a word is one of the language, which no name may be.
fn is_word(word: &str) -> bool {
    const INNER: &[&str] = &[
        "and", "at", "costs", "else", "false", "for", "if", "in", "let", "not", "or", "then", "true", "when",
    ];
    ITEM_WORDS.contains(&word) || INNER.contains(&word)
}

/// `a`, `a or b`, `a, b or c`: what the grammar would have taken, in words.
fn expected(positives: &[Rule]) -> String {
    let after_value = positives.contains(&Rule::comparison);
    let before_value = positives.contains(&Rule::literal) || positives.contains(&Rule::expr);
    let mut words: Vec<String> = Vec::new();
    if before_value {
        words.push("a value".to_owned());
    }
    for rule in positives {
        let hidden = (after_value && OPERATORS.contains(rule)) || (before_value && BEGINNINGS.contains(rule));
        if let Some(word) =
            describe(*rule).filter(|word| !hidden && !ENTRIES.contains(rule) && !words.contains(word))
        {
            words.push(word);
        }
    }
    if after_value {
        words.push("an operator".to_owned());
    }
    if positives.contains(&Rule::EOI) {
        words.push("the end of the item".to_owned());
    }
    if words.is_empty() {
        words.push("an entry".to_owned());
    }
    match words.split_last() {
        Some((last, [])) => last.clone(),
        Some((last, others)) => format!("{} or {last}", others.join(", ")),
        None => String::new(),
    }
}

/// What may follow a value and is told as one operator. The name is that of a unit.
#[rustfmt::skip]
const OPERATORS: &[Rule] = &[
    Rule::comparison, Rule::plus_minus, Rule::times_over, Rule::power, Rule::dots, Rule::kw_and, Rule::kw_or,
    Rule::dot, Rule::open_bracket, Rule::open_paren, Rule::percent, Rule::name,
];

/// What a value may begin with.
#[rustfmt::skip]
const BEGINNINGS: &[Rule] = &[
    Rule::negative, Rule::fold_word, Rule::tally_word, Rule::truth, Rule::literal, Rule::name, Rule::bar,
    Rule::open_paren, Rule::open_bracket, Rule::kw_if, Rule::kw_not, Rule::expr,
];

/// Whole entries: a comma is told instead.
const ENTRIES: &[Rule] = &[
    Rule::ending,
    Rule::term,
    Rule::setting,
    Rule::observation,
    Rule::observe,
    Rule::output,
    Rule::next,
    Rule::state,
    Rule::doc_line,
];

fn describe(rule: Rule) -> Option<String> {
    let symbol = match rule {
        Rule::arrow => "->",
        Rule::bar => "|",
        Rule::close_angle => ">",
        Rule::close_brace => "}",
        Rule::close_bracket => "]",
        Rule::close_paren => ")",
        Rule::colon => ":",
        Rule::comma => ",",
        Rule::dot => ".",
        Rule::equals => "=",
        Rule::open_angle => "<",
        Rule::open_brace => "{",
        Rule::open_bracket => "[",
        Rule::open_paren => "(",
        Rule::becomes => return Some("`=`, `~`".to_owned()),
        Rule::side => return Some("`<`, `>`".to_owned()),
        Rule::exponent | Rule::integer => return Some("a whole number".to_owned()),
        Rule::EOI => return None,
        Rule::text => return Some("a text in quotes".to_owned()),
        Rule::within_of => return Some("`±`".to_owned()),
        Rule::place | Rule::turn | Rule::steer | Rule::step | Rule::check => {
            return Some(format!("`{rule:?}`"));
        }
        Rule::minus => "-",
        Rule::extern_kind => return Some("`fn`, `dist`, `algorithm`, `controller` or `body`".to_owned()),
        Rule::type_ | Rule::dimensions | Rule::dimension_factor => return Some("a type".to_owned()),
        _ => {
            let rule = format!("{rule:?}");
            let word = rule.strip_prefix("kw_").map(|word| format!("`{word}`"));
            return Some(word.unwrap_or_else(|| "a name".to_owned()));
        }
    };
    Some(format!("`{symbol}`"))
}
