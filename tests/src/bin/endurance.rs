//! Nights of the test programme: `cargo run --release -p mpgx-tests --bin endurance -- fuzz --minutes 60`.
//!
//! What fails is written to `endurance/` and printed; exit code 1.

use std::ops::Range;
use std::path::Path;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use clap::Parser;
use mpgx_tests::crashes::Sample;
use mpgx_tests::fuzz::{Inputs, Reached, fuzz};
use mpgx_tests::kills::{SCENARIO, kill_often};

/// Tries what a user, a scheduler or a power cut could do, for as long as it is told.
#[derive(Parser)]
struct Arguments {
    what: What,
    #[arg(long, default_value_t = 60.0)]
    minutes: f64,
    /// Another seed tries other inputs.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Where to begin: the number of an input.
    #[arg(long, default_value_t = 0)]
    from: u64,
    /// So many inputs, kills or states, if the time is enough.
    #[arg(long, default_value_t = u64::MAX)]
    count: u64,
    #[arg(long, default_value_t = 1)]
    threads: usize,
}

#[derive(Clone, Copy, PartialEq, clap::ValueEnum)]
enum What {
    /// Strange scenarios.
    Fuzz,
    /// `kill -9` of `mpgx` beside this program.
    Kills,
    /// Power cuts on a simulated disk.
    Crashes,
    /// A third of the time each.
    All,
}

const FOLDER: &str = "endurance";

fn main() -> Result<ExitCode, Box<dyn std::error::Error>> {
    let mut arguments = Arguments::parse();
    std::fs::create_dir_all(FOLDER)?;
    // A panic is caught and told once, with its input.
    std::panic::set_hook(Box::new(|_| {}));
    let faults = match arguments.what {
        What::Fuzz => fuzzed(&arguments)?,
        What::Kills => told(killed(&arguments)),
        What::Crashes => told(crashed(&arguments)),
        What::All => {
            arguments.minutes /= 3.0;
            fuzzed(&arguments)? + told(crashed(&arguments)) + told(killed(&arguments))
        }
    };
    Ok(if faults == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn told(result: Result<(), Box<dyn std::error::Error>>) -> usize {
    result.inspect_err(|error| println!("{error}")).is_err().into()
}

/// Whether the time is over.
fn clock(arguments: &Arguments) -> impl Fn() -> bool + Sync + use<> {
    let (began, minutes) = (Instant::now(), arguments.minutes);
    move || began.elapsed() > Duration::from_secs_f64(60.0 * minutes)
}

fn killed(arguments: &Arguments) -> Result<(), Box<dyn std::error::Error>> {
    let mpgx = std::env::current_exe()?.with_file_name("mpgx");
    let folder = Path::new(FOLDER).join("kills");
    let sum = kill_often(&mpgx, &folder, SCENARIO, arguments.seed, arguments.count, clock(arguments))?;
    println!("{sum:?}");
    Ok(())
}

fn crashed(arguments: &Arguments) -> Result<(), Box<dyn std::error::Error>> {
    let sum = Sample::new()?.stop_often(arguments.seed, arguments.count, clock(arguments))?;
    println!("{sum:?}");
    Ok(())
}

fn fuzzed(arguments: &Arguments) -> Result<usize, Box<dyn std::error::Error>> {
    let inputs = Inputs::new(arguments.seed).ok_or("the grammar cannot be read")?;
    let began = Instant::now();
    let numbers = arguments.from..arguments.from.saturating_add(arguments.count);
    let mark = |thread: usize, batch: Range<u64>| {
        let _ = std::fs::write(Path::new(FOLDER).join(format!("thread-{thread}")), format!("{batch:?}\n"));
    };
    let tally = fuzz(&inputs, numbers, arguments.threads, mark, clock(arguments));
    let seconds = began.elapsed().as_secs_f64();
    println!(
        "{} inputs in {seconds:.0} s, {:.0} a second; {} printed and read again, {} compiled, {} simulated",
        tally.inputs(),
        tally.inputs() as f64 / seconds,
        tally.at_least(Reached::Tree),
        tally.at_least(Reached::Plan),
        tally.at_least(Reached::Steps)
    );
    tally.reached.iter().for_each(|((kind, reached), count)| println!("{kind:?} {reached:?} {count}"));
    for finding in &tally.findings {
        let path = Path::new(FOLDER).join(format!("{}.scn", finding.number));
        std::fs::write(&path, &finding.text)?;
        println!("{}: {}", path.display(), finding.fault);
    }
    Ok(tally.findings.len())
}
