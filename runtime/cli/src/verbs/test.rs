//! `mpgx test`: what a scenario says of itself. Its `test` blocks, and a golden file of its reward: beside `x.scn`
//! stands `x.reward`, the compiled reward as text.

use std::path::{Path, PathBuf};

use mpgx_lang::plan::{Place, Plan};
use mpgx_sim::TestFailure;

use crate::failure::{Exit, Failure};
use crate::scenario;
use crate::verbs::compile::reward;

#[derive(clap::Args)]
#[command(after_help = "Example: mpgx test scenarios --bless")]
pub struct Args {
    /// Scenarios or folders of scenarios
    #[arg(default_value = ".", value_name = "PATH")]
    paths: Vec<PathBuf>,
    /// Write the golden files instead of comparing with them
    #[arg(long)]
    bless: bool,
}

pub fn run(args: Args) -> Result<Exit, Failure> {
    let (mut passed, mut failed) = (0, 0);
    for path in &scenario::collect(&args.paths)? {
        let shown = path.display();
        let (plan, _) = scenario::plan(&path.to_string_lossy(), &[])?;
        let golden = golden(&plan, &path.with_extension("reward"), args.bless)?;
        let tests = plan.tests.iter().map(|test| {
            let result = mpgx_sim::run_test(&plan, test);
            (format!("{shown}: {}", test.name), result.err().map(|failure| told(&failure)))
        });
        let golden = golden.map(|failure| (format!("{shown}: its reward"), failure));
        for (name, failure) in golden.into_iter().chain(tests) {
            match failure {
                None => {
                    passed += 1;
                    println!("{name} ... ok");
                }
                Some(why) => {
                    failed += 1;
                    println!("{name} ... FAILED\n{why}");
                }
            }
        }
    }
    println!("{passed} passed, {failed} failed");
    Ok(if failed == 0 { Exit::Done } else { Exit::NotAsExpected })
}

/// What failed, and where.
fn told(failure: &TestFailure) -> String {
    let at = match failure {
        TestFailure::Check { at, .. } => at.clone(),
        TestFailure::Fault { fault, .. } => fault.at.clone(),
        TestFailure::World(_) => Place::default(),
    };
    let place =
        if at.file.is_empty() { String::new() } else { format!("{}:{}:{}: ", at.file, at.line, at.column) };
    format!("  {place}{failure}")
}

/// Compares the reward with its golden file, or writes that. `None`: there is no such file; `Some(None)`: it is
/// as it was.
fn golden(plan: &Plan, file: &Path, bless: bool) -> Result<Option<Option<String>>, Failure> {
    let compiled = reward(plan);
    if bless {
        std::fs::write(file, &compiled).map_err(|why| cannot("write", file, why))?;
        println!("{}: written", file.display());
        return Ok(None);
    }
    match std::fs::read_to_string(file) {
        Ok(expected) if expected == compiled => Ok(Some(None)),
        Ok(expected) => {
            let gone =
                expected.lines().filter(|line| !compiled.contains(line)).map(|line| format!("  - {line}"));
            let new =
                compiled.lines().filter(|line| !expected.contains(line)).map(|line| format!("  + {line}"));
            Ok(Some(Some(gone.chain(new).collect::<Vec<_>>().join("\n"))))
        }
        Err(why) if why.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(why) => Err(cannot("read", file, why)),
    }
}

fn cannot(what: &str, path: &Path, why: std::io::Error) -> Failure {
    Failure::new(Exit::Io, format!("cannot {what} {}: {why}", path.display()))
}
