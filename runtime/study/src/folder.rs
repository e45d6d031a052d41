//! The folder of a study.
//!
//! ```text
//! plan.ron  plan.hash  source/…        what runs, frozen; `plan.hash` is written last and tells what it is
//! cells/<id>/record.bin                the finished cell: written last and never again
//! localisers/<name>/…                  networks that tell poses
//! cells/<id>/policy.bin  timing.json   the trained policy; how long it took
//! cells/<id>/checkpoint.*  replay.log  of an unfinished cell
//! study.json                           the summary of a finished study
//! ```

use std::collections::BTreeMap;
use std::path::{Component, Path};

use mpgx_lang::plan::Plan;

use crate::cell::{Cell, CellId, cells};
use crate::error::StudyError;
use crate::hash::{Identity, study_hash};
use crate::localisers;
use crate::record::{CellRecord, LocaliserRecord, Timing};
use crate::sealed::{self, Damage, Kind};
use crate::storage::{Storage, StorageError};
use crate::summary::Summary;

const PLAN: &str = "plan.ron";
const IDENTITY: &str = "plan.hash";
const SOURCE: &str = "source";
const SUMMARY: &str = "study.json";

const RECORD: Kind = Kind { magic: *b"mpgx-rec", format: 3 };
const POLICY: Kind = Kind { magic: *b"mpgx-pol", format: 2 };

/// A study as it lies in its folder. An unfinished one has some of its records and no summary.
#[derive(Clone, Debug, PartialEq)]
pub struct Study {
    pub plan: Plan,
    /// Name and text of the scenario's files, the main one first.
    pub source: Vec<(String, String)>,
    pub records: BTreeMap<CellId, CellRecord>,
    pub timings: BTreeMap<CellId, Timing>,
    /// The networks that tell poses, by name.
    pub localisers: BTreeMap<String, LocaliserRecord>,
    pub summary: Option<Summary>,
}

/// Reads a study. Only the cells of its Plan count, so one with fewer seeds than it once had is the smaller
/// one; a summary of other records than these is none.
pub fn load(storage: &dyn Storage) -> Result<Study, StudyError> {
    let identity = read_identity(storage)?;
    let plan = read_plan(storage)?;
    let source = read_source(storage, &plan)?;
    let (mut records, mut timings) = (BTreeMap::new(), BTreeMap::new());
    for cell in cells(&plan)? {
        let Some(record) = read_record(storage, &cell, &identity)? else { continue };
        timings.insert(cell.id.clone(), read_timing(storage, &cell)?);
        records.insert(cell.id, record);
    }
    let localisers = localisers::read_records(storage, &plan, &identity)?;
    let summary = storage.read_if_there(SUMMARY)?;
    let summary = summary.and_then(|bytes| serde_json::from_slice::<Summary>(&bytes).ok());
    let summary = match summary {
        Some(summary) if study_hash(&plan, &records, &localisers, &summary)? == summary.study_hash => {
            Some(summary)
        }
        _ => None,
    };
    Ok(Study { plan, source, records, timings, localisers, summary })
}

/// The policy that a learner's cell ended with, as [`mpgx_learn::Policy`] reads it.
pub fn read_policy(storage: &dyn Storage, cell: &Cell) -> Result<Vec<u8>, StudyError> {
    let path = format!("cells/{}/policy.bin", cell.id);
    let bytes = storage.read(&path)?;
    let opened = sealed::open(POLICY, &cell.belongs_to(&read_identity(storage)?), &bytes);
    let [policy] = opened.map_err(|damage| damaged(&path, damage))?;
    Ok(policy.to_vec())
}

/// Freezes the Plan and its source, or finds them frozen by an earlier run; gives what is frozen, with the
/// seeds now asked for. Another Plan is refused; `identity` tells them apart.
pub(crate) fn freeze(
    storage: &dyn Storage,
    plan: &Plan,
    source: &[(String, String)],
    identity: impl Fn(&Plan) -> Identity,
) -> Result<Plan, StudyError> {
    let wanted = identity(plan).0.to_hex().to_string();
    if let Some(found) = storage.read_if_there(IDENTITY)? {
        if found != wanted.as_bytes() {
            let found = String::from_utf8_lossy(&found).chars().take(64).collect();
            return Err(StudyError::OtherPlan { found, wanted });
        }
        match read_plan(storage) {
            Ok(mut frozen) if identity(&frozen) == identity(plan) => {
                let wanted = (plan.first_seed, plan.seeds);
                if (frozen.first_seed, frozen.seeds) != wanted {
                    (frozen.first_seed, frozen.seeds) = wanted;
                    storage.write_atomic(PLAN, frozen.to_ron().as_bytes())?;
                }
                return Ok(frozen);
            }
            Err(StudyError::Storage(error)) if !matches!(error, StorageError::Missing { .. }) => {
                return Err(error.into());
            }
            _ => {}
        }
    }
    for name in storage.list(SOURCE)? {
        storage.remove(&format!("{SOURCE}/{name}"))?;
    }
    for (name, text) in source {
        let path = format!("{SOURCE}/{name}");
        if !Path::new(name).components().all(|part| matches!(part, Component::Normal(_))) || name.is_empty() {
            return Err(StudyError::SourceName { name: name.clone() });
        }
        if let Some((folder, _)) = path.rsplit_once('/') {
            storage.create_folder(folder)?;
        }
        storage.write_atomic(&path, text.as_bytes())?;
    }
    storage.write_atomic(PLAN, plan.to_ron().as_bytes())?;
    storage.write_atomic(IDENTITY, wanted.as_bytes())?;
    Ok(plan.clone())
}

/// The record of a cell, or `None` if it is not finished.
pub(crate) fn read_record(
    storage: &dyn Storage,
    cell: &Cell,
    study: &Identity,
) -> Result<Option<CellRecord>, StudyError> {
    let path = format!("cells/{}/record.bin", cell.id);
    let Some(bytes) = storage.read_if_there(&path)? else { return Ok(None) };
    let opened = sealed::open(RECORD, &cell.belongs_to(study), &bytes);
    let [record] = opened.map_err(|damage| damaged(&path, damage))?;
    postcard::from_bytes(record).map(Some).map_err(|_| damaged(&path, Damage::Broken))
}

/// How long a cell took; zero if that is not known.
pub(crate) fn read_timing(storage: &dyn Storage, cell: &Cell) -> Result<Timing, StudyError> {
    let bytes = storage.read_if_there(&format!("cells/{}/timing.json", cell.id))?;
    Ok(bytes.and_then(|bytes| serde_json::from_slice(&bytes).ok()).unwrap_or_default())
}

/// Writes all that a finished cell leaves. The record comes last: with it the cell is finished.
pub(crate) fn write_cell(
    storage: &dyn Storage,
    cell: &Cell,
    study: &Identity,
    record: &CellRecord,
    timing: &Timing,
    policy: Option<&[u8]>,
) -> Result<(), StudyError> {
    let folder = format!("cells/{}", cell.id);
    storage.create_folder(&folder)?;
    if let Some(policy) = policy {
        let sealed = sealed::seal(POLICY, &cell.belongs_to(study), &[policy]);
        storage.write_atomic(&format!("{folder}/policy.bin"), &sealed)?;
    }
    let timing = serde_json::to_vec(timing).map_err(|why| unwritable("timing.json", why))?;
    storage.write_atomic(&format!("{folder}/timing.json"), &timing)?;
    let record = postcard::to_stdvec(record).map_err(|why| unwritable("record.bin", why))?;
    let sealed = sealed::seal(RECORD, &cell.belongs_to(study), &[&record]);
    Ok(storage.write_atomic(&format!("{folder}/record.bin"), &sealed)?)
}

pub(crate) fn write_summary(storage: &dyn Storage, summary: &Summary) -> Result<(), StudyError> {
    let text = serde_json::to_vec_pretty(summary);
    let text = text.map_err(|why| unwritable(SUMMARY, why))?;
    Ok(storage.write_atomic(SUMMARY, &text)?)
}

pub(crate) fn read_identity(storage: &dyn Storage) -> Result<Identity, StudyError> {
    let hash = storage.read_if_there(IDENTITY)?.ok_or(StudyError::NoStudy { file: IDENTITY })?;
    blake3::Hash::from_hex(&hash).map(Identity).map_err(|why| unreadable(IDENTITY, why))
}

fn read_plan(storage: &dyn Storage) -> Result<Plan, StudyError> {
    let text = read_text(storage, PLAN)?;
    Plan::from_ron(&text).map_err(|why| unreadable(PLAN, why))
}

fn read_source(storage: &dyn Storage, plan: &Plan) -> Result<Vec<(String, String)>, StudyError> {
    let mut source = Vec::new();
    for name in storage.list(SOURCE)? {
        let text = read_text(storage, &format!("{SOURCE}/{name}"))?;
        source.push((name, text));
    }
    let main = plan.learners.first().map(|learner| learner.at.file.as_str());
    source.sort_by_key(|(name, _)| Some(name.as_str()) != main);
    Ok(source)
}

fn read_text(storage: &dyn Storage, path: &str) -> Result<String, StudyError> {
    String::from_utf8(storage.read(path)?).map_err(|why| unreadable(path, why))
}

fn damaged(path: &str, damage: Damage) -> StudyError {
    StudyError::Damaged { path: path.to_string(), damage }
}

fn unreadable(path: &str, why: impl std::fmt::Display) -> StudyError {
    StudyError::Unreadable { path: path.to_string(), cause: why.to_string() }
}

fn unwritable(what: &'static str, why: impl std::fmt::Display) -> StudyError {
    StudyError::Unwritable { what, cause: why.to_string() }
}
