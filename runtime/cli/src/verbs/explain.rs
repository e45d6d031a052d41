//! `mpgx explain`: the story of an error code, or what a scenario means with all its defaults.

use mpgx_lang::diff::{diff, render};
use mpgx_lang::plan::{
    Area, Control, Expr, Extern, Group, Localiser, Method, Plan, Protocol, Scenery, World,
};
use mpgx_lang::render::text;

use crate::failure::{Exit, Failure};
use crate::scenario;

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

/// A scenario for people: everything that it says or leaves to defaults, in SI units where nothing else is said.
fn describe(plan: &Plan) -> Result<String, Failure> {
    let task = mpgx_sim::Task::new(plan, &plan.world)
        .map_err(|error| Failure::new(Exit::BadInput, error.to_string()))?;
    let world = &plan.world;
    let formula = |expr: &Expr| text::expr(plan, world, expr);
    let mut out = format!("{}\n{}\n", plan.name, plan.doc.trim());
    let mut section = |title: &str, lines: Vec<String>| {
        if !lines.is_empty() {
            out += &format!("\n{title}\n");
            lines.iter().for_each(|line| out += &format!("  {line}\n"));
        }
    };
    let each = |names: Vec<String>| vec![names.join(", ")];
    section(
        "Each episode",
        vec![format!(
            "{} steps of {} s; agents closer than {} m collide",
            world.horizon, world.dt_s, world.safety_m
        )],
    );
    let (agents, obstacles): (Vec<&Group>, Vec<&Group>) =
        world.groups.iter().partition(|group| group.solid.is_none());
    section("Agents", agents.iter().flat_map(|group| self::group(plan, group)).collect());
    section("Obstacles", obstacles.iter().flat_map(|group| self::group(plan, group)).collect());
    section(
        "Formations",
        world
            .formations
            .iter()
            .map(|it| {
                let group = world.groups.get(it.group).map_or("", |group| &group.name);
                let about =
                    it.about.map_or(String::new(), |agent| format!(" about {}", world.agent_name(agent)));
                format!("{} of {group}: {}{about}", it.name, it.shape)
            })
            .collect(),
    );
    section(
        "Parameters",
        plan.params
            .iter()
            .map(|param| remark(format!("{} = {}", param.name, param.text), &param.doc))
            .collect(),
    );
    section("Starts are drawn again until", world.require.iter().map(formula).collect());
    section(&format!("The policy sees {} numbers", task.state_len()), each(task.observation_names()));
    section(&format!("and commands {}, each in [-1, 1]", task.action_len()), each(task.action_names()));
    let dimension = world.reward.first().map_or("number", |term| term.dimension.as_str());
    section(
        &format!("Reward of each step ({dimension}), the sum of"),
        world.reward.iter().map(|term| remark(text::term(plan, world, term), &term.doc)).collect(),
    );
    section(
        "The episode ends early",
        world
            .ends
            .iter()
            .map(|end| {
                let kind = if end.failure { "failure" } else { "no failure" };
                let cost = end.cost.as_ref().map(|cost| format!(", costs {}", formula(cost)));
                format!("{} ({kind}): {}{}", end.name, formula(&end.when), cost.unwrap_or_default())
            })
            .collect(),
    );
    section(&format!("Learners, {} seeds", plan.seeds), plan.learners.iter().flat_map(method).collect());
    section("Stages before", plan.stages.iter().map(|stage| stage.name.clone()).collect());
    section("To be seen", plan.world.scenery.iter().flat_map(scenery).collect());
    let localiser = |it: &Localiser| format!("{}: {}", it.name, settings(&it.what));
    section("Localisers", plan.localisers.iter().map(localiser).collect());
    section("Controllers", plan.controllers.iter().flat_map(method).collect());
    section("Evaluations", plan.protocols.iter().flat_map(|it| protocol(plan, it)).collect());
    section("Claims", plan.claims.iter().map(|claim| claim.text.clone()).collect());
    section("Variants", plan.variants.iter().map(|it| format!("{}: {}", it.name, it.text)).collect());
    section("Tests", plan.tests.iter().map(|test| test.name.clone()).collect());
    Ok(out)
}

/// With the first line of its comment.
fn remark(text: String, doc: &str) -> String {
    match doc.lines().next() {
        Some(line) => format!("{text}    // {line}"),
        None => text,
    }
}

fn group(plan: &Plan, group: &Group) -> Vec<String> {
    let formula = |expr: &Expr| text::expr(plan, &plan.world, expr);
    let number = if group.size == 1 { String::new() } else { format!("[{}]", group.size) };
    let mut lines = vec![format!("{}{number}: {}", group.name, settings(&group.body))];
    let mut line = |text: String| lines.push(format!("  {text}"));
    match &group.control {
        Control::Still => line("stays where it starts".to_owned()),
        Control::Learned => line("learns".to_owned()),
        Control::Motion(motion) => line(format!("moves: {}", motion.name)),
    }
    if let Some(filter) = &group.filter {
        line(format!("filtered by {}", settings(filter)));
    }
    if let Some(camera) = &group.camera {
        line(format!("sees with {}", settings(camera)));
    }
    if let Some(odometry) = &group.odometry {
        line(format!("counts its way with {}", settings(odometry)));
    }
    if group.solid.is_none() {
        let (low, high) = group.speed_mps;
        line(format!("speed {low} .. {high} m/s on each axis"));
    }
    if let Some(Area { x_m: (left, right), y_m: (bottom, top) }) = group.arena {
        line(format!("arena x {left} .. {right} m, y {bottom} .. {top} m"));
    }
    if let Some(start) = &group.start {
        line(format!("start {}", formula(start)));
    }
    lines
}

fn scenery(scenery: &Scenery) -> Vec<String> {
    let light = scenery.lighting.as_ref().map_or("in each lighting in turn".to_owned(), settings);
    let mut lines = vec![settings(&scenery.room), light];
    lines.extend(scenery.landmarks.iter().map(|landmark| {
        let (x, y) = landmark.position_m;
        format!("{} at ({x} m, {y} m): {}", landmark.name, settings(&landmark.what))
    }));
    lines
}

/// A method and its settings, a few on each line.
fn method(method: &Method) -> Vec<String> {
    let what = &method.what;
    let name = if what.name == method.label { String::new() } else { format!(" ({})", what.name) };
    let all: Vec<String> = what.settings.iter().map(|(name, value)| format!("{name} = {value}")).collect();
    let lines = all.chunks(5).map(|some| format!("  {}", some.join(", ")));
    std::iter::once(format!("{}{name}", method.label)).chain(lines).collect()
}

fn protocol(plan: &Plan, protocol: &Protocol) -> Vec<String> {
    let mut lines = vec![format!("{}: {} episodes", protocol.name, protocol.episodes)];
    if let Some(world) = &protocol.world {
        let other = Plan { world: World::clone(world), ..plan.clone() };
        lines.extend(render(&diff(plan, &other)).lines().map(|line| format!("  {line}")));
    }
    lines
}

fn settings(what: &Extern) -> String {
    let all: Vec<String> =
        what.settings.iter().map(|(name, setting)| format!("{name} = {setting}")).collect();
    if all.is_empty() { what.name.clone() } else { format!("{} ({})", what.name, all.join(", ")) }
}
