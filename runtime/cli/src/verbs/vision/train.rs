//! `mpgx vision train`.

use std::io::IsTerminal;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Instant;

use clap::ValueEnum;
use mpgx_vision::network::{
    self, ImageSet, Orientation, Progress, ResNetConfig, Source, Stem, TrainConfig, Weighting,
};
use mpgx_vision::{AugmentConfig, TrialsConfig};

use super::localise::recordings;
use super::trials;
use crate::failure::{Exit, Failure};

#[derive(clap::Args)]
#[command(after_help = "Example: mpgx vision train resnet.safetensors --depth 18 --steps 3000

Without recordings the network learns from trials in the built-in world, new ones in every epoch. The file is a
network that can be measured at any time; while the training is not done it also holds what is needed to go on.")]
pub struct Args {
    /// Where to keep the network, safetensors
    out: PathBuf,
    /// Folders of recordings, TUM RGB-D or 7-Scenes
    recordings: Vec<PathBuf>,
    /// Layers of the network: 18, 34 or 50
    #[arg(long, default_value_t = 18, value_name = "N")]
    depth: usize,
    /// Channels of its first stage
    #[arg(long, default_value_t = 64, value_name = "N")]
    channels: usize,
    /// What comes before the first stage
    #[arg(long, value_enum, default_value = "standard")]
    stem: StemName,
    /// Side of the images that it looks at, pixels
    #[arg(long, default_value_t = 64, value_name = "N")]
    size: usize,
    /// Outputs that stand for the orientation
    #[arg(long, value_enum, default_value = "heading")]
    orientation: OrientationName,
    /// Bins of the distributions that tell the outputs; 1: the outputs themselves, as in the paper
    #[arg(long, default_value_t = 32, value_name = "N")]
    bins: usize,
    /// How the losses of position, orientation and landmarks are weighed
    #[arg(long, value_enum, default_value = "fixed")]
    weighting: WeightingName,
    /// Batches to learn from
    #[arg(long, default_value_t = 5000, value_name = "N")]
    steps: u64,
    /// Images of a batch
    #[arg(long, default_value_t = 32, value_name = "N")]
    batch: usize,
    #[arg(long, default_value_t = 2e-3)]
    learning_rate: f64,
    /// Of the weights, the order and the changes of images
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Trials of an epoch
    #[arg(long, default_value_t = 36, value_name = "N")]
    trials: usize,
    /// Images of a trial
    #[arg(long, default_value_t = 100, value_name = "N")]
    images: usize,
    /// Steps between two checkpoints
    #[arg(long, default_value_t = 100, value_name = "N")]
    keep: u64,
}

#[derive(Clone, Copy, ValueEnum)]
enum StemName {
    /// 7 × 7 and a pool: a quarter of the side
    Standard,
    /// 3 × 3, the whole side
    Small,
}

#[derive(Clone, Copy, ValueEnum)]
enum OrientationName {
    /// Sine and cosine
    Heading,
    /// As in the paper
    Quaternion,
}

#[derive(Clone, Copy, ValueEnum)]
enum WeightingName {
    Fixed,
    /// Kendall and Cipolla 2017
    Learnt,
}

pub fn run(args: Args) -> Result<Exit, Failure> {
    let mut config = config(&args);
    let source = if args.recordings.is_empty() {
        config.augment = AugmentConfig::NONE;
        let trials = trials(args.size, 60.0, 1);
        Source::Rendered(Box::new(TrialsConfig { trials: args.trials, images: args.images, ..trials }))
    } else {
        config.check()?;
        Source::Recorded(Arc::new(ImageSet::read(&recordings(&args.recordings)?, args.size, args.size)?))
    };

    let stop = crate::interrupt::flag()?;
    let mut display = Display::new(&config);
    let mut watch = |progress: &Progress| {
        display.show(progress);
        if stop.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let weights = network::train_to(&config, &source, &args.out, args.keep, &mut watch)?;
    let step = weights.record.step;
    if step < config.steps {
        let message = format!("interrupted after step {step} of {}", config.steps);
        return Err(Failure::new(Exit::Interrupted, message).help("run the same command again to resume"));
    }
    println!("{}: {step} steps, training {}", args.out.display(), &weights.record.hash()[..16]);
    Ok(Exit::Done)
}

fn config(args: &Args) -> TrainConfig {
    TrainConfig {
        network: ResNetConfig {
            depth: args.depth,
            channels: args.channels,
            stem: match args.stem {
                StemName::Standard => Stem::Standard,
                StemName::Small => Stem::Small,
            },
            width_px: args.size,
            height_px: args.size,
        },
        orientation: match args.orientation {
            OrientationName::Heading => Orientation::Heading,
            OrientationName::Quaternion => Orientation::Quaternion,
        },
        bins: args.bins,
        weighting: match args.weighting {
            WeightingName::Fixed => Weighting::default(),
            WeightingName::Learnt => Weighting::Learnt,
        },
        steps: args.steps,
        batch: args.batch,
        learning_rate: args.learning_rate,
        seed: args.seed,
        ..TrainConfig::default()
    }
}

/// Means over some steps, on stderr.
struct Display {
    started: Instant,
    steps: u64,
    every: u64,
    batch: usize,
    first: Option<u64>,
    sum: [f64; 3],
    count: u64,
}

impl Display {
    fn new(config: &TrainConfig) -> Display {
        let every = if std::io::stderr().is_terminal() { 10 } else { 100 };
        let (steps, batch) = (config.steps, config.batch);
        Display { started: Instant::now(), steps, every, batch, first: None, sum: [0.0; 3], count: 0 }
    }

    fn show(&mut self, progress: &Progress) {
        let first = *self.first.get_or_insert(progress.step);
        for (sum, loss) in self.sum.iter_mut().zip(progress.losses) {
            *sum += loss;
        }
        self.count += 1;
        if !progress.step.is_multiple_of(self.every) && progress.step != self.steps {
            return;
        }
        let seconds = self.started.elapsed().as_secs_f64();
        let images = (progress.step - first + 1) * self.batch as u64;
        let [position, orientation, landmarks] = self.sum.map(|sum| 50.0 * sum / self.count as f64);
        anstream::eprintln!(
            "[{:>6}/{}] position {position:6.2} %  orientation {orientation:6.2} %  landmarks {landmarks:6.2} %  \
             {:5.1} images/s  {seconds:6.0} s",
            progress.step,
            self.steps,
            images as f64 / seconds,
        );
        (self.sum, self.count) = ([0.0; 3], 0);
    }
}
