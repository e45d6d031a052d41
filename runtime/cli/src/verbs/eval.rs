//! `mpgx eval`: a trained study under other evaluations or in another scenario, without training.

use std::path::PathBuf;

use mpgx_lang::plan::{ClaimKind, Plan};
use mpgx_lang::source::Loader;
use mpgx_lang::{Override, meaning_hash};
use mpgx_study::storage::RealDisk;
use mpgx_study::{Options, Outcome, Study, Trained, cells, parts, transfer, transferred};

use crate::failure::{Exit, Failure};
use crate::layout::{fold, width_of_stderr, width_of_stdout};
use crate::progress::Display;
use crate::verbs::compile::parse_override;
use crate::verbs::report::{unloaded, write_report};
use crate::{interrupt, provenance, scenario, table};

#[derive(clap::Args)]
#[command(after_help = "\
Example: mpgx eval runs/square_unison --set side=0.6m --episodes 500
         mpgx eval runs/track_random --scenario track_circle")]
pub struct Args {
    /// Folder of a trained study
    #[arg(value_name = "DIR")]
    study: PathBuf,
    /// Worlds, controllers and evaluations of this scenario: a file, or the name of one that is built in [default:
    /// the study's own]
    #[arg(long, value_name = "FILE|NAME")]
    scenario: Option<String>,
    /// Another value for a parameter
    #[arg(long, value_name = "NAME=VALUE", value_parser = parse_override)]
    set: Vec<Override>,
    /// Held-out episodes of each evaluation
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    episodes: Option<u32>,
    /// Only these evaluations
    #[arg(long, value_delimiter = ',', value_name = "A,B")]
    protocols: Vec<String>,
    /// Folder of the results [default: eval/<scenario>/<hash> in the study's folder]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Cells that run side by side [default: all cores]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=1024))]
    threads: Option<u32>,
    /// Print the summary as JSON
    #[arg(long)]
    json: bool,
}

pub fn run(args: Args) -> Result<Exit, Failure> {
    let storage = RealDisk::new(&args.study);
    let trained = Trained::load(&storage).map_err(|error| unloaded(&args.study, error))?;
    let left = trained.unfinished()?;
    if trained.study.records.values().all(|record| record.training.is_none()) {
        let message = format!("nothing in {} is trained yet", args.study.display());
        return Err(
            Failure::new(Exit::BadInput, message).help("finish it first, with the command that began it")
        );
    }
    let (plan, source) = asked(&trained.study, &args)?;
    let plan = transferred(&trained.study, &chosen(plan, &args)?)?;
    let folder = args.out.clone().unwrap_or_else(|| {
        let hash = meaning_hash(&Plan { first_seed: 0, seeds: 0, ..plan.clone() });
        args.study.join("eval").join(&plan.name).join(hash.chars().take(8).collect::<String>())
    });
    if !left.is_empty() {
        let line = format!("not trained yet, and left out: {}", left.join(", "));
        eprint!("{}", fold(&line, 2, width_of_stderr()));
    }
    let mut options = Options { interrupt: interrupt::flag()?, ..Options::default() };
    options.threads = args.threads.map_or(options.threads, |threads| threads as usize);
    let display = Display::new(cells(&plan)?.len() - left.len());
    let out = RealDisk::new(&folder);
    let study = match transfer(&trained, &plan, &source, &out, &options, &display)? {
        Outcome::Finished(study) => *study,
        Outcome::Interrupted { finished, cells } => {
            eprintln!("interrupted: {finished} of {cells} cells are done; the same command goes on");
            return Ok(Exit::Interrupted);
        }
    };
    if display.trained() {
        provenance::keep(&out, &provenance::of_this_run(options.threads, display.elapsed_s()))?;
    }
    let report = write_report(&study, &folder, &out)?;
    let Some(summary) = &study.summary else {
        return Err(Failure::new(Exit::Internal, "the finished evaluation has no summary"));
    };
    if args.json {
        let text = serde_json::to_string_pretty(summary);
        println!("{}", text.map_err(|why| Failure::new(Exit::Internal, why.to_string()))?);
    } else {
        anstream::print!("{}", table::results(summary, width_of_stdout()));
        println!("\nstudy hash {}\nreport     {}", summary.study_hash, report.display());
    }
    let as_expected =
        left.is_empty() && summary.failures.is_empty() && summary.expect.iter().all(|claim| claim.holds);
    Ok(if as_expected { Exit::Done } else { Exit::NotAsExpected })
}

/// What is evaluated, and the scenario's files.
fn asked(study: &Study, args: &Args) -> Result<(Plan, Vec<(String, String)>), Failure> {
    match &args.scenario {
        Some(name) => {
            let (plan, compilation) = scenario::plan(name, &args.set)?;
            Ok((plan, scenario::files(&compilation)))
        }
        None if args.set.is_empty() => Ok((study.plan.clone(), study.source.clone())),
        None => Ok((compiled_again(study, &args.set)?, study.source.clone())),
    }
}

/// The evaluations that are asked for, of so many episodes.
fn chosen(mut plan: Plan, args: &Args) -> Result<Plan, Failure> {
    let known: Vec<&str> = plan.protocols.iter().map(|protocol| protocol.name.as_str()).collect();
    if let Some(unknown) = args.protocols.iter().find(|name| !known.contains(&name.as_str())) {
        return Err(Failure::new(Exit::BadInput, format!("there is no evaluation `{unknown}`"))
            .help(format!("there is {}", known.join(", "))));
    }
    if !args.protocols.is_empty() {
        plan.protocols.retain(|protocol| args.protocols.contains(&protocol.name));
        plan.claims.retain(|claim| match &claim.kind {
            ClaimKind::Bound { protocol, .. } | ClaimKind::Beats { protocol, .. } => {
                args.protocols.contains(protocol)
            }
        });
    }
    if let Some(episodes) = args.episodes {
        plan.protocols.iter_mut().for_each(|protocol| protocol.episodes = episodes as usize);
    }
    Ok(plan)
}

/// The study's own scenario with other values of parameters; of a variant's study that variant, and what was set
/// when it ran stays set.
fn compiled_again(study: &Study, set: &[Override]) -> Result<Plan, Failure> {
    let frozen = Frozen(&study.source);
    let lost = || {
        let message = "the study's own files do not make its Plan any more";
        Failure::new(Exit::BadInput, message).help("name the scenario: `--scenario FILE`")
    };
    let (name, text) = study.source.first().ok_or_else(lost)?;
    let compile = |set: &[Override]| mpgx_lang::compile(name, text.clone(), set, &frozen);
    let part = |plan: Plan, number: usize| parts(&plan).ok()?.into_iter().nth(number).map(|part| part.plan);
    let written = compile(&[]).plan.ok_or_else(lost)?;
    let (number, earlier) = parts(&written)?
        .into_iter()
        .enumerate()
        .map(|(number, part)| (number, set_since(&part.plan, &study.plan)))
        .find(|(number, earlier)| {
            let found = compile(earlier).plan.and_then(|plan| part(plan, *number));
            found.is_some_and(|found| worlds_hash(&found) == worlds_hash(&study.plan))
        })
        .ok_or_else(lost)?;
    let plan = scenario::checked(name, compile(&[&earlier, set].concat()))?.0;
    part(plan, number).ok_or_else(lost)
}

/// The parameters that have another value in the second Plan.
fn set_since(before: &Plan, after: &Plan) -> Vec<Override> {
    let pairs = before.params.iter().zip(&after.params).filter(|(before, after)| before.text != after.text);
    pairs.map(|(_, after)| Override { name: after.name.clone(), value: after.text.clone() }).collect()
}

/// The hash of a Plan without its methods and seeds, which the command line chooses among.
fn worlds_hash(plan: &Plan) -> String {
    let (learners, controllers) = (Vec::new(), Vec::new());
    meaning_hash(&Plan { learners, controllers, first_seed: 0, seeds: 0, ..plan.clone() })
}

/// The files of a study.
struct Frozen<'a>(&'a [(String, String)]);

impl Loader for Frozen<'_> {
    fn load(&self, path: &str) -> Result<String, String> {
        let found = self.0.iter().find(|(name, _)| name == path);
        found.map(|(_, text)| text.clone()).ok_or_else(|| format!("the study keeps no `{path}`"))
    }
}
