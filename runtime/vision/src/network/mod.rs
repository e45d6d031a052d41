//! Residual networks that tell a camera's pose from an image, on burn.

mod adam;
mod architecture;
mod bins;
mod cost;
mod error;
mod eval;
mod feed;
mod images;
mod localise;
mod loss;
mod pose_head;
mod resnet;
mod tensors;
#[cfg(test)]
mod tests;
mod train;
mod weights;

pub use architecture::{ResNetConfig, Stem};
pub use cost::{LookCost, Size, epochs, look_cost, size, step_cost};
pub use error::NetworkError;
pub use eval::{HeldOut, answers, held_out, measuring_s, reliability};
pub use images::{ImageSet, Source, SourceRecord};
pub use localise::Localiser;
pub use loss::Weighting;
pub use pose_head::{Estimate, Orientation, Part, PoseHead};
pub use train::{Course, Progress, TrainConfig, train, train_to};
pub use weights::{NetworkRecord, Weights};
