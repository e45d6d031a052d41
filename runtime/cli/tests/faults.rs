//! What goes wrong around a run, and what the user sees: exit codes, words, and what is left behind.
#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use mpgx_tests::kills::SCENARIO;
use tempfile::TempDir;

fn mpgx(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_mpgx"));
    command.current_dir(folder).args(arguments);
    command
}

fn run(folder: &Path, arguments: &[&str]) -> Output {
    mpgx(folder, arguments).output().unwrap()
}

fn folder(scenario: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("kills.scn"), scenario).unwrap();
    folder
}

#[track_caller]
fn ends(output: &Output, code: i32, said: &str) {
    let told = [output.stdout.as_slice(), &output.stderr].concat();
    let told = String::from_utf8_lossy(&told);
    assert_eq!(output.status.code(), Some(code), "{told}");
    assert!(told.contains(said), "{told}");
}

/// Seen to fail when the limit is not held against what was read, or links are followed anywhere.
#[cfg(unix)]
#[test]
fn an_endless_file_is_refused() {
    let folder = folder("");
    ends(&run(folder.path(), &["check", "/dev/zero"]), 2, "larger than 1 MiB");
    std::os::unix::fs::symlink("/dev/zero", folder.path().join("mine.scn")).unwrap();
    fs::write(folder.path().join("kills.scn"), "scenario kills\nuse mine.thing\n").unwrap();
    ends(&run(folder.path(), &["check", "kills.scn"]), 2, "out of the scenario's folder");
}

/// A second run in the same folder is told who is there; when that one is killed, it takes over.
/// Seen to fail when whoever is found counts as dead, when nobody does, and when it ends with another code.
#[test]
fn one_folder_has_one_run() {
    let long = folder(&SCENARIO.replace("steps = 9000", "steps = 1000000"));
    let mut first =
        mpgx(long.path(), &["run", "kills.scn"]).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    while !long.path().join("runs/kills/owner.json").exists() {
        assert!(first.try_wait().unwrap().is_none());
        std::thread::yield_now();
    }
    let second = run(long.path(), &["run", "kills.scn"]);
    let pid = format!("process {}", first.id());
    first.kill().unwrap();
    first.wait().unwrap();
    ends(&second, 74, &pid);
    let mut third = mpgx(long.path(), &["run", "kills.scn"]).stderr(Stdio::null()).spawn().unwrap();
    let owner = || fs::read_to_string(long.path().join("runs/kills/owner.json")).unwrap_or_default();
    while !owner().contains(&format!("\"pid\":{}", third.id())) {
        assert!(third.try_wait().unwrap().is_none(), "it did not take over");
        std::thread::yield_now();
    }
    third.kill().unwrap();
    third.wait().unwrap();
}

/// A place where no folder can be made.
/// Seen to fail when it ends with another code.
#[test]
fn a_folder_that_cannot_be_made_ends_with_74_and_leaves_nothing() {
    let folder = folder(SCENARIO);
    ends(&run(folder.path(), &["run", "kills.scn", "--out", "kills.scn/study"]), 74, "kills.scn");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    assert_eq!(fs::read_to_string(folder.path().join("kills.scn")).unwrap(), SCENARIO);
}

/// What runs is frozen: another text under the same name is refused, with both hashes, and the study is as it was.
/// Seen to fail when the hashes are not compared.
#[test]
fn a_scenario_that_was_edited_meanwhile_is_refused() {
    let folder = folder(&SCENARIO.replace("steps = 9000", "steps = 300"));
    assert!(run(folder.path(), &["run", "kills.scn"]).status.success());
    let study = fs::read(folder.path().join("runs/kills/study.json")).unwrap();
    fs::write(folder.path().join("kills.scn"), SCENARIO).unwrap();
    ends(&run(folder.path(), &["run", "kills.scn"]), 2, "another study");
    assert_eq!(fs::read(folder.path().join("runs/kills/study.json")).unwrap(), study);
}

/// The root is no number where a follower is far.
/// Seen to fail when failures do not count.
#[test]
fn a_seed_that_fails_ends_with_1_and_the_others_finish() {
    let far = "    odd = sum(i in follower) sqrt(1.6 m * 1 m - |p[i] - F[i]| * 1 m)\n    gap   = ";
    let folder = folder(&include_str!("small.scn").replace("    gap   = ", far));
    let output = run(folder.path(), &["run", "kills.scn", "--out", "study"]);
    ends(&output, 1, "reward term `odd` is NaN (kills.scn:32:5)");
    assert!(folder.path().join("study/cells/mpg-000/policy.bin").exists());
}

/// What is printed is lost: that is told.
/// Seen to fail when it is a panic like any other.
#[cfg(target_os = "linux")]
#[test]
fn output_that_cannot_be_written_ends_with_74() {
    let folder = folder("");
    let full = fs::File::options().write(true).open("/dev/full").unwrap();
    let output = mpgx(folder.path(), &["list"]).stdout(full).output().unwrap();
    ends(&output, 74, "error: failed printing");
}

/// Threads that the machine does not give, for their stacks are larger than its addresses.
/// Seen to fail when it ends with another code.
#[cfg(target_os = "linux")]
#[test]
fn what_is_nobodys_fault_ends_with_70() {
    let folder = folder(SCENARIO);
    let output =
        mpgx(folder.path(), &["run", "kills.scn"]).env("RUST_MIN_STACK", "1000000000000000").output();
    ends(&output.unwrap(), 70, "threads");
}
