//! Scenarios whose robots see, with a binary that has networks and with one that has none.

#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::Path;
use std::process::Command;

use tempfile::TempDir;

fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("seeing.scn"), include_str!("seeing.scn")).unwrap();
    folder
}

/// Exit code and stderr.
fn run(folder: &Path, arguments: &[&str]) -> (Option<i32>, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_mpgx"));
    let output = command.current_dir(folder).args(arguments).env_remove("MPGX_SIMD").env_remove("MPGX_LOG");
    let output = output.output().unwrap();
    (output.status.code(), String::from_utf8(output.stderr).unwrap())
}

/// Seen to fail when networks are taken for built in, and when a verb names another feature.
#[cfg(not(feature = "vision"))]
#[test]
fn a_binary_without_networks_says_how_to_get_one_with_them() {
    let folder = folder();
    let remedy = "cargo build --release --features vision";
    let (code, said) = run(folder.path(), &["run", "seeing.scn"]);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("localiser `eyes`") && said.contains("seeing.scn:44:11"), "{said}");
    assert!(said.contains(remedy), "{said}");
    assert!(!folder.path().join("runs").exists(), "something was left behind");
    for verb in ["train", "eval", "predict"] {
        let (code, said) = run(folder.path(), &["vision", verb, "data", "--out", "x"]);
        assert_eq!(code, Some(2), "{said}");
        assert!(said.contains(remedy), "{said}");
    }
    let (code, said) = run(folder.path(), &["check", "seeing.scn"]);
    assert_eq!(code, Some(0), "what is right is right without networks too: {said}");
}

/// Seen to fail when what a network learns from depends on the number of threads.
#[cfg(feature = "vision")]
#[test]
fn a_study_that_sees_has_one_hash_for_any_number_of_threads() {
    let hash = |threads: &str| {
        let folder = folder();
        let (code, said) = run(folder.path(), &["run", "seeing.scn", "--threads", threads]);
        assert_eq!(code, Some(0), "{said}");
        let study = fs::read(folder.path().join("runs/seeing/study.json")).unwrap();
        let study: serde_json::Value = serde_json::from_slice(&study).unwrap();
        study["study_hash"].as_str().unwrap().to_string()
    };
    assert_eq!(hash("1"), hash("2"));
}
