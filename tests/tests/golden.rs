//! Each pass of the compiler against its golden files.

use std::path::{Path, PathBuf};

use mpgx_lang::plan::{Plan, Term, World};
use mpgx_lang::problem::{Problems, Style, render};
use mpgx_lang::render::{latex, mathml, text};
use mpgx_lang::source::Sources;
use mpgx_lang::{codes, describe, meaning_hash, parse, print};
use mpgx_tests::{compiled, golden, root, scenarios_in};
use similar::{ChangeTag, TextDiff};

fn scenarios() -> Vec<PathBuf> {
    scenarios_in(&root().join("scenarios"))
}

fn problems(problems: &Problems, sources: &Sources) -> String {
    match problems.is_empty() {
        true => "no problems\n".to_owned(),
        false => render(problems, sources, Style::Plain),
    }
}

/// What a case gives if it compiles, else its problems.
fn with_plan(path: &Path, output: impl Fn(&Plan) -> String) -> String {
    let it = compiled(path);
    match &it.plan {
        Some(plan) => output(plan),
        None => problems(&it.problems, &it.sources),
    }
}

/// The tree as source, with all its parentheses.
#[test]
fn parse() {
    golden::hold("parse", &[], |path| {
        let (mut sources, mut found) = (Sources::default(), Problems::default());
        let text = std::fs::read_to_string(path).unwrap();
        let file = sources.add(&path.file_name().unwrap_or_default().to_string_lossy(), text);
        let tree = print::file(&parse::parse(&sources, file, &mut found));
        if found.is_empty() { tree } else { tree + "\n" + &problems(&found, &sources) }
    });
}

/// Everything with its type.
#[test]
fn check() {
    golden::hold("check", &scenarios(), |path| {
        let it = compiled(path);
        let described = describe::describe(&it.hir, &it.units);
        if it.problems.is_empty() {
            described
        } else {
            described + "\n" + &problems(&it.problems, &it.sources)
        }
    });
}

/// The terms and ends in each notation.
#[test]
fn reward() {
    golden::hold("reward", &scenarios(), |path| {
        with_plan(path, |plan| {
            let world = &plan.world;
            let term = |term: &Term| {
                let lines = [
                    format!("{}    [{}]", text::term(plan, world, term), term.dimension),
                    format!("  {}", latex::term(plan, world, term)),
                    format!("  {}", mathml::term(plan, world, term)),
                ];
                lines.join("\n") + "\n"
            };
            let end = |end: &mpgx_lang::plan::End| {
                let cost = end.cost.as_ref().map(|cost| format!(" costs {}", text::expr(plan, world, cost)));
                format!(
                    "{} when {}{}\n",
                    end.name,
                    text::expr(plan, world, &end.when),
                    cost.unwrap_or_default()
                )
            };
            world.reward.iter().map(term).chain(world.ends.iter().map(end)).collect()
        })
    });
}

#[test]
fn plan() {
    golden::hold("plan", &scenarios(), |path| {
        with_plan(path, |plan| format!("// meaning {}\n{}\n", meaning_hash(plan), plan.to_ron()))
    });
}

/// What each evaluation, stage and variant changes, as lines of the Plan; draws and tests as they are.
#[test]
fn cases() {
    let changes = |before: &str, after: &str| -> String {
        let diff = TextDiff::from_lines(before, after);
        let lines = diff.iter_all_changes().filter(|line| line.tag() != ChangeTag::Equal);
        lines.map(|line| format!("  {} {}", line.tag(), line.value().trim())).collect::<Vec<_>>().join("\n")
            + "\n"
    };
    golden::hold("cases", &[], |path| {
        with_plan(path, |plan| {
            let with = |world: &World| Plan { world: world.clone(), ..Plan::default() }.to_ron();
            let mut text: Vec<String> =
                plan.world.randomise.iter().map(|drawn| format!("randomise {:?}\n", drawn.value)).collect();
            let training = with(&plan.world);
            for protocol in &plan.protocols {
                let world = protocol.world.as_ref().map(|world| changes(&training, &with(world)));
                let line = format!("evaluate {} over {} episodes\n", protocol.name, protocol.episodes);
                text.push(line + &world.unwrap_or_default());
            }
            for stage in &plan.stages {
                let line =
                    format!("stage {} until {:?} within {:?}\n", stage.name, stage.until, stage.most_steps);
                text.push(line + &changes(&training, &with(&stage.world)));
            }
            let own = Plan { variants: Vec::new(), tests: Vec::new(), ..plan.clone() }.to_ron();
            for variant in &plan.variants {
                let line = format!("variant {}: {}\n", variant.name, variant.text);
                text.push(line + &changes(&own, &variant.plan.to_ron()));
            }
            for test in &plan.tests {
                text.push(format!("test {}\n", test.name));
                text.extend(test.steps.iter().map(|step| format!("  {step:?}\n")));
            }
            text.concat()
        })
    });
}

#[test]
fn diagnostics() {
    golden::hold("diagnostics", &[], |path| {
        let it = compiled(path);
        problems(&it.problems, &it.sources)
    });
}

/// Codes whose cases are too large for a file, and one that only a broken standard library can raise.
const WITHOUT_CASE: &[&str] = &["file-too-large", "not-provided", "too-complex"];

#[test]
fn every_code_has_a_case_and_a_story() {
    let cases: Vec<_> =
        scenarios_in(&golden::folder("diagnostics")).iter().map(|path| compiled(path)).collect();
    for code in codes::ALL {
        let shown = cases.iter().any(|case| case.problems.iter().any(|problem| problem.code == *code));
        assert_eq!(shown, !WITHOUT_CASE.contains(&code.name), "a golden case for `{}`", code.name);
        assert!(code.explain.len() > 80, "a story for `{}`", code.name);
        assert_eq!(codes::find(code.name), Some(*code), "`{}` stands twice", code.name);
    }
    let mut names: Vec<&str> = codes::ALL.iter().map(|code| code.name).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), codes::ALL.len());
}
