//! `mpgx check`: all problems of scenarios at once.

use clap::ValueEnum;
use mpgx_lang::problem::{Style, render, render_short};

use crate::failure::{Exit, Failure};
use crate::scenario;

#[derive(clap::Args)]
#[command(after_help = "Example: mpgx check scenarios/*.scn")]
pub struct Args {
    /// Scenario files, or names of built-in scenarios
    #[arg(required = true, value_name = "FILE|NAME")]
    scenarios: Vec<String>,
    /// How problems are shown
    #[arg(long, value_enum, default_value_t = Format::Human)]
    format: Format,
    /// Warnings count as errors
    #[arg(long)]
    pedantic: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    /// With the source and labels
    Human,
    /// One line a problem: file:line:column
    Short,
}

pub fn run(args: Args) -> Result<Exit, Failure> {
    let mut exit = Exit::Done;
    for name in &args.scenarios {
        let compilation = scenario::compile(name, &[])?;
        let problems = &compilation.problems;
        match args.format {
            Format::Human => anstream::print!("{}", render(problems, &compilation.sources, Style::Coloured)),
            Format::Short => print!("{}", render_short(problems, &compilation.sources)),
        }
        if problems.has_errors() || (args.pedantic && !problems.is_empty()) {
            exit = Exit::BadInput;
        } else if args.format == Format::Human {
            println!("{name}: no errors");
        }
    }
    Ok(exit)
}
