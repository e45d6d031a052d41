//! `mpgx report`: the report of a study or suite, from records alone.

use std::path::{Path, PathBuf};

use mpgx_report::Input;
use mpgx_study::Study;
use mpgx_study::storage::{RealDisk, Storage};

use crate::failure::{Exit, Failure};
use crate::{provenance, suite};

#[derive(clap::Args)]
#[command(after_help = "Example: mpgx report runs/square_unison")]
pub struct Args {
    /// Folders of finished studies or suites
    #[arg(required = true, value_name = "DIR")]
    studies: Vec<PathBuf>,
}

pub fn run(args: Args) -> Result<Exit, Failure> {
    for folder in &args.studies {
        if let Some(report) = suite::rewrite_report(folder)? {
            println!("{}", report.display());
            continue;
        }
        let storage = RealDisk::new(folder);
        let study = mpgx_study::load(&storage)?;
        println!("{}", write_report(&study, folder, &storage)?.display());
    }
    Ok(Exit::Done)
}

/// Writes `report.html` into the study's folder and gives its path.
pub fn write_report(study: &Study, folder: &Path, storage: &dyn Storage) -> Result<PathBuf, Failure> {
    let Some(summary) = &study.summary else {
        return Err(Failure::new(Exit::Io, format!("the study in {} is not finished", folder.display()))
            .help("run the scenario again; it goes on where it stopped"));
    };
    let html = mpgx_report::html(&Input {
        plan: &study.plan,
        source: &study.source,
        records: &study.records,
        timings: &study.timings,
        summary,
        provenance: provenance::kept(storage),
    })
    .map_err(|error| Failure::new(Exit::Internal, error.to_string()))?;
    storage.write_atomic("report.html", html.as_bytes())?;
    Ok(folder.join("report.html"))
}
