//! Recordings: images on disk and where the camera was.

mod error;
mod file;
mod pair;
mod recording;
mod seven_scenes;
mod tum;

pub use error::DatasetError;
pub use file::{png_bytes, read_png, write_png};
pub use pair::Truth;
pub use recording::{Entry, Recording, Tags};
pub use seven_scenes::read_seven_scenes;
pub use tum::{read_truth, read_tum, write_tum};
