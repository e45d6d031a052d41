//! Random text from the productions of `scn.pest` itself, so that new grammar is tried without new code here.

use std::collections::BTreeMap;

use mpgx_random::Stream;
use pest_meta::ast::{Expr, RuleType};
use pest_meta::parser::{self, Rule};

const TEXT: &str = include_str!("../../../lang/src/scn.pest");

/// The rules of the language, by name.
pub struct Grammar {
    rules: BTreeMap<String, Production>,
}

struct Production {
    /// Whether blanks may stand between its parts; `None`: as where it is used.
    spaced: Option<bool>,
    expr: Expr,
    /// Levels of rules below it at least.
    height: usize,
}

/// Words for what the grammar leaves to the author.
pub struct Words {
    pub names: Vec<String>,
    pub numbers: Vec<String>,
}

impl Grammar {
    /// # Errors
    /// If the grammar is none.
    pub fn new() -> Result<Grammar, String> {
        let nodes = parser::parse(Rule::grammar_rules, TEXT).map_err(|error| error.to_string())?;
        let rules = parser::consume_rules(nodes).map_err(|errors| format!("{errors:?}"))?;
        let production = |ty, expr| Production {
            spaced: match ty {
                RuleType::Atomic | RuleType::CompoundAtomic => Some(false),
                RuleType::NonAtomic => Some(true),
                RuleType::Normal | RuleType::Silent => None,
            },
            expr,
            height: usize::MAX,
        };
        let rules = rules.into_iter().map(|rule| (rule.name, production(rule.ty, rule.expr)));
        let mut grammar = Grammar { rules: rules.collect() };
        // Heights sink until none does any more.
        loop {
            let height = |rule: &Production| grammar.height(&rule.expr).saturating_add(1);
            let heights: Vec<usize> = grammar.rules.values().map(height).collect();
            let sunk = grammar.rules.values().zip(&heights).any(|(rule, height)| rule.height != *height);
            grammar.rules.values_mut().zip(heights).for_each(|(rule, height)| rule.height = height);
            if !sunk {
                return Ok(grammar);
            }
        }
    }

    fn height(&self, expr: &Expr) -> usize {
        match expr {
            Expr::Ident(name) => self.rules.get(name).map_or(0, |rule| rule.height),
            Expr::Seq(a, b) => self.height(a).max(self.height(b)),
            Expr::Choice(a, b) => self.height(a).min(self.height(b)),
            Expr::RepOnce(a) | Expr::Push(a) => self.height(a),
            _ => 0,
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
            Expr::Str(text) | Expr::Insens(text) => self.text += text,
            Expr::Range(low, _) => self.text += low,
            Expr::Ident(name) => self.rule(name, spaced, depth),
            Expr::Seq(a, b) => {
                self.expr(a, spaced, depth);
                self.blank(spaced);
                self.expr(b, spaced, depth);
            }
            Expr::Choice(..) => {
                let mut ways = Vec::new();
                choices(expr, &mut ways);
                ways.retain(|way| self.grammar.height(way) < depth);
                match ways.get(self.random.below(ways.len().max(1) as u64) as usize) {
                    Some(way) => self.expr(way, spaced, depth),
                    None => self.soonest(expr, spaced, depth),
                }
            }
            Expr::Opt(a) if self.may(a, depth) => self.expr(a, spaced, depth),
            Expr::Rep(a) => self.repeat(a, spaced, depth),
            Expr::RepOnce(a) => {
                self.expr(a, spaced, depth);
                self.repeat(a, spaced, depth);
            }
            _ => {}
        }
    }

    fn soonest(&mut self, expr: &Expr, spaced: bool, depth: usize) {
        let mut ways = Vec::new();
        choices(expr, &mut ways);
        if let Some(way) = ways.into_iter().min_by_key(|way| self.grammar.height(way)) {
            self.expr(way, spaced, depth);
        }
    }

    /// Whether to write something that could be left out.
    fn may(&mut self, expr: &Expr, depth: usize) -> bool {
        self.grammar.height(expr) < depth && self.random.below(self.depth as u64) < depth as u64 / 2
    }

    fn repeat(&mut self, expr: &Expr, spaced: bool, depth: usize) {
        let mut most = 4;
        while most > 0 && self.may(expr, depth) {
            if spaced {
                self.text += if self.random.below(3) == 0 { " " } else { "\n" };
            }
            self.expr(expr, spaced, depth);
            most -= 1;
        }
    }

    fn blank(&mut self, spaced: bool) {
        if spaced && !self.text.ends_with(['\n', ' ']) {
            self.text += if self.random.below(40) == 0 { "\n    " } else { " " };
        }
    }
}

fn choices<'a>(expr: &'a Expr, ways: &mut Vec<&'a Expr>) {
    match expr {
        Expr::Choice(a, b) => {
            choices(a, ways);
            choices(b, ways);
        }
        way => ways.push(way),
    }
}
