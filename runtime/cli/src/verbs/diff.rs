//! `mpgx diff`: what two scenarios mean otherwise.

use mpgx_lang::Override;
use mpgx_lang::diff::{diff, render};

use crate::failure::{Exit, Failure};
use crate::scenario;
use crate::verbs::compile::parse_override;

#[derive(clap::Args)]
#[command(after_help = "\
Example: mpgx diff square_unison.scn wide.scn

Layout, comments and order do not count. The exit code is 0 if both mean the same, else 1.")]
pub struct Args {
    /// A scenario file, or the name of a built-in scenario
    #[arg(value_name = "FILE|NAME")]
    before: String,
    /// The scenario to compare with it
    #[arg(value_name = "FILE|NAME")]
    after: String,
    /// Another value for a parameter of the second
    #[arg(long, value_name = "NAME=VALUE", value_parser = parse_override)]
    set: Vec<Override>,
}

pub fn run(args: Args) -> Result<Exit, Failure> {
    let (before, _) = scenario::plan(&args.before, &[])?;
    let (after, _) = scenario::plan(&args.after, &args.set)?;
    let changes = diff(&before, &after);
    print!("{}", render(&changes));
    Ok(if changes.is_empty() { Exit::Done } else { Exit::NotAsExpected })
}
