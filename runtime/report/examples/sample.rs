//! Writes the reports of a made-up study: `cargo run -p mpgx-report --example sample -- sample.html`, or, into a
//! folder, those of one whose names would do harm: `-- --hostile probes`.

#[path = "../tests/sample/mod.rs"]
#[allow(dead_code, clippy::unwrap_used)]
mod sample;

use std::path::Path;

use mpgx_report::{Compared, Document, Provenance, Side, compare_html, compare_tables, html, study_tables};
use sample::hostile::{self, NAMES, PROBE};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    if let [flag, folder] = args.as_slice()
        && flag == "--hostile"
    {
        return probes(Path::new(folder));
    }
    let path = args.first().map_or("sample.html", String::as_str);
    let mut study = sample::study(10, &["random", "regular"]);
    if let Some(record) = study.records.get_mut("td3-003") {
        sample::fail(record);
    }
    let study = sample::Sample::new(study.plan, study.records);
    let page = html(&study.input())?;
    println!("{} bytes", page.len());
    Ok(std::fs::write(path, page)?)
}

/// `study.html`, `compare.html`, `tables.tex` and `tables.md`.
fn probes(folder: &Path) -> Result<(), Box<dyn std::error::Error>> {
    let study = hostile::everywhere();
    let mut input = study.input();
    let probe = || PROBE.to_string();
    input.provenance = Provenance { command: probe(), cpu: probe(), threads: probe(), duration: probe() };
    std::fs::write(folder.join("study.html"), html(&input)?)?;
    let other = sample::study(10, &["random", "regular"]).finished();
    let study = study.finished();
    let mut tables = Document::default();
    if let Some((a, b)) = study.summary.as_ref().zip(other.summary.as_ref()) {
        let side = |name: &str, study, summary| Side { name: name.into(), study, summary };
        let compared = Compared::new(side(PROBE, &study, a), side("plain", &other, b));
        std::fs::write(folder.join("compare.html"), compare_html(&compared)?)?;
        tables = tables.then(compare_tables(&compared));
        tables = tables.then(study_tables(PROBE, &study.plan, a));
    }
    for name in NAMES {
        let it = hostile::named(name);
        tables = tables.then(study_tables(name, &it.plan, &it.summary));
    }
    std::fs::write(folder.join("tables.md"), tables.markdown())?;
    Ok(std::fs::write(folder.join("tables.tex"), tables.latex())?)
}
