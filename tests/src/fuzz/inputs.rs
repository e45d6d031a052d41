//! Input number k of a seed: written by the grammar, or a file at hand with a few changes.

use mpgx_random::{Address, Purpose, Stream};

use super::corpus::{Corpus, Scenario, tokens};
use super::grammar::{Grammar, Words};

/// Makes inputs. The same seed and number give the same text as long as grammar and corpus stay as they are.
pub struct Inputs {
    grammar: Grammar,
    corpus: Corpus,
    seed: u64,
}

/// How an input was made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// Items that the grammar allows.
    Written,
    /// A scenario that compiles, with an item or a formula of another origin in it.
    Grafted,
    /// A file or an item with tokens lost, doubled, moved or replaced.
    Tokens,
    /// A file or an item with bytes changed.
    Bytes,
}

impl Inputs {
    /// `None` if the grammar cannot be read.
    pub fn new(seed: u64) -> Option<Inputs> {
        Some(Inputs { grammar: Grammar::new()?, corpus: Corpus::new(), seed })
    }

    pub fn make(&self, number: u64) -> (Kind, String) {
        let (master, purpose) = (self.seed, Purpose::Bootstrap);
        let address = Address { master, purpose, protocol: 0, part: 0, seed: 0, episode: 0, step: number };
        let random = &mut address.stream();
        match random.below(8) {
            0 | 1 => (Kind::Written, self.written(random)),
            2 | 3 => (Kind::Grafted, self.grafted(random)),
            4..=6 => (Kind::Tokens, self.with_tokens(random)),
            _ => (Kind::Bytes, self.with_bytes(random)),
        }
    }

    /// An item or two.
    fn written(&self, random: &mut Stream) -> String {
        let items = (0..=random.below(2)).map(|_| self.item(random));
        items.collect::<Vec<_>>().join("\n")
    }

    /// A file, or, since most of the time would go to what was not changed, an item of one.
    fn at_hand(&self, random: &mut Stream) -> &str {
        one(if random.below(8) == 0 { &self.corpus.files } else { &self.corpus.items }, random)
    }

    fn item(&self, random: &mut Stream) -> String {
        self.grammar.write("declaration", &self.corpus.words, 8 + random.below(12) as usize, random)
    }

    fn grafted(&self, random: &mut Stream) -> String {
        // Short ones more often.
        let count = self.corpus.valid.len() as u64;
        let chosen = random.below(count.max(1)).min(random.below(count.max(1))) as usize;
        let Scenario { mut items, words } = self.corpus.valid.get(chosen).cloned().unwrap_or_default();
        for _ in 0..=random.below(4) / 3 {
            let at = random.below(items.len().max(1) as u64) as usize;
            let Some(item) = items.get_mut(at) else { break };
            match random.below(8) {
                0 => *item = one(&self.corpus.items, random).to_owned(),
                1 => *item = self.item(random),
                2 => *item += &format!("\n{}", one(&self.corpus.items, random)),
                3 => *item = self.replaced(item, random),
                4 | 5 => *item = self.value(item, &self.corpus.words, random),
                _ => *item = self.value(item, &words, random),
            }
        }
        items.join("\n")
    }

    /// With another formula where one begins.
    fn value(&self, item: &str, words: &Words, random: &mut Stream) -> String {
        let before = ["= ", "~ ", "in ", "when ", "costs ", "if ", "(", "[", ", "];
        let places = before.iter().flat_map(|sign| item.match_indices(sign));
        let places: Vec<usize> = places.map(|(at, sign)| at + sign.len()).collect();
        let Some(&start) = places.get(random.below(places.len().max(1) as u64) as usize) else {
            return self.replaced(item, random);
        };
        let end = item[start..].find([',', '\n', '}', ')', ']']).map_or(item.len(), |length| start + length);
        let formula = self.grammar.write("expr", words, 1 + random.below(8) as usize, random);
        format!("{}{formula}{}", &item[..start], &item[end..])
    }

    /// With one word or number in place of another.
    fn replaced(&self, text: &str, random: &mut Stream) -> String {
        let mut parts = tokens(text);
        let at = random.below(parts.len() as u64) as usize;
        let word = parts[at].starts_with(|c: char| c.is_ascii_alphabetic());
        let words = &self.corpus.words;
        parts[at] = one(if word { &words.names } else { &words.numbers }, random);
        parts.concat()
    }

    fn with_tokens(&self, random: &mut Stream) -> String {
        let text = self.at_hand(random);
        let mut parts = tokens(text);
        for _ in 0..=random.below(3) {
            let at = random.below(parts.len() as u64) as usize;
            match random.below(5) {
                0 if parts.len() > 1 => drop(parts.remove(at)),
                1 => parts.insert(at, parts[at]),
                2 => {
                    let other = random.below(parts.len() as u64) as usize;
                    parts.swap(at, other);
                }
                3 => parts[at] = one(&self.corpus.tokens, random),
                _ => parts.insert(at, one(&self.corpus.tokens, random)),
            }
        }
        parts.concat()
    }

    fn with_bytes(&self, random: &mut Stream) -> String {
        let mut bytes = self.at_hand(random).as_bytes().to_vec();
        for _ in 0..=random.below(3) {
            let at = random.below(bytes.len().max(1) as u64) as usize;
            let signs = b"()[]{}|\"'/\\.,:;=<>+-*^~%#@!&\n\r\t \0e0";
            match random.below(5) {
                0 => bytes.truncate(at),
                1 => bytes.insert(at, signs[random.below(signs.len() as u64) as usize]),
                2 if at < bytes.len() => bytes[at] ^= 1 << random.below(8),
                3 => {
                    let part = bytes.get(at..(at + 20).min(bytes.len())).unwrap_or_default().repeat(3);
                    bytes.splice(at..at, part);
                }
                _ => drop(bytes.splice(at..at, "±µ\u{feff}\u{202e}é".bytes())),
            }
        }
        String::from_utf8_lossy(&bytes).into_owned()
    }
}

fn one<'a>(of: &'a [String], random: &mut Stream) -> &'a str {
    of.get(random.below(of.len().max(1) as u64) as usize).map_or("", String::as_str)
}
