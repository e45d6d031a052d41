//! Why a study cannot run, go on or be read.

use mpgx_lang::plan::Place;
use mpgx_sim::{Fault, SimError};
use thiserror::Error;

use crate::sealed::Damage;
use crate::storage::StorageError;

/// The error of this crate. A cell that diverges is no error: it is a record with a
/// [`Failure`](crate::record::Failure).
#[derive(Clone, Debug, PartialEq, Error)]
pub enum StudyError {
    #[error(transparent)]
    Storage(#[from] StorageError),

    #[error("{cause}{}", suffix(at))]
    Plan { cause: String, at: Place },

    #[error("`{label}` cannot name a folder; use letters, digits and `_-=.,`, up to 100{}", suffix(at))]
    Label { label: String, at: Place },

    #[error("two {what} are called `{label}`; give one another name{}", suffix(at))]
    SameLabel { what: &'static str, label: String, at: Place },

    #[error("the source file `{name}` cannot be kept under that name; give it a plain relative path")]
    SourceName { name: String },

    #[error(
        "the folder holds another study (hash {found}, this one has {wanted}); choose another folder, or undo the change"
    )]
    OtherPlan { found: String, wanted: String },

    #[error(
        "the study is in use by process {pid} on {host} since {since}; wait for it, or remove `{file}` if that process is gone"
    )]
    InUse { pid: u32, host: String, since: String, file: &'static str },

    #[error("there is no study here: `{file}` is missing; run a scenario first, or choose its folder")]
    NoStudy { file: &'static str },

    #[error("`{path}` cannot be used: {damage}; run the study again to make it anew")]
    Damaged { path: String, damage: Damage },

    #[error("`{path}` cannot be read: {cause}; run the study again to make it anew")]
    Unreadable { path: String, cause: String },

    #[error("`{what}` cannot be written: {cause}")]
    Unwritable { what: &'static str, cause: String },

    #[error("cannot start {threads} threads: {cause}; ask for fewer")]
    Threads { threads: usize, cause: String },
}

/// ` (file:line:column)`, nothing where the place is unknown.
fn suffix(at: &Place) -> String {
    if at.file.is_empty() { String::new() } else { format!(" ({})", written(at)) }
}

/// `file:line:column`; nothing where the place is unknown.
pub(crate) fn written(at: &Place) -> String {
    if at.file.is_empty() { String::new() } else { format!("{}:{}:{}", at.file, at.line, at.column) }
}

/// Why work on a cell ended before its time.
pub(crate) enum Halt {
    Interrupted,
    /// This cell is worth nothing; the others go on.
    Fault(Fault),
    /// The whole run cannot go on.
    Error(StudyError),
}

impl From<StudyError> for Halt {
    fn from(error: StudyError) -> Halt {
        Halt::Error(error)
    }
}

impl From<Fault> for Halt {
    fn from(fault: Fault) -> Halt {
        Halt::Fault(fault)
    }
}

/// An episode that cannot begin.
pub(crate) fn no_start(error: SimError) -> Fault {
    let at = match &error {
        SimError::StartsRejected { at, .. } | SimError::StartNotFinite { at, .. } => at.clone(),
        _ => Place::default(),
    };
    Fault { cause: error.to_string(), at }
}
