//! `mpgx view`: a picture of a scenario before any training.

use std::path::{Path, PathBuf};

use mpgx_lang::Override;
use mpgx_lang::plan::{Constraint, Control, Plan, World};
use mpgx_lang::problem::did_you_mean;
use mpgx_report::picture::{self, Landscape, Moment};
use mpgx_sim::{Episode, EpisodeKey, Mode, SimError, Task, Worth};

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

/// Nodes of the landscape for a small world; of large ones fewer, since pairs of agents grow with the square.
const NODES: usize = 30_000;
const PAIRS: usize = 100_000_000;

pub fn run(args: Args) -> Result<Exit, Failure> {
    let (plan, _) = scenario::plan(&args.scenario, &args.set)?;
    let world = &plan.world;
    let term = args.term.as_deref().map(|term| term_of(world, term)).transpose()?;
    let agent = agent_of(world, args.agent.as_deref())?;
    let (task, episode) =
        begin(&plan, args.seed).map_err(|error| Failure::new(Exit::BadInput, error.to_string()))?;
    let moment = moment(world, &task, &episode);
    let area = picture::extent(&moment);
    let nodes = (PAIRS / world.agents().pow(2).max(1)).clamp(400, NODES);
    let (columns, rows) = picture::grid(area, nodes);
    let worth = task.worth(&episode, agent, &picture::nodes(area, columns, rows));
    let failed = |worth: &Worth| world.ends.iter().zip(&worth.ends).any(|(end, holds)| end.failure && *holds);
    let value = |worth: &Worth| match term {
        Some((k, _)) => worth.terms.get(k).copied().unwrap_or(f64::NAN),
        None => worth.reward,
    };
    let landscape = Landscape {
        agent,
        name: term.map_or("reward", |(_, name)| name).to_string(),
        dimension: world.reward.first().map(|term| term.dimension.clone()).unwrap_or_default(),
        columns,
        values: worth.iter().map(value).collect(),
        failed: worth.iter().map(failed).collect(),
    };
    let file = args.out.unwrap_or_else(|| Path::new(&plan.name).with_extension("svg"));
    write(&file, &picture::svg(&plan, &moment, &landscape))?;
    println!("{}", file.display());
    Ok(Exit::Done)
}

/// The start of the first training episode of a seed.
fn begin(plan: &Plan, seed: u32) -> Result<(Task, Episode), SimError> {
    let task = Task::new(plan, &plan.world)?;
    let mut episode = task.episode();
    task.reset(&mut episode, EpisodeKey { seed, ..EpisodeKey::default() })?;
    Ok((task, episode))
}

/// The moment, and the ways that scripted agents and obstacles will go while those that learn stand still.
fn moment<'a>(world: &'a World, task: &Task, episode: &Episode) -> Moment<'a> {
    let positions = |episode: &Episode| (0..task.agents()).map(|k| episode.position(k)).collect::<Vec<_>>();
    let moved: Vec<bool> = world
        .groups
        .iter()
        .flat_map(|group| vec![matches!(group.control, Control::Motion(_)); group.size])
        .collect();
    let start = positions(episode);
    let mut ways: Vec<Vec<[f64; 2]>> =
        start.iter().zip(&moved).map(|(at, moves)| if *moves { vec![*at] } else { Vec::new() }).collect();
    let mut later = episode.clone();
    while moved.contains(&true) && later.time_steps() < task.horizon() {
        task.idle(&mut later, Mode::Evaluate);
        for (way, at) in ways.iter_mut().zip(positions(&later)).filter(|(way, _)| !way.is_empty()) {
            way.push(at);
        }
    }
    let mut slots = episode.slots().iter().copied();
    let lengths_m: Vec<Vec<f64>> = (0..world.formations.len()).map(|k| task.lengths(episode, k)).collect();
    let places_m = world
        .formations
        .iter()
        .map(|formation| match formation.constraint {
            Constraint::Displacements { .. } => {
                let members = world.groups.get(formation.group).map_or(0, |group| group.size);
                slots.by_ref().take(members).collect()
            }
            Constraint::Distances(_) => Vec::new(),
        })
        .collect();
    let headings = (0..task.agents()).map(|k| task.heading(episode, k)).collect();
    Moment { world, positions_m: start, headings, ways_m: ways, places_m, lengths_m }
}

/// Index and name of a term.
fn term_of<'a>(world: &'a World, wanted: &str) -> Result<(usize, &'a str), Failure> {
    let names: Vec<&str> = world.reward.iter().map(|term| term.name.as_str()).collect();
    let found = names.iter().position(|name| *name == wanted).and_then(|k| Some((k, *names.get(k)?)));
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
