//! What inputs are made from: the scenarios, the standard library and the golden cases.

use std::collections::BTreeSet;

use mpgx_lang::parse::parse;
use mpgx_lang::problem::Problems;
use mpgx_lang::source::Sources;
use mpgx_lang::stdlib::MODULES;

use super::grammar::Words;
use crate::{golden, root, scenarios_in};

/// Bytes of a file that is taken: longer ones say little that shorter ones do not.
const MOST_BYTES: usize = 3000;

pub struct Corpus {
    /// Whole files, valid and not.
    pub files: Vec<String>,
    /// Those that compile, shortest first.
    pub valid: Vec<Scenario>,
    /// Single items of all of them.
    pub items: Vec<String>,
    /// Parts of items between blanks.
    pub tokens: Vec<String>,
    pub words: Words,
}

#[derive(Clone, Default)]
pub struct Scenario {
    pub items: Vec<String>,
    /// What its formulas may speak of.
    pub words: Words,
}

impl Scenario {
    fn new(text: &str) -> Scenario {
        let items = items(text);
        let known = ["p", "v", "t", "i", "all", "obstacles", "pairs", "nearest", "edges", "members", "size"];
        let names = items.iter().filter_map(|item| declared(item)).chain(known).map(str::to_owned).collect();
        let numbers = ["0", "1", "2", "0.5 m", "1 m / s", "1 s"].map(str::to_owned).into();
        Scenario { items, words: Words { names, numbers } }
    }
}

impl Corpus {
    /// Reads the files; the same order every time.
    pub fn new() -> Corpus {
        let passes = ["parse", "check", "reward", "plan", "diagnostics", "format", "cases"];
        let folders = passes.iter().map(|pass| golden::folder(pass)).chain([root().join("scenarios")]);
        let paths = folders.flat_map(|folder| scenarios_in(&folder));
        let texts = paths.filter_map(|path| std::fs::read_to_string(path).ok());
        let mut files: Vec<String> = texts.filter(|text| text.len() <= MOST_BYTES).collect();
        files.extend(MODULES.iter().map(|(_, text)| text.to_string()));
        let mut valid: Vec<String> =
            files.iter().filter(|text| super::front::plan(text).is_some()).cloned().collect();
        valid.sort_by_key(String::len);
        let valid = valid.iter().map(|text| Scenario::new(text)).collect();
        let items = unique(files.iter().flat_map(|text| items(text)));
        let tokens = unique(files.iter().flat_map(|text| tokens(text).into_iter().map(str::to_owned)));
        let begins = |token: &&String, with: fn(u8) -> bool| token.bytes().next().is_some_and(with);
        let names = tokens.iter().filter(|token| begins(token, |byte| byte.is_ascii_alphabetic()));
        let numbers = tokens.iter().filter(|token| begins(token, |byte| byte.is_ascii_digit()));
        let extremes =
            ["0", "1", "1e308", "1e-320", "4294967296", "18446744073709551616", "0.1e-9", "1000000"];
        let words = Words {
            names: names.cloned().collect(),
            numbers: numbers.cloned().chain(extremes.map(str::to_owned)).collect(),
        };
        Corpus { files, valid, items, tokens, words }
    }
}

fn unique(texts: impl Iterator<Item = String>) -> Vec<String> {
    texts.collect::<BTreeSet<String>>().into_iter().collect()
}

/// The items of a file that have no syntax errors.
fn items(text: &str) -> Vec<String> {
    let (mut sources, mut problems) = (Sources::default(), Problems::default());
    let file = sources.add("a.scn", text.to_owned());
    let tree = parse(&sources, file, &mut problems);
    tree.items.iter().map(|item| sources.text(item.span).to_owned()).collect()
}

/// The name of what an item declares: its second word.
fn declared(item: &str) -> Option<&str> {
    let code = item.lines().find(|line| !line.starts_with("///"))?;
    tokens(code).into_iter().filter(|token| token.starts_with(|c: char| c.is_ascii_alphabetic())).nth(1)
}

/// Words, numbers, blanks and single signs, one after another.
pub fn tokens(text: &str) -> Vec<&str> {
    let kind = |c: char| match c {
        _ if c.is_ascii_alphanumeric() || c == '_' => 0,
        '.' => 1,
        ' ' | '\n' => 2,
        _ => 3,
    };
    let (mut tokens, mut start, mut last) = (Vec::new(), 0, 3);
    for (at, c) in text.char_indices() {
        let now = kind(c);
        // A point between digits belongs to them.
        let fraction = now == 1 && last == 0 && text[start..].starts_with(|c: char| c.is_ascii_digit());
        let same = (now == last && now != 3) || fraction;
        if at > start && !same {
            tokens.push(&text[start..at]);
            start = at;
        }
        last = if fraction { 0 } else { now };
    }
    tokens.push(&text[start..]);
    tokens
}
