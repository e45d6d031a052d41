//! The localisers of a Plan: networks are trained beside the cells, and measured on trials that they have not seen.
//!
//! ```text
//! localisers/<name>/network.safetensors   the network, at every checkpoint
//! localisers/<name>/record.bin            how it was trained and how good it is: written last
//! ```

#[cfg(feature = "vision")]
mod train;

use std::collections::BTreeMap;

use mpgx_lang::plan::{Localiser, Plan, World};
use mpgx_vision::declared::pose_noise;

use crate::cell::check_names;
use crate::error::StudyError;
use crate::hash::Identity;
use crate::progress::Progress;
use crate::record::LocaliserRecord;
use crate::run::Options;
use crate::sealed::{self, Kind};
use crate::sight::Teller;
use crate::storage::Storage;

const RECORD: Kind = Kind { magic: *b"mpgx-loc", format: 3 };

/// Checks what can be checked before anything is written.
pub(crate) fn check(plan: &Plan) -> Result<(), StudyError> {
    check_names("localisers", plan.localisers.iter().map(|localiser| (&localiser.name, &localiser.at)))?;
    for localiser in &plan.localisers {
        let wrong = |cause: String| StudyError::Plan { cause, at: localiser.at.clone() };
        pose_noise(&localiser.what).map_err(|why| wrong(why.to_string()))?;
    }
    networks(plan).try_for_each(|number| check_network(plan, number))
}

#[cfg(feature = "vision")]
use train::check as check_network;

#[cfg(not(feature = "vision"))]
fn check_network(plan: &Plan, number: usize) -> Result<(), StudyError> {
    let localiser = plan.localisers.get(number);
    let name = localiser.map_or("", |localiser| localiser.name.as_str());
    let cause = format!(
        "localiser `{name}` is a network, and this mpgx was built without networks that see; build it with \
         `cargo build --release --features vision`"
    );
    Err(StudyError::Plan { cause, at: localiser.map(|localiser| localiser.at.clone()).unwrap_or_default() })
}

/// What a network takes, bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Size {
    /// Of memory, while it is trained and for each room that it looks around in.
    pub memory: f64,
    pub room: f64,
    /// On disk, when it is trained and at most.
    pub file: f64,
    pub most_file: f64,
}

/// What a network takes on this machine, s: a short look, which another look may contradict.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Time {
    /// Its training with its measures, and beside it making the images; 0 if it is trained.
    pub training: f64,
    pub rendering: f64,
    /// In an evaluation: a room, and each look around in it.
    pub room: f64,
    pub look: f64,
}

/// The networks that evaluations need, by their places in the Plan.
pub(crate) fn networks(plan: &Plan) -> impl Iterator<Item = usize> {
    (0..plan.localisers.len()).filter(|&number| {
        let localiser = plan.localisers.get(number);
        is_used(plan, number) && localiser.is_some_and(|it| matches!(pose_noise(&it.what), Ok(None)))
    })
}

/// Makes every localiser that is used ready; `None` if it was interrupted meanwhile.
pub(crate) fn prepare(
    plan: &Plan,
    study: &Identity,
    storage: &dyn Storage,
    options: &Options,
    progress: &dyn Progress,
) -> Result<Option<Vec<Teller>>, StudyError> {
    let mut tellers = Vec::new();
    for (number, localiser) in plan.localisers.iter().enumerate() {
        let noise = pose_noise(&localiser.what);
        let noise =
            noise.map_err(|why| StudyError::Plan { cause: why.to_string(), at: localiser.at.clone() })?;
        tellers.push(match noise {
            Some(noise) => Teller::Noise(noise),
            None if !is_used(plan, number) => Teller::Noise(Default::default()),
            None => match network(plan, number, study, storage, options, progress)? {
                Some(teller) => teller,
                None => return Ok(None),
            },
        });
    }
    Ok(Some(tellers))
}

#[cfg(feature = "vision")]
pub(crate) use train::{Measured, size, time};

#[cfg(not(feature = "vision"))]
pub(crate) fn size(plan: &Plan, number: usize) -> Result<Size, StudyError> {
    check_network(plan, number).map(|()| Size::default())
}

/// What was measured of networks, so that of equal ones in several variants one is looked at.
#[cfg(not(feature = "vision"))]
pub(crate) type Measured = Vec<Time>;

#[cfg(not(feature = "vision"))]
pub(crate) fn time(plan: &Plan, number: usize, _: bool, _: &mut Measured) -> Result<Time, StudyError> {
    check_network(plan, number).map(|()| Time::default())
}

#[cfg(feature = "vision")]
use train::network;

#[cfg(not(feature = "vision"))]
fn network(
    plan: &Plan,
    number: usize,
    _: &Identity,
    _: &dyn Storage,
    _: &Options,
    _: &dyn Progress,
) -> Result<Option<Teller>, StudyError> {
    check_network(plan, number).map(|()| None)
}

/// The world of each protocol.
pub(crate) fn worlds(plan: &Plan) -> impl Iterator<Item = &World> {
    plan.protocols.iter().map(|protocol| protocol.world.as_deref().unwrap_or(&plan.world))
}

/// Whether evaluations need any.
pub(crate) fn are_used(plan: &Plan) -> bool {
    worlds(plan).any(|world| !world.localised.is_empty())
}

fn is_used(plan: &Plan, number: usize) -> bool {
    worlds(plan).any(|world| world.localised.iter().any(|localised| localised.via == number))
}

/// The records of the networks that are finished.
pub(crate) fn read_records(
    storage: &dyn Storage,
    plan: &Plan,
    study: &Identity,
) -> Result<BTreeMap<String, LocaliserRecord>, StudyError> {
    let mut records = BTreeMap::new();
    for localiser in &plan.localisers {
        if let Some(record) = read_record(storage, localiser, study)? {
            records.insert(localiser.name.clone(), record);
        }
    }
    Ok(records)
}

fn read_record(
    storage: &dyn Storage,
    localiser: &Localiser,
    study: &Identity,
) -> Result<Option<LocaliserRecord>, StudyError> {
    let path = record_path(localiser);
    let Some(bytes) = storage.read_if_there(&path)? else { return Ok(None) };
    let damaged = |damage| StudyError::Damaged { path: path.clone(), damage };
    let [record] = sealed::open(RECORD, &belongs_to(localiser, study), &bytes).map_err(damaged)?;
    postcard::from_bytes(record).map(Some).map_err(|_| damaged(sealed::Damage::Broken))
}

fn record_path(localiser: &Localiser) -> String {
    format!("localisers/{}/record.bin", localiser.name)
}

fn belongs_to(localiser: &Localiser, study: &Identity) -> blake3::Hash {
    let mut hasher = blake3::Hasher::new();
    hasher.update(study.0.as_bytes());
    hasher.update(b"localiser ");
    hasher.update(localiser.name.as_bytes());
    hasher.finalize()
}
