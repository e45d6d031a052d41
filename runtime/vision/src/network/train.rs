//! Training: a function of the configuration and the images, to the bit, however often it is interrupted.

use std::ops::ControlFlow;
use std::path::Path;

use burn::tensor::{Device, Tensor, TensorData};
use serde::{Deserialize, Serialize};

use super::adam::Adam;
use super::architecture::{ResNetConfig, Slot};
use super::error::NetworkError;
use super::feed::{Batch, batches};
use super::images::Source;
use super::loss::{Weighting, losses, total};
use super::pose_head::{BINS, Orientation, PoseHead};
use super::resnet::ResNet;
use super::tensors::{Values, gradients, numbers, values, with_values};
use super::weights::{FORMAT, NetworkRecord, Weights};
use crate::augment::AugmentConfig;
use crate::world::within;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TrainConfig {
    pub network: ResNetConfig,
    pub orientation: Orientation,
    /// See [`PoseHead::bins`].
    pub bins: usize,
    pub weighting: Weighting,
    pub augment: AugmentConfig,
    /// Batches that are learnt from.
    pub steps: u64,
    /// Images of a batch.
    pub batch: usize,
    /// The highest; it rises over the first twentieth of the steps and falls to 0 with a cosine.
    pub learning_rate: f64,
    pub seed: u64,
}

impl Default for TrainConfig {
    fn default() -> TrainConfig {
        TrainConfig {
            network: ResNetConfig::default(),
            orientation: Orientation::default(),
            bins: 32,
            weighting: Weighting::default(),
            augment: AugmentConfig::default(),
            steps: 5000,
            batch: 32,
            learning_rate: 2e-3,
            seed: 1,
        }
    }
}

/// A step that was done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Steps done so far.
    pub step: u64,
    /// Mean absolute errors of position, orientation and landmarks, as outputs between −1 and 1.
    pub losses: [f64; 3],
    /// What they were multiplied with.
    pub weights: [f64; 3],
}

/// How a training went: means over a hundredth of its steps each.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Course {
    /// Steps done at the end of each entry.
    pub steps: Vec<u64>,
    /// Mean absolute errors of position, orientation and landmarks, as outputs between −1 and 1.
    pub losses: Vec<[f64; 3]>,
    /// Sums and their number since the last entry.
    sums: [f64; 3],
    count: u64,
}

impl Course {
    fn add(&mut self, progress: &Progress, steps: u64) {
        self.sums = std::array::from_fn(|part| self.sums[part] + progress.losses[part]);
        self.count += 1;
        if progress.step.is_multiple_of(steps.div_ceil(100)) || progress.step == steps {
            self.steps.push(progress.step);
            self.losses.push(self.sums.map(|sum| sum / self.count as f64));
            (self.sums, self.count) = ([0.0; 3], 0);
        }
    }
}

impl TrainConfig {
    pub fn check(&self) -> Result<(), NetworkError> {
        self.network.check()?;
        within("the number of steps", self.steps as f64, (1.0, 1e9), "1 to 1000000000")?;
        within("the images of a batch", self.batch as f64, (2.0, 1024.0), "2 to 1024")?;
        within("the number of bins", self.bins as f64, (1.0, *BINS.end() as f64), "1 to 256")?;
        within("the learning rate", self.learning_rate, (1e-9, 1.0), "1e-9 to 1")?;
        if let Weighting::Fixed { position, orientation, landmarks } = self.weighting {
            for weight in [position, orientation, landmarks] {
                within("the weight of a loss", weight, (0.0, 1e6), "0 to 1000000")?;
            }
        }
        Ok(())
    }

    fn learning_rate_at(&self, step: u64) -> f64 {
        let share = step as f64 / self.steps as f64;
        let rise = (20.0 * (step + 1) as f64 / self.steps as f64).min(1.0);
        self.learning_rate * rise * 0.5 * (1.0 + libm::cos(std::f64::consts::PI * share))
    }
}

/// Where networks are computed: the first CUDA device with the feature `cuda`, the processor without.
pub(crate) fn device() -> Device {
    #[cfg(feature = "cuda")]
    return Device::cuda(0);
    #[cfg(not(feature = "cuda"))]
    Device::flex()
}

/// Trains a network. `keep` is given it every `keep_steps` steps with what is needed to go on, and at the end without. A
/// training that was `kept` before goes on from there; one that is done is left as it is. `watch` sees every step and may
/// stop the training, which keeps it first.
pub fn train<E: From<NetworkError>>(
    config: &TrainConfig,
    source: &Source,
    kept: Option<Weights>,
    keep_steps: u64,
    keep: &mut dyn FnMut(&Weights) -> Result<(), E>,
    watch: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
) -> Result<Weights, E> {
    let record = planned(config, source)?;
    let mut weights = match kept {
        Some(found) => resumed(found, &record)?,
        None => fresh(record),
    };
    let (head, start) = (weights.record.head.clone(), weights.record.step);
    if start >= config.steps {
        return Ok(weights);
    }
    let layout = config.network.layout(head.numbers());
    let model = ResNet::new(&config.network, head.numbers(), &device().autodiff());
    let mut model = with_values(model, &layout, &weights.values, false);
    let pass_steps = (images(source) / config.batch) as u64;

    std::thread::scope(|scope| {
        for batch in batches(scope, config, &head, source, start..config.steps, pass_steps)? {
            let batch = batch?;
            let step = batch.step;
            let progress;
            (model, progress) = learn(config, &head, &layout, model, batch, &mut weights)?;
            weights.record.step = step + 1;
            weights.record.course.add(&progress, config.steps);
            let stopped = watch(&progress).is_break();
            let done = step + 1 == config.steps;
            if stopped || done || (step + 1) % keep_steps.max(1) == 0 {
                keep_statistics(&model, &layout, &mut weights.values);
                if done {
                    weights.adam = None;
                }
                keep(&weights)?;
            }
            if stopped {
                break;
            }
        }
        Ok(weights)
    })
}

/// [`train`] with a file: what it holds goes on.
pub fn train_to(
    config: &TrainConfig,
    source: &Source,
    path: &Path,
    keep_steps: u64,
    watch: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
) -> Result<Weights, NetworkError> {
    let kept = if path.exists() { Some(Weights::read(path)?) } else { None };
    train(config, source, kept, keep_steps, &mut |weights| weights.write(path), watch)
}

/// Images of one pass.
fn images(source: &Source) -> usize {
    match source {
        Source::Rendered(trials) => trials.trials * trials.images,
        Source::Recorded(set) => set.poses().len(),
    }
}

/// What a training makes, before its first step.
fn planned(config: &TrainConfig, source: &Source) -> Result<NetworkRecord, NetworkError> {
    config.check()?;
    if let Source::Rendered(trials) = source {
        trials.check()?;
    }
    match source.head(config.orientation, config.bins) {
        Some(head) if images(source) >= config.batch => Ok(NetworkRecord {
            format: FORMAT,
            training: config.clone(),
            head,
            source: source.record(),
            step: 0,
            course: Course::default(),
        }),
        _ => Err(NetworkError::NoImages { what: "fill a batch" }),
    }
}

/// A network before its first step.
pub(crate) fn untrained(config: &TrainConfig, source: &Source) -> Result<Weights, NetworkError> {
    planned(config, source).map(fresh)
}

fn fresh(record: NetworkRecord) -> Weights {
    let layout = record.training.network.layout(record.head.numbers());
    let seed = record.training.seed;
    let values: Values = layout.iter().enumerate().map(|(number, slot)| slot.initial(number, seed)).collect();
    let trained = layout.iter().map(|slot| if slot.trained() { slot.count() } else { 0 });
    let adam = Some(Adam::new(trained.chain([3])));
    Weights { record, values, log_variances: vec![0.0; 3], adam }
}

/// What was kept, if it is of the same training.
fn resumed(found: Weights, wanted: &NetworkRecord) -> Result<Weights, NetworkError> {
    let differs = |what: &'static str| NetworkError::OtherTraining { what };
    if found.record.training != wanted.training {
        return Err(differs("configuration"));
    }
    if found.record.source != wanted.source || found.record.head != wanted.head {
        return Err(differs("set of images"));
    }
    Ok(found)
}

/// One step: the network after it, and how it went.
fn learn(
    config: &TrainConfig,
    head: &PoseHead,
    layout: &[Slot],
    model: ResNet,
    batch: Batch,
    weights: &mut Weights,
) -> Result<(ResNet, Progress), NetworkError> {
    let device = device().autodiff();
    let ResNetConfig { width_px, height_px, .. } = config.network;
    let images = TensorData::new(batch.pixels, [config.batch, 3, height_px, width_px]);
    let targets = TensorData::new(batch.targets, [config.batch, head.outputs()]);
    let told = model.forward(Tensor::from_data(images, &device));
    let (errors, parts) = losses(&told, &Tensor::from_data(targets, &device), head);
    let factors = config.weighting.weights(&weights.log_variances);
    let found = parts.clone().map(|loss| loss.map_or(0.0, scalar));
    let loss = found.iter().zip(factors).map(|(loss, factor)| loss * factor).sum::<f64>();
    let (true, Some(total)) = (loss.is_finite(), total(&parts, factors)) else {
        return Err(NetworkError::Diverged { step: batch.step, loss });
    };
    let mut slopes = gradients(&model, &mut total.backward());
    slopes.push(config.weighting.gradient(&found, &weights.log_variances, head));
    if let Some(adam) = &mut weights.adam {
        weights.values.push(std::mem::take(&mut weights.log_variances));
        adam.update(&mut weights.values, &slopes, config.learning_rate_at(batch.step));
        weights.log_variances = weights.values.pop().unwrap_or_default();
    }
    let model = with_values(model, layout, &weights.values, true);
    Ok((
        model,
        Progress {
            step: batch.step + 1,
            losses: errors.map(|error| error.map_or(0.0, scalar)),
            weights: factors,
        },
    ))
}

/// Copies the running statistics out of the network; all else is in `kept` already.
fn keep_statistics(model: &ResNet, layout: &[Slot], kept: &mut Values) {
    for ((slot, kept), now) in layout.iter().zip(kept).zip(values(model)) {
        if !slot.trained() {
            *kept = now;
        }
    }
}

fn scalar(tensor: Tensor<1>) -> f64 {
    numbers(tensor.detach()).first().map_or(f64::NAN, |&value| f64::from(value))
}
