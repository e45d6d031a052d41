//! What can be wrong with a network and its training.

use std::io;
use std::path::PathBuf;

use thiserror::Error;

use crate::dataset::DatasetError;
use crate::world::ConfigError;

#[derive(Debug, Error)]
pub enum NetworkError {
    #[error("{}: {source}", path.display())]
    Io { path: PathBuf, source: io::Error },

    #[error("{file} holds no network: {why}")]
    BadWeights { file: String, why: String },

    #[error("the network that was kept was made by another training: its {what} differs")]
    OtherTraining { what: &'static str },

    #[error("training diverged in step {step}: the loss is {loss}")]
    Diverged { step: u64, loss: f64 },

    #[error("there are no images to {what}")]
    NoImages { what: &'static str },

    #[error("cannot start threads: {0}")]
    Threads(io::Error),

    #[error("an estimate is not a number")]
    NotFinite,

    #[error(transparent)]
    Config(#[from] ConfigError),

    #[error(transparent)]
    Dataset(#[from] DatasetError),
}
