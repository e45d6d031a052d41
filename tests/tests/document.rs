//! The reference: it is current, it leaves nothing out, and its examples compile.

#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;

use mpgx_lang::compile;
use mpgx_lang::document::{Entry, entries, index, markdown};
use mpgx_lang::problem::{Style, render};
use mpgx_lang::source::Loader;
use mpgx_lang::stdlib::{MODULES, PRELUDE};
use mpgx_tests::{completed, root};

#[test]
fn the_reference_is_current() {
    let folder = root().join("docs/reference");
    let mut expected: BTreeMap<String, String> =
        MODULES.iter().map(|(name, text)| (format!("{name}.md"), markdown(name, text))).collect();
    expected.insert("README.md".to_owned(), index(MODULES));
    for (name, text) in &expected {
        if std::env::var_os("MPGX_BLESS").is_some() {
            std::fs::write(folder.join(name), text).unwrap();
        }
        let written = std::fs::read_to_string(folder.join(name)).unwrap_or_default();
        assert!(
            written == *text,
            "docs/reference/{name} is not current: MPGX_BLESS=1 cargo test -p mpgx-tests"
        );
    }
    for file in std::fs::read_dir(&folder).unwrap() {
        let name = file.unwrap().file_name().into_string().unwrap();
        assert!(expected.contains_key(&name), "docs/reference/{name} is of no module");
    }
}

#[test]
fn every_entry_says_what_it_is() {
    for (module, text) in MODULES {
        let (doc, entries) = entries(text);
        assert!(!doc.is_empty(), "{module} has no comment");
        for entry in entries {
            assert!(!entry.doc.is_empty(), "{module}.{} has no comment", entry.name);
            for parameter in entry.parameters.iter().filter(|_| !matches!(entry.kind, "fn" | "dist")) {
                assert!(!parameter.doc.is_empty(), "{module}.{}: `{}`", entry.name, parameter.name);
            }
        }
    }
}

/// What examples stand in.
const BASE: &str = "\
scenario example
world { dt = 0.1 s, horizon = 100 steps }
recording walk = \"walk.csv\"
obstacle pillar : disc(0.1 m) { position = (1.8 m, 1.8 m) }
agent leader : point { speed = -1 m/s .. 1 m/s, start = (0 m, 0 m), motion = rest() }
agents follower[3] : point {
    arena   = box(-2 m .. 2 m, -2 m .. 2 m)
    speed   = -1 m/s .. 1 m/s
    control = learned
    start   = (0 m, 0 m)
}
motion rest() { velocity = (0 m/s, 0 m/s) }
formation places() { slot k of n = (-0.1 m * k, 0 m) }
formation sides() { edges ring = 0.5 m }
formation F of follower = places() about leader
formation T of follower = sides()
observe { p[leader] }
reward { gap = -|p[leader]| }
learn mpg
";

/// A path for `recording walk`.
struct Walk;

impl Loader for Walk {
    fn load(&self, _path: &str) -> Result<String, String> {
        Ok("t,x,y\n0,0,0\n1,0.5,0\n".to_owned())
    }
}

/// The items of an example: of a `motion` or `dist` it is settings of the leader, of a `fn` or `let` terms of a
/// reward, of the rest items already.
fn items(entry: &Entry, example: &str) -> String {
    let sets = |name: &str| example.lines().any(|line| line.split([' ', '=', '~']).next() == Some(name));
    match entry.kind {
        "motion" | "dist" => {
            let mut leader = "agent leader : point {\n".to_owned();
            leader += "arena = box(-1 m .. 1 m, -1 m .. 1 m)\nspeed = -1 m/s .. 1 m/s\n";
            leader += if sets("start") { "" } else { "start = (0 m, 0 m)\n" };
            leader += if sets("motion") { "" } else { "motion = rest()\n" };
            leader + example + "\n}\n"
        }
        "fn" | "let" if !example.starts_with("learn") => format!("reward {{\n{example}\n}}\n"),
        _ => format!("{example}\n"),
    }
}

#[test]
fn every_entry_has_an_example_that_compiles() {
    for (module, text) in MODULES {
        let (_, all) = entries(text);
        let names: Vec<&str> = all.iter().map(|entry| entry.name.as_str()).collect();
        let uses = match PRELUDE.contains(module) {
            true => String::new(),
            false => format!("use {module}.{{{}}}\n", names.join(", ")),
        };
        for entry in all.iter().filter(|entry| !matches!(entry.kind, "unit" | "dimension")) {
            let example = entry.example.as_deref();
            let example = example.unwrap_or_else(|| panic!("{module}.{} has no example", entry.name));
            assert!(example.contains(&entry.name), "{module}.{}: {example}", entry.name);
            let part = uses.clone() + &items(entry, example);
            let name = format!("{module}.{}", entry.name);
            let it = compile(&name, completed(BASE, &part), &[], &Walk);
            assert!(it.plan.is_some(), "{}", render(&it.problems, &it.sources, Style::Plain));
        }
    }
}
