//! Seeing: a room to look at, data sets of images and poses, and measures of localisation.
//!
//! Everything made here is a function of its configuration and seeds, to the bit.

mod camera;
mod image;
mod pose;

pub use camera::CameraConfig;
pub use image::{Frame, Image};
pub use pose::{Pose, PoseQ, Quaternion};
