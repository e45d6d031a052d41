//! How a command ends: exit codes as in docs/reliability.md, and errors with a remedy.

use std::fmt;
use std::process::ExitCode;

use mpgx_study::StudyError;
use mpgx_study::storage::StorageError;

/// Exit codes of `mpgx`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exit {
    Done = 0,
    /// Finished, but a claim failed or a seed did.
    NotAsExpected = 1,
    /// The scenario or the command line is wrong.
    BadInput = 2,
    Internal = 70,
    /// Cannot read or write.
    Io = 74,
    /// Run the same command again to resume.
    Interrupted = 75,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        ExitCode::from(exit as u8)
    }
}

/// Why a command could not do its work.
#[derive(Debug)]
pub struct Failure {
    pub exit: Exit,
    pub message: String,
    /// What to do about it.
    pub remedy: Option<String>,
}

impl Failure {
    pub fn new(exit: Exit, message: impl Into<String>) -> Self {
        Failure { exit, message: message.into(), remedy: None }
    }

    pub fn help(mut self, remedy: impl Into<String>) -> Self {
        self.remedy = Some(remedy.into());
        self
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.message)?;
        match &self.remedy {
            Some(remedy) => write!(f, "\n  help: {remedy}"),
            None => Ok(()),
        }
    }
}

impl From<StorageError> for Failure {
    fn from(error: StorageError) -> Self {
        Failure::new(Exit::Io, error.to_string())
    }
}

impl From<StudyError> for Failure {
    fn from(error: StudyError) -> Self {
        let exit = match error {
            StudyError::Storage(_) | StudyError::Damaged { .. } | StudyError::Unreadable { .. } => Exit::Io,
            StudyError::Unwritable { .. } | StudyError::InUse { .. } => Exit::Io,
            StudyError::Threads { .. } => Exit::Internal,
            _ => Exit::BadInput,
        };
        Failure::new(exit, error.to_string())
    }
}
