//! Checkpoints: what an unfinished cell leaves, so that training goes on as if nothing had happened.
//!
//! Two files take turns, so that a damaged one leaves the other. Replay rows are appended to a log and never
//! rewritten; a checkpoint tells how much of the log belongs to it and the hash of that.

use serde::{Deserialize, Serialize};

use crate::cell::Cell;
use crate::error::StudyError;
use crate::hash::Identity;
use crate::record::Training;
use crate::sealed::{self, Kind};
use crate::storage::Storage;

const KIND: Kind = Kind { magic: *b"mpgx-chk", format: 2 };
const SLOTS: [&str; 2] = ["checkpoint.0", "checkpoint.1"];
const LOG: &str = "replay.log";

/// How far training has come, beside the learner itself.
///
/// The episode that is going on needs no state of the world: the world is a function of the episode's key and
/// of the actions taken.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Course {
    /// Environment steps done.
    pub steps: u64,
    /// Replay rows pushed: one a step, or one for each member that shares the policy.
    pub rows: u64,
    /// The episode that is going on.
    pub episode: u32,
    /// The actions taken in it, one after another.
    pub actions: Vec<f32>,
    pub training: Training,
    /// Seconds of training so far, over all runs.
    pub seconds: f64,
}

/// What a checkpoint holds, read back.
pub(crate) struct Restored {
    pub course: Course,
    pub learner: Vec<u8>,
    /// All replay rows pushed so far.
    pub rows: Vec<u8>,
}

/// The checkpoints of one cell.
pub(crate) struct Checkpoints<'a> {
    storage: &'a dyn Storage,
    folder: String,
    belongs_to: blake3::Hash,
    /// The slot that is written next.
    slot: usize,
    /// Of the replay log: its length and the hash of its content.
    length: u64,
    content: blake3::Hasher,
}

/// The part of a checkpoint about the replay log.
#[derive(Serialize, Deserialize)]
struct Log {
    length: u64,
    hash: [u8; 32],
}

impl<'a> Checkpoints<'a> {
    /// For a cell that begins anew.
    pub fn new(
        storage: &'a dyn Storage,
        cell: &Cell,
        study: &Identity,
    ) -> Result<Checkpoints<'a>, StudyError> {
        let folder = format!("cells/{}", cell.id);
        storage.create_folder(&folder)?;
        let belongs_to = cell.belongs_to(study);
        Ok(Checkpoints { storage, folder, belongs_to, slot: 0, length: 0, content: blake3::Hasher::new() })
    }

    /// The latest checkpoint that is whole, and what was wrong with a later one, if anything.
    pub fn load(&mut self) -> Result<(Option<Restored>, Vec<String>), StudyError> {
        let mut warnings = Vec::new();
        let mut found = Vec::new();
        for (slot, name) in SLOTS.iter().enumerate() {
            let path = format!("{}/{name}", self.folder);
            let Some(bytes) = self.storage.read_if_there(&path)? else { continue };
            match self.read(&bytes) {
                Ok((course, learner, log)) => found.push((slot, course, learner, log)),
                Err(why) => warnings.push(format!("passed over `{path}`: {why}")),
            }
        }
        found.sort_by_key(|(_, course, ..)| std::cmp::Reverse(course.steps));
        if found.is_empty() {
            return Ok((None, warnings));
        }
        let path = format!("{}/{LOG}", self.folder);
        let mut rows = self.storage.read_if_there(&path)?.unwrap_or_default();
        for (slot, course, learner, log) in found {
            let length = usize::try_from(log.length).unwrap_or(usize::MAX);
            if rows.get(..length).is_some_and(|rows| blake3::hash(rows) == log.hash) {
                rows.truncate(length);
                self.slot = 1 - slot;
                self.length = log.length;
                self.content.update(&rows);
                return Ok((Some(Restored { course, learner, rows }), warnings));
            }
            warnings.push(format!("passed over `{}/{}`: `{path}` is damaged", self.folder, SLOTS[slot]));
        }
        Ok((None, warnings))
    }

    fn read(&self, bytes: &[u8]) -> Result<(Course, Vec<u8>, Log), sealed::Damage> {
        let [course, learner, log] = sealed::open(KIND, &self.belongs_to, bytes)?;
        let broken = |_| sealed::Damage::Broken;
        let course = postcard::from_bytes(course).map_err(broken)?;
        let log = postcard::from_bytes(log).map_err(broken)?;
        Ok((course, learner.to_vec(), log))
    }

    /// Writes a checkpoint; `rows` are the replay rows pushed since the one before.
    pub fn save(&mut self, course: &Course, learner: &[u8], rows: &[u8]) -> Result<(), StudyError> {
        let path = format!("{}/{LOG}", self.folder);
        self.length = self.storage.append(&path, self.length, rows)?;
        self.content.update(rows);
        let log = Log { length: self.length, hash: *self.content.finalize().as_bytes() };
        let unwritable =
            |why: postcard::Error| StudyError::Unwritable { what: "checkpoint", cause: why.to_string() };
        let course = postcard::to_stdvec(course).map_err(unwritable)?;
        let log = postcard::to_stdvec(&log).map_err(unwritable)?;
        let bytes = sealed::seal(KIND, &self.belongs_to, &[&course, learner, &log]);
        self.storage.write_atomic(&format!("{}/{}", self.folder, SLOTS[self.slot]), &bytes)?;
        self.slot = 1 - self.slot;
        Ok(())
    }
}

/// Removes what a finished cell no longer needs. What cannot be removed stays; it does no harm.
pub(crate) fn clear(storage: &dyn Storage, cell: &Cell) {
    let folder = format!("cells/{}", cell.id);
    let Ok(files) = storage.list(&folder) else { return };
    for file in files {
        // A write that was cut off leaves `.tmp`.
        let name = file.strip_suffix(".tmp").unwrap_or(&file);
        if SLOTS.contains(&name) || name == LOG {
            let _ = storage.remove(&format!("{folder}/{file}"));
        }
    }
}
