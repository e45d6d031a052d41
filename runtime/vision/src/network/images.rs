//! Images to learn from: recordings in memory, or trials rendered anew for every epoch.

use std::sync::Arc;

use mpgx_random::{Address, Purpose};
use serde::{Deserialize, Serialize};

use super::error::NetworkError;
use super::pose_head::{Orientation, PoseHead};
use crate::dataset::Recording;
use crate::image::Image;
use crate::pose::{Pose, PoseQ};
use crate::trials::{Split, TrialsConfig};

/// Images of one size with the poses of their cameras.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImageSet {
    width_px: usize,
    height_px: usize,
    /// Three a pixel.
    bytes: Vec<u8>,
    poses: Vec<PoseQ>,
}

impl ImageSet {
    pub fn new(width_px: usize, height_px: usize) -> ImageSet {
        ImageSet { width_px, height_px, ..ImageSet::default() }
    }

    /// All images of recordings, brought to one size.
    pub fn read(
        recordings: &[Recording],
        width_px: usize,
        height_px: usize,
    ) -> Result<ImageSet, NetworkError> {
        let mut set = ImageSet::new(width_px, height_px);
        for frame in recordings.iter().flat_map(Recording::frames) {
            let frame = frame?;
            set.add(&frame.image, frame.pose);
        }
        Ok(set)
    }

    pub fn add(&mut self, image: &Image, pose: PoseQ) {
        self.bytes.extend_from_slice(&fitted(image, self.width_px, self.height_px).rgb);
        self.poses.push(pose);
    }

    pub fn poses(&self) -> &[PoseQ] {
        &self.poses
    }

    /// The bytes of an image; none beyond the last.
    pub(crate) fn rgb(&self, number: usize) -> &[u8] {
        let count = 3 * self.width_px * self.height_px;
        self.bytes.get(number * count..(number + 1) * count).unwrap_or_default()
    }

    pub fn image(&self, number: usize) -> Image {
        Image { width: self.width_px, height: self.height_px, rgb: self.rgb(number).to_vec() }
    }

    /// A hash of all images and poses.
    fn hash(&self) -> String {
        let mut hasher = blake3::Hasher::new();
        hasher.update(&self.bytes);
        for pose in &self.poses {
            let q = pose.quaternion;
            for value in pose.position_m.into_iter().chain([q.w, q.x, q.y, q.z]) {
                hasher.update(&value.to_le_bytes());
            }
        }
        hasher.finalize().to_hex().to_string()
    }
}

/// An image in the size that a network looks at.
pub(crate) fn fitted(image: &Image, width_px: usize, height_px: usize) -> Image {
    if (image.width, image.height) == (width_px, height_px) {
        return image.clone();
    }
    image.resized(width_px, height_px)
}

/// Where the images of an epoch come from.
#[derive(Clone, Debug)]
pub enum Source {
    /// The same in every epoch.
    Recorded(Arc<ImageSet>),
    /// New trials in every epoch.
    Rendered(Box<TrialsConfig>),
}

/// What weights remember of the images that they were learnt from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SourceRecord {
    Recorded { images: usize, hash: String },
    Rendered(Box<TrialsConfig>),
}

impl Source {
    /// The images of an epoch.
    pub(crate) fn epoch(&self, epoch: u32) -> Result<Arc<ImageSet>, NetworkError> {
        match self {
            Source::Recorded(set) => Ok(set.clone()),
            Source::Rendered(config) => {
                let mut set = ImageSet::new(config.camera.width_px, config.camera.height_px);
                let first = epoch.wrapping_mul(config.trials as u32);
                for number in 0..config.trials as u32 {
                    let trial = config.trial(Split::Training, first.wrapping_add(number))?;
                    for frame in config.frames(&trial) {
                        let frame = trial.frame(frame);
                        set.add(&frame.image, frame.pose);
                    }
                }
                Ok(Arc::new(set))
            }
        }
    }

    /// How often the images of an epoch are learnt from.
    pub(crate) fn passes(&self) -> u64 {
        match self {
            Source::Recorded(_) => 1,
            Source::Rendered(config) => config.passes as u64,
        }
    }

    /// What a network for these images tells; nothing without images.
    pub(crate) fn head(&self, orientation: Orientation, bins: usize) -> Option<PoseHead> {
        match self {
            Source::Recorded(set) => PoseHead::of(set.poses(), &[], orientation, bins),
            Source::Rendered(trials) => Some(PoseHead {
                orientation,
                bins,
                x_m: around(trials.trajectory.middle_m[0], trials.trajectory.half_x_m),
                y_m: around(trials.trajectory.middle_m[1], trials.trajectory.half_y_m),
                mount: trials.camera.pose(Pose::default()),
                landmarks_m: trials
                    .world
                    .landmarks
                    .iter()
                    .map(|mark| [mark.pose.x_m, mark.pose.y_m])
                    .collect(),
            }),
        }
    }

    pub(crate) fn record(&self) -> SourceRecord {
        match self {
            Source::Recorded(set) => SourceRecord::Recorded { images: set.poses().len(), hash: set.hash() },
            Source::Rendered(config) => SourceRecord::Rendered(config.clone()),
        }
    }
}

fn around(middle: f64, half: f64) -> [f64; 2] {
    [middle - half, middle + half]
}

/// The order of a pass over images: every one once.
pub(crate) fn shuffled(count: usize, seed: u64, pass: u32) -> Vec<usize> {
    let purpose = Purpose::Replay;
    let address = Address { master: seed, purpose, protocol: 0, part: 0, seed: 0, episode: pass, step: 0 };
    let mut stream = address.stream();
    let mut order: Vec<usize> = (0..count).collect();
    for last in (1..count).rev() {
        order.swap(last, stream.below(last as u64 + 1) as usize);
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::CameraConfig;

    #[test]
    fn every_epoch_has_an_order_of_its_own_with_every_image_once() {
        let (first, second) = (shuffled(50, 1, 0), shuffled(50, 1, 1));
        assert_ne!(first, second);
        assert_eq!(first, shuffled(50, 1, 0));
        for mut order in [first, second] {
            order.sort_unstable();
            assert!(order.into_iter().eq(0..50));
        }
    }

    #[test]
    fn every_epoch_renders_its_own_trials() {
        let camera = CameraConfig { width_px: 16, height_px: 16, samples: 1, ..CameraConfig::default() };
        let config =
            TrialsConfig { camera, duration_s: 2.0, images: 3, trials: 2, ..TrialsConfig::default() };
        let source = Source::Rendered(Box::new(config.clone()));
        let (first, second) = (source.epoch(0).unwrap(), source.epoch(1).unwrap());
        assert_eq!((first.poses().len(), first.rgb(5).len(), first.rgb(6).len()), (6, 768, 0));
        assert_ne!(first, second);
        let third = config.trial(Split::Training, 2).unwrap();
        assert_eq!(third.frame(config.frames(&third).next().unwrap()).image.rgb, second.rgb(0));
    }
}
