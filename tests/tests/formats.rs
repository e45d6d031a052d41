//! Problems for machines: each form against golden files, and fixes that fix.

#![allow(clippy::unwrap_used)]

use std::path::PathBuf;

use mpgx_lang::problem::{Problem, render_github, render_json, render_sarif};
use mpgx_tests::{Beside, compiled, golden, scenarios_in};

/// Cases with several labels, notes, fixes, several lines, no problems.
fn cases() -> Vec<PathBuf> {
    let names = ["draws", "given_twice", "no_problems", "reward_mismatch", "syntax_errors", "unit_mismatch"];
    names.map(|name| golden::folder("diagnostics").join(name).with_extension("scn")).to_vec()
}

#[test]
fn json() {
    golden::hold("json", &cases(), |path| {
        let it = compiled(path);
        render_json(&it.problems, &it.sources)
    });
}

#[test]
fn sarif() {
    golden::hold("sarif", &cases(), |path| {
        let it = compiled(path);
        render_sarif(&[(&it.problems, &it.sources)])
    });
}

#[test]
fn github() {
    golden::hold("github", &cases(), |path| {
        let it = compiled(path);
        render_github(&it.problems, &it.sources)
    });
}

/// Each fix of a golden case, taken alone, ends its problem.
#[test]
fn fixes_fix() {
    let folder = golden::folder("diagnostics");
    let mut tried = 0;
    for path in scenarios_in(&folder) {
        let it = compiled(&path);
        for problem in it.problems.iter() {
            let Some((span, text)) = problem.fix.as_ref().filter(|(span, _)| span.file == 0) else {
                continue;
            };
            let mut fixed = it.sources.file(0).text.clone();
            fixed.replace_range(span.start..span.end, text);
            let after = mpgx_lang::compile("a.scn", fixed, &[], &Beside(&folder));
            let there = |it: &Problem| (it.code, it.span().map(|span| (span.file, span.start)));
            let left = after.problems.iter().any(|it| there(it) == there(problem));
            assert!(!left, "{}: `{text}` for: {}", path.display(), problem.message);
            tried += 1;
        }
    }
    assert!(tried > 20, "{tried}");
}
