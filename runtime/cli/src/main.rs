//! `mpgx`: one file a verb in `verbs/`. A verb gives an exit code or a failure with a remedy.

mod bench;
mod bytes;
mod failure;
mod forecast;
mod import;
mod interrupt;
mod layout;
mod progress;
mod provenance;
mod scenario;
mod seeds;
mod suite;
mod table;
mod verbs;

use std::io::Write;
use std::panic::UnwindSafe;
use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};
use clap_complete::Shell;

use failure::{Exit, Failure};

/// Scenarios for leader-follower and formation control by deep reinforcement learning.
#[derive(Parser)]
#[command(
    version,
    propagate_version = true,
    max_term_width = 100,
    after_help = "\
Example: mpgx run square_unison.scn

Exit codes:
   0  done
   1  a claim or a seed failed
   2  the scenario or the command line is wrong
  70  internal
  74  cannot read or write
  75  interrupted, run again to resume"
)]
struct Cli {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Subcommand)]
enum Verb {
    /// Compile, train all cells, evaluate and write the report; run again to resume or to add seeds
    Run(verbs::run::Args),
    /// Tell all problems of scenarios at once
    Check(verbs::check::Args),
    /// Print what the compiler makes of a scenario
    Compile(verbs::compile::Args),
    /// The story of an error code, or what a scenario means with all its defaults
    Explain(verbs::explain::Args),
    /// Run the tests in scenarios, and compare compiled rewards with the golden files beside them
    Test(verbs::test::Args),
    /// Tell what two scenarios mean otherwise
    Diff(verbs::diff::Args),
    /// Print or write the reference of the standard library or of a file
    Doc(verbs::doc::Args),
    /// Write a first scenario with comments
    New(verbs::new::Args),
    /// Lay out scenario files in the one style
    Fmt(verbs::fmt::Args),
    /// The hash of a scenario's meaning; comments and layout do not change it
    Hash(verbs::hash::Args),
    /// What can be run or read
    List(verbs::list::Args),
    /// Write the report of finished studies again, from their records alone
    Report(verbs::report::Args),
    /// Evaluate what a study has learned by other evaluations or in another scenario, without training
    Eval(verbs::eval::Args),
    /// Write the weights and records of a study for other programs
    Export(verbs::export::Args),
    /// Measure this machine: kernels, learners, simulator and compiler
    Bench(verbs::bench::Args),
    /// Draw the scene, its formations and the landscape of the reward, before any training
    View(verbs::view::Args),
    /// Tell where a camera is from what it sees: render, train, eval, predict
    Vision(verbs::vision::Args),
    /// Print completions for a shell
    Completions { shell: Shell },
}

fn main() -> ExitCode {
    end_with_closed_pipes();
    tracing_subscriber::fmt()
        .with_writer(std::io::stderr)
        .with_env_filter(tracing_subscriber::EnvFilter::from_env("MPGX_LOG"))
        .init();
    ended(|| choose_kernels().and_then(|()| run(Cli::parse().verb)))
}

/// Does it, tells what went wrong, and gives the exit code.
fn ended(it: impl FnOnce() -> Result<Exit, Failure> + UnwindSafe) -> ExitCode {
    match std::panic::catch_unwind(it) {
        Ok(Ok(exit)) => exit.into(),
        // It has told where and why.
        Err(_) => Exit::Internal.into(),
        Ok(Err(failure)) => {
            let style = anstyle::AnsiColor::Red.on_default().bold();
            let text = layout::fold(&format!("error: {failure}"), 2, layout::width_of_stderr());
            let rest = text.strip_prefix("error").unwrap_or(&text);
            anstream::eprint!("{style}error{style:#}{rest}");
            failure.exit.into()
        }
    }
}

/// `mpgx list | head -1` is no error: who reads has read enough. The exit code is that of SIGPIPE. Output that cannot be
/// written for another reason, as to a full disk, is one.
fn end_with_closed_pipes() {
    let told = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        let message = panic.payload().downcast_ref::<String>().map_or("", String::as_str);
        if message.starts_with("failed printing to") {
            if message.contains("Broken pipe") {
                std::process::exit(141);
            }
            let _ = writeln!(std::io::stderr(), "error: {message}");
            std::process::exit(Exit::Io as i32);
        }
        told(panic);
    }));
}

/// `MPGX_SIMD` chooses slower kernels than the processor has; the results keep their bits.
fn choose_kernels() -> Result<(), Failure> {
    match std::env::var("MPGX_SIMD") {
        Ok(name) => mpgx_learn::force_simd(&name).map_err(|error| {
            Failure::new(Exit::BadInput, error.to_string()).help("MPGX_SIMD is avx512, avx2 or scalar")
        }),
        Err(_) => Ok(()),
    }
}

fn run(verb: Verb) -> Result<Exit, Failure> {
    match verb {
        Verb::Run(args) => verbs::run::run(args),
        Verb::Check(args) => verbs::check::run(args),
        Verb::Compile(args) => verbs::compile::run(args),
        Verb::Explain(args) => verbs::explain::run(args),
        Verb::Test(args) => verbs::test::run(args),
        Verb::Diff(args) => verbs::diff::run(args),
        Verb::Doc(args) => verbs::doc::run(args),
        Verb::New(args) => verbs::new::run(args),
        Verb::Fmt(args) => verbs::fmt::run(args),
        Verb::Hash(args) => verbs::hash::run(args),
        Verb::List(args) => verbs::list::run(args),
        Verb::Report(args) => verbs::report::run(args),
        Verb::Eval(args) => verbs::eval::run(args),
        Verb::Export(args) => verbs::export::run(args),
        Verb::Bench(args) => verbs::bench::run(args),
        Verb::View(args) => verbs::view::run(args),
        Verb::Vision(args) => verbs::vision::run(args),
        Verb::Completions { shell } => {
            clap_complete::generate(shell, &mut Cli::command(), "mpgx", &mut std::io::stdout());
            Ok(Exit::Done)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Seen to fail when panics are not caught.
    #[test]
    fn every_end_has_its_exit_code() {
        assert_eq!(ended(|| panic!("on purpose")), ExitCode::from(70));
        assert_eq!(ended(|| Ok(Exit::Interrupted)), ExitCode::from(75));
        assert_eq!(ended(|| Err(Failure::new(Exit::Io, "on purpose"))), ExitCode::from(74));
    }
}
