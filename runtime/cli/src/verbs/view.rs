//! `mpgx view`: a picture of a scenario before any training.

use std::path::{Path, PathBuf};

use mpgx_lang::Override;
use mpgx_lang::plan::World;
use mpgx_lang::problem::did_you_mean;
use mpgx_report::picture::{self, Start};

use crate::failure::{Exit, Failure};
use crate::scenario;
use crate::verbs::compile::parse_override;
use crate::verbs::fmt::write;

#[derive(clap::Args)]
#[command(after_help = "\
Example: mpgx view square_unison.scn --agent 'follower[2]' --term gap

The picture is an SVG file: the scene at the start of an episode, its formations, and how much reward there
would be with one agent elsewhere and all others where they are.")]
pub struct Args {
    /// A scenario file, or the name of a built-in scenario
    #[arg(value_name = "FILE|NAME")]
    scenario: String,
    /// Another value for a parameter
    #[arg(long, value_name = "NAME=VALUE", value_parser = parse_override)]
    set: Vec<Override>,
    /// Whose position the reward is shown over [default: the first agent that learns]
    #[arg(long, value_name = "AGENT")]
    agent: Option<String>,
    /// Show one term of the reward instead of all
    #[arg(long)]
    term: Option<String>,
    /// The first episode of this seed
    #[arg(long, default_value_t = 0)]
    seed: u32,
    /// Where to write [default: NAME.svg]
    #[arg(long, value_name = "FILE.svg")]
    out: Option<PathBuf>,
}

/// Nodes of the landscape, at most.
const NODES: usize = 30_000;

pub fn run(args: Args) -> Result<Exit, Failure> {
    let (plan, _) = scenario::plan(&args.scenario, &args.set)?;
    let world = &plan.world;
    let term = args.term.as_deref().map(|term| term_of(world, term)).transpose()?;
    let agent = agent_of(world, args.agent.as_deref())?;
    let start =
        Start::new(&plan, args.seed).map_err(|error| Failure::new(Exit::BadInput, error.to_string()))?;
    let landscape = start.landscape(agent, term, NODES);
    let file = args.out.unwrap_or_else(|| Path::new(&plan.name).with_extension("svg"));
    write(&file, &picture::svg(&plan, &start.moment, &landscape))?;
    println!("{}", file.display());
    Ok(Exit::Done)
}

/// Index of a term.
fn term_of(world: &World, wanted: &str) -> Result<usize, Failure> {
    let names: Vec<&str> = world.reward.iter().map(|term| term.name.as_str()).collect();
    let found = names.iter().position(|name| *name == wanted);
    found.ok_or_else(|| unknown("reward term", wanted, &names))
}

fn agent_of(world: &World, wanted: Option<&str>) -> Result<usize, Failure> {
    let names = picture::names(world);
    let obstacles: Vec<bool> =
        world.groups.iter().flat_map(|group| vec![group.solid.is_some(); group.size]).collect();
    let agents = || names.iter().zip(&obstacles).enumerate().filter(|(_, (_, obstacle))| !**obstacle);
    let Some(wanted) = wanted else {
        let first = world.learned().first().copied().or_else(|| agents().next().map(|(k, _)| k));
        return first.ok_or_else(|| Failure::new(Exit::BadInput, "the scenario has no agents"));
    };
    let found = agents().find(|(_, (name, _))| *name == wanted).map(|(k, _)| k);
    let known: Vec<&str> = agents().map(|(_, (name, _))| name.as_str()).collect();
    found.ok_or_else(|| unknown("agent", wanted, &known))
}

fn unknown(what: &str, wanted: &str, known: &[&str]) -> Failure {
    let failure = Failure::new(Exit::BadInput, format!("the scenario has no {what} `{wanted}`"));
    match did_you_mean(wanted, known.iter().copied()) {
        Some(close) => failure.help(format!("did you mean `{close}`?")),
        None if known.len() <= 12 => failure.help(format!("it has {}", known.join(", "))),
        None => failure,
    }
}
