//! Image retrieval: the pose of the most similar picture. Networks that regress poses tend to do no better (Sattler et al.
//! 2019).

use crate::image::Image;
use crate::pose::PoseQ;

/// Side of the small pictures that are compared.
const SIDE_PX: usize = 16;

/// Small grey pictures with the poses that they were taken from.
#[derive(Clone, Debug, Default)]
pub struct Retrieval {
    known: Vec<(Vec<f32>, PoseQ)>,
}

impl Retrieval {
    pub fn add(&mut self, image: &Image, pose: PoseQ) {
        self.known.push((signature(image), pose));
    }

    /// The pose of the known image with the least sum of squared differences (the first of equals); nothing if none is
    /// known.
    pub fn estimate(&self, image: &Image) -> Option<PoseQ> {
        let wanted = signature(image);
        let away = |known: &[f32]| known.iter().zip(&wanted).map(|(a, b)| (a - b) * (a - b)).sum::<f32>();
        let scored = self.known.iter().map(|(known, pose)| (away(known), pose));
        scored.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, pose)| *pose)
    }
}

/// 16 × 16 greys with mean 0 and variance 1, so that the exposure does not count.
fn signature(image: &Image) -> Vec<f32> {
    let grey = image.resized(SIDE_PX, SIDE_PX).grey();
    let count = grey.len() as f32;
    let mean = grey.iter().sum::<f32>() / count;
    let variance = grey.iter().map(|value| (value - mean) * (value - mean)).sum::<f32>() / count;
    let deviation = variance.sqrt().max(1e-3);
    grey.iter().map(|value| (value - mean) / deviation).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pose::Quaternion;

    #[test]
    fn the_most_similar_picture_is_found_in_other_light() {
        let picture = |slope: usize, light: usize| {
            let rgb =
                (0..32 * 32 * 3).map(|byte| (byte / 3 % 32 * slope + byte / 96 * (4 - slope) + light) as u8);
            Image { width: 32, height: 32, rgb: rgb.collect() }
        };
        let pose = |x: f64| PoseQ { position_m: [x, 0.0, 0.0], quaternion: Quaternion::IDENTITY };
        let mut known = Retrieval::default();
        assert_eq!(known.estimate(&picture(1, 0)), None);
        for slope in 0..4 {
            known.add(&picture(slope, 0), pose(slope as f64));
        }
        for slope in 0..4 {
            assert_eq!(known.estimate(&picture(slope, 90)), Some(pose(slope as f64)));
        }
    }
}
