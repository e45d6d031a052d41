//! Reads a grammar of pest: rules of strings, names, `~`, `|`, `*`, `+`, `?` and parentheses. What only looks ahead
//! (`!x`, `&x`) is left out. (pest's own reader of grammars would change how pest is built into the compiler.)

use std::collections::BTreeMap;
use std::iter::Peekable;
use std::str::Chars;

/// The right side of a rule.
#[derive(Clone, Debug, PartialEq)]
pub enum Expr {
    Text(String),
    Name(String),
    Row(Vec<Expr>),
    Choice(Vec<Expr>),
    Optional(Box<Expr>),
    /// As often as one likes, at least so often (0 or 1).
    Repeated(Box<Expr>, usize),
}

#[derive(Clone, Debug, PartialEq)]
pub struct Rule {
    /// Whether blanks may stand between its parts; `None`: as where it is used.
    pub spaced: Option<bool>,
    pub expr: Expr,
}

/// The rules of a grammar by name; `None` if it cannot be read.
pub fn rules(text: &str) -> Option<BTreeMap<String, Rule>> {
    let lines = text.lines().map(|line| if line.trim_start().starts_with("//") { "" } else { line });
    let text = lines.collect::<Vec<_>>().join("\n");
    let mut reader = Reader(text.chars().peekable());
    let mut rules = BTreeMap::new();
    while reader.next().is_some() {
        let name = reader.word();
        reader.sign('=')?;
        let spaced = match reader.next()? {
            '@' | '$' => Some(false),
            '!' => Some(true),
            _ => None,
        };
        while reader.next()? != '{' {
            reader.0.next();
        }
        reader.sign('{')?;
        let expr = reader.choice()?;
        reader.sign('}')?;
        rules.insert(name, Rule { spaced, expr });
    }
    Some(rules)
}

struct Reader<'a>(Peekable<Chars<'a>>);

impl Reader<'_> {
    /// The next sign that is no blank.
    fn next(&mut self) -> Option<char> {
        while self.0.next_if(|c| c.is_whitespace()).is_some() {}
        self.0.peek().copied()
    }

    fn sign(&mut self, sign: char) -> Option<()> {
        (self.next()? == sign).then(|| {
            self.0.next();
        })
    }

    fn word(&mut self) -> String {
        self.next();
        std::iter::from_fn(|| self.0.next_if(|c| c.is_ascii_alphanumeric() || *c == '_')).collect()
    }

    fn choice(&mut self) -> Option<Expr> {
        let mut ways = vec![self.row()?];
        while self.sign('|').is_some() {
            ways.push(self.row()?);
        }
        Some(if ways.len() == 1 { ways.remove(0) } else { Expr::Choice(ways) })
    }

    fn row(&mut self) -> Option<Expr> {
        let mut parts = Vec::new();
        loop {
            parts.extend(self.part()?);
            if self.sign('~').is_none() {
                return Some(if parts.len() == 1 { parts.remove(0) } else { Expr::Row(parts) });
            }
        }
    }

    /// `Some(None)` for what looks ahead.
    fn part(&mut self) -> Option<Option<Expr>> {
        let looks = matches!(self.next()?, '!' | '&').then(|| self.0.next()).is_some();
        let mut expr = match self.next()? {
            '(' => {
                self.sign('(')?;
                let inner = self.choice()?;
                self.sign(')')?;
                inner
            }
            '"' => Expr::Text(self.between('"')?),
            '^' => {
                self.sign('^')?;
                Expr::Text(self.between('"')?)
            }
            // A range stands for its last letter.
            '\'' => {
                self.between('\'')?;
                self.sign('.').and_then(|()| self.sign('.'))?;
                self.next()?;
                Expr::Text(self.between('\'')?)
            }
            _ => Expr::Name(Some(self.word()).filter(|word| !word.is_empty())?),
        };
        loop {
            expr = match self.next() {
                Some('?') => Expr::Optional(Box::new(expr)),
                Some('*') => Expr::Repeated(Box::new(expr), 0),
                Some('+') => Expr::Repeated(Box::new(expr), 1),
                _ => return Some((!looks).then_some(expr)),
            };
            self.0.next();
        }
    }

    /// Between quotes of a kind.
    fn between(&mut self, quote: char) -> Option<String> {
        self.sign(quote)?;
        let mut text = String::new();
        loop {
            match self.0.next()? {
                letter if letter == quote => return Some(text),
                '\\' => text.push(match self.0.next()? {
                    'n' => '\n',
                    'r' => '\r',
                    't' => '\t',
                    other => other,
                }),
                other => text.push(other),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grammar_is_read() {
        let read = rules("// a remark\na = { \"x\" ~ !c ~ (b | ^\"\\\"\")* }\n\nb = @{ a? ~ c+ }").unwrap();
        let name = |name: &str| Expr::Name(name.into());
        let ways = Expr::Choice(vec![name("b"), Expr::Text("\"".into())]);
        assert_eq!(
            read["a"].expr,
            Expr::Row(vec![Expr::Text("x".into()), Expr::Repeated(Box::new(ways), 0)])
        );
        assert_eq!((read["a"].spaced, read["b"].spaced), (None, Some(false)));
        let parts = vec![Expr::Optional(Box::new(name("a"))), Expr::Repeated(Box::new(name("c")), 1)];
        assert_eq!(read["b"].expr, Expr::Row(parts));
    }

    #[test]
    fn the_grammar_of_scenarios_is_read_whole() {
        let text = include_str!("../../../lang/src/scn.pest");
        let read = rules(text).unwrap();
        let heads = text
            .lines()
            .filter(|line| line.contains(" = ") && line.starts_with(|c: char| c.is_ascii_alphabetic()));
        assert_eq!(read.len(), heads.count());
        assert!(matches!(&read["declaration"].expr, Expr::Choice(ways) if ways.len() > 25));
    }
}
