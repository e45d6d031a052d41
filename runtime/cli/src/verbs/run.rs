//! `mpgx run`: compile, train, evaluate, report; the scenario itself, then its variants.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use mpgx_lang::Override;
use mpgx_lang::plan::{Plan, Setting};
use mpgx_report::Member;
use mpgx_study::storage::RealDisk;
use mpgx_study::summary::Summary;
use mpgx_study::{Options, Outcome, Part, Study, cells, parts};

use crate::bytes::Bytes;
use crate::failure::{Exit, Failure};
use crate::layout::{fold, width_of_stderr, width_of_stdout};
use crate::progress::Display;
use crate::seeds::Seeds;
use crate::verbs::compile::parse_override;
use crate::verbs::report::write_report;
use crate::{forecast, interrupt, provenance, scenario, suite, table};

#[derive(clap::Args)]
#[command(after_help = "Example: mpgx run square_unison.scn --seeds 20 --set side=0.5m")]
pub struct Args {
    /// A scenario, or a suite of them (.toml): a file, or the name of one that is built in
    #[arg(value_name = "FILE|NAME")]
    scenario: String,
    /// How many seeds, or which: A..B is A to B - 1; only those not trained before are trained
    #[arg(long, value_name = "N|A..B")]
    seeds: Option<Seeds>,
    /// Only these methods of the scenario, for example mpg,oracle
    #[arg(long, value_delimiter = ',', value_name = "A,B")]
    algorithms: Vec<String>,
    /// Another value for a parameter
    #[arg(long, value_name = "NAME=VALUE", value_parser = parse_override)]
    set: Vec<Override>,
    /// Only this variant of the scenario; may be given several times
    #[arg(long, value_name = "NAME")]
    variant: Vec<String>,
    /// Folder of the study [default: runs/<scenario>]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Cells that run side by side [default: all cores]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=1024))]
    threads: Option<u32>,
    /// Refuse to begin if the run could take more memory than this, for example 2GB
    #[arg(long, value_name = "SIZE")]
    max_memory: Option<Bytes>,
    /// At most this many episodes of training
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    episodes: Option<u32>,
    /// Compile and tell what would run
    #[arg(long)]
    dry_run: bool,
}

pub fn run(args: Args) -> Result<Exit, Failure> {
    if let Some(found) = suite::find(&args.scenario)? {
        return run_suite(&found, &args);
    }
    let (plan, compilation) = scenario::plan(&args.scenario, &args.set)?;
    let source = scenario::files(&compilation);
    let jobs: Vec<Job> =
        chosen(&plan, &args)?.into_iter().map(|part| Job { part, source: &source }).collect();
    let folder = args.out.clone().unwrap_or_else(|| Path::new("runs").join(&plan.name));
    let Some(done) = forecast_and_run(&jobs, &folder, &args)? else { return Ok(Exit::Done) };
    if done.summaries.len() > 1 {
        let name = |(part, summary): &(&Part, Summary)| (forecast::name(part), summary.clone());
        print!(
            "\n{}",
            table::side_by_side(&done.summaries.iter().map(name).collect::<Vec<_>>(), width_of_stdout())
        );
    }
    Ok(done.exit)
}

/// Runs all scenarios of a suite, each in a folder of its own, and writes the report over all.
fn run_suite(found: &suite::Found, args: &Args) -> Result<Exit, Failure> {
    if !(args.set.is_empty() && args.variant.is_empty()) {
        let message = "a suite runs its scenarios as they are";
        return Err(Failure::new(Exit::BadInput, message).help("leave out --set and --variant"));
    }
    let mut studies = Vec::new();
    for name in &found.suite.scenarios {
        let (plan, compilation) = scenario::plan(&found.scenario(name), &[])?;
        studies.push((parts(&plan)?, scenario::files(&compilation)));
    }
    let all: Vec<Vec<Part>> = studies.iter().map(|(parts, _)| parts.clone()).collect();
    found.suite.check(&all).map_err(|message| Failure::new(Exit::BadInput, message))?;
    let mut jobs = Vec::new();
    for (parts, source) in &studies {
        for part in parts {
            let mut part = part.clone();
            part.folder = mpgx_study::suite::folder(&part);
            adjust(&mut part.plan, args);
            jobs.push(Job { part, source });
        }
    }
    let folder = args.out.clone().unwrap_or_else(|| Path::new("runs").join(&found.name));
    let Some(done) = forecast_and_run(&jobs, &folder, args)? else { return Ok(Exit::Done) };
    if done.exit == Exit::Interrupted {
        return Ok(done.exit);
    }
    let members: Vec<Member> =
        done.summaries.iter().map(|(part, summary)| suite::member(part, summary)).collect();
    let report = suite::write_report(found, &members, &folder)?;
    print!("{}", table::beside(&found.suite, &members, width_of_stdout()));
    println!("\nreport     {}", report.display());
    Ok(done.exit)
}

/// A study to run, with its scenario's files.
struct Job<'a> {
    part: Part,
    source: &'a [(String, String)],
}

/// How a number of studies ended.
struct Done<'a> {
    exit: Exit,
    /// Of those that were finished.
    summaries: Vec<(&'a Part, Summary)>,
}

/// Tells what will run and runs it; `None` if that is all that was asked for.
fn forecast_and_run<'a>(jobs: &'a [Job], folder: &Path, args: &Args) -> Result<Option<Done<'a>>, Failure> {
    let mut options = Options::default();
    if let Some(threads) = args.threads {
        options.threads = threads as usize;
    }
    let parts: Vec<&Part> = jobs.iter().map(|job| &job.part).collect();
    let told = forecast::of(&parts, folder, options.threads, args.max_memory)?;
    eprint!("{}", fold(&told, 2, width_of_stderr()));
    if args.dry_run {
        return Ok(None);
    }
    options.interrupt = interrupt::flag()?;
    run_all(jobs, folder, &options).map(Some)
}

/// Runs one study after another.
fn run_all<'a>(jobs: &'a [Job], folder: &Path, options: &Options) -> Result<Done<'a>, Failure> {
    let mut done = Done { exit: Exit::Done, summaries: Vec::new() };
    for Job { part, source } in jobs {
        if jobs.len() > 1 {
            eprintln!("\n{}", forecast::name(part));
        }
        let Some(study) = run_part(part, source, &folder.join(&part.folder), options)? else {
            return Ok(Done { exit: Exit::Interrupted, ..done });
        };
        let Some(summary) = study.summary else {
            return Err(Failure::new(Exit::Internal, "the finished study has no summary"));
        };
        if !(summary.failures.is_empty() && summary.expect.iter().all(|claim| claim.holds)) {
            done.exit = Exit::NotAsExpected;
        }
        done.summaries.push((part, summary));
    }
    Ok(done)
}

/// Runs one study and writes its report; `None` if it was interrupted.
fn run_part(
    part: &Part,
    source: &[(String, String)],
    folder: &Path,
    options: &Options,
) -> Result<Option<Study>, Failure> {
    let storage = RealDisk::new(folder);
    let display = Display::new(cells(&part.plan)?.len());
    match mpgx_study::run(&part.plan, source, &storage, options, &display)? {
        Outcome::Interrupted { finished, cells } => {
            eprintln!("interrupted: {finished} of {cells} cells are done; the same command goes on");
            Ok(None)
        }
        Outcome::Finished(study) => {
            if display.trained() || !provenance::is_kept(&storage) {
                provenance::keep(&storage, &provenance::of_this_run(options.threads, display.elapsed_s()))?;
            }
            let report = write_report(&study, folder, &storage)?;
            if let Some(summary) = &study.summary {
                anstream::print!("{}", table::results(summary, width_of_stdout()));
                println!("\nstudy hash {}\nreport     {}", summary.study_hash, report.display());
            }
            Ok(Some(*study))
        }
    }
}

/// The studies of a scenario that are asked for, with `--seeds`, `--algorithms` and `--episodes`.
fn chosen(plan: &Plan, args: &Args) -> Result<Vec<Part>, Failure> {
    let mut parts = parts(plan)?;
    let variants = || plan.variants.iter().map(|variant| variant.name.as_str());
    if let Some(unknown) = args.variant.iter().find(|name| !variants().any(|variant| variant == *name)) {
        let known = variants().collect::<Vec<_>>().join(", ");
        return Err(Failure::new(Exit::BadInput, format!("the scenario has no variant `{unknown}`"))
            .help(if known.is_empty() { "it has none".into() } else { format!("it has {known}") }));
    }
    if !args.variant.is_empty() {
        parts.retain(|part| args.variant.contains(&part.variant));
    }
    let labels = parts.iter().flat_map(|part| part.plan.learners.iter().chain(&part.plan.controllers));
    let mut seen = BTreeSet::new();
    let labels: Vec<&str> =
        labels.map(|method| method.label.as_str()).filter(|label| seen.insert(*label)).collect();
    if let Some(unknown) = args.algorithms.iter().find(|name| !labels.contains(&name.as_str())) {
        return Err(Failure::new(Exit::BadInput, format!("the scenario has no method `{unknown}`"))
            .help(format!("it has {}", labels.join(", "))));
    }
    parts.iter_mut().for_each(|part| adjust(&mut part.plan, args));
    Ok(parts)
}

fn adjust(plan: &mut Plan, args: &Args) {
    if let Some(seeds) = args.seeds {
        (plan.first_seed, plan.seeds) = (seeds.first, seeds.count);
    }
    if !args.algorithms.is_empty() {
        plan.learners.retain(|method| args.algorithms.contains(&method.label));
        plan.controllers.retain(|method| args.algorithms.contains(&method.label));
    }
    if let Some(episodes) = args.episodes {
        for learner in &mut plan.learners {
            learner.what.settings.insert("episodes".to_string(), Setting::Number(f64::from(episodes)));
        }
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;
    use mpgx_lang::plan::{Claim, ClaimKind, Place, Variant};
    use mpgx_lang::source::NoFiles;

    use super::*;

    #[derive(Parser)]
    struct Cli {
        #[command(flatten)]
        args: Args,
    }

    fn args(options: &str) -> Args {
        let words = format!("mpgx small.scn {options}");
        Cli::try_parse_from(words.split_whitespace()).unwrap().args
    }

    /// Two variants, of another horizon and of one seed more; the second claims what cannot be.
    fn plan() -> Plan {
        let text = include_str!("../../tests/small.scn").replace("steps = 400", "steps = 40");
        let mut plan = mpgx_lang::compile("small.scn", text, &[], &NoFiles).plan.unwrap();
        let variant = |name: &str, change: &dyn Fn(&mut Plan)| {
            let mut plan = Plan { variants: Vec::new(), ..plan.clone() };
            change(&mut plan);
            Variant { name: name.into(), text: String::new(), plan: Box::new(plan), at: Place::default() }
        };
        let short = variant("short", &|plan| plan.world.horizon = 10);
        let kind = ClaimKind::Bound {
            protocol: "held_out".into(),
            metric: "error_m".into(),
            method: "oracle".into(),
            below: true,
            bound: 0.0,
            confidence: 0.95,
        };
        let claim = Claim { text: "error < 0".into(), kind, at: Place::default() };
        let more = variant("more", &|plan| (plan.seeds, plan.claims) = (3, vec![claim.clone()]));
        plan.variants = vec![short, more];
        plan
    }

    #[test]
    fn options_hold_for_the_scenario_and_its_variants() {
        let told = |options: &str| {
            let parts = chosen(&plan(), &args(options)).map_err(|failure| failure.to_string())?;
            let of =
                |part: Part| (part.folder, part.plan.first_seed, part.plan.seeds, part.plan.learners.len());
            Ok::<_, String>(parts.into_iter().map(of).collect::<Vec<_>>())
        };
        let [short, more] = ["variants/short", "variants/more"].map(String::from);
        let itself = String::new();
        assert_eq!(
            told("").unwrap(),
            [(itself.clone(), 0, 2, 2), (short.clone(), 0, 2, 2), (more.clone(), 0, 3, 2)]
        );
        assert_eq!(
            told("--seeds 5..9 --algorithms td3").unwrap(),
            [(itself, 5, 4, 1), (short.clone(), 5, 4, 1), (more.clone(), 5, 4, 1)]
        );
        assert_eq!(told("--variant more").unwrap(), [(more.clone(), 0, 3, 2)]);
        assert_eq!(told("--variant more --variant short").unwrap(), [(short, 0, 2, 2), (more, 0, 3, 2)]);
        assert!(told("--variant mor").unwrap_err().contains("it has short, more"));
        let refused = told("--algorithms ppo").unwrap_err();
        assert!(
            refused.contains("no method `ppo`") && refused.ends_with("it has mpg, td3, oracle, proportional"),
            "{refused}"
        );
    }

    #[test]
    fn every_variant_is_run_in_its_folder_and_any_claim_counts() {
        let folder = tempfile::tempdir().unwrap();
        let run = |options: &str| {
            let parts = chosen(&plan(), &args(options)).unwrap();
            let jobs: Vec<Job> = parts.into_iter().map(|part| Job { part, source: &[] }).collect();
            run_all(&jobs, folder.path(), &Options::default()).unwrap().exit
        };
        assert_eq!(run("--variant short"), Exit::Done);
        assert!(!folder.path().join("study.json").exists());
        assert_eq!(run(""), Exit::NotAsExpected);
        for study in ["", "variants/short", "variants/more"] {
            for file in ["study.json", "report.html", "cells/td3-001/record.bin"] {
                assert!(folder.path().join(study).join(file).is_file(), "{study}/{file}");
            }
        }
        let parts = chosen(&plan(), &args("--seeds 3")).unwrap();
        let left = forecast::of(&parts.iter().collect::<Vec<_>>(), folder.path(), 1, None).unwrap();
        assert!(
            left.contains("in all 24 cells of 3 studies") && left.contains("for the 4 cells left"),
            "{left}"
        );
    }
}
