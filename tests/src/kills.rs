//! `kill -9` at any instant of a small study, and again while it recovers: the same command goes on, to the hash of an
//! undisturbed run and the same files.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::crashes::stream;

/// Trains for a tenth of a second, with checkpoints.
pub const SCENARIO: &str = include_str!("kills.scn");

/// How many kills met a run.
#[derive(Clone, Copy, Debug, Default)]
pub struct Killed {
    pub studies: u64,
    pub kills: u64,
    /// Kills of a run that went on where an earlier one had been killed.
    pub recovering: u64,
    /// Kills that came when the run was over.
    pub late: u64,
}

/// Kills runs of `scenario.scn` in a folder of its own below `folder`, until `kills` of them met a run or `over`.
/// The instants are drawn by `seed`, evenly over the time of a run.
///
/// # Errors
/// The hash or the files that are not those of an undisturbed run.
pub fn kill_often(
    mpgx: &Path,
    folder: &Path,
    scenario: &str,
    seed: u64,
    kills: u64,
    over: impl Fn() -> bool,
) -> Result<Killed, String> {
    let began = Instant::now();
    let expected = finished(mpgx, &fresh(folder, "undisturbed", scenario)?)?;
    let length = began.elapsed();
    let mut sum = Killed::default();
    while sum.kills < kills && !over() {
        let random = &mut stream(seed, sum.studies);
        let here = fresh(folder, &format!("study-{}", sum.studies), scenario)?;
        let mut first = true;
        while first || random.below(4) != 0 {
            let threads = (1 + random.below(3)).to_string();
            let mut run = command(mpgx, &here, &threads).spawn().map_err(|why| why.to_string())?;
            std::thread::sleep(Duration::from_nanos(random.below(length.as_nanos() as u64)));
            let ended = run.try_wait().map_err(|why| why.to_string())?.is_some();
            let _ = run.kill();
            let _ = run.wait();
            let met = u64::from(!ended);
            sum.late += 1 - met;
            sum.kills += met;
            sum.recovering += if first { 0 } else { met };
            first = false;
        }
        let found = finished(mpgx, &here)?;
        if found != expected {
            return Err(format!("seed {seed}, study {}: {found:?}, not {expected:?}", sum.studies));
        }
        let _ = std::fs::remove_dir_all(&here);
        sum.studies += 1;
    }
    Ok(sum)
}

fn fresh(folder: &Path, name: &str, scenario: &str) -> Result<std::path::PathBuf, String> {
    let here = folder.join(name);
    let made =
        std::fs::create_dir_all(&here).and_then(|()| std::fs::write(here.join("scenario.scn"), scenario));
    made.map(|()| here).map_err(|why| why.to_string())
}

fn command(mpgx: &Path, here: &Path, threads: &str) -> Command {
    let mut command = Command::new(mpgx);
    command.args(["run", "scenario.scn", "--out", "out", "--threads", threads]).current_dir(here);
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command
}

/// Runs to the end; gives the hash and the names of all files.
fn finished(mpgx: &Path, here: &Path) -> Result<(String, Vec<String>), String> {
    let ended = command(mpgx, here, "2").status().map_err(|why| why.to_string())?;
    if !ended.success() {
        return Err(format!("{}: {ended}", here.display()));
    }
    let out = here.join("out");
    let study = std::fs::read_to_string(out.join("study.json")).map_err(|why| why.to_string())?;
    let hash = study.lines().find(|line| line.contains("\"study_hash\"")).unwrap_or_default().to_owned();
    Ok((hash, files(&out, &out)))
}

fn files(root: &Path, folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut all: Vec<String> = entries
        .flat_map(|path| match path.is_dir() {
            true => files(root, &path),
            false => vec![path.strip_prefix(root).unwrap_or(&path).display().to_string()],
        })
        .collect();
    all.sort();
    all
}
