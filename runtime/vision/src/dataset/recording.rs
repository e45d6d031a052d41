//! A recording, whatever its layout on disk.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::error::DatasetError;
use super::file::read_png_for;
use crate::image::Frame;
use crate::pose::PoseQ;

/// What a trial was: results are told for each lighting and each kind of trajectory.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tags {
    pub lighting: String,
    pub trajectory: String,
}

/// Images with their poses; the images stay on disk until they are asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    pub folder: PathBuf,
    /// If the recording says.
    pub tags: Option<Tags>,
    /// In the order of their times.
    pub entries: Vec<Entry>,
    /// Images left out, because no pose was measured near their times.
    pub without_pose: usize,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    pub image: PathBuf,
    /// Of the camera.
    pub pose: PoseQ,
    pub time_s: f64,
    /// The file, and the line of it, that names the image.
    pub(crate) named_by: Option<String>,
}

impl Entry {
    /// Reads the image.
    pub fn frame(&self) -> Result<Frame, DatasetError> {
        let image = read_png_for(&self.image, self.named_by.as_deref())?;
        Ok(Frame { image, pose: self.pose, time_s: self.time_s })
    }
}

impl Recording {
    /// All frames, read one after another.
    pub fn frames(&self) -> impl Iterator<Item = Result<Frame, DatasetError>> {
        self.entries.iter().map(Entry::frame)
    }
}
