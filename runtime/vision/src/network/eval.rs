//! How good a network is on images that it has not seen: the paper's table, overall and for each lighting and kind of path.

use std::collections::BTreeMap;

use serde::Serialize;

use super::error::NetworkError;
use super::localise::Localiser;
use crate::dataset::Tags;
use crate::image::{Frame, Image};
use crate::measure::{Localisation, Ranges, measure, measure_groups};
use crate::pose::PoseQ;

/// A frame's true pose and what a network, or something to compare it with, told of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    pub tags: Tags,
    pub truth: PoseQ,
    pub estimate: PoseQ,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Evaluation {
    pub all: Localisation,
    pub by_lighting: BTreeMap<String, Localisation>,
    pub by_trajectory: BTreeMap<String, Localisation>,
}

/// What a network tells of frames.
pub fn answers(localiser: &Localiser, tags: &Tags, frames: &[Frame]) -> Result<Vec<Answer>, NetworkError> {
    let images: Vec<Image> = frames.iter().map(|frame| frame.image.clone()).collect();
    let estimates = localiser.estimate(&images)?;
    let pairs = frames.iter().zip(estimates);
    let answer = |(frame, estimate): (&Frame, super::Estimate)| Answer {
        tags: tags.clone(),
        truth: frame.pose,
        estimate: estimate.pose,
    };
    Ok(pairs.map(answer).collect())
}

/// The errors of answers, in percent of the ranges of all true poses among them.
pub fn evaluate(answers: &[Answer]) -> Result<Evaluation, NetworkError> {
    let ranges = Ranges::of(answers.iter().map(|answer| &answer.truth));
    let ranges = ranges.ok_or(NetworkError::NoImages { what: "measure with" })?;
    let pairs: Vec<(PoseQ, PoseQ)> = answers.iter().map(|answer| (answer.truth, answer.estimate)).collect();
    let grouped = |name: fn(&Tags) -> &String| {
        let named = answers.iter().map(|answer| (name(&answer.tags).clone(), answer.truth, answer.estimate));
        let groups = measure_groups(named, &ranges).into_iter();
        groups.filter_map(|(name, found)| Some((name, found?))).collect()
    };
    Ok(Evaluation {
        all: measure(&pairs, &ranges).ok_or(NetworkError::NotFinite)?,
        by_lighting: grouped(|tags| &tags.lighting),
        by_trajectory: grouped(|tags| &tags.trajectory),
    })
}
