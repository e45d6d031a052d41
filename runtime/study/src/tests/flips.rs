//! Every byte of every file flipped, every length cut: refused, made again or passed over, never a wrong result.

use super::faults::{small, with_checkpoints};
use super::sample::*;
use crate::checkpoint::{Checkpoints, Restored};
use crate::hash::Identity;
use crate::storage::{SimulatedDisk, Storage};
use crate::*;

/// A file with one bit of each byte flipped in turn, and cut to each length.
fn damaged(whole: &[u8]) -> impl Iterator<Item = (String, Vec<u8>)> {
    let flipped = (0..whole.len()).map(|at| {
        let mut bytes = whole.to_vec();
        bytes[at] ^= 1 << (at % 8);
        (format!("byte {at} flipped"), bytes)
    });
    flipped.chain((0..whole.len()).map(|at| (format!("cut to {at}"), whole[..at].to_vec())))
}

fn first_cell() -> Cell {
    cells(&small()).unwrap().remove(0)
}

fn identity(disk: &SimulatedDisk) -> Identity {
    Identity(blake3::Hash::from_hex(disk.read("plan.hash").unwrap()).unwrap())
}

type State = Option<(u64, Vec<u8>, Vec<u8>)>;

/// What training would go on from, and whether a warning tells of damage.
fn loaded(disk: &SimulatedDisk, identity: &Identity) -> (State, bool) {
    let mut checkpoints = Checkpoints::new(disk, &first_cell(), identity).unwrap();
    let (restored, warnings) = checkpoints.load().unwrap();
    let state = restored.map(|Restored { course, learner, rows }| (course.steps, learner, rows));
    (state, !warnings.is_empty())
}

/// Seen to fail when the hash of the header or of the log is not compared.
#[test]
fn a_damaged_checkpoint_leaves_the_other_or_none() {
    let start = with_checkpoints(&small());
    let identity = identity(&start);
    let path = |name| format!("cells/mpg-000/{name}");
    let without = |name| {
        let disk = start.fork();
        disk.remove(&path(name)).unwrap();
        loaded(&disk, &identity).0
    };
    let (whole, warned) = loaded(&start, &identity);
    assert!(whole.is_some() && !warned);
    let earlier =
        [without("checkpoint.0"), without("checkpoint.1")].into_iter().find(|it| *it != whole).unwrap();
    for name in ["checkpoint.0", "checkpoint.1", "replay.log"] {
        let allowed = if name == "replay.log" { vec![earlier.clone(), None] } else { vec![without(name)] };
        for (damage, bytes) in damaged(&start.read(&path(name)).unwrap()) {
            let disk = start.fork();
            disk.write(&path(name), 0, &bytes).unwrap();
            let (state, warned) = loaded(&disk, &identity);
            assert!(warned, "{name}, {damage}: nobody was told");
            assert!(allowed.contains(&state), "{name}, {damage}: {:?}", state.map(|(steps, ..)| steps));
        }
    }
}

/// Seen to fail when the hash of a section is not compared.
#[test]
fn a_damaged_record_or_policy_is_refused() {
    let disk = SimulatedDisk::default();
    hash_of(&disk, &small());
    let identity = identity(&disk);
    for name in ["record.bin", "policy.bin"] {
        let path = format!("cells/mpg-000/{name}");
        for (damage, bytes) in damaged(&disk.read(&path).unwrap()) {
            let disk = disk.fork();
            disk.write(&path, 0, &bytes).unwrap();
            let refused = match name {
                "policy.bin" => read_policy(&disk, &first_cell()).err(),
                _ => folder::read_record(&disk, &first_cell(), &identity).err(),
            };
            assert!(matches!(refused, Some(StudyError::Damaged { .. })), "{name}, {damage}: {refused:?}");
        }
    }
}

/// What `load` gives is the study that was written, or it has no summary, or it is refused.
#[test]
fn a_damaged_plan_or_summary_is_never_another_result() {
    let start = SimulatedDisk::default();
    let expected = hash_of(&start, &small());
    let records = load(&start).unwrap().records;
    for path in ["plan.ron", "plan.hash", "study.json"] {
        for (damage, bytes) in damaged(&start.read(path).unwrap()) {
            let disk = start.fork();
            disk.write(path, 0, &bytes).unwrap();
            let Ok(study) = load(&disk) else { continue };
            let Some(summary) = study.summary else { continue };
            assert_eq!(
                (summary.study_hash, study.records),
                (expected.clone(), records.clone()),
                "{path}, {damage}"
            );
        }
    }
}
