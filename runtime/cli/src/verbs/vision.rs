//! `mpgx vision`: recordings of a room to look at, and networks that tell from an image where the camera is.

#[cfg(feature = "vision")]
mod localise;
#[cfg(not(feature = "vision"))]
mod missing;
mod render;
#[cfg(feature = "vision")]
mod train;

#[cfg(not(feature = "vision"))]
use missing as localise;
#[cfg(not(feature = "vision"))]
use missing as train;

use clap::Subcommand;
use mpgx_vision::dataset::DatasetError;
use mpgx_vision::{CameraConfig, ConfigError, TrialsConfig};

use crate::failure::{Exit, Failure};

#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    part: Part,
}

#[derive(Subcommand)]
enum Part {
    /// Write recordings of trials: images, and where the camera was
    Render(render::Args),
    /// Train a network; run again to resume
    Train(train::Args),
    /// Measure a network on trials that it has not seen, or on recordings
    Eval(localise::EvalArgs),
    /// Tell where images were taken from
    Predict(localise::PredictArgs),
}

pub fn run(args: Args) -> Result<Exit, Failure> {
    match args.part {
        Part::Render(args) => render::run(args),
        Part::Train(args) => train::run(args),
        Part::Eval(args) => localise::eval(args),
        Part::Predict(args) => localise::predict(args),
    }
}

/// Trials in the built-in world, seen by a camera of `size` × `size` pixels.
fn trials(size: usize, seconds: f64, master: u64) -> TrialsConfig {
    let camera = CameraConfig { width_px: size, height_px: size, ..CameraConfig::default() };
    TrialsConfig { camera, duration_s: seconds, master, ..TrialsConfig::default() }
}

impl From<DatasetError> for Failure {
    fn from(error: DatasetError) -> Self {
        Failure::new(Exit::Io, error.to_string())
    }
}

impl From<ConfigError> for Failure {
    fn from(error: ConfigError) -> Self {
        Failure::new(Exit::BadInput, error.to_string())
    }
}
