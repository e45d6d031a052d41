//! Golden files: `golden/<pass>/<case>.scn` and, beside it, `<case>.txt`: what the pass makes of it.
//! `MPGX_BLESS=1 cargo test -p mpgx-tests` writes the outputs anew.

use std::path::{Path, PathBuf};

use similar::TextDiff;

use crate::{root, scenarios_in};

/// The folder of a pass.
pub fn folder(pass: &str) -> PathBuf {
    root().join("tests/golden").join(pass)
}

/// Holds what a pass makes of each case against the file beside it.
/// `sources` are further cases; their outputs stand in the pass's folder too.
///
/// # Panics
/// If any output differs, with all differences; or if an output has no case.
pub fn hold(pass: &str, sources: &[PathBuf], output: impl Fn(&Path) -> String) {
    let folder = folder(pass);
    let bless = std::env::var_os("MPGX_BLESS").is_some_and(|value| value == "1");
    let mut failures = String::new();
    let mut expected_files = Vec::new();
    for source in scenarios_in(&folder).iter().chain(sources) {
        let file = folder.join(source.file_stem().unwrap_or_default()).with_extension("txt");
        let actual = output(source);
        let expected = std::fs::read_to_string(&file).unwrap_or_default();
        if actual != expected && bless {
            std::fs::write(&file, &actual).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        } else if actual != expected {
            let diff = TextDiff::from_lines(&expected, &actual);
            failures +=
                &format!("{}:\n{}\n", source.display(), diff.unified_diff().header("expected", "actual"));
        }
        expected_files.push(file);
    }
    for entry in std::fs::read_dir(&folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.extension().is_some_and(|it| it == "txt") && !expected_files.contains(&path) {
            failures += &format!("{}: there is no case for this output\n", path.display());
        }
    }
    assert!(failures.is_empty(), "{failures}If this is meant: MPGX_BLESS=1 cargo test -p mpgx-tests");
}
