//! Random text from the productions of `scn.pest` itself, so that new grammar is tried without new code here.

use std::collections::BTreeMap;

use mpgx_random::Stream;

use super::rules::{Expr, Rule, rules};

const TEXT: &str = include_str!("../../../lang/src/scn.pest");

/// The rules of the language, by name.
pub struct Grammar {
    rules: BTreeMap<String, Rule>,
    /// Levels of rules below each, at least.
    heights: BTreeMap<String, usize>,
}

/// Words for what the grammar leaves to the author.
#[derive(Clone, Default)]
pub struct Words {
    pub names: Vec<String>,
    pub numbers: Vec<String>,
}

impl Grammar {
    /// `None` if the grammar cannot be read.
    pub fn new() -> Option<Grammar> {
        let rules = rules(TEXT)?;
        let heights = rules.keys().map(|name| (name.clone(), usize::MAX)).collect();
        let mut grammar = Grammar { rules, heights };
        // Heights sink until none does any more.
        loop {
            let height =
                |(name, rule): (&String, &Rule)| (name.clone(), grammar.height(&rule.expr).saturating_add(1));
            let heights: BTreeMap<String, usize> = grammar.rules.iter().map(height).collect();
            if heights == grammar.heights {
                return Some(grammar);
            }
            grammar.heights = heights;
        }
    }

    fn height(&self, expr: &Expr) -> usize {
        match expr {
            Expr::Name(name) => self.heights.get(name).copied().unwrap_or(0),
            Expr::Row(parts) => parts.iter().map(|part| self.height(part)).max().unwrap_or(0),
            Expr::Choice(ways) => ways.iter().map(|way| self.height(way)).min().unwrap_or(0),
            Expr::Repeated(part, 1) => self.height(part),
            Expr::Text(_) | Expr::Optional(_) | Expr::Repeated(..) => 0,
        }
    }

    /// What a rule allows, with these words: so many levels of rules at random, below them whatever ends soonest.
    pub fn write(&self, rule: &str, words: &Words, depth: usize, random: &mut Stream) -> String {
        let mut writer = Writer { grammar: self, words, depth, random, text: String::new() };
        writer.rule(rule, true, depth);
        writer.text
    }
}

struct Writer<'a> {
    grammar: &'a Grammar,
    words: &'a Words,
    depth: usize,
    random: &'a mut Stream,
    text: String,
}

impl Writer<'_> {
    fn rule(&mut self, name: &str, spaced: bool, depth: usize) {
        match name {
            "name" | "new_name" => return self.word(|words| &words.names),
            "literal" | "integer" => return self.word(|words| &words.numbers),
            "text" => return self.text += "\"a text\"",
            "doc_line" => return self.text += "/// A remark.\n",
            "blank" | "EOI" | "SOI" => return,
            "ANY" | "letter" | "ASCII_DIGIT" => return self.text += "1",
            _ => {}
        }
        if let Some(rule) = self.grammar.rules.get(name) {
            self.expr(&rule.expr, rule.spaced.unwrap_or(spaced), depth.saturating_sub(1));
        }
    }

    fn word(&mut self, of: fn(&Words) -> &Vec<String>) {
        let words = of(self.words);
        let chosen = self.random.below(words.len().max(1) as u64) as usize;
        self.text += words.get(chosen).map_or("x", String::as_str);
    }

    fn expr(&mut self, expr: &Expr, spaced: bool, depth: usize) {
        match expr {
            Expr::Text(text) => self.text += text,
            Expr::Name(name) => self.rule(name, spaced, depth),
            Expr::Row(parts) => {
                for (k, part) in parts.iter().enumerate() {
                    if k > 0 && spaced && !self.text.ends_with(['\n', ' ']) {
                        self.text += if self.random.below(40) == 0 { "\n    " } else { " " };
                    }
                    self.expr(part, spaced, depth);
                }
            }
            Expr::Choice(ways) => {
                let low: Vec<&Expr> = ways.iter().filter(|way| self.grammar.height(way) < depth).collect();
                let chosen = self.random.below(low.len().max(1) as u64) as usize;
                let soonest = || ways.iter().min_by_key(|way| self.grammar.height(way));
                if let Some(way) = low.get(chosen).copied().or_else(soonest) {
                    self.expr(way, spaced, depth);
                }
            }
            Expr::Optional(part) if self.may(part, depth) => self.expr(part, spaced, depth),
            Expr::Optional(_) => {}
            Expr::Repeated(part, least) => {
                if *least == 1 {
                    self.expr(part, spaced, depth);
                }
                for _ in 0..4 {
                    if !self.may(part, depth) {
                        break;
                    }
                    if spaced {
                        self.text += if self.random.below(3) == 0 { " " } else { "\n" };
                    }
                    self.expr(part, spaced, depth);
                }
            }
        }
    }

    /// Whether to write something that could be left out.
    fn may(&mut self, expr: &Expr, depth: usize) -> bool {
        self.grammar.height(expr) < depth && self.random.below(self.depth as u64) < depth as u64 / 2
    }
}
