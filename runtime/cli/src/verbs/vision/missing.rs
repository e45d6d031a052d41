//! What this binary was built without.

use crate::failure::{Exit, Failure};

#[derive(clap::Args)]
#[command(disable_help_flag = true)]
pub struct Args {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
    rest: Vec<String>,
}

pub type EvalArgs = Args;
pub type PredictArgs = Args;

pub fn run(_: Args) -> Result<Exit, Failure> {
    let message = "this mpgx was built without networks that see";
    Err(Failure::new(Exit::BadInput, message).help("cargo build --release --features vision"))
}

pub use run as eval;
pub use run as predict;
