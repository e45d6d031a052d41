//! Networks that look: the trials that a scenario means, training with checkpoints, and measures.

use std::ops::ControlFlow;
use std::sync::atomic::Ordering;

use mpgx_lang::plan::{Extern, Localiser, Plan, Setting};
use mpgx_vision::declared::{camera_config, train_config, world_config};
use mpgx_vision::network::{self, Estimate, HeldOut, NetworkError, Source, TrainConfig, Weights, held_out};
use mpgx_vision::{Fix, Image, Reliability, ScatterConfig, TrajectoryConfig, TrialsConfig};

use super::{RECORD, Size, Time, belongs_to, read_record, record_path, worlds};
use crate::error::StudyError;
use crate::hash::Identity;
use crate::progress::Progress;
use crate::record::LocaliserRecord;
use crate::run::Options;
use crate::sealed;
use crate::sight::{Eyes, Teller};
use crate::storage::{Storage, StorageError};

/// Steps of training between two checkpoints.
const KEEP_STEPS: u64 = 100;
/// Held-out trials: each lighting with each kind of path and with none.
const HELD_OUT: u32 = 12;
/// Of a record, bytes: all errors on held-out trials (measured).
const MEASURES: f64 = 900e3;

pub(super) fn check(plan: &Plan, number: usize) -> Result<(), StudyError> {
    let Some(localiser) = plan.localisers.get(number) else { return Ok(()) };
    let (_, trials) = configured(plan, localiser, number, 0)?;
    trials.check().map_err(|why| wrong(localiser, &why))
}

pub(super) fn network(
    plan: &Plan,
    number: usize,
    study: &Identity,
    storage: &dyn Storage,
    options: &Options,
    progress: &dyn Progress,
) -> Result<Option<Teller>, StudyError> {
    let Some(localiser) = plan.localisers.get(number) else { return Ok(None) };
    let (config, trials) = configured(plan, localiser, number, options.master)?;
    let path = format!("localisers/{}/network.safetensors", localiser.name);
    let kept = kept(storage, &path, progress)?;
    if let Some(weights) = &kept
        && let Ok(Some(record)) = read_record(storage, localiser, study)
        && record.weights == hash(weights).map_err(|why| wrong(localiser, &why))?
    {
        progress.localiser_finished(&record);
        return Ok(Some(Teller::Eyes(Box::new(network::Localiser::new(weights)), record.reliability)));
    }
    let Some(weights) = train(localiser, &config, &trials, kept, &path, storage, options, progress)? else {
        return Ok(None);
    };
    let teller = network::Localiser::new(&weights);
    let found = held_out(&teller, &trials, HELD_OUT).map_err(|why| wrong(localiser, &why))?;
    let reliability = network::reliability(&teller, &trials, HELD_OUT, plan.world.dt_s);
    let reliability = reliability.map_err(|why| wrong(localiser, &why))?;
    let record =
        record(localiser, &config, &weights, found, reliability).map_err(|why| wrong(localiser, &why))?;
    let bytes = postcard::to_stdvec(&record)
        .map_err(|why| StudyError::Unwritable { what: "a localiser's record", cause: why.to_string() })?;
    let sealed = sealed::seal(RECORD, &belongs_to(localiser, study), &[&bytes]);
    storage.write_atomic(&record_path(localiser), &sealed)?;
    progress.localiser_finished(&record);
    Ok(Some(Teller::Eyes(Box::new(teller), record.reliability)))
}

pub(crate) fn size(plan: &Plan, number: usize) -> Result<Size, StudyError> {
    let Some(localiser) = plan.localisers.get(number) else { return Ok(Size::default()) };
    let (config, trials) = configured(plan, localiser, number, 0)?;
    let network::Size { memory, file, most_file } = network::size(&config, &trials);
    let [memory, file, most_file] = [memory, file, most_file].map(|bytes| bytes as f64);
    Ok(Size {
        memory,
        room: trials.world.scene_bytes(),
        file: file + MEASURES,
        most_file: most_file + MEASURES,
    })
}

pub(crate) type Measured = Vec<((TrainConfig, TrialsConfig, bool), Time)>;

pub(crate) fn time(
    plan: &Plan,
    number: usize,
    trained: bool,
    measured: &mut Measured,
) -> Result<Time, StudyError> {
    let Some(localiser) = plan.localisers.get(number) else { return Ok(Time::default()) };
    let (config, trials) = configured(plan, localiser, number, 0)?;
    let key = (config, trials, trained);
    if let Some((_, time)) = measured.iter().find(|(other, _)| *other == key) {
        return Ok(*time);
    }
    let (config, trials, _) = &key;
    let wrong = |why: NetworkError| wrong(localiser, &why);
    let look = network::look_cost(config, trials).map_err(wrong)?;
    let mut time = Time { room: look.trial_s, look: look.image_s + look.answer_s, ..Time::default() };
    if !trained {
        let (epochs, epoch_s) = (network::epochs(config, trials), look.epoch_s(trials));
        let learning_s = config.steps as f64 * network::step_cost(config, trials).map_err(wrong)?;
        let measuring_s = network::measuring_s(&look, trials, HELD_OUT).map_err(wrong)?;
        // The first epoch is made before anything can be learnt from it.
        time.training = epoch_s + learning_s + measuring_s;
        time.rendering = epochs.saturating_sub(1) as f64 * epoch_s;
    }
    measured.push((key, time));
    Ok(time)
}

/// How a network is trained, and on what.
fn configured(
    plan: &Plan,
    localiser: &Localiser,
    number: usize,
    master: u64,
) -> Result<(TrainConfig, TrialsConfig), StudyError> {
    let trials = trials(plan, number, master)?;
    let config =
        train_config(&localiser.what, trials.camera.width_px).map_err(|why| wrong(localiser, &why))?;
    Ok((config, trials))
}

/// What an earlier run left; a file that is no network is passed over.
fn kept(storage: &dyn Storage, path: &str, progress: &dyn Progress) -> Result<Option<Weights>, StudyError> {
    let Some(bytes) = storage.read_if_there(path)? else { return Ok(None) };
    let weights = Weights::from_bytes(&bytes, path);
    if let Err(why) = &weights {
        progress.remark(&format!("{why}; it is trained anew"));
    }
    Ok(weights.ok())
}

/// `None` if it was interrupted.
#[expect(clippy::too_many_arguments, reason = "one call, of a function that only keeps its caller short")]
fn train(
    localiser: &Localiser,
    config: &TrainConfig,
    trials: &TrialsConfig,
    kept: Option<Weights>,
    path: &str,
    storage: &dyn Storage,
    options: &Options,
    progress: &dyn Progress,
) -> Result<Option<Weights>, StudyError> {
    let folder = format!("localisers/{}", localiser.name);
    storage.create_folder(&folder)?;
    let name = localiser.name.as_str();
    progress.localiser_started(name, kept.as_ref().map_or(0, |weights| weights.record.step), config.steps);
    let source = Source::Rendered(Box::new(trials.clone()));
    let mut keep =
        |weights: &Weights| -> Result<(), Stopped> { Ok(storage.write_atomic(path, &weights.to_bytes()?)?) };
    let mut watch = |now: &network::Progress| {
        progress.localiser_step(name, now.step, config.steps, 50.0 * now.losses[0]);
        match options.interrupt.load(Ordering::Relaxed) {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    };
    let trained = network::train(config, &source, kept, KEEP_STEPS, &mut keep, &mut watch);
    let weights = trained.map_err(|stopped| match stopped {
        Stopped::Network(NetworkError::Threads(why)) => {
            StudyError::Threads { threads: 2, cause: why.to_string() }
        }
        Stopped::Network(why) => wrong(localiser, &why),
        Stopped::Storage(why) => why.into(),
    })?;
    Ok((weights.record.step >= config.steps).then_some(weights))
}

impl Eyes for network::Localiser {
    fn fixes(&self, images: &[Image]) -> Result<Vec<Fix>, String> {
        let estimates = self.estimate(images).map_err(|why| why.to_string())?;
        Ok(estimates.iter().map(Estimate::fix).collect())
    }
}

enum Stopped {
    Network(NetworkError),
    Storage(StorageError),
}

impl From<NetworkError> for Stopped {
    fn from(error: NetworkError) -> Stopped {
        Stopped::Network(error)
    }
}

impl From<StorageError> for Stopped {
    fn from(error: StorageError) -> Stopped {
        Stopped::Storage(error)
    }
}

/// Trials in the scenario's room, in every light, by a robot with the camera of the first group that the localiser tells,
/// which drives through that group's arena at half its highest speed, among as many others as there are. In every other trial
/// to learn from, all are somewhere else in each image and move at any speed that they can.
fn trials(plan: &Plan, number: usize, master: u64) -> Result<TrialsConfig, StudyError> {
    let missing = |what: &str| {
        let at = plan.localisers.get(number).map(|localiser| localiser.at.clone()).unwrap_or_default();
        StudyError::Plan { cause: format!("the network cannot be trained: {what}"), at }
    };
    let localised = |world: &'_ mpgx_lang::plan::World| {
        world.localised.iter().find(|localised| localised.via == number).map(|localised| localised.group)
    };
    let world = worlds(plan).find(|world| localised(world).is_some());
    let world = world.ok_or_else(|| missing("nobody is told by it"))?;
    let group = localised(world).and_then(|group| world.groups.get(group));
    let group = group.ok_or_else(|| missing("nobody is told by it"))?;
    let scenery = world.scenery.as_ref().ok_or_else(|| missing("there is no room to see"))?;
    let camera = group.camera.as_ref().ok_or_else(|| missing("there is no camera"))?;
    let arena = group.arena.ok_or_else(|| missing("the robots have no arena"))?;
    let odd = |why: mpgx_vision::ConfigError| missing(&why.to_string());
    let robots =
        world.groups.iter().filter(|group| group.solid.is_none()).map(|group| group.size).sum::<usize>();
    Ok(TrialsConfig {
        world: world_config(scenery).map_err(odd)?,
        camera: camera_config(camera).map_err(odd)?,
        trajectory: TrajectoryConfig {
            middle_m: [(arena.x_m.0 + arena.x_m.1) / 2.0, (arena.y_m.0 + arena.y_m.1) / 2.0],
            half_x_m: (arena.x_m.1 - arena.x_m.0) / 2.0,
            half_y_m: (arena.y_m.1 - arena.y_m.0) / 2.0,
            speed_mps: group.speed_mps.1.abs() / 2.0,
            ..TrajectoryConfig::default()
        },
        others: robots.saturating_sub(1),
        scattered: Some(ScatterConfig {
            speed_mps: group.speed_mps.0.abs().max(group.speed_mps.1.abs()),
            turn_radps: turn_radps(&group.body),
        }),
        master,
        ..TrialsConfig::default()
    })
}

/// The fastest that a body turns, rad/s; those without a limit turn as fast as others do unless told.
fn turn_radps(body: &Extern) -> f64 {
    match body.settings.get("turn") {
        Some(Setting::Range(low, high)) => low.abs().max(high.abs()),
        _ => TrajectoryConfig::default().turn_radps,
    }
}

fn record(
    localiser: &Localiser,
    config: &TrainConfig,
    weights: &Weights,
    found: HeldOut,
    reliability: Reliability,
) -> Result<LocaliserRecord, NetworkError> {
    let course = &weights.record.course;
    Ok(LocaliserRecord {
        name: localiser.name.clone(),
        weights: hash(weights)?,
        parameters: weights.parameters(),
        images: config.steps * config.batch as u64,
        steps: course.steps.clone(),
        errors_percent: course.losses.iter().map(|losses| losses.map(|loss| 50.0 * loss)).collect(),
        reliability,
        network: found.network,
        retrieval: found.retrieval,
        reckoning: found.reckoning,
    })
}

fn hash(weights: &Weights) -> Result<String, NetworkError> {
    Ok(blake3::hash(&weights.to_bytes()?).to_hex().to_string())
}

fn wrong(localiser: &Localiser, why: &dyn std::fmt::Display) -> StudyError {
    StudyError::Plan { cause: format!("localiser `{}`: {why}", localiser.name), at: localiser.at.clone() }
}

#[cfg(test)]
mod tests;
