//! The verbs that read and write scenarios, as a user meets them.

#![allow(clippy::unwrap_used)]

use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use tempfile::TempDir;

const SCENARIO: &str = include_str!("small.scn");

fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("small.scn"), SCENARIO).unwrap();
    folder
}

fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_mpgx"));
    command.current_dir(folder).args(arguments).env_remove("MPGX_SIMD").env_remove("MPGX_LOG");
    command
}

/// Exit code, stdout, stderr.
fn run(folder: &Path, arguments: &[&str]) -> (Option<i32>, String, String) {
    said(command(folder, arguments).output().unwrap())
}

fn said(output: Output) -> (Option<i32>, String, String) {
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

fn piped(folder: &Path, arguments: &[&str], input: &str) -> (Option<i32>, String, String) {
    let mut child = command(folder, arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(input.as_bytes()).unwrap();
    said(child.wait_with_output().unwrap())
}

#[test]
fn fmt_writes_checks_and_shows() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let (code, out, _) = run(folder.path(), &["fmt", "--check", "."]);
    assert_eq!((code, out.as_str()), (Some(0), ""));

    let crooked = SCENARIO.replace("seeds 2", "seeds   2 // two");
    fs::write(at("small.scn"), &crooked).unwrap();
    let (code, out, _) = run(folder.path(), &["fmt", "--check", "small.scn"]);
    assert_eq!((code, out.as_str()), (Some(1), "small.scn\n"));
    let (code, out, _) = run(folder.path(), &["fmt", "--diff", "small.scn"]);
    assert_eq!(code, Some(1));
    assert!(out.contains("-seeds   2 // two\n+seeds 2  // two\n"), "{out}");
    assert_eq!(fs::read_to_string(at("small.scn")).unwrap(), crooked);

    let expected = SCENARIO.replace("seeds 2", "seeds 2  // two");
    let (code, out, _) = piped(folder.path(), &["fmt", "-"], &crooked);
    assert_eq!((code, &out), (Some(0), &expected));
    assert_eq!(run(folder.path(), &["fmt", "."]).0, Some(0));
    assert_eq!(fs::read_to_string(at("small.scn")).unwrap(), expected);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "nothing else may be left behind");

    fs::write(at("bad.scn"), "param   side = (1 m\n").unwrap();
    let (code, _, err) = run(folder.path(), &["fmt", "."]);
    assert!(code == Some(2) && err.contains("unbalanced-brackets"), "{err}");
    assert_eq!(fs::read_to_string(at("bad.scn")).unwrap(), "param   side = (1 m\n");
}

#[test]
fn check_speaks_to_machines() {
    let folder = folder();
    fs::write(folder.path().join("bad.scn"), SCENARIO.replace("0.1 s", "0.1 m")).unwrap();
    let check = |format: &str| {
        let (code, out, _) = run(folder.path(), &["check", "bad.scn", "small.scn", "--format", format]);
        assert_eq!(code, Some(2), "{out}");
        out
    };
    let line: serde_json::Value = serde_json::from_str(&check("json")).unwrap();
    assert_eq!((line["code"].as_str(), line["line"].as_u64()), (Some("unit-mismatch"), Some(11)));
    let log: serde_json::Value = serde_json::from_str(&check("sarif")).unwrap();
    assert_eq!(log["runs"][0]["results"].as_array().map(Vec::len), Some(1));
    assert!(check("github").starts_with("::error file=bad.scn,line=11,"));
    assert!(check("short").starts_with("bad.scn:11:"));
}

#[test]
fn diff_tells_what_is_meant_otherwise() {
    let folder = folder();
    fs::write(folder.path().join("same.scn"), SCENARIO.replace("param", "\n// a remark\nparam")).unwrap();
    let (code, out, _) = run(folder.path(), &["diff", "small.scn", "same.scn"]);
    assert_eq!((code, out.as_str()), (Some(0), ""));
    let (code, out, _) = run(folder.path(), &["diff", "small.scn", "same.scn", "--set", "side=0.5 m"]);
    assert_eq!((code, out.as_str()), (Some(1), "~ param side: 0.4 m → 0.5 m\n"));
    assert_eq!(run(folder.path(), &["diff", "small.scn", "none.scn"]).0, Some(2));
}

#[test]
fn new_writes_a_scenario_that_compiles_and_overwrites_nothing() {
    let folder = folder();
    for (name, template) in [("first", "track"), ("second", "unison")] {
        let (code, out, err) = run(folder.path(), &["new", name, "--template", template]);
        assert_eq!((code, out), (Some(0), format!("{name}.scn\n")), "{err}");
        assert_eq!(run(folder.path(), &["check", &format!("{name}.scn"), "--pedantic"]).0, Some(0));
        assert_eq!(run(folder.path(), &["fmt", "--check", &format!("{name}.scn")]).0, Some(0));
    }
    let (code, _, err) = run(folder.path(), &["new", "small"]);
    assert!(code == Some(2) && err.contains("there already"), "{err}");
    assert_eq!(fs::read_to_string(folder.path().join("small.scn")).unwrap(), SCENARIO);
    for bad in ["world", "../x", "2nd", "a b"] {
        assert_eq!(run(folder.path(), &["new", bad]).0, Some(2), "{bad}");
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 3);
}

#[test]
fn doc_prints_and_writes_the_reference() {
    let folder = folder();
    let (code, out, _) = run(folder.path(), &["doc"]);
    assert!(code == Some(0) && out.contains("std.motion"), "{out}");
    let (code, motion, _) = run(folder.path(), &["doc", "motion"]);
    assert!(code == Some(0) && motion.contains("## motion `circle`"), "{motion}");
    let (code, own, _) = run(folder.path(), &["doc", "small.scn"]);
    assert!(code == Some(0) && own.contains("## param `side`"), "{own}");
    let (code, _, err) = run(folder.path(), &["doc", "std.moton"]);
    assert!(code == Some(2) && err.contains("did you mean `std.motion`?"), "{err}");
    assert_eq!(run(folder.path(), &["doc", "--out", "reference"]).0, Some(0));
    assert_eq!(fs::read_to_string(folder.path().join("reference/std.motion.md")).unwrap(), motion);
}

#[test]
fn explain_says_what_a_scenario_means() {
    let folder = folder();
    let (code, out, _) = run(folder.path(), &["explain", "small.scn"]);
    assert_eq!(code, Some(0));
    for said in [
        "30 steps of 0.1 s; agents closer than 0.1 m collide",
        "follower[2]: unicycle",
        "moves: random_velocity",
        "arena x -1 .. 1 m, y -1 .. 1 m",
        "F of follower: line about leader",
        "side = 0.4 m",
        "gap = −∑_{i ∈ follower} ‖p_i − F_i‖",
        "lost (failure): ∃i ∈ follower : p_i ∉ A_i, costs 1",
        "held_out: 5 episodes",
    ] {
        assert!(out.contains(said), "{said}:\n{out}");
    }
}

#[test]
fn results_of_another_program_become_a_page_beside_them() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let results = include_str!("../../study/tests/fixtures/marl_eval.json");
    fs::write(at("results.json"), results).unwrap();
    let (code, out, err) = run(folder.path(), &["report", "--import", "results.json"]);
    assert_eq!(code, Some(0), "{err}");
    assert!(out.contains("vmas/balance: return") && out.trim_end().ends_with("results.html"), "{out}");
    let line = out.lines().find(|line| line.starts_with("iql ")).unwrap();
    assert!(line.contains("72.946 [") && line.ends_with("10       1"), "{line}");
    assert!(out.contains("ippo against mappo: -6.517 ["), "{out}");
    assert!(fs::read_to_string(at("results.html")).unwrap().contains("</html>"));

    fs::write(at("broken.json"), results.replace("\"step_count\": 0,", "")).unwrap();
    let (code, _, err) = run(folder.path(), &["report", "--import", "broken.json"]);
    assert_eq!(code, Some(2));
    assert!(err.contains("broken.json: vmas/balance/ippo/seed_0/step_0 has no step_count"), "{err}");
    assert!(err.contains("help: give each step"), "{err}");
    assert!(!at("broken.html").exists());
    assert_eq!(run(folder.path(), &["report", "--import", "missing.json"]).0, Some(74));
    assert_eq!(run(folder.path(), &["report"]).0, Some(2));
}
