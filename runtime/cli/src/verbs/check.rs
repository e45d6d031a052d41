//! `mpgx check`: all problems of scenarios at once.

use clap::ValueEnum;
use mpgx_lang::problem::{Style, render, render_github, render_json, render_sarif, render_short};

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
    /// One JSON object a line
    Json,
    /// One SARIF 2.1.0 log
    Sarif,
    /// Workflow commands of GitHub Actions
    Github,
}

pub fn run(args: Args) -> Result<Exit, Failure> {
    let mut exit = Exit::Done;
    let mut compilations = Vec::new();
    for name in &args.scenarios {
        let compilation = scenario::compile(name, &[])?;
        let (problems, sources) = (&compilation.problems, &compilation.sources);
        match args.format {
            Format::Human => anstream::print!("{}", render(problems, sources, Style::Coloured)),
            Format::Short => print!("{}", render_short(problems, sources)),
            Format::Json => print!("{}", render_json(problems, sources)),
            Format::Github => print!("{}", render_github(problems, sources)),
            Format::Sarif => {}
        }
        if problems.has_errors() || (args.pedantic && !problems.is_empty()) {
            exit = Exit::BadInput;
        } else if args.format == Format::Human {
            println!("{name}: no errors");
        }
        compilations.push(compilation);
    }
    if args.format == Format::Sarif {
        let all: Vec<_> = compilations.iter().map(|it| (&it.problems, &it.sources)).collect();
        print!("{}", render_sarif(&all));
    }
    Ok(exit)
}
