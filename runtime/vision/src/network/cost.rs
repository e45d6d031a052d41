//! What a training and its network will take, before it begins.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::architecture::Slot;
use super::error::NetworkError;
use super::images::{ImageSet, Source};
use super::localise::Localiser;
use super::train::{TrainConfig, train, untrained};
use crate::image::{Frame, Image};
use crate::trial::Trial;
use crate::trials::{Split, TrialsConfig};

/// Time for a look at how fast a network learns.
const LOOK: Duration = Duration::from_millis(500);
/// Images of a trial that are rendered and answered for.
const LOOKED_AT: usize = 16;

/// Bytes of a parameter while it is trained: itself, its gradient, Adam's two moments, and a checkpoint on its way to disk.
const TRAINED_PARAMETER: usize = 28;
/// Bytes that a training takes whatever its size (measured).
const ANY_TRAINING: usize = 14_000_000;
/// Epochs of images in memory: the one learnt from and the next.
const EPOCHS: usize = 2;
/// Bytes of a parameter in the network's file: itself, and until it is trained Adam's two moments.
const KEPT_PARAMETER: usize = 4;
const CHECKPOINT_PARAMETER: usize = 12;

/// Known from the configuration.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Size {
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
    let room = trials.world.scene_bytes() as usize;
    Size {
        memory: ANY_TRAINING + room + EPOCHS * images + features + TRAINED_PARAMETER * parameters,
        file: KEPT_PARAMETER * parameters,
        // While a checkpoint is written, the one before lies there too.
        most_file: 2 * CHECKPOINT_PARAMETER * parameters,
    }
}

/// What looking around takes on this machine, s: a short look, which another look may contradict.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LookCost {
    /// A new trial without its images.
    pub trial_s: f64,
    /// An image.
    pub image_s: f64,
    /// A network's answer to one.
    pub answer_s: f64,
}

impl LookCost {
    /// Making the images of an epoch of training, s.
    pub fn epoch_s(&self, trials: &TrialsConfig) -> f64 {
        trials.trials as f64 * (self.trial_s + trials.images as f64 * self.image_s)
    }
}

/// Epochs whose images a training makes, the last of them whole like all others.
pub fn epochs(config: &TrainConfig, trials: &TrialsConfig) -> u64 {
    let pass_steps = (trials.trials * trials.images / config.batch).max(1);
    config.steps.div_ceil((trials.passes * pass_steps) as u64)
}

/// Renders a few images, and answers for them with a network that has learnt nothing yet.
pub fn look_cost(config: &TrainConfig, trials: &TrialsConfig) -> Result<LookCost, NetworkError> {
    let began = Instant::now();
    let trial = trials.trial(Split::Training, 0)?;
    let trial_s = began.elapsed().as_secs_f64();
    let began = Instant::now();
    let images: Vec<Image> = frames(trials, &trial).map(|frame| frame.image).collect();
    let each = 1.0 / images.len().max(1) as f64;
    let image_s = each * began.elapsed().as_secs_f64();

    let localiser = Localiser::new(&untrained(config, &Source::Rendered(Box::new(trials.clone())))?);
    // The first answer asks for all memory and is slower than those after it.
    localiser.estimate(&images)?;
    let began = Instant::now();
    localiser.estimate(&images)?;
    Ok(LookCost { trial_s, image_s, answer_s: each * began.elapsed().as_secs_f64() })
}

/// What a step of training takes on this machine, s, without making its images: learns from a few for a moment.
pub fn step_cost(config: &TrainConfig, trials: &TrialsConfig) -> Result<f64, NetworkError> {
    let trial = trials.trial(Split::Training, 0)?;
    let few: Vec<Frame> = frames(trials, &trial).collect();
    let mut set = ImageSet::new(trials.camera.width_px, trials.camera.height_px);
    for frame in few.iter().cycle().take(config.batch) {
        set.add(&frame.image, frame.pose);
    }
    // The first step asks for all memory and is slower than those after it.
    let config = TrainConfig { steps: config.steps.max(2), ..config.clone() };
    let (mut steps, mut began) = (0, Instant::now());
    let mut watch = |_: &_| {
        steps += 1;
        if steps == 1 {
            began = Instant::now();
        }
        if steps > 1 && began.elapsed() > LOOK { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let mut keep = |_: &_| Ok::<(), NetworkError>(());
    train(&config, &Source::Recorded(Arc::new(set)), None, u64::MAX, &mut keep, &mut watch)?;
    Ok(began.elapsed().as_secs_f64() / (steps - 1).max(1) as f64)
}

/// A few of a trial.
fn frames<'a>(trials: &TrialsConfig, trial: &'a Trial) -> impl Iterator<Item = Frame> + use<'a> {
    trials.frames(trial).take(LOOKED_AT).map(|frame| trial.frame(frame))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::CameraConfig;
    use crate::network::{ResNetConfig, Stem, Weights};

    fn small() -> (TrainConfig, TrialsConfig) {
        let camera = CameraConfig { width_px: 16, height_px: 16, ..CameraConfig::default() };
        let trials =
            TrialsConfig { camera, duration_s: 2.0, images: 8, trials: 1, ..TrialsConfig::default() };
        let stem = Stem::Small;
        let network =
            ResNetConfig { stem, channels: 4, width_px: 16, height_px: 16, ..ResNetConfig::default() };
        (TrainConfig { network, steps: 3, batch: 4, ..TrainConfig::default() }, trials)
    }

    /// All but the description at the head of a file.
    #[test]
    fn the_disk_holds_what_is_told() {
        let (config, trials) = small();
        let (told, mut kept) = (size(&config, &trials), Vec::new());
        let mut keep = |weights: &_| -> Result<(), NetworkError> {
            kept.push(Weights::to_bytes(weights)?.len());
            Ok(())
        };
        let source = Source::Rendered(Box::new(trials));
        train(&config, &source, None, 1, &mut keep, &mut |_| ControlFlow::Continue(())).unwrap();
        let [.., before, last] = kept.as_slice() else { panic!("{kept:?}") };
        for (told, held) in [(told.most_file, 2 * before), (told.file, *last)] {
            let ratio = told as f64 / held as f64;
            assert!((0.8..1.1).contains(&ratio), "{told} for {held}");
        }
    }

    /// 18 batches of 4 are in two passes over 36 images.
    #[test]
    fn epochs_are_made_whole() {
        let trials = TrialsConfig { images: 12, trials: 3, passes: 2, ..small().1 };
        let of = |steps| epochs(&TrainConfig { steps, ..small().0 }, &trials);
        assert_eq!([1, 18, 19, 36, 37].map(of), [1, 1, 2, 2, 3]);
        let look = LookCost { trial_s: 10.0, image_s: 1.0, answer_s: 100.0 };
        assert_eq!(look.epoch_s(&trials), 66.0);
    }

    /// A training of one step, too.
    #[test]
    fn everything_takes_time() {
        let (config, trials) = small();
        let LookCost { trial_s, image_s, answer_s } = look_cost(&config, &trials).unwrap();
        let step_s = step_cost(&TrainConfig { steps: 1, ..config }, &trials).unwrap();
        for seconds in [trial_s, image_s, answer_s, step_s] {
            assert!(seconds > 0.0 && seconds < 60.0, "{seconds}");
        }
        assert!(step_s > answer_s, "{step_s} s to learn from four and {answer_s} s to answer for one");
    }
}
