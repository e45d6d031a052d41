//! Results of other programs: from a file of marl-eval's JSON to a page beside it and tables on the terminal.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use mpgx_study::import::{Algorithm, MAX_BYTES, Results, import};
use mpgx_study::storage::{RealDisk, Storage};
use mpgx_study::summary::Pair;

use crate::failure::{Exit, Failure};
use crate::layout;

/// Writes the page beside the file, under its stem, and gives its path and the same as text.
pub fn report(file: &Path) -> Result<(PathBuf, String), Failure> {
    let results = import(&read(file)?).map_err(|error| {
        Failure::new(Exit::BadInput, format!("{}: {error}", file.display())).help(error.remedy())
    })?;
    let stem = file.file_stem().unwrap_or_default().to_string_lossy();
    let html = mpgx_report::import_html(&stem, &results)
        .map_err(|error| Failure::new(Exit::Internal, error.to_string()))?;
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let name = format!("{stem}.html");
    RealDisk::new(folder).write_atomic(&name, html.as_bytes())?;
    Ok((file.with_file_name(name), results.iter().map(table).collect()))
}

fn read(file: &Path) -> Result<String, Failure> {
    let shown = file.display();
    let mut bytes = Vec::new();
    File::open(file)
        .and_then(|opened| opened.take(MAX_BYTES + 1).read_to_end(&mut bytes))
        .map_err(|why| Failure::new(Exit::Io, format!("cannot read {shown}: {why}")))?;
    if bytes.len() as u64 > MAX_BYTES {
        return Err(Failure::new(Exit::BadInput, format!("{shown} is larger than {} MiB", MAX_BYTES >> 20))
            .help("split it by task"));
    }
    String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        Failure::new(Exit::BadInput, format!("{shown} is not UTF-8 text: the first bad byte is byte {at}"))
            .help("save it as UTF-8")
    })
}

/// A line an algorithm, then a line a comparison.
fn table(results: &Results) -> String {
    let Results { environment, task, metric, algorithms, pairs, .. } = results;
    let width = layout::width_of_stdout();
    let head = [&format!("{environment}/{task}: {metric}"), "IQM [95 %]", "mean [95 %]", "runs", "failed"];
    let row = |Algorithm { name, statistic, scores, .. }: &Algorithm| {
        let failed = statistic.per_seed.iter().filter(|value| value.is_none()).count();
        vec![
            name.clone(),
            interval(statistic.iqm, statistic.lo, statistic.hi),
            interval(statistic.mean, statistic.mean_lo, statistic.mean_hi),
            scores.len().to_string(),
            failed.to_string(),
        ]
    };
    let rows: Vec<Vec<String>> = algorithms.iter().map(row).collect();
    let mut out = String::from("\n");
    out += &layout::table(&head.map(String::from), &rows, width);
    for Pair { comparison: it, paired } in pairs {
        let chance = interval(it.probability_of_improvement, it.probability_lo, it.probability_hi);
        let line = format!(
            "{} against {}: {}{}, better with chance {chance}{}  {}",
            it.a,
            it.b,
            interval(it.difference, it.lo, it.hi),
            if *paired { "" } else { " unpaired" },
            it.p_holm.map_or(String::new(), |p| format!(", p {p:.3}")),
            it.verdict,
        );
        out += &layout::fold(&line, 2, width);
    }
    out
}

fn interval(value: f64, lo: Option<f64>, hi: Option<f64>) -> String {
    match (lo, hi) {
        (Some(lo), Some(hi)) => format!("{value:.3} [{lo:.3}, {hi:.3}]"),
        _ => format!("{value:.3}"),
    }
}
