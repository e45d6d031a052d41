//! How much of everything there may be: the most of it compiles, one more is told, and nothing else.

use std::collections::BTreeSet;

use mpgx_lang::problem::{Severity, Style, render};
use mpgx_lang::source::{Loader, NoFiles};
use mpgx_lang::{Compilation, compile};

const SIGHT: &str = include_str!("../../scenarios/localise_and_follow.scn");

fn each(number: usize, entry: impl Fn(usize) -> String) -> String {
    (0..number).map(entry).collect()
}

fn with(text: &str) -> Compilation {
    compile("a.scn", format!("{SIGHT}\n{text}"), &[], &NoFiles)
}

fn errors(compilation: &Compilation) -> BTreeSet<&'static str> {
    let errors = compilation.problems.iter().filter(|problem| problem.severity == Severity::Error);
    errors.map(|problem| problem.code.name).collect()
}

/// `more` of something beside what the scenario has already are as many as possible.
#[track_caller]
fn at_most(more: usize, code: &str, entries: impl Fn(usize) -> String) {
    assert_eq!(errors(&with(&entries(more))), BTreeSet::new());
    assert_eq!(errors(&with(&entries(more + 1))), BTreeSet::from([code]));
}

/// Seen to fail for each with its limit raised.
#[test]
fn of_everything_there_are_so_many() {
    at_most(100, "too-large", |n| each(n, |k| format!("stage s{k} {{ channels = 16 }} within 10 steps\n")));
    at_most(1000, "too-large", |n| each(n, |k| format!("variant v{k} {{ batches = {} }}\n", k + 1)));
    at_most(94, "too-large", |n| each(n, |k| format!("evaluate e{k} {{ episodes = 1 }}\n")));
    at_most(98, "too-large", |n| {
        each(n, |k| format!("localiser l{k} = noisy(position = 5 cm, heading = 2 deg)\n"))
    });
    at_most(992, "too-large", |n| {
        format!("landmarks more[{n}] : books(height = 50 cm) {{ at = 2.6 m * (1, 0), heading = 0 deg }}")
    });
    at_most(1000, "too-large", |n| {
        format!("fn f({}) -> number = 1", each(n, |k| format!("x{k}: number, ")).trim_end_matches(", "))
    });
    let pillars = |name: &str, n| {
        let places = vec!["(2 m, 2 m)"; n].join(", ");
        format!(
            "obstacles {name}[{n}] : disc(1 mm) {{ position = [{places}] }}
"
        )
    };
    at_most(998, "too-large", |n| each(n, |k| pillars(&format!("o{k}"), 1)));
    at_most(999, "too-large", |n| {
        each(n, |k| format!("formation F{k} of follower = coincide() about leader\n"))
    });
    at_most(10_000, "out-of-range", |n| {
        format!(
            "agents crowd[{n}] : point {{ motion = random_velocity(0.1 m/s), speed = -1 m/s .. 1 m/s, start ~ uniform_in(box(-1 m .. 1 m, -1 m .. 1 m)) }}"
        )
    });
    at_most(1000, "too-large", |n| {
        let states = each(n, |k| format!("    state s{k} = 0\n    next s{k} = s{k}\n"));
        format!("motion m() {{\n{states}    velocity = (0 m/s, 0 m/s)\n}}")
    });
}

/// Seen to fail with more shown.
#[test]
fn of_many_problems_a_hundred_are_shown() {
    let wrong = with(&each(103, |k| format!("let a{k} = nobody{k}\n")));
    let text = render(&wrong.problems, &wrong.sources, Style::Plain);
    assert_eq!(text.matches("error[").count(), 100, "{text}");
    assert!(text.contains("… and 3 more"), "{text}");
}

/// A file `a1.scn` that uses `a2.scn`, and so on without end.
struct Endless;

impl Loader for Endless {
    fn load(&self, path: &str) -> Result<String, String> {
        let number: usize = path.trim_matches(|c: char| !c.is_ascii_digit()).parse().map_err(|_| path)?;
        Ok(format!("use a{}.f{}\nfn f{number}(x: number) -> number = x", number + 1, number + 1))
    }
}

/// Seen to fail with the limit raised, by a stack that overflows.
#[test]
fn files_that_use_files_have_an_end() {
    let endless = compile("a.scn", format!("use a1.f1\n{SIGHT}"), &[], &Endless);
    assert_eq!(errors(&endless), BTreeSet::from(["unknown-module"]));
}
