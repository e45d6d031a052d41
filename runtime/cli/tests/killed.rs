//! `kill -9` at three hundred random instants, a third of them while a run recovers from another.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use mpgx_tests::kills::{SCENARIO, kill_often};

#[test]
fn kill_nine_at_any_instant_changes_no_byte_and_leaves_no_litter() {
    let folder = tempfile::tempdir().unwrap();
    let mpgx = Path::new(env!("CARGO_BIN_EXE_mpgx"));
    let sum = kill_often(mpgx, folder.path(), SCENARIO, 1, 300, || false).unwrap();
    assert!(sum.recovering > 100, "{sum:?}");
}
