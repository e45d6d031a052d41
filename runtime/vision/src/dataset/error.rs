//! What can be wrong with a recording.

use std::io;
use std::path::PathBuf;

use thiserror::Error;

/// Why a recording cannot be read or written. Every one names the file, and the line where there is one.
#[derive(Debug, Error)]
pub enum DatasetError {
    #[error("{} is missing{}", path.display(), needed_by(by))]
    Missing { path: PathBuf, by: Option<String> },

    #[error("{}: {source}", path.display())]
    Io { path: PathBuf, source: io::Error },

    #[error("{} has {bytes} bytes; more than {limit} are not read", path.display())]
    TooLarge { path: PathBuf, bytes: u64, limit: u64 },

    #[error("{} is no image that can be read: {why}", path.display())]
    BadImage { path: PathBuf, why: String },

    #[error("{}, line {line}: {what}", path.display())]
    BadLine { path: PathBuf, line: usize, what: String },

    #[error("{}: {what}", path.display())]
    Misnamed { path: PathBuf, what: String },

    #[error("{} holds no {what}", path.display())]
    Empty { path: PathBuf, what: &'static str },

    #[error("no pose is known for {time_s} s: {why}")]
    NoPose { time_s: f64, why: String },
}

fn needed_by(by: &Option<String>) -> String {
    by.as_ref().map_or(String::new(), |by| format!("; {by} needs it"))
}
