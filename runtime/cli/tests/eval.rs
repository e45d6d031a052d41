//! `mpgx eval` as a user meets it: what was trained, under other evaluations, without training.

#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;
use tempfile::TempDir;

const SCENARIO: &str = include_str!("small.scn");

fn mpgx(folder: &Path, arguments: &str) -> (Option<i32>, String, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_mpgx"));
    command.current_dir(folder).env_remove("MPGX_SIMD").env_remove("MPGX_LOG");
    let output = command.args(arguments.split_whitespace()).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

/// A folder with a trained study of the scenario, as it is after some replacements.
fn trained(replaced: &[(&str, &str)], options: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let text = SCENARIO.replace("steps = 400", "steps = 60");
    let text = replaced.iter().fold(text, |text, (old, new)| text.replace(old, new));
    fs::write(folder.path().join("small.scn"), text).unwrap();
    let (code, _, error) = mpgx(folder.path(), &format!("run small.scn --threads 1 {options}"));
    assert_eq!(code, Some(0), "{error}");
    folder
}

fn study(folder: &Path) -> Value {
    serde_json::from_slice(&fs::read(folder.join("study.json")).unwrap()).unwrap()
}

/// Every file below a folder with its bytes, except those that tell times.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        match path.is_dir() {
            true => found.extend(files(&path)),
            false => drop(found.insert(path.clone(), fs::read(&path).unwrap())),
        }
    }
    found
}

#[test]
fn without_a_change_it_finds_what_the_run_found_and_leaves_the_study_alone() {
    let folder = trained(&[], "");
    let before = files(&folder.path().join("runs/small"));
    let (code, table, error) = mpgx(folder.path(), "eval runs/small --out again");
    assert_eq!(code, Some(0), "{error}");
    assert!(table.contains("held_out") && table.contains("oracle") && table.contains("again/report.html"));
    let (own, again) = (study(&folder.path().join("runs/small")), study(&folder.path().join("again")));
    assert_eq!(own["protocols"], again["protocols"]);
    assert_eq!(own["comparisons"], again["comparisons"]);
    assert_eq!(again["training"], serde_json::json!({}));
    assert_eq!(files(&folder.path().join("runs/small")), before);
    assert!(fs::read_to_string(folder.path().join("again/report.html")).unwrap().contains("</html>"));
}

/// Other places, more episodes, any number of threads; a second call computes nothing.
#[test]
fn parameters_and_episodes_change_and_threads_do_not_matter() {
    let blur = ("param side = 0.4 m", "param side = 0.4 m\nparam blur = 0.1 m");
    let folder = trained(&[blur, ("near(F[i], 0.1 m)", "near(F[i], blur)")], "--set side=0.5m");
    let eval = |out: &str, threads: usize| {
        let options = format!("--set side=0.7m --episodes 9 --threads {threads} --json --out {out}");
        let (code, json, error) = mpgx(folder.path(), &format!("eval runs/small {options}"));
        assert_eq!(code, Some(0), "{error}");
        serde_json::from_str::<Value>(&json).unwrap()
    };
    let (one, three) = (eval("one", 1), eval("three", 3));
    assert_eq!(one["study_hash"], three["study_hash"]);
    assert_ne!(one["protocols"], study(&folder.path().join("runs/small"))["protocols"]);
    let record = folder.path().join("one/cells/mpg-001/record.bin");
    let same = |out: &str| fs::read(folder.path().join(out).join("cells/mpg-001/record.bin")).unwrap();
    assert_eq!(same("one"), same("three"));
    let written = fs::metadata(&record).unwrap().modified().unwrap();
    assert_eq!(eval("one", 2)["study_hash"], one["study_hash"]);
    assert_eq!(fs::metadata(&record).unwrap().modified().unwrap(), written);

    // What was set when it ran stays set.
    assert_eq!(mpgx(folder.path(), "eval runs/small --set blur=0.1m --out own").0, Some(0));
    let own = study(&folder.path().join("own"));
    assert_eq!(own["protocols"], study(&folder.path().join("runs/small"))["protocols"]);
}

#[test]
fn a_variant_is_found_in_its_own_files() {
    let variant = "seeds 2\nvariant near { world.safety = 0.05 m }\n";
    let folder = trained(&[("seeds 2\n", variant)], "--variant near");
    let eval = |side: &str| {
        let (code, json, error) =
            mpgx(folder.path(), &format!("eval runs/small/variants/near --json --set side={side}"));
        assert_eq!(code, Some(0), "{error}");
        serde_json::from_str::<Value>(&json).unwrap()["protocols"].clone()
    };
    let own = study(&folder.path().join("runs/small/variants/near"))["protocols"].clone();
    assert_eq!(eval("0.4m"), own);
    assert_ne!(eval("0.6m"), own);
    let results = folder.path().join("runs/small/variants/near/eval/small");
    assert_eq!(fs::read_dir(results).unwrap().count(), 2);
}

#[test]
fn another_scenario_with_evaluations_of_its_own() {
    let folder = trained(&[], "");
    let other = SCENARIO
        .replace("scenario small", "scenario other")
        .replace("evaluate held_out { episodes = 5 }", "evaluate wide { side = 0.8 m, episodes = 3 }\nevaluate slow { leader.speed = -0.1 m/s .. 0.1 m/s, episodes = 3 }\nexpect slow.error < 10 m");
    fs::write(folder.path().join("other.scn"), &other).unwrap();
    let (code, table, error) = mpgx(folder.path(), "eval runs/small --scenario other.scn --protocols slow");
    assert_eq!(code, Some(1), "an interval needs five seeds: {table} {error}");
    assert!(table.contains("slow") && !table.contains("wide"), "{table}");

    let seen = other
        .replace("observe { F[i] - p[i] for i in follower }", "observe { p[i] - F[i] for i in follower }");
    fs::write(folder.path().join("seen.scn"), seen).unwrap();
    let (code, _, error) = mpgx(folder.path(), "eval runs/small --scenario seen.scn");
    assert_eq!(code, Some(2));
    assert!(error.contains("do not fit `other`") && error.contains("entry 1 of the state was"), "{error}");
    assert!(error.contains("(seen.scn:"), "{error}");
    assert!(!folder.path().join("runs/small/eval/other").join("cells").exists());
}

/// The same question about what another study has learned.
#[test]
fn the_results_of_two_studies_do_not_share_a_folder() {
    let folder = trained(&[], "");
    assert_eq!(mpgx(folder.path(), "run small.scn --set side=0.5m --out wider").0, Some(0));
    let eval = |study: &str| mpgx(folder.path(), &format!("eval {study} --scenario small.scn --out same"));
    assert_eq!(eval("runs/small").0, Some(0));
    let (code, _, error) = eval("wider");
    assert!(code == Some(2) && error.contains("holds another study"), "{error}");
    assert_eq!(eval("runs/small").0, Some(0));
}

#[test]
fn what_cannot_be_evaluated_is_told() {
    let folder = trained(&[], "");
    let told = |arguments: &str, code: i32, words: &str| {
        let (found, _, error) = mpgx(folder.path(), arguments);
        assert_eq!(found, Some(code), "{arguments}: {error}");
        assert!(error.contains(words), "{arguments}: {error}");
    };
    told("eval nowhere", 2, "there is no study in nowhere");
    told("eval runs/small --protocols held", 2, "there is held_out");
    told("eval runs/small --set sid=1m", 2, "unknown-override");
    told("eval runs/small --set side=1m --out runs/small", 2, "holds another study");

    let cell = folder.path().join("runs/small/cells/td3-001");
    let policy = fs::read(cell.join("policy.bin")).unwrap();
    fs::write(cell.join("policy.bin"), &policy[..policy.len() - 1]).unwrap();
    told("eval runs/small", 74, "cells/td3-001/policy.bin");
    fs::write(cell.join("policy.bin"), policy).unwrap();

    // Without its record a cell is not finished; the others are evaluated, and later that one alone.
    let record = fs::read(cell.join("record.bin")).unwrap();
    fs::remove_file(cell.join("record.bin")).unwrap();
    told("eval runs/small --out left", 1, "left out: td3-001");
    let left = study(&folder.path().join("left"));
    assert_eq!(left["protocols"]["held_out"]["td3"]["error_m"]["per_seed"].as_array().unwrap().len(), 1);
    fs::write(cell.join("record.bin"), &record[..record.len() - 1]).unwrap();
    told("eval runs/small --out left", 74, "cells/td3-001/record.bin");
    fs::write(cell.join("record.bin"), record).unwrap();
    let (code, _, error) = mpgx(folder.path(), "eval runs/small --out left");
    assert_eq!((code, error.matches("already done").count()), (Some(0), 5), "{error}");
}
