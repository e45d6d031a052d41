//! Strange scenarios, and power cuts. The binary `endurance` does the same for a night.
#![allow(clippy::unwrap_used)]

use mpgx_study::storage::Crash;
use mpgx_tests::crashes::{Sample, stream};
use mpgx_tests::fuzz::{Inputs, Reached, fuzz};

/// It has found numbers with units that were printed without parentheses where something is looked up in them.
#[test]
fn strange_scenarios_are_compiled_or_refused() {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let tally = fuzz(&Inputs::new(1).unwrap(), 0..5000, cores, |_, _| {}, || false);
    assert!(tally.findings.is_empty(), "{:#?}", tally.findings);
    assert!(tally.at_least(Reached::Tree) * 4 > tally.inputs(), "{:?}", tally.reached);
    assert!(tally.at_least(Reached::Steps) * 100 > tally.inputs(), "{:?}", tally.reached);
}

#[test]
fn a_machine_that_stops_at_any_operation_loses_nothing() {
    let sample = Sample::new().unwrap();
    for operation in 0..=sample.operations {
        sample.stop_at(operation, &Crash::SAMPLE, &mut stream(1, operation)).unwrap();
    }
}

/// So none is missing, and none is there for nothing.
#[test]
fn a_disk_that_forgets_any_one_fsync_is_found_out() {
    let sample = Sample::new().unwrap();
    assert!(sample.syncs > 30, "{}", sample.syncs);
    let unnoticed: Vec<u64> = (0..sample.syncs).filter(|sync| !sample.is_found_out(*sync)).collect();
    assert!(unnoticed.is_empty(), "of {}: {unnoticed:?}", sample.syncs);
}
