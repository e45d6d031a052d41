//! `mpgx run`: compile, train, evaluate, report.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use mpgx_lang::Override;
use mpgx_lang::plan::{Plan, Setting};
use mpgx_study::storage::RealDisk;
use mpgx_study::{Options, Outcome, Study, cells};

use crate::failure::{Exit, Failure};
use crate::progress::Display;
use crate::verbs::compile::parse_override;
use crate::verbs::report::write_report;
use crate::{provenance, scenario, table};

#[derive(clap::Args)]
#[command(after_help = "Example: mpgx run square_unison.scn --seeds 20 --set side=0.5m")]
pub struct Args {
    /// A scenario file, or the name of a built-in scenario
    #[arg(value_name = "FILE|NAME")]
    scenario: String,
    /// Number of seeds; with more than before only the new ones are trained
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    seeds: Option<u32>,
    /// Only these methods of the scenario, for example mpg,oracle
    #[arg(long, value_delimiter = ',', value_name = "A,B")]
    algorithms: Vec<String>,
    /// Another value for a parameter
    #[arg(long, value_name = "NAME=VALUE", value_parser = parse_override)]
    set: Vec<Override>,
    /// Folder of the study [default: runs/<scenario>]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Cells that run side by side [default: all cores]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=1024))]
    threads: Option<u32>,
    /// At most this many episodes of training
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    episodes: Option<u32>,
    /// Compile and tell what would run
    #[arg(long)]
    dry_run: bool,
}

pub fn run(args: Args) -> Result<Exit, Failure> {
    let (mut plan, compilation) = scenario::plan(&args.scenario, &args.set)?;
    choose(&mut plan, &args)?;
    let folder = args.out.clone().unwrap_or_else(|| Path::new("runs").join(&plan.name));
    let planned = cells(&plan).map_err(|error| Failure::new(Exit::BadInput, error.to_string()))?.len();
    eprintln!(
        "{}: {} seeds of {}; {planned} cells; into {}",
        plan.name,
        plan.seeds,
        plan.learners.iter().map(|learner| learner.label.as_str()).collect::<Vec<_>>().join(", "),
        folder.display()
    );
    if args.dry_run {
        return Ok(Exit::Done);
    }
    let source = scenario::files(&compilation);
    let storage = RealDisk::new(&folder);
    let mut options = Options { interrupt: interrupt_flag()?, ..Options::default() };
    if let Some(threads) = args.threads {
        options.threads = threads as usize;
    }
    let display = Display::new(planned);
    match mpgx_study::run(&plan, &source, &storage, &options, &display)? {
        Outcome::Interrupted { finished, cells } => {
            eprintln!("interrupted: {finished} of {cells} cells are done; the same command goes on");
            Ok(Exit::Interrupted)
        }
        Outcome::Finished(study) => {
            if display.trained() {
                provenance::keep(&storage, &provenance::of_this_run(options.threads, display.elapsed_s()))?;
            }
            finish(&study, &folder, &storage)
        }
    }
}

/// Applies `--seeds`, `--algorithms` and `--episodes`.
fn choose(plan: &mut Plan, args: &Args) -> Result<(), Failure> {
    if let Some(seeds) = args.seeds {
        plan.seeds = seeds as usize;
    }
    if !args.algorithms.is_empty() {
        let labels: Vec<String> =
            plan.learners.iter().chain(&plan.controllers).map(|method| method.label.clone()).collect();
        if let Some(unknown) = args.algorithms.iter().find(|name| !labels.contains(name)) {
            return Err(Failure::new(Exit::BadInput, format!("the scenario has no method `{unknown}`"))
                .help(format!("it has {}", labels.join(", "))));
        }
        plan.learners.retain(|method| args.algorithms.contains(&method.label));
        plan.controllers.retain(|method| args.algorithms.contains(&method.label));
    }
    if let Some(episodes) = args.episodes {
        for learner in &mut plan.learners {
            learner.what.settings.insert("episodes".to_string(), Setting::Number(f64::from(episodes)));
        }
    }
    Ok(())
}

fn finish(study: &Study, folder: &Path, storage: &RealDisk) -> Result<Exit, Failure> {
    let Some(summary) = &study.summary else {
        return Err(Failure::new(Exit::Internal, "the finished study has no summary"));
    };
    let report = write_report(study, folder, storage)?;
    anstream::print!("{}", table::results(summary));
    println!("\nstudy hash {}\nreport     {}", summary.study_hash, report.display());
    let as_expected = summary.failures.is_empty() && summary.expect.iter().all(|claim| claim.holds);
    Ok(if as_expected { Exit::Done } else { Exit::NotAsExpected })
}

/// A flag that Ctrl-C and SIGTERM raise; a second Ctrl-C stops at once.
fn interrupt_flag() -> Result<Arc<AtomicBool>, Failure> {
    let flag = Arc::new(AtomicBool::new(false));
    let raised = Arc::clone(&flag);
    ctrlc::set_handler(move || {
        if raised.swap(true, Ordering::SeqCst) {
            std::process::exit(Exit::Interrupted as i32);
        }
        eprintln!("\nstopping at the next checkpoint; once more stops at once");
    })
    .map_err(|why| Failure::new(Exit::Internal, format!("cannot listen for Ctrl-C: {why}")))?;
    Ok(flag)
}
