//! `mpgx hash`: the hash of a scenario's meaning.

use crate::failure::{Exit, Failure};
use crate::scenario;

#[derive(clap::Args)]
#[command(after_help = "Example: mpgx hash square_unison.scn")]
pub struct Args {
    /// A scenario file, or the name of a built-in scenario
    #[arg(required = true, value_name = "FILE|NAME")]
    scenarios: Vec<String>,
}

pub fn run(args: Args) -> Result<Exit, Failure> {
    for name in &args.scenarios {
        let (plan, _) = scenario::plan(name, &[])?;
        println!("{}  {name}", mpgx_lang::hash::meaning_hash(&plan));
    }
    Ok(Exit::Done)
}
