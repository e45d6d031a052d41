//! Batches in the order of their steps, made on threads beside the training.

use std::ops::Range;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{Builder, Scope};

use mpgx_random::{Address, Purpose};

use super::error::NetworkError;
use super::images::{ImageSet, Source, shuffled};
use super::pose_head::PoseHead;
use super::train::TrainConfig;
use crate::augment::{AugmentConfig, augment_light};

/// What a step learns from.
pub(crate) struct Batch {
    pub step: u64,
    /// `[batch, 3, height, width]`.
    pub pixels: Vec<f32>,
    /// `[batch, outputs]`.
    pub targets: Vec<f32>,
}

type Made<T> = Result<T, NetworkError>;

/// The batches of some steps: each is a function of its step. One thread renders the epoch after the one that another
/// cuts into batches, `pass_steps` of them in each pass over its images. Both end when the receiver is dropped.
pub(crate) fn batches<'scope, 'env>(
    scope: &'scope Scope<'scope, 'env>,
    config: &'env TrainConfig,
    head: &'env PoseHead,
    source: &'env Source,
    steps: Range<u64>,
    pass_steps: u64,
) -> Made<Receiver<Made<Batch>>> {
    let (send_set, sets) = sync_channel(0);
    let (send_batch, batches) = sync_channel(4);
    let epoch_steps = pass_steps * source.passes();
    let epochs = steps.start / epoch_steps..steps.end.div_ceil(epoch_steps);
    let render = move || {
        // A failed send means that nobody learns any more.
        let _ = epochs.map(|epoch| source.epoch(epoch as u32)).try_for_each(|set| send_set.send(set));
    };
    let cut = move || cut(config, head, &sets, steps, [pass_steps, epoch_steps], &send_batch);
    Builder::new().spawn_scoped(scope, render).map_err(NetworkError::Threads)?;
    Builder::new().spawn_scoped(scope, cut).map_err(NetworkError::Threads)?;
    Ok(batches)
}

fn cut(
    config: &TrainConfig,
    head: &PoseHead,
    sets: &Receiver<Made<Arc<ImageSet>>>,
    steps: Range<u64>,
    [pass_steps, epoch_steps]: [u64; 2],
    batches: &SyncSender<Made<Batch>>,
) {
    let mut step = steps.start;
    for set in sets {
        let set = match set {
            Ok(set) => set,
            Err(error) => {
                let _ = batches.send(Err(error));
                return;
            }
        };
        let end = steps.end.min((step / epoch_steps + 1) * epoch_steps);
        let mut order = Vec::new();
        while step < end {
            let (pass, first) = (step / pass_steps, step % pass_steps);
            if order.is_empty() || first == 0 {
                order = shuffled(set.poses().len(), config.seed, pass as u32);
            }
            let start = first as usize * config.batch;
            let chosen = order.get(start..start + config.batch).unwrap_or_default();
            if batches.send(Ok(batch(config, head, &set, chosen, step))).is_err() {
                return;
            }
            step += 1;
        }
    }
}

fn batch(config: &TrainConfig, head: &PoseHead, set: &ImageSet, chosen: &[usize], step: u64) -> Batch {
    let (width, height) = (config.network.width_px, config.network.height_px);
    let mut batch = Batch { step, pixels: Vec::new(), targets: Vec::new() };
    for (slot, &image) in chosen.iter().enumerate() {
        let address = Address {
            master: config.seed,
            purpose: Purpose::Augment,
            protocol: 0,
            part: 0,
            seed: 0,
            episode: 0,
            step: step * config.batch as u64 + slot as u64,
        };
        let mut light = light(set.rgb(image));
        if config.augment != AugmentConfig::NONE {
            augment_light(&mut light, width, height, &config.augment, address);
        }
        batch.pixels.extend(planes(&light));
        batch.targets.extend(set.poses().get(image).map(|pose| head.encode(pose)).unwrap_or_default());
    }
    batch
}

/// Bytes as numbers in 0..=1.
pub(crate) fn light(rgb: &[u8]) -> Vec<f32> {
    rgb.iter().map(|&byte| f32::from(byte) / 255.0).collect()
}

/// Red, then green, then blue, brought to mean 0 and variance 1 together, so that the exposure does not count.
pub(crate) fn planes(light: &[f32]) -> Vec<f32> {
    let count = light.len().max(1) as f32;
    let mean = light.iter().sum::<f32>() / count;
    let variance = light.iter().map(|value| (value - mean) * (value - mean)).sum::<f32>() / count;
    let scale = 1.0 / variance.sqrt().max(1e-3);
    (0..3)
        .flat_map(|channel| light.iter().skip(channel).step_by(3))
        .map(|value| (value - mean) * scale)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: mean 1/2, deviation 1/2.
    #[test]
    fn an_image_becomes_planes_with_mean_0_and_variance_1() {
        assert_eq!(planes(&[0.0, 1.0, 0.0, 1.0, 0.0, 1.0]), [-1.0, 1.0, 1.0, -1.0, -1.0, 1.0]);
        assert_eq!(planes(&[0.5; 3]), [0.0; 3]);
    }
}
