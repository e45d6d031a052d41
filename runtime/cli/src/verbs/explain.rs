//! `mpgx explain`: the story of an error code, or what a scenario means with all its defaults.

use mpgx_lang::plan::{Extern, Method, Plan};

use crate::failure::{Exit, Failure};
use crate::scenario;
use crate::verbs::compile::reward;

#[derive(clap::Args)]
#[command(after_help = "Example: mpgx explain unit-mismatch")]
pub struct Args {
    /// An error code, a scenario file, or the name of a built-in scenario
    #[arg(value_name = "CODE|FILE|NAME")]
    what: String,
}

pub fn run(args: Args) -> Result<Exit, Failure> {
    if let Some(code) = mpgx_lang::codes::find(&args.what) {
        println!("{}\n\n{}", code.name, code.explain.trim());
        return Ok(Exit::Done);
    }
    match scenario::plan(&args.what, &[]) {
        Ok((plan, _)) => {
            print!("{}", describe(&plan)?);
            Ok(Exit::Done)
        }
        Err(failure) if !args.what.contains('.') && !args.what.contains('/') => {
            let codes = mpgx_lang::codes::ALL.iter().map(|code| code.name);
            Err(match mpgx_lang::problem::did_you_mean(&args.what, codes) {
                Some(close) => failure.help(format!("did you mean the code `{close}`?")),
                None => failure,
            })
        }
        Err(failure) => Err(failure),
    }
}

/// A scenario for people: layouts, reward, settings.
fn describe(plan: &Plan) -> Result<String, Failure> {
    let task = mpgx_sim::Task::new(plan, &plan.world)
        .map_err(|error| Failure::new(Exit::BadInput, error.to_string()))?;
    let world = &plan.world;
    let mut out = format!("{}\n{}\n", plan.name, plan.doc.trim());
    let mut section = |title: &str, lines: Vec<String>| {
        if !lines.is_empty() {
            out += &format!("\n{title}\n");
            lines.iter().for_each(|line| out += &format!("  {line}\n"));
        }
    };
    section(
        "world",
        vec![format!(
            "{} steps of {} s; agents closer than {} m collide",
            world.horizon, world.dt_s, world.safety_m
        )],
    );
    section(
        "agents",
        world
            .groups
            .iter()
            .map(|group| format!("{} × {}: {}", group.size, group.name, settings(&group.body)))
            .collect(),
    );
    section(
        "params",
        plan.params
            .iter()
            .map(|param| format!("{} = {} ({}, SI)", param.name, param.value, param.dimension))
            .collect(),
    );
    section("state", task.observation_names());
    section("action, each in [-1, 1]", task.action_names());
    section("reward", reward(plan).lines().map(str::to_string).collect());
    section("ends", world.ends.iter().map(|end| end.name.clone()).collect());
    section(
        "protocols",
        plan.protocols
            .iter()
            .map(|protocol| format!("{}: {} episodes", protocol.name, protocol.episodes))
            .collect(),
    );
    let method = |method: &Method| format!("{}: {}", method.label, settings(&method.what));
    section("learners", plan.learners.iter().map(method).collect());
    section("controllers", plan.controllers.iter().map(method).collect());
    Ok(out)
}

fn settings(what: &Extern) -> String {
    let all: Vec<String> =
        what.settings.iter().map(|(name, setting)| format!("{name} = {setting}")).collect();
    if all.is_empty() { what.name.clone() } else { format!("{} ({})", what.name, all.join(", ")) }
}
