//! The work on one cell: train, evaluate, write the record.

use std::any::Any;
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::Instant;

use mpgx_lang::plan::{Place, Plan};
use mpgx_learn::Policy;
use mpgx_sim::{EpisodeKey, Fault};

use crate::cell::{Cell, Role};
use crate::checkpoint::{self, Checkpoints};
use crate::error::{Halt, StudyError, written};
use crate::evaluation::{Driver, evaluate};
use crate::folder;
use crate::hash::Identity;
use crate::localisers;
use crate::progress::Progress;
use crate::record::{CellRecord, Evaluation, Failure, Timing, Training};
use crate::run::Options;
use crate::sight::{Sight, Teller};
use crate::storage::Storage;
use crate::team;
use crate::training::Trainer;
use crate::transfer::Trained;
use crate::worlds::{Worlds, episodes_of};

/// Seconds of training between two checkpoints at most, however slow the steps are.
const MOST_SECONDS: f64 = 5.0;

/// What all cells of a run share.
pub(crate) struct Work<'a> {
    pub plan: &'a Plan,
    pub worlds: Worlds,
    /// In the order of the Plan's localisers, once they are ready.
    pub tellers: OnceLock<Vec<Teller>>,
    /// Cells whose training ended before that.
    pub waiting: Mutex<Vec<(Cell, Learned)>>,
    pub study: Identity,
    pub storage: &'a dyn Storage,
    /// Where the policies come from that are not learned here.
    pub trained: Option<&'a Trained<'a>>,
    pub options: &'a Options,
    pub progress: &'a dyn Progress,
    /// Set when a cell could not be stored: the others stop too.
    pub stop: AtomicBool,
}

/// What came of a cell's training.
#[derive(Default)]
pub(crate) struct Learned {
    training: Option<Training>,
    policy: Option<Policy>,
    steps: u64,
    seconds: f64,
}

impl Work<'_> {
    /// Makes the localisers ready, unless it is interrupted.
    pub fn localisers(&self) -> Result<(), StudyError> {
        let Work { plan, study, storage, options, progress, .. } = self;
        if let Some(tellers) = localisers::prepare(plan, study, *storage, options, *progress)? {
            self.tellers.get_or_init(|| tellers);
        }
        Ok(())
    }

    /// Brings one cell to its end; false if it was interrupted.
    pub fn cell(&self, cell: &Cell) -> Result<bool, StudyError> {
        match folder::read_record(self.storage, cell, &self.study) {
            Ok(Some(record)) => {
                checkpoint::clear(self.storage, cell);
                self.progress.cell_kept(cell, &record);
                return Ok(true);
            }
            Ok(None) => {}
            Err(damaged @ StudyError::Damaged { .. }) => self.progress.warning(cell, &damaged.to_string()),
            Err(error) => return Err(error),
        }
        if self.is_interrupted() {
            return Ok(false);
        }
        match (cell.role, self.trained) {
            (Role::Learner, None) => self.learner(cell),
            (Role::Learner, Some(trained)) => self.learned(cell, trained),
            (Role::Controller, _) => {
                self.progress.cell_started(cell, 0, 0);
                self.finish(cell, Learned::default(), Ok(()))
            }
        }
    }

    /// A cell that another study trained.
    fn learned(&self, cell: &Cell, trained: &Trained) -> Result<bool, StudyError> {
        self.progress.cell_started(cell, 0, 0);
        if let Some(failure) = trained.record(cell).and_then(|record| record.failure.clone()) {
            let (method, seed) = (cell.method.label.clone(), cell.seed);
            let (failure, protocols) = (Some(failure), BTreeMap::new());
            let record = CellRecord { method, seed, training: None, failure, protocols };
            return self.keep(cell, &record, &Timing::default(), None);
        }
        let sizes = self.worlds.training.last().map_or((0, 0), |ground| team::sizes(&ground.task));
        let policy = Some(trained.policy(cell, sizes)?);
        self.finish(cell, Learned { policy, ..Learned::default() }, Ok(()))
    }

    fn learner(&self, cell: &Cell) -> Result<bool, StudyError> {
        let (mut trainer, mut checkpoints) = self.resume(cell)?;
        self.progress.cell_started(cell, trainer.course.steps, trainer.most_steps());
        let ended = guarded(|| self.train(cell, &mut trainer, &mut checkpoints));
        let (steps, seconds) = (trainer.course.steps, trainer.course.seconds);
        let (training, policy) = trainer.finish();
        self.finish(cell, Learned { training: Some(training), policy: Some(policy), steps, seconds }, ended)
    }

    /// A trainer as far as the last good checkpoint.
    fn resume<'a>(&'a self, cell: &'a Cell) -> Result<(Trainer<'a>, Checkpoints<'a>), StudyError> {
        let new_trainer =
            || Trainer::new(&self.worlds.training, &self.plan.stages, cell, self.options.master);
        let new_checkpoints = || Checkpoints::new(self.storage, cell, &self.study);
        let (mut trainer, mut checkpoints) = (new_trainer()?, new_checkpoints()?);
        let (restored, warnings) = checkpoints.load()?;
        warnings.iter().for_each(|warning| self.progress.warning(cell, warning));
        match restored.map(|restored| trainer.resume(restored)) {
            Some(Err(fault)) => {
                self.progress
                    .warning(cell, &format!("begins anew; its checkpoint does not fit: {}", fault.cause));
                Ok((new_trainer()?, new_checkpoints()?))
            }
            _ => Ok((trainer, checkpoints)),
        }
    }

    fn train(&self, cell: &Cell, trainer: &mut Trainer, checkpoints: &mut Checkpoints) -> Result<(), Halt> {
        let (began, earlier) = (Instant::now(), trainer.course.seconds);
        let (most, mut saved, mut saved_rows) =
            (trainer.most_steps(), trainer.course.steps, trainer.course.rows);
        let mut saved_at = earlier;
        while !trainer.is_done() {
            let interrupted = self.is_interrupted();
            trainer.course.seconds = earlier + began.elapsed().as_secs_f64();
            let (steps, seconds) = (trainer.course.steps, trainer.course.seconds);
            let due = steps - saved >= self.options.checkpoint_steps || seconds - saved_at >= MOST_SECONDS;
            if steps > saved && (interrupted || due) {
                checkpoints.save(&trainer.course, &trainer.save(), &trainer.rows_since(saved_rows))?;
                (saved, saved_rows, saved_at) = (steps, trainer.course.rows, seconds);
                tracing::debug!(cell = cell.id, steps, "checkpoint");
            }
            if interrupted {
                return Err(Halt::Interrupted);
            }
            if let Some(episode) = trainer.step()? {
                self.progress.episode(cell, trainer.course.steps, most, episode.total, episode.error_m);
            }
        }
        trainer.course.seconds = earlier + began.elapsed().as_secs_f64();
        Ok(())
    }

    /// Evaluates what training gave, unless it has failed, and writes the record. Without the localisers that evaluations
    /// need the cell waits, and is not finished.
    pub fn finish(&self, cell: &Cell, learned: Learned, ended: Result<(), Halt>) -> Result<bool, StudyError> {
        if ended.is_ok() && self.tellers.get().is_none() && localisers::are_used(self.plan) {
            let mut waiting = self.waiting.lock().unwrap_or_else(PoisonError::into_inner);
            waiting.push((cell.clone(), learned));
            return Ok(false);
        }
        let Learned { training, policy, steps, seconds } = learned;
        let began = Instant::now();
        let evaluated = ended.and_then(|()| guarded(|| self.evaluate(cell, policy.clone())));
        let timing = Timing { training_s: seconds, evaluation_s: began.elapsed().as_secs_f64() };
        let (protocols, failure) = match evaluated {
            Ok(protocols) => (protocols, None),
            Err(Halt::Fault(Fault { cause, at })) => {
                (BTreeMap::new(), Some(Failure { step: steps, cause, at: written(&at) }))
            }
            Err(Halt::Interrupted) => return Ok(false),
            Err(Halt::Error(error)) => return Err(error),
        };
        let record =
            CellRecord { method: cell.method.label.clone(), seed: cell.seed, training, failure, protocols };
        let policy = policy.filter(|_| record.failure.is_none()).map(|policy| policy.to_bytes());
        tracing::info!(cell = cell.id, steps, seconds, failed = record.failure.is_some(), "finished");
        self.keep(cell, &record, &timing, policy.as_deref())
    }

    /// Writes what a finished cell leaves.
    fn keep(
        &self,
        cell: &Cell,
        record: &CellRecord,
        timing: &Timing,
        policy: Option<&[u8]>,
    ) -> Result<bool, StudyError> {
        folder::write_cell(self.storage, cell, &self.study, record, timing, policy)?;
        checkpoint::clear(self.storage, cell);
        self.progress.cell_finished(cell, record, timing);
        Ok(true)
    }

    /// All protocols, driven by the policy, or by the cell's controller if there is none.
    fn evaluate(&self, cell: &Cell, policy: Option<Policy>) -> Result<BTreeMap<String, Evaluation>, Halt> {
        let mut driver = policy.map_or(Driver::Controller(&cell.method.what), Driver::Policy);
        let mut protocols = BTreeMap::new();
        for (number, (protocol, task)) in self.plan.protocols.iter().zip(&self.worlds.held_out).enumerate() {
            let episodes = episodes_of(self.plan, number);
            let key = EpisodeKey { master: self.options.master, protocol: episodes, seed: 0, episode: 0 };
            let world = protocol.world.as_deref().unwrap_or(&self.plan.world);
            let sight = Sight::new(self.plan, world, self.tellers.get().map_or(&[][..], Vec::as_slice))
                .map_err(|cause| StudyError::Plan { cause, at: protocol.at.clone() })?;
            let interrupted = || self.is_interrupted();
            let evaluation =
                evaluate(task, sight.as_ref(), &mut driver, key, protocol.episodes, interrupted)?;
            protocols.insert(protocol.name.clone(), evaluation);
        }
        Ok(protocols)
    }

    fn is_interrupted(&self) -> bool {
        self.options.interrupt.load(Ordering::Relaxed) || self.stop.load(Ordering::Relaxed)
    }
}

/// A panic in one cell is a fault of that cell.
fn guarded<T>(work: impl FnOnce() -> Result<T, Halt>) -> Result<T, Halt> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|panic| {
        let cause = format!("it panicked: {}", words(panic.as_ref()));
        Err(Halt::Fault(Fault { cause, at: Place::default() }))
    })
}

fn words(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str)).unwrap_or("without a word")
}
