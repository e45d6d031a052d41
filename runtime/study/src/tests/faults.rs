use std::collections::BTreeSet;

use mpgx_lang::plan::{Expr, Function, Plan, Stage, Until};

use super::sample::*;
use crate::storage::{Crash, Fault, SimulatedDisk, Storage};
use crate::*;

/// MPG with one seed and the oracle: enough to meet every kind of write.
pub fn small() -> Plan {
    Plan { learners: vec![learner("mpg", 25.0)], seeds: 1, ..plan() }
}

/// The same with a curriculum for robots that share a policy.
fn small_shared() -> Plan {
    Plan { learners: shared().learners.drain(..1).collect(), seeds: 1, ..shared() }
}

/// The operations of an undisturbed run, and its hash.
fn undisturbed() -> (u64, String) {
    undisturbed_of(&small())
}

fn undisturbed_of(plan: &Plan) -> (u64, String) {
    let disk = SimulatedDisk::default();
    let hash = hash_of(&disk, plan);
    (disk.operations(), hash)
}

/// The cells whose records are on a disk.
fn finished_on(disk: &SimulatedDisk) -> BTreeSet<CellId> {
    let files = disk.list("cells").unwrap();
    files.iter().filter_map(|file| file.strip_suffix("/record.bin")).map(str::to_string).collect()
}

/// Seen to fail when a record is written in place, without a temporary file.
#[test]
fn every_operation_may_fail() {
    let (operations, expected) = undisturbed();
    for fault in [Fault::Full, Fault::FullOnce, Fault::Broken, Fault::BrokenOnce] {
        let mut errors = 0;
        for operation in 0..operations {
            let disk = SimulatedDisk::default();
            disk.inject(operation, fault);
            match run_on(&disk, &small(), &Listener::default()) {
                Ok(outcome) => assert_eq!(hash(Ok(outcome)), expected, "{fault:?} at {operation}"),
                Err(StudyError::Storage(_)) => errors += 1,
                Err(error) => panic!("{fault:?} at {operation}: {error}"),
            }
            disk.repair();
            let (before, listener) = (finished_on(&disk), Listener::default());
            assert_eq!(hash(run_on(&disk, &small(), &listener)), expected, "{fault:?} at {operation}");
            assert_eq!(*listener.kept.lock().unwrap(), before, "{fault:?} at {operation}");
        }
        assert!(errors * 3 > operations, "{fault:?}: only {errors} of {operations} were noticed");
    }
}

/// Seen to fail when a write is renamed before it is flushed or its folder is not, and when a checkpoint leaves out the actions
/// of the episode that is going on.
#[test]
fn the_machine_may_stop_at_every_operation() {
    for plan in [small(), small_shared()] {
        stopped_at_every_operation(&plan);
    }
}

fn stopped_at_every_operation(plan: &Plan) {
    let (operations, expected) = undisturbed_of(plan);
    for operation in 0..operations {
        let disk = SimulatedDisk::default();
        disk.inject(operation, Fault::Crash);
        let first = Listener::default();
        run_on(&disk, plan, &first).ok();
        let finished = first.finished.into_inner().unwrap();
        for crash in [Crash::Forget, Crash::Keep, Crash::Mixed(operation), Crash::Mixed(!operation)] {
            let (disk, listener) = (disk.after_crash(crash), Listener::default());
            assert_eq!(hash(run_on(&disk, plan, &listener)), expected, "{crash:?} at {operation}");
            let kept = listener.kept.lock().unwrap();
            assert!(kept.is_superset(&finished), "{crash:?} at {operation}: {finished:?} became {kept:?}");
        }
    }
}

/// It stops again and again, later each time it has come further.
/// Seen to fail when a checkpoint leaves out the actions of the episode that is going on.
#[test]
fn the_machine_may_stop_while_it_recovers() {
    let (_, expected) = undisturbed();
    for stride in [7, 17, 37] {
        let mut disk = SimulatedDisk::default();
        for seed in 0.. {
            disk.inject(disk.operations() + stride + seed, Fault::Crash);
            match run_on(&disk, &small(), &Listener::default()) {
                Ok(outcome) => {
                    assert_eq!(hash(Ok(outcome)), expected, "stride {stride}");
                    break;
                }
                Err(_) => disk = disk.after_crash(Crash::Mixed(seed)),
            }
        }
    }
}

/// A study interrupted in the middle of a cell, with two checkpoints on disk.
pub fn with_checkpoints(plan: &Plan) -> SimulatedDisk {
    let disk = SimulatedDisk::default();
    let listener = Listener { interrupt_after: Some(3), ..Listener::default() };
    assert!(matches!(run_on(&disk, plan, &listener), Ok(Outcome::Interrupted { .. })));
    let files = disk.list("cells/mpg-000").unwrap();
    assert_eq!(files, ["checkpoint.0", "checkpoint.1", "replay.log"]);
    disk
}

/// Seen to fail when checkpoints do not take turns, the earlier of two is taken, or nobody looks whether the log is whole.
#[test]
fn damaged_checkpoints_are_passed_over() {
    let (_, expected) = undisturbed();
    let start = with_checkpoints(&small());
    let resumed_at = |disk: &SimulatedDisk| {
        let listener = Listener::default();
        assert_eq!(hash(run_on(disk, &small(), &listener)), expected);
        let warned = !listener.warnings.into_inner().unwrap().is_empty();
        (listener.started.into_inner().unwrap()[0].1, warned)
    };
    let (latest, warned) = resumed_at(&start.fork());
    assert!(latest > 10 && !warned);
    let mut seen = BTreeSet::new();
    for name in ["checkpoint.0", "checkpoint.1", "replay.log"] {
        let path = format!("cells/mpg-000/{name}");
        let whole = start.read(&path).unwrap();
        let header = (0..whole.len()).filter(|at| *at < 200 || at % 997 == 0 || at + 9 > whole.len());
        let flipped = header.map(|at| {
            let mut bytes = whole.clone();
            bytes[at] ^= 1 << (at % 8);
            bytes
        });
        let cut = [0, 1, 7, 51, 100, whole.len() / 2, whole.len() - 1].map(|at| whole[..at].to_vec());
        for bytes in flipped.chain(cut) {
            let disk = start.fork();
            disk.write_atomic(&path, &bytes).unwrap();
            let (steps, warned) = resumed_at(&disk);
            assert!(warned);
            seen.insert((name, steps));
        }
    }
    // The other checkpoint takes over; a damaged log leaves the checkpoint before the damage, or none.
    let first = seen.iter().map(|(_, steps)| *steps).find(|steps| (1..latest).contains(steps)).unwrap();
    let expected =
        [("checkpoint.0", latest), ("checkpoint.1", first), ("replay.log", 0), ("replay.log", first)];
    let other = [("checkpoint.0", first), ("checkpoint.1", latest), ("replay.log", 0), ("replay.log", first)];
    assert!(seen == expected.into() || seen == other.into(), "{seen:?}");
}

/// After one damaged checkpoint there are soon two whole ones again.
/// Seen to fail when the next checkpoint goes where the good one lies.
#[test]
fn the_good_checkpoint_is_not_the_next_to_be_written() {
    let plan = Plan { learners: vec![learner("mpg", 60.0)], ..small() };
    let expected = hash_of(&SimulatedDisk::default(), &plan);
    for damaged in ["cells/mpg-000/checkpoint.0", "cells/mpg-000/checkpoint.1"] {
        let disk = with_checkpoints(&plan);
        disk.write_atomic(damaged, b"mpgx-chk").unwrap();
        let further = Listener { interrupt_after: Some(1), ..Listener::default() };
        run_on(&disk, &plan, &further).unwrap();
        for path in ["cells/mpg-000/checkpoint.0", "cells/mpg-000/checkpoint.1"] {
            let (disk, listener) = (disk.fork(), Listener::default());
            disk.write_atomic(path, b"mpgx-chk").unwrap();
            assert_eq!(hash(run_on(&disk, &plan, &listener)), expected);
            assert!(listener.started.lock().unwrap()[0].1 > 0, "{damaged}, then {path}");
        }
    }
}

/// One cell that cannot be stored stops the others, so that nobody waits an hour for an error.
/// Seen to fail when a cell that cannot be stored does not stop the others.
#[test]
fn a_broken_disk_stops_all_cells() {
    let disk = SimulatedDisk::default();
    disk.inject(30, Fault::FullOnce);
    let listener = Listener::default();
    let error = run_on(&disk, &plan(), &listener).unwrap_err().to_string();
    assert!(error.contains("no space left"), "{error}");
    assert_eq!(listener.started(), ["mpg-000"]);
}

/// Seen to fail when nobody looks what a sealed file belongs to.
#[test]
fn a_checkpoint_of_another_cell_or_study_is_passed_over() {
    let (_, expected) = undisturbed();
    let other = Plan { learners: vec![learner("mpg", 26.0)], ..small() };
    let foreign = SimulatedDisk::default();
    run_on(&foreign, &other, &Listener { interrupt_after: Some(3), ..Listener::default() }).unwrap();
    let disk = with_checkpoints(&small());
    for name in ["checkpoint.0", "checkpoint.1", "replay.log"] {
        let path = format!("cells/mpg-000/{name}");
        disk.write_atomic(&path, &foreign.read(&path).unwrap()).unwrap();
    }
    let listener = Listener::default();
    assert_eq!(hash(run_on(&disk, &small(), &listener)), expected);
    let warnings = listener.warnings.into_inner().unwrap();
    assert!(warnings.len() == 2 && warnings[0].contains("another study"), "{warnings:?}");
}

/// Seen to fail when a damaged record is an error.
#[test]
fn a_damaged_record_is_made_again() {
    let disk = SimulatedDisk::default();
    let expected = hash_of(&disk, &small());
    let path = "cells/mpg-000/record.bin";
    let mut bytes = disk.read(path).unwrap();
    bytes[300] ^= 1;
    disk.write_atomic(path, &bytes).unwrap();
    assert!(matches!(load(&disk), Err(StudyError::Damaged { .. })));
    let listener = Listener::default();
    assert_eq!(hash(run_on(&disk, &small(), &listener)), expected);
    assert_eq!(listener.started(), ["mpg-000"]);
}

/// Seen to fail when a damaged plan is an error.
#[test]
fn a_damaged_plan_is_frozen_again() {
    let disk = SimulatedDisk::default();
    let expected = hash_of(&disk, &small());
    for text in ["", "(name: \"other\")", "\u{0}"] {
        disk.write_atomic("plan.ron", text.as_bytes()).unwrap();
        assert_eq!(hash_of(&disk, &small()), expected);
    }
}

/// √(1.3 m − gap) is no number where the follower is far: the learners meet that, the oracle starts closer.
/// Seen to fail when training goes on with NaN, places name the folder, or a failed cell leaves a policy.
#[test]
fn a_cell_without_numbers_fails_alone() {
    let mut plan = plan();
    let short = Expr::Binary(mpgx_lang::plan::BinaryOp::Sub, Box::new(Expr::Number(1.3)), Box::new(gap()));
    plan.world.reward.push(term("close", Expr::Call(Function::Sqrt, vec![short])));
    plan.protocols[0].episodes = 1;
    let disk = SimulatedDisk::default();
    let Ok(Outcome::Finished(study)) = run_on(&disk, &plan, &Listener::default()) else { panic!() };
    let failed: Vec<_> = study.records.values().filter(|record| record.failure.is_some()).collect();
    assert!(!failed.is_empty() && failed.len() < study.records.len(), "{} failed", failed.len());
    for record in failed {
        let failure = record.failure.as_ref().unwrap();
        assert_eq!(failure.cause, "reward term `close` is NaN");
        assert_eq!(failure.at, "sample.scn:9:5");
        assert!(failure.step > 0 && record.protocols.is_empty());
        let policy = format!("cells/{}-{:03}/policy.bin", record.method, record.seed);
        assert_eq!(disk.read_if_there(&policy).unwrap(), None);
    }
    assert!(study.records["oracle-000"].failure.is_none());
    assert!(!study.summary.as_ref().unwrap().failures.is_empty());
    let again = Listener::default();
    assert_eq!(hash(run_on(&disk, &plan, &again)), study.summary.unwrap().study_hash);
    assert_eq!(again.started(), Vec::<CellId>::new());
}

/// Seen to fail when panics are not caught.
#[test]
fn a_panic_stays_in_its_cell() {
    let listener = Listener { panic_in: Some("td3-001".into()), ..Listener::default() };
    let Ok(Outcome::Finished(study)) = run_on(&SimulatedDisk::default(), &plan(), &listener) else {
        panic!()
    };
    let failed: Vec<_> = study.records.iter().filter(|(_, record)| record.failure.is_some()).collect();
    assert_eq!(failed.len(), 1);
    let (id, record) = failed[0];
    let failure = record.failure.as_ref().unwrap();
    assert_eq!((id.as_str(), failure.cause.as_str()), ("td3-001", "it panicked: a panic on purpose"));
    assert!(failure.step > 0);
    assert_eq!(record.training.as_ref().unwrap().returns.len(), 1);
}

/// Seen to fail when something is written before the Plan is checked.
#[test]
fn a_bad_plan_is_refused_before_anything_is_written() {
    let disk = SimulatedDisk::default();
    let change = |change: &dyn Fn(&mut Plan)| {
        let mut plan = plan();
        change(&mut plan);
        run_on(&disk, &plan, &Listener::default()).unwrap_err().to_string()
    };
    for (error, part) in [
        (change(&|plan| plan.learners[1].label = "mpg".into()), "two methods are called `mpg`"),
        (change(&|plan| plan.learners[0].label = "../mpg".into()), "cannot name a folder"),
        (change(&|plan| plan.learners[0].what.name = "sarsa".into()), "no algorithm `sarsa`"),
        (change(&|plan| plan.controllers[0].what.name = "pid".into()), "no controller `pid`"),
        (
            change(&|plan| plan.protocols.push(plan.protocols[0].clone())),
            "two evaluations are called `random`",
        ),
        (change(&|plan| plan.world.observe.clear()), "nothing is observed"),
        (change(&|plan| plan.seeds = usize::MAX), "at most 100000"),
        (change(&|plan| plan.world.dt_s = f64::NAN), "time step"),
        (change(&|plan| plan.stages.push(stage(None))), "stage `near` has no end (folder/sample.scn:13:5)"),
        (
            change(&|plan| {
                let until = Until { measure: "gap".into(), below: true, bound: 1.0, episodes: 9 };
                plan.stages.push(Stage { until: Some(until), ..stage(None) });
            }),
            "stage `near` ends by `gap`",
        ),
        (
            change(&|plan| {
                plan.stages.push(stage(Some(9)));
                plan.stages[0].world.observe.clear();
            }),
            "`near` has 0 numbers of state, 2 of action and 1 reward terms, training has 2, 2 and 1",
        ),
        (
            change(&|plan| {
                *plan = shared();
                let three = plan.protocols[1].world.as_mut().unwrap();
                three.observe.extend(three.observe.clone());
            }),
            "`three` has 4 numbers of state, 2 of action",
        ),
    ] {
        assert!(error.contains(part), "{error}");
    }
    assert_eq!(disk.list("").unwrap(), Vec::<String>::new());
}

#[test]
fn a_source_cannot_leave_its_folder() {
    let source = |name: &str| vec![(name.to_string(), String::new())];
    for (name, kept) in
        [("../../evil.scn", "evil.scn"), ("/etc/evil.scn", "evil.scn"), ("a/b.scn", "a/b.scn")]
    {
        let disk = SimulatedDisk::default();
        run(&small(), &source(name), &disk, &options(), &Silent).unwrap();
        assert_eq!(disk.list("source").unwrap(), [kept]);
    }
    let disk = SimulatedDisk::default();
    assert!(matches!(
        run(&small(), &source(".."), &disk, &options(), &Silent),
        Err(StudyError::SourceName { .. })
    ));
}
