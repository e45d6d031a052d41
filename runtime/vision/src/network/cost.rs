//! What a training and its network will take, before it begins.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::architecture::Slot;
use super::error::NetworkError;
use super::images::{ImageSet, Source};
use super::localise::Localiser;
use super::train::{TrainConfig, train};
use crate::image::Image;
use crate::trials::{Split, TrialsConfig};

/// Time for a look at how fast a network learns.
const LOOK: Duration = Duration::from_millis(500);
/// Images of a trial that are rendered and answered for.
const LOOKED_AT: usize = 16;

/// Bytes of a parameter while it is trained: itself, its gradient, Adam's two moments, and a checkpoint on its way to disk.
const TRAINED_PARAMETER: usize = 28;
/// Bytes that a training takes whatever its size: rooms and the libraries' own (measured).
const ANY_TRAINING: usize = 25_000_000;
/// Epochs of images in memory: the one learnt from and the next.
const EPOCHS: usize = 2;

/// Known from the configuration.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Size {
    pub parameters: usize,
    /// The most memory that the training takes, bytes.
    pub memory: usize,
    /// Of the network's file, and the most while it is trained, bytes.
    pub file: usize,
    pub most_file: usize,
}

pub fn size(config: &TrainConfig, trials: &TrialsConfig) -> Size {
    let source = Source::Rendered(Box::new(trials.clone()));
    let outputs = source.head(config.orientation, config.bins).map_or(0, |head| head.numbers());
    let parameters = config.network.layout(outputs).iter().map(Slot::count).sum::<usize>();
    let images = trials.trials * trials.images * 3 * trials.camera.width_px * trials.camera.height_px;
    let features = 4 * config.network.features() * config.batch;
    Size {
        parameters,
        memory: ANY_TRAINING + EPOCHS * images + features + TRAINED_PARAMETER * parameters,
        file: 4 * parameters,
        most_file: 12 * parameters,
    }
}

/// Measured on this machine by a short look, which another look may contradict.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cost {
    /// A step of training, s, without making its images.
    pub step_s: f64,
    /// A new trial, s, without its images.
    pub trial_s: f64,
    /// An image, s.
    pub image_s: f64,
    /// The network's answer to one, s.
    pub answer_s: f64,
}

/// Renders a few images and learns from them for a moment.
pub fn cost(config: &TrainConfig, trials: &TrialsConfig) -> Result<Cost, NetworkError> {
    let began = Instant::now();
    let trial = trials.trial(Split::Training, 0)?;
    let trial_s = began.elapsed().as_secs_f64();
    let began = Instant::now();
    let frames = trials.frames(&trial).take(LOOKED_AT).map(|frame| trial.frame(frame));
    let frames: Vec<_> = frames.collect();
    let image_s = began.elapsed().as_secs_f64() / frames.len().max(1) as f64;

    let mut set = ImageSet::new(trials.camera.width_px, trials.camera.height_px);
    for frame in frames.iter().cycle().take(config.batch) {
        set.add(&frame.image, frame.pose);
    }
    // The first step asks for all memory and is slower than those after it.
    let (mut steps, mut first) = (0, Instant::now());
    let mut watch = |_: &_| {
        steps += 1;
        if steps == 1 {
            first = Instant::now();
        }
        if steps > 1 && first.elapsed() > LOOK { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let source = Source::Recorded(Arc::new(set));
    let mut keep = |_: &_| Ok::<(), NetworkError>(());
    let weights = train(config, &source, None, u64::MAX, &mut keep, &mut watch)?;
    let step_s = first.elapsed().as_secs_f64() / (steps - 1).max(1) as f64;

    let localiser = Localiser::new(&weights);
    let images: Vec<Image> = frames.into_iter().map(|frame| frame.image).collect();
    localiser.estimate(&images)?;
    let began = Instant::now();
    localiser.estimate(&images)?;
    let answer_s = began.elapsed().as_secs_f64() / images.len().max(1) as f64;
    Ok(Cost { step_s, trial_s, image_s, answer_s })
}
