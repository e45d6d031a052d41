//! The two hashes of a study: what it is of, and what came out.

use std::collections::BTreeMap;

use mpgx_lang::plan::Plan;

use crate::cell::CellId;
use crate::error::StudyError;
use crate::record::{CellRecord, LocaliserRecord};
use crate::sealed::NUMERICS_VERSION;
use crate::summary::Summary;

/// What decides every cell: the Plan without its choice of seeds, the master seed and the numerics version.
/// Two runs with the same identity may share a folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Identity(pub blake3::Hash);

impl Identity {
    pub fn of(plan: &Plan, master: u64) -> Identity {
        let meaning = mpgx_lang::meaning_hash(&Plan { first_seed: 0, seeds: 0, ..plan.clone() });
        let mut hasher = blake3::Hasher::new();
        hasher.update(meaning.as_bytes());
        hasher.update(&master.to_le_bytes());
        hasher.update(&NUMERICS_VERSION.to_le_bytes());
        Identity(hasher.finalize())
    }

    /// Of an evaluation of what another study learned.
    pub fn learned_in(self, trained: Option<&Identity>) -> Identity {
        let Some(trained) = trained else { return self };
        let mut hasher = blake3::Hasher::new();
        hasher.update(self.0.as_bytes());
        hasher.update(trained.0.as_bytes());
        Identity(hasher.finalize())
    }
}

/// The hash of all that must be the same on every machine and for every schedule: the Plan's meaning, the
/// records in order, the statistics. Times, versions and places in the source are no part of it.
pub fn study_hash(
    plan: &Plan,
    records: &BTreeMap<CellId, CellRecord>,
    localisers: &BTreeMap<String, LocaliserRecord>,
    statistics: &Summary,
) -> Result<String, StudyError> {
    let mut hasher = blake3::Hasher::new();
    let mut add = |bytes: &[u8]| {
        hasher.update(&(bytes.len() as u64).to_le_bytes());
        hasher.update(bytes);
    };
    let unwritable =
        |why: postcard::Error| StudyError::Unwritable { what: "the study's hash", cause: why.to_string() };
    add(&NUMERICS_VERSION.to_le_bytes());
    add(mpgx_lang::meaning_hash(plan).as_bytes());
    for (id, record) in records {
        add(id.as_bytes());
        add(&postcard::to_stdvec(record).map_err(unwritable)?);
    }
    for record in localisers.values() {
        add(&postcard::to_stdvec(record).map_err(unwritable)?);
    }
    let Summary { seeds, failures, protocols, comparisons, expect, .. } = statistics;
    add(&postcard::to_stdvec(&(seeds, failures, protocols, comparisons, expect)).map_err(unwritable)?);
    Ok(hasher.finalize().to_hex().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::storage::SimulatedDisk;
    use crate::tests::sample;

    /// A record counts whole, not only as far as the statistics see it.
    /// Seen to fail when records are left out.
    #[test]
    fn every_record_and_every_statistic_counts() {
        let disk = SimulatedDisk::default();
        let hash = sample::hash_of(&disk, &sample::plan());
        let study = crate::load(&disk).unwrap();
        let summary = study.summary.unwrap();
        let of = |records: &BTreeMap<_, _>, summary: &Summary| {
            study_hash(&study.plan, records, &study.localisers, summary).unwrap()
        };
        assert_eq!(of(&study.records, &summary), hash);

        let mut records = study.records.clone();
        records.get_mut("td3-001").unwrap().training.as_mut().unwrap().error_m[0] += 1e-12;
        assert_ne!(of(&records, &summary), hash);
        let mut fewer = study.records.clone();
        fewer.remove("oracle-000");
        assert_ne!(of(&fewer, &summary), hash);

        let mut other = summary.clone();
        other.protocols.get_mut("random").unwrap().remove("td3");
        assert_ne!(of(&study.records, &other), hash);
        let timed = Summary { training: BTreeMap::new(), version: "next".into(), ..summary };
        assert_eq!(of(&study.records, &timed), hash);
    }
}
