//! `mpgx fmt`: the one layout of scenario files.

use std::path::{Path, PathBuf};

use mpgx_lang::format::format;
use mpgx_lang::problem::{Problems, Style, render};
use mpgx_lang::source::Sources;
use mpgx_study::storage::{RealDisk, Storage};

use crate::failure::{Exit, Failure};
use crate::scenario;

#[derive(clap::Args)]
#[command(after_help = "Example: mpgx fmt --check scenarios")]
pub struct Args {
    /// Scenario files or folders of them; - reads standard input and writes standard output
    #[arg(required = true, value_name = "PATH")]
    paths: Vec<PathBuf>,
    /// Write nothing; tell which files are laid out otherwise
    #[arg(long)]
    check: bool,
    /// Write nothing; print what would change
    #[arg(long, conflicts_with = "check")]
    diff: bool,
}

pub fn run(args: Args) -> Result<Exit, Failure> {
    if args.paths == [Path::new("-")] {
        let before = scenario::read_all(std::io::stdin(), "standard input")?;
        let Some(after) = laid_out("standard input", &before) else { return Ok(Exit::BadInput) };
        return finish(&args, "standard input", &before, &after, |after| {
            print!("{after}");
            Ok(())
        });
    }
    let mut exit = Exit::Done;
    for path in scenario::collect(&args.paths)? {
        let shown = path.display().to_string();
        let before = scenario::read(&path)?;
        let Some(after) = laid_out(&shown, &before) else {
            exit = Exit::BadInput;
            continue;
        };
        let outcome = finish(&args, &shown, &before, &after, |after| match after == before {
            true => Ok(()),
            false => write(&path, after),
        })?;
        exit = if exit == Exit::Done { outcome } else { exit };
    }
    Ok(exit)
}

/// The text as it should be, or all its syntax errors on stderr.
fn laid_out(name: &str, text: &str) -> Option<String> {
    let (mut sources, mut problems) = (Sources::default(), Problems::default());
    let file = sources.add(name, text.to_owned());
    let after = format(&sources, file, &mut problems);
    anstream::eprint!("{}", render(&problems, &sources, Style::Coloured));
    after
}

fn finish(
    args: &Args,
    name: &str,
    before: &str,
    after: &str,
    write: impl FnOnce(&str) -> Result<(), Failure>,
) -> Result<Exit, Failure> {
    if args.diff {
        print!(
            "{}",
            similar::TextDiff::from_lines(before, after).unified_diff().header(name, "as it should be")
        );
    } else if args.check && before != after {
        println!("{name}");
    }
    if !args.check && !args.diff {
        write(after)?;
        return Ok(Exit::Done);
    }
    Ok(if before == after { Exit::Done } else { Exit::NotAsExpected })
}

/// Replaces a file whole, also if the power fails meanwhile.
pub fn write(path: &Path, text: &str) -> Result<(), Failure> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    Ok(RealDisk::new(folder).write_atomic(&name, text.as_bytes())?)
}
