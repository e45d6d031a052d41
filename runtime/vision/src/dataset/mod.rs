//! Recordings: images on disk and where the camera was.

mod error;
mod file;

pub use error::DatasetError;
pub use file::{read_png, write_png};
