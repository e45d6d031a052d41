//! `mpgx test`: a user's own golden files. Beside `x.scn` stands `x.reward`, the compiled reward as text.

use std::path::{Path, PathBuf};

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
    let mut exit = Exit::Done;
    for path in &scenario::collect(&args.paths)? {
        let (plan, _) = scenario::plan(&path.to_string_lossy(), &[])?;
        let compiled = reward(&plan);
        let golden = path.with_extension("reward");
        if args.bless {
            std::fs::write(&golden, &compiled).map_err(|why| cannot("write", &golden, why))?;
            println!("{}: written", golden.display());
            continue;
        }
        match std::fs::read_to_string(&golden) {
            Ok(expected) if expected == compiled => println!("{}: ok", path.display()),
            Ok(expected) => {
                exit = Exit::NotAsExpected;
                println!("{}: the reward has changed", path.display());
                for line in expected.lines().filter(|line| !compiled.contains(line)) {
                    println!("  - {line}");
                }
                for line in compiled.lines().filter(|line| !expected.contains(line)) {
                    println!("  + {line}");
                }
            }
            Err(why) if why.kind() == std::io::ErrorKind::NotFound => {
                println!("{}: compiles; no golden file (--bless writes one)", path.display());
            }
            Err(why) => return Err(cannot("read", &golden, why)),
        }
    }
    Ok(exit)
}

fn cannot(what: &str, path: &Path, why: std::io::Error) -> Failure {
    Failure::new(Exit::Io, format!("cannot {what} {}: {why}", path.display()))
}
