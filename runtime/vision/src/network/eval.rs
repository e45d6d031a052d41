//! How good a network is on images that it has not seen, beside what does not learn.

use super::cost::LookCost;
use super::error::NetworkError;
use super::localise::Localiser;
use super::pose_head::Estimate;
use crate::baseline::{Retrieval, dead_reckoning};
use crate::dataset::Tags;
use crate::image::{Frame, Image};
use crate::measure::{Answer, Evaluation, evaluate};
use crate::pose::PoseQ;
use crate::reliability::{Fix, Reliability};
use crate::trials::{Split, TrialsConfig};

/// Trials whose images retrieval knows: three of each lighting and kind of path.
const KNOWN_TRIALS: u32 = 27;
/// Of their frames it knows every sixth.
const KNOWN_EVERY: usize = 6;
/// Dead reckoning is told its true pose this often, s.
const TOLD_EVERY_S: f64 = 5.0;

/// The errors on the same held-out trials.
#[derive(Clone, Debug, PartialEq)]
pub struct HeldOut {
    pub network: Evaluation,
    /// The pose of the most similar image known.
    pub retrieval: Evaluation,
    /// Going on at constant velocity from poses that are told every five seconds.
    pub reckoning: Evaluation,
}

/// What a network tells of frames.
pub fn answers(localiser: &Localiser, tags: &Tags, frames: &[Frame]) -> Result<Vec<Answer>, NetworkError> {
    let images: Vec<Image> = frames.iter().map(|frame| frame.image.clone()).collect();
    let estimates = localiser.estimate(&images)?;
    let pairs = frames.iter().zip(estimates);
    let answer = |(frame, estimate): (&Frame, Estimate)| Answer {
        tags: tags.clone(),
        truth: frame.pose,
        estimate: estimate.pose,
    };
    Ok(pairs.map(answer).collect())
}

/// Measures a network on `count` trials that it has not seen, `trials.images` images of each.
pub fn held_out(localiser: &Localiser, trials: &TrialsConfig, count: u32) -> Result<HeldOut, NetworkError> {
    let mut known = Retrieval::default();
    for number in 0..KNOWN_TRIALS {
        let trial = trials.trial(Split::Training, number)?;
        for frame in (0..trial.frames).step_by(KNOWN_EVERY).map(|number| trial.frame(number)) {
            known.add(&frame.image, frame.pose);
        }
    }
    let (mut told, mut retrieved, mut reckoned) = (Vec::new(), Vec::new(), Vec::new());
    for number in 0..count {
        let trial = trials.trial(Split::HeldOut, number)?;
        let frames: Vec<Frame> = trials.frames(&trial).map(|frame| trial.frame(frame)).collect();
        told.extend(answers(localiser, &trial.tags, &frames)?);
        let answer = |truth: PoseQ, estimate: PoseQ| Answer { tags: trial.tags.clone(), truth, estimate };
        retrieved.extend(
            frames.iter().filter_map(|frame| Some(answer(frame.pose, known.estimate(&frame.image)?))),
        );
        if !trial.drives() {
            continue;
        }
        let course: Vec<(f64, PoseQ)> =
            (0..trial.frames).map(|number| (trial.time_s(number), trial.pose(number))).collect();
        let estimates = dead_reckoning(&course, TOLD_EVERY_S);
        reckoned.extend(course.iter().zip(estimates).map(|(&(_, truth), estimate)| answer(truth, estimate)));
    }
    let measured =
        |answers: &[Answer]| evaluate(answers).ok_or(NetworkError::NoImages { what: "measure with" });
    Ok(HeldOut {
        network: measured(&told)?,
        retrieval: measured(&retrieved)?,
        reckoning: measured(&reckoned)?,
    })
}

/// How wrong a network is on the images of such trials; where the robot drives, the images `next_s` later tell how alike
/// answers are that follow each other.
pub fn reliability(
    localiser: &Localiser,
    trials: &TrialsConfig,
    count: u32,
    next_s: f64,
) -> Result<Reliability, NetworkError> {
    let mut runs = Vec::new();
    for number in 0..count {
        let trial = trials.trial(Split::HeldOut, number)?;
        let errors = |frames: Vec<usize>| -> Result<Vec<[f64; 3]>, NetworkError> {
            let frames: Vec<Frame> = frames.into_iter().map(|frame| trial.frame(frame)).collect();
            let (poses, images): (Vec<PoseQ>, Vec<Image>) =
                frames.into_iter().map(|frame| (frame.pose, frame.image)).unzip();
            let estimates = localiser.estimate(&images)?;
            Ok(poses.iter().zip(&estimates).map(|(&truth, estimate)| error(truth, estimate)).collect())
        };
        let now: Vec<usize> = trials.frames(&trial).collect();
        let later = now.iter().filter_map(|&frame| trial.later(frame, next_s));
        let later = if trial.drives() { errors(later.collect())? } else { Vec::new() };
        let mut later = later.into_iter();
        runs.extend(errors(now)?.into_iter().map(|error| [error].into_iter().chain(later.next()).collect()));
    }
    Ok(Reliability::of(&runs))
}

/// What [`held_out`] and [`reliability`] take together, s, but for looking for the most similar image.
pub fn measuring_s(look: &LookCost, trials: &TrialsConfig, count: u32) -> Result<f64, NetworkError> {
    let frames = trials.trial(Split::Training, 0)?.frames;
    let known = KNOWN_TRIALS as usize * frames.div_ceil(KNOWN_EVERY);
    // Each in both, and in the second the image after it.
    let told = 3 * count as usize * trials.images.min(frames);
    let rooms = f64::from(KNOWN_TRIALS + 2 * count);
    Ok(rooms * look.trial_s + (known + told) as f64 * look.image_s + told as f64 * look.answer_s)
}

/// How far a planar robot's x, y and heading are told off, over the spreads.
fn error(truth: PoseQ, estimate: &Estimate) -> [f64; 3] {
    let (truth, Fix { pose: [x, y, heading], spread }) = (truth.planar(), estimate.fix());
    let turn = libm::remainder(heading - truth.heading_rad, std::f64::consts::TAU);
    let off = [x - truth.x_m, y - truth.y_m, turn];
    std::array::from_fn(|k| off[k] / spread[k])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::CameraConfig;

    /// Retrieval knows every sixth frame of 27 trials; three times eight images of four trials are answered for.
    #[test]
    fn measuring_takes_what_its_rooms_images_and_answers_take() {
        let camera = CameraConfig { width_px: 16, height_px: 16, ..CameraConfig::default() };
        let trials = TrialsConfig { camera, duration_s: 2.0, images: 8, ..TrialsConfig::default() };
        let frames = trials.trial(Split::Training, 0).unwrap().frames;
        let of = |look| measuring_s(&look, &trials, 4).unwrap();
        let nothing = LookCost::default();
        assert_eq!(of(LookCost { trial_s: 1.0, ..nothing }), 27.0 + 8.0);
        assert_eq!(of(LookCost { image_s: 1.0, ..nothing }), (27 * frames.div_ceil(6) + 3 * 4 * 8) as f64);
        assert_eq!(of(LookCost { answer_s: 1.0, ..nothing }), 96.0);
    }
}
