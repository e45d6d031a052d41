//! `mpgx list`: built-in scenarios, the standard library, studies.

use std::path::Path;

use clap::ValueEnum;

use crate::failure::{Exit, Failure};
use crate::layout::{fold, width_of_stdout};
use crate::suite::studies_in;
use crate::{scenario, suite};

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
    /// Suites of scenarios that come with mpgx
    Suites,
    /// Modules of the standard library
    Std,
    /// Studies in ./runs
    Runs,
}

pub fn run(args: Args) -> Result<Exit, Failure> {
    match args.what {
        What::Scenarios => {
            for (name, text) in scenario::EMBEDDED {
                print!("{}", line(name, first_line(text)));
            }
        }
        What::Suites => {
            for (name, text) in suite::EMBEDDED {
                let comment = text.lines().next().and_then(|line| line.strip_prefix('#'));
                print!("{}", line(name, comment.map_or("", str::trim)));
            }
        }
        What::Std => {
            for (name, text) in mpgx_lang::stdlib::MODULES {
                print!("{}", line(name, first_line(text)));
            }
        }
        What::Runs => {
            for run in studies_in(Path::new("runs")) {
                let folder = Path::new("runs").join(&run);
                print!("{}", line(&run, state(&folder)));
                let variants = folder.join("variants");
                for variant in studies_in(&variants) {
                    println!("  variant {variant:<10} {}", state(&variants.join(&variant)));
                }
            }
        }
    }
    Ok(Exit::Done)
}

/// A name and what it is.
fn line(name: &str, what: &str) -> String {
    let width = width_of_stdout();
    fold(&format!("{name:<20} {what}"), if width < Some(60) { 2 } else { 21 }, width)
}

/// The first line of the `//!` comment.
fn first_line(text: &str) -> &str {
    text.lines().next().and_then(|line| line.strip_prefix("//!")).map_or("", str::trim)
}

fn state(folder: &Path) -> &'static str {
    if folder.join("study.json").is_file() { "finished" } else { "unfinished" }
}
