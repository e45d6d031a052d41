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
            let mut runs: Vec<String> = match std::fs::read_dir("runs") {
                Ok(entries) => entries
                    .filter_map(|entry| entry.ok())
                    .filter(|entry| entry.path().join("plan.ron").is_file())
                    .map(|entry| entry.file_name().to_string_lossy().into_owned())
                    .collect(),
                Err(_) => Vec::new(),
            };
            runs.sort();
            for run in runs {
                let done = Path::new("runs").join(&run).join("study.json").is_file();
                println!("{run:<20} {}", if done { "finished" } else { "unfinished" });
            }
        }
    }
    Ok(Exit::Done)
}

/// The first line of the `//!` comment.
fn first_line(text: &str) -> &str {
    text.lines().next().and_then(|line| line.strip_prefix("//!")).map_or("", str::trim)
}
