//! `mpgx compile`: what the compiler makes of a scenario.

use clap::ValueEnum;
use mpgx_lang::Override;
use mpgx_lang::plan::Plan;
use mpgx_lang::render::{latex, mathml, text};

use crate::failure::{Exit, Failure};
use crate::scenario;

#[derive(clap::Args)]
#[command(after_help = "Example: mpgx compile square_unison.scn --emit latex")]
pub struct Args {
    /// A scenario file, or the name of a built-in scenario
    #[arg(value_name = "FILE|NAME")]
    scenario: String,
    /// What to print
    #[arg(long, value_enum, default_value_t = Emit::Text)]
    emit: Emit,
    /// Another value for a parameter
    #[arg(long, value_name = "NAME=VALUE", value_parser = parse_override)]
    set: Vec<Override>,
}

#[derive(Clone, Copy, ValueEnum)]
enum Emit {
    /// The reward terms as plain text
    Text,
    /// The same
    Reward,
    /// The reward terms as MathML
    Mathml,
    /// The reward terms as LaTeX
    Latex,
    /// The whole Plan as RON
    Plan,
    /// What rewards can be, what is seen and commanded, and how much work it is
    Bounds,
}

pub fn run(args: Args) -> Result<Exit, Failure> {
    let (plan, compilation) = scenario::plan(&args.scenario, &args.set)?;
    match args.emit {
        Emit::Text | Emit::Reward => print!("{}", reward(&plan)),
        Emit::Mathml => {
            for term in &plan.world.reward {
                println!("{}", mathml::term(&plan, &plan.world, term));
            }
        }
        Emit::Latex => {
            for term in &plan.world.reward {
                println!("{}", latex::term(&plan, &plan.world, term));
            }
        }
        Emit::Plan => println!("{}", plan.to_ron()),
        Emit::Bounds => print!("{}", compilation.analysis.text()),
    }
    Ok(Exit::Done)
}

/// The compiled reward as text, a line a term: what golden files hold.
pub fn reward(plan: &Plan) -> String {
    plan.world.reward.iter().map(|term| text::term(plan, &plan.world, term) + "\n").collect()
}

/// `NAME=VALUE` of `--set`.
pub fn parse_override(argument: &str) -> Result<Override, String> {
    match argument.split_once('=') {
        Some((name, value)) if !name.trim().is_empty() && !value.trim().is_empty() => {
            Ok(Override { name: name.trim().to_string(), value: value.trim().to_string() })
        }
        _ => Err("write NAME=VALUE, for example side=0.5m".to_string()),
    }
}
