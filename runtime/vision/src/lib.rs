//! Seeing: a room to look at, data sets of images and poses, and measures of localisation.
//!
//! Everything made here is a function of its configuration and seeds, to the bit.

mod augment;
pub mod baseline;
mod camera;
mod cast;
mod colour;
pub mod dataset;
pub mod declared;
mod exposure;
mod grain;
mod image;
mod light;
pub mod measure;
#[cfg(feature = "vision")]
pub mod network;
mod people;
mod pose;
mod props;
mod reliability;
mod room;
mod scattered;
mod solid;
mod texture;
mod trajectory;
mod trial;
mod trials;
mod world;

pub use augment::{AugmentConfig, augment, augment_light};
pub use camera::CameraConfig;
pub use cast::{Moving, Shot};
pub use image::{Frame, Image};
pub use light::TimeOfDay;
pub use pose::{Pose, PoseQ, Quaternion};
pub use reliability::{Fix, Reliability};
pub use scattered::ScatterConfig;
pub use trajectory::{Path, TrajectoryConfig, TrajectoryKind};
pub use trial::{Trial, TrialConfig};
pub use trials::{Split, TrialsConfig};
pub use world::{ConfigError, LandmarkConfig, LandmarkKind, Scene, TrialKey, WorldConfig};
