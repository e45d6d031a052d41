//! `mpgx vision render`.

use std::path::PathBuf;

use mpgx_vision::Split;
use mpgx_vision::dataset::write_tum;

use super::trials;
use crate::failure::{Exit, Failure};

#[derive(clap::Args)]
#[command(after_help = "Example: mpgx vision render recordings --trials 9

Trials 0 to 8 have each lighting with each kind of trajectory once, and so on. The layout is that of TUM RGB-D.")]
pub struct Args {
    /// Folder for a folder of each trial
    out: PathBuf,
    /// How many trials
    #[arg(long, default_value_t = 9, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    trials: u32,
    /// Number of the first trial
    #[arg(long, default_value_t = 0, value_name = "N")]
    first: u32,
    /// Trials to measure with instead of those to train on
    #[arg(long)]
    held_out: bool,
    /// Side of the images, pixels
    #[arg(long, default_value_t = 96, value_name = "N")]
    size: usize,
    /// Length of a trial
    #[arg(long, default_value_t = 30.0)]
    seconds: f64,
    /// Of the world's trials
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

pub fn run(args: Args) -> Result<Exit, Failure> {
    let config = trials(args.size, args.seconds, args.seed);
    let (name, split) = if args.held_out { ("held-out", Split::HeldOut) } else { ("trial", Split::Training) };
    for number in args.first..args.first.saturating_add(args.trials) {
        let trial = config.trial(split, number)?;
        let folder = args.out.join(format!("{name}-{number:04}"));
        write_tum(&folder, &trial.tags, &trial.truth, trial.frames())?;
        println!(
            "{}: {} images, {}, {}",
            folder.display(),
            trial.frames,
            trial.tags.lighting,
            trial.tags.trajectory
        );
    }
    Ok(Exit::Done)
}
