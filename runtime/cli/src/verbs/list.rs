//! `mpgx list`: built-in scenarios, the standard library, studies.

use std::path::Path;

use clap::ValueEnum;

use crate::failure::{Exit, Failure};
use crate::scenario;

#[derive(clap::Args)]
#[command(after_help = "Example: mpgx list std")]
pub struct Args {
    #[arg(value_enum, default_value_t = What::Scenarios)]
    what: What,
}

#[derive(Clone, Copy, ValueEnum)]
enum What {
    /// Scenarios that come with mpgx
    Scenarios,
    /// Modules of the standard library
    Std,
    /// Studies in ./runs
    Runs,
}

pub fn run(args: Args) -> Result<Exit, Failure> {
    match args.what {
        What::Scenarios => {
            for (name, text) in scenario::EMBEDDED {
                println!("{name:<20} {}", first_line(text));
            }
        }
        What::Std => {
            for (name, text) in mpgx_lang::stdlib::MODULES {
                println!("{name:<20} {}", first_line(text));
            }
        }
        What::Runs => {
            for run in studies_in(Path::new("runs")) {
                let folder = Path::new("runs").join(&run);
                println!("{run:<20} {}", state(&folder));
                let variants = folder.join("variants");
                for variant in studies_in(&variants) {
                    println!("  variant {variant:<10} {}", state(&variants.join(&variant)));
                }
            }
        }
    }
    Ok(Exit::Done)
}

/// The first line of the `//!` comment.
fn first_line(text: &str) -> &str {
    text.lines().next().and_then(|line| line.strip_prefix("//!")).map_or("", str::trim)
}

/// The folders in `folder` that hold a study, in order; none if it cannot be read.
fn studies_in(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().filter_map(|entry| entry.ok());
    let studies = entries.filter(|entry| entry.path().join("plan.ron").is_file());
    let mut studies: Vec<String> =
        studies.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    studies.sort();
    studies
}

fn state(folder: &Path) -> &'static str {
    if folder.join("study.json").is_file() { "finished" } else { "unfinished" }
}
