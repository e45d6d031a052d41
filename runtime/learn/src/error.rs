/// Why a learner cannot be made, restored or trained further.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LearnError {
    #[error("there is no algorithm `{name}`; there are {}", crate::ALGORITHMS.join(", "))]
    UnknownAlgorithm { name: String },
    #[error("`{algorithm}` has no setting `{setting}`")]
    UnknownSetting { algorithm: String, setting: String },
    #[error("`{algorithm}` needs the setting `{setting}`")]
    MissingSetting { algorithm: String, setting: &'static str },
    #[error("the setting `{setting}` must be {expected}, not {found}")]
    WrongSetting { setting: &'static str, expected: String, found: String },
    #[error("the {part} has no entries")]
    Empty { part: &'static str },
    #[error("the {part} has {found} entries, not {expected}")]
    WrongLength { part: &'static str, expected: usize, found: usize },
    #[error("{quantity} is {value} at update {update}")]
    Diverged { quantity: &'static str, value: f32, update: u64 },
    #[error("the saved learner has {found} bytes, not {expected}: it is of another learner or damaged")]
    WrongSize { expected: usize, found: usize },
    #[error("the saved learner cannot be: {reason}")]
    Damaged { reason: &'static str },
    #[error("the replay holds {found} of {expected} transitions; restore the others first")]
    ReplayMissing { expected: u64, found: u64 },
    #[error("this CPU has no vector width `{name}`")]
    NoSuchSimd { name: String },
}
