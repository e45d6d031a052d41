//! `mpgx report`: the report of a study or suite, from records alone, or of another program's results.

use std::path::{Path, PathBuf};

use mpgx_report::Input;
use mpgx_study::Study;
use mpgx_study::storage::{RealDisk, Storage};

use crate::failure::{Exit, Failure};
use crate::{import, provenance, suite};

#[derive(clap::Args)]
#[command(after_help = "\
Example: mpgx report runs/square_unison
         mpgx report --import benchmarl.json")]
pub struct Args {
    /// Folders of finished studies or suites
    #[arg(required_unless_present = "import", value_name = "DIR")]
    studies: Vec<PathBuf>,

    /// Results of another program as marl-eval's JSON, which BenchMARL writes; the page is put beside it
    #[arg(long, value_name = "FILE.json")]
    import: Vec<PathBuf>,
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
    for file in &args.import {
        let (page, tables) = import::report(file)?;
        println!("{tables}\n{}", page.display());
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
