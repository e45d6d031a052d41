//! Memory: what is told before a run is what the run takes, and many cells take no more of it than few.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

const SCENARIO: &str = include_str!("small.scn");

fn mpgx(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_mpgx"));
    command.current_dir(folder).args(["run", "small.scn"]).args(arguments).stdout(Stdio::null());
    command
}

/// The most megabytes that a run had at a time.
fn used(folder: &Path, arguments: &[&str]) -> f64 {
    let mut run = mpgx(folder, arguments).stderr(Stdio::null()).spawn().unwrap();
    let status = format!("/proc/{}/status", run.id());
    let mut most = 0.0f64;
    loop {
        let now = fs::read_to_string(&status).unwrap_or_default();
        let line = now.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let kilobytes = line.and_then(|line| line.split_whitespace().next()?.parse::<f64>().ok());
        most = most.max(kilobytes.unwrap_or(0.0) * 1024.0 / 1e6);
        if let Some(ended) = run.try_wait().unwrap() {
            assert_eq!(ended.code(), Some(0));
            return most;
        }
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
}

/// Megabytes that a run could take, as it tells before.
fn told(folder: &Path, arguments: &[&str]) -> f64 {
    let output = mpgx(folder, &[arguments, &["--dry-run"]].concat()).output().unwrap();
    let text = String::from_utf8(output.stderr).unwrap().replace('\n', " ");
    let before = text.split(" of memory").next().unwrap();
    let mut words = before.split_whitespace().rev();
    let (unit, number) = (words.next().unwrap(), words.next().unwrap().parse::<f64>().unwrap());
    number * if unit == "GB" { 1e3 } else { 1.0 }
}

/// Small and large networks, and the long memory of a large team.
#[test]
fn the_memory_that_is_told_is_within_half_of_what_is_used() {
    let each = "observe each i in follower { F[i] - p[i] for j in follower }";
    let one = ("compare { td3, oracle, proportional }\nseeds 2", "compare { oracle }\nseeds 1");
    let cases: [(&str, &[(&str, &str)]); 3] = [
        ("small", &[]),
        // Long enough for a checkpoint.
        ("wide", &[one, ("steps = 400, hidden = [16, 12]", "steps = 4010, batch = 2, hidden = [400, 300]")]),
        (
            "team",
            &[
                one,
                ("observe { F[i] - p[i] for i in follower }", each),
                ("follower[2]", "follower[40]"),
                ("steps = 400", "steps = 1000, replay = 1000000"),
            ],
        ),
    ];
    for (name, changes) in cases {
        let folder = tempfile::tempdir().unwrap();
        let text = changes.iter().fold(SCENARIO.to_owned(), |text, (from, to)| {
            assert!(text.contains(from), "{name}: {from}");
            text.replace(from, to)
        });
        fs::write(folder.path().join("small.scn"), text).unwrap();
        let (told, used) = (told(folder.path(), &[]), used(folder.path(), &[]));
        println!("{name}: {told} MB told, {used:.1} MB used");
        assert!((1.0 / 1.5..1.6).contains(&(told / used)), "{name}: {told} MB told, {used:.1} MB used");
    }
}

/// Their records are held for the report: about 22 kB each.
#[test]
fn a_thousand_cells_take_little_more_memory_than_fifty() {
    let folder = tempfile::tempdir().unwrap();
    let text = SCENARIO.replace("steps = 400, hidden = [16, 12]", "steps = 20, hidden = [4], batch = 2");
    let text = text.replace("compare { td3, oracle, proportional }", "compare { oracle }");
    fs::write(folder.path().join("small.scn"), text.replace("episodes = 5", "episodes = 1")).unwrap();
    let few = used(folder.path(), &["--seeds", "50", "--out", "few"]);
    let many = used(folder.path(), &["--seeds", "1000", "--out", "many"]);
    println!("{few:.1} MB for 50 cells, {many:.1} MB for 1000");
    assert!(many - few < 0.03 * 950.0, "{few:.1} MB for 50 cells, {many:.1} MB for 1000");
}
