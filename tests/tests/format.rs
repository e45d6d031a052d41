//! The layout of every file at hand, and of many made from them: it is a fixed point, keeps all comments and says the same.

#![allow(clippy::unwrap_used)]

use std::path::PathBuf;

use mpgx_lang::format::format;
use mpgx_lang::problem::{Problems, render_short};
use mpgx_lang::source::Sources;
use mpgx_lang::{meaning_hash, parse, print};
use mpgx_tests::{Beside, golden, root, scenarios_in};

fn files(folders: &[&str]) -> Vec<PathBuf> {
    folders.iter().flat_map(|folder| scenarios_in(&root().join(folder))).collect()
}

/// What a text says, if its syntax is right.
fn said(text: &str) -> Option<String> {
    let (mut sources, mut problems) = (Sources::default(), Problems::default());
    let file = sources.add("a.scn", text.to_owned());
    let tree = parse::parse(&sources, file, &mut problems);
    problems.is_empty().then(|| print::file(&tree))
}

fn formatted(text: &str) -> String {
    let (mut sources, mut problems) = (Sources::default(), Problems::default());
    let file = sources.add("a.scn", text.to_owned());
    let formatted = format(&sources, file, &mut problems);
    formatted.unwrap_or_else(|| panic!("{}{text}", render_short(&problems, &sources)))
}

fn comments(text: &str) -> Vec<&str> {
    text.lines().filter_map(|line| line.find("//").map(|at| line[at..].trim_end())).collect()
}

/// The cases of a pass as they are laid out.
#[test]
fn layouts() {
    golden::hold("format", &[], |path| formatted(&std::fs::read_to_string(path).unwrap()));
}

#[test]
fn the_standard_library_and_the_scenarios_are_laid_out() {
    for path in files(&["stdlib", "scenarios", "runtime/cli/templates"]) {
        let text = std::fs::read_to_string(&path).unwrap();
        assert_eq!(formatted(&text), text, "{}: `mpgx fmt` lays it out", path.display());
    }
}

#[test]
fn files_with_syntax_errors_are_left_alone() {
    let (mut sources, mut problems) = (Sources::default(), Problems::default());
    let file = sources.add("a.scn", "param   a = 1 m\nparam b = (2".to_owned());
    assert_eq!(format(&sources, file, &mut problems), None);
    assert_eq!(problems.errors(), 1);
}

/// Seen to fail when a unit does not belong to its number.
#[test]
fn any_layout_of_a_text_comes_to_the_same() {
    let mut random = Random(1);
    for (path, text, tree) in sources() {
        let expected = formatted(&text);
        for _ in 0..8 {
            let other = spaced(&text, &mut random);
            assert_eq!(said(&other).as_ref(), Some(&tree), "{}:\n{other}", path.display());
            assert_eq!(formatted(&other), expected, "{}:\n{other}", path.display());
        }
    }
}

#[test]
fn whatever_is_written_stays_said_with_its_comments() {
    let mut random = Random(2);
    for (path, text, tree) in sources() {
        let folder = path.parent().unwrap();
        let hash = |text: &str| {
            let plan = mpgx_lang::compile("a.scn", text.to_owned(), &[], &Beside(folder)).plan;
            plan.map(|plan| meaning_hash(&plan))
        };
        let meaning = hash(&text);
        for round in 0..8 {
            let other = broken(&text, &mut random);
            assert_eq!(said(&other).as_ref(), Some(&tree), "{}:\n{other}", path.display());
            let once = formatted(&other);
            let about = format!("{}:\n{other}\n-----\n{once}", path.display());
            assert_eq!(said(&once).as_ref(), Some(&tree), "{about}");
            assert_eq!(comments(&once), comments(&other), "{about}");
            assert_eq!(formatted(&once), once, "{about}");
            assert!(once.ends_with('\n') && !once.ends_with("\n\n") && !once.contains("\n\n\n"), "{about}");
            assert!(once.lines().all(|line| line == line.trim_end()), "{about}");
            assert!(round > 0 || hash(&once) == meaning, "{about}");
        }
    }
}

/// Every file of the library, the scenarios and the golden cases whose syntax is right, and what it says.
fn sources() -> Vec<(PathBuf, String, String)> {
    let golden = ["parse", "check", "reward", "plan", "diagnostics", "format"];
    let golden: Vec<String> = golden.iter().map(|pass| format!("tests/golden/{pass}")).collect();
    let mut folders = vec!["stdlib", "scenarios"];
    folders.extend(golden.iter().map(String::as_str));
    let texts = files(&folders).into_iter().filter_map(|path| {
        let text = std::fs::read_to_string(&path).ok()?.replace('\r', "");
        let tree = said(text.trim_start_matches('\u{feff}'))?;
        Some((path, text, tree))
    });
    let texts: Vec<_> = texts.collect();
    assert!(texts.len() > 40);
    texts
}

struct Random(u64);

impl Random {
    fn below(&mut self, number: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % number
    }

    fn one_in(&mut self, number: u64) -> bool {
        self.below(number) == 0
    }
}

/// Other spaces and indentation; the lines, and whether they are blank, stay.
fn spaced(text: &str, random: &mut Random) -> String {
    let mut out = String::new();
    let mut depth = 0_i64;
    for line in text.lines() {
        let (code, comment) = line.split_at(line.find("//").unwrap_or(line.len()));
        let indented = line.starts_with(' ');
        out += match (depth > 0, indented) {
            (true, _) => ["", " ", "\t", "      "][random.below(4) as usize],
            (false, true) => [" ", "\t", "      "][random.below(3) as usize],
            (false, false) => "",
        };
        let mut characters = code.trim().chars().peekable();
        let mut quoted = false;
        while let Some(character) = characters.next() {
            depth += i64::from("([{".contains(character)) - i64::from(")]}".contains(character));
            let exponent = exponent(&out);
            quoted ^= character == '"';
            match character {
                _ if exponent || quoted => out.push(character),
                // A unit has no spaces inside, and needs one after.
                ' ' => out += ["", " ", "   ", "\t"][1 + random.below(3) as usize],
                ',' | '{' if random.one_in(2) => {
                    out.push(character);
                    while characters.next_if_eq(&' ').is_some() {}
                }
                ',' | ')' | '}' | ']' if random.one_in(3) => {
                    out.push(' ');
                    out.push(character);
                }
                _ => out.push(character),
            }
        }
        if !comment.is_empty() {
            out += if code.trim().is_empty() { "" } else { [" ", "", "\t\t"][random.below(3) as usize] };
            out += comment;
        }
        out += ["", " ", "\t"][random.below(3) as usize];
        out.push('\n');
    }
    out
}

/// Whether a text ends inside the parentheses of an exponent, where there are no spaces.
fn exponent(text: &str) -> bool {
    text.rfind("^(").is_some_and(|at| !text[at..].contains(')'))
}

/// Other spaces, and more lines, blank lines and comments.
fn broken(text: &str, random: &mut Random) -> String {
    let mut out = String::new();
    let (mut depth, mut number) = (0_i64, 0);
    let mut comment = |random: &mut Random| {
        number += 1;
        if random.one_in(2) { format!("// {number}  {{ (") } else { format!("//{number}") }
    };
    for line in spaced(text, random).lines() {
        let (code, remark) = line.split_at(line.find("//").unwrap_or(line.len()));
        let mut quoted = false;
        for character in code.chars() {
            out.push(character);
            quoted ^= character == '"';
            depth += i64::from("([{".contains(character)) - i64::from(")]}".contains(character));
            if depth > 0
                && !quoted
                && matches!(character, ',' | '(' | '{')
                && !exponent(&out)
                && random.one_in(6)
            {
                if random.one_in(4) {
                    out += &format!(" {}", comment(random));
                }
                out += "\n";
            }
        }
        out += remark;
        if remark.is_empty() && random.one_in(8) {
            out += &comment(random);
        }
        out.push('\n');
        // A `//!` stands before everything else.
        if !remark.starts_with("//!") && random.one_in(8) {
            out += &"\n".repeat(random.below(4) as usize);
            out += &format!("  {}\n", comment(random));
        }
    }
    out
}
