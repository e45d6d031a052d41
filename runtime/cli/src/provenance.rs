//! How a study was made: kept beside it as `provenance.json`, shown in its report, part of no hash.

use mpgx_report::Provenance;
use mpgx_study::storage::Storage;

const FILE: &str = "provenance.json";

/// What this run is.
pub fn of_this_run(threads: usize, elapsed_s: f64) -> Provenance {
    let quoted = |word: String| if word.contains([' ', '\'', '"']) { format!("{word:?}") } else { word };
    Provenance {
        command: ["mpgx".to_string()]
            .into_iter()
            .chain(std::env::args().skip(1).map(quoted))
            .collect::<Vec<_>>()
            .join(" "),
        cpu: format!("{}, {} kernels", cpu(), mpgx_learn::simd_level()),
        threads: threads.to_string(),
        duration: format!("{elapsed_s:.0} s (last run)"),
    }
}

/// Keeps it; a run that only finds finished cells does not hide the one that made them.
pub fn keep(storage: &dyn Storage, provenance: &Provenance) -> Result<(), mpgx_study::storage::StorageError> {
    let text = serde_json::to_string_pretty(provenance).unwrap_or_default();
    storage.write_atomic(FILE, text.as_bytes())
}

/// Whether it was kept: a run may have been killed before it came to that.
pub fn is_kept(storage: &dyn Storage) -> bool {
    matches!(storage.read_if_there(FILE), Ok(Some(_)))
}

/// What was kept, or nothing known.
pub fn kept(storage: &dyn Storage) -> Provenance {
    let bytes = storage.read_if_there(FILE).ok().flatten();
    bytes.and_then(|bytes| serde_json::from_slice(&bytes).ok()).unwrap_or_default()
}

fn cpu() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model =
        info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(": ")).map(|(_, name)| name);
    model.unwrap_or("unknown processor").to_string()
}
