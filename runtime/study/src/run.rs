//! Running a study: its cells side by side, each finished one written at once, all of it taken up again
//! where an earlier run stopped.

use std::fmt::Display;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use mpgx_lang::plan::Plan;

use crate::cell::{Cell, cells};
use crate::error::StudyError;
use crate::folder::{self, Study};
use crate::hash::{Identity, study_hash};
use crate::localisers;
use crate::owner::{self, Owner};
use crate::places;
use crate::progress::Progress;
use crate::sealed::NUMERICS_VERSION;
use crate::storage::Storage;
use crate::summarise::summarise;
use crate::summary::Summary;
use crate::transfer::Trained;
use crate::work::Work;
use crate::worlds::Worlds;

/// The master seed of every study that is reported. Who tunes a preset must use another one, so that tuning
/// and reporting never meet the same episodes.
pub const REPORTING_MASTER: u64 = 0;

/// How to run; nothing here changes a record, except `master`.
#[derive(Clone, Debug)]
pub struct Options {
    /// Cells that run side by side.
    pub threads: usize,
    pub master: u64,
    /// When this turns true, every cell writes a checkpoint and the run ends.
    pub interrupt: Arc<AtomicBool>,
    /// Steps of training between two checkpoints; if they are slow, a checkpoint comes earlier.
    pub checkpoint_steps: u64,
    pub owner: Owner,
}

impl Default for Options {
    fn default() -> Options {
        Options {
            threads: std::thread::available_parallelism().map_or(1, usize::from),
            master: REPORTING_MASTER,
            interrupt: Arc::default(),
            checkpoint_steps: 4000,
            owner: Owner::this_process(),
        }
    }
}

/// How a run ended.
#[derive(Clone, Debug)]
pub enum Outcome {
    /// All cells are finished, failed ones among them.
    Finished(Box<Study>),
    /// The same call goes on.
    Interrupted { finished: usize, cells: usize },
}

/// Trains and evaluates every cell of a Plan that is not finished in this storage, and writes the summary.
///
/// `source` holds name and text of the scenario's files. The result depends on the Plan and the master seed
/// alone: not on the number of threads, the schedule, interruptions or what earlier runs left.
///
/// # Errors
/// If the Plan cannot run, if the folder belongs to another Plan or is in use, or if the storage fails. What
/// is finished stays finished.
pub fn run(
    plan: &Plan,
    source: &[(String, String)],
    storage: &dyn Storage,
    options: &Options,
    progress: &dyn Progress,
) -> Result<Outcome, StudyError> {
    run_cells(plan, source, storage, options, progress, None, |_| {})
}

/// `trained`: the study whose policies are evaluated; without one they are learned. `arrange` changes the order.
pub(crate) fn run_cells(
    plan: &Plan,
    source: &[(String, String)],
    storage: &dyn Storage,
    options: &Options,
    progress: &dyn Progress,
    trained: Option<&Trained>,
    arrange: impl FnOnce(&mut Vec<Cell>),
) -> Result<Outcome, StudyError> {
    Worlds::new(plan)?;
    localisers::check(plan)?;
    cells(plan)?;
    let (plan, source) = places::without_folder(plan, source)?;
    let learned_in = trained.map(Trained::identity).transpose()?;
    let identity = |plan: &Plan| Identity::of(plan, options.master).learned_in(learned_in.as_ref());
    storage.create_folder("")?;
    let _lock = owner::acquire(storage, &options.owner)?;
    let plan = folder::freeze(storage, &plan, &source, identity)?;
    let mut todo = cells(&plan)?;
    todo.retain(|cell| trained.is_none_or(|trained| trained.has(cell)));
    let all = todo.len();
    arrange(&mut todo);
    let study = identity(&plan);
    let work = Work {
        plan: &plan,
        worlds: Worlds::new(&plan)?,
        tellers: OnceLock::new(),
        waiting: Mutex::default(),
        study,
        storage,
        trained,
        options,
        progress,
        stop: AtomicBool::new(false),
    };
    let finished = all_cells(&work, &todo, options.threads)?;
    if finished < all {
        return Ok(Outcome::Interrupted { finished, cells: all });
    }
    let mut study = folder::load(storage)?;
    let summary = summarise(&study.plan, &study.records, &study.timings);
    let summary = Summary {
        version: env!("CARGO_PKG_VERSION").to_string(),
        numerics_version: NUMERICS_VERSION,
        meaning_hash: mpgx_lang::meaning_hash(&study.plan),
        study_hash: study_hash(&study.plan, &study.records, &study.localisers, &summary)?,
        ..summary
    };
    folder::write_summary(storage, &summary)?;
    study.summary = Some(summary);
    Ok(Outcome::Finished(Box::new(study)))
}

/// Trains the cells in this order on all threads, and the localisers beside them; then evaluates the cells that had to wait
/// for the localisers. Gives how many cells are finished.
fn all_cells(work: &Work, cells: &[Cell], threads: usize) -> Result<usize, StudyError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.max(1)).build();
    let refused = |why: &dyn Display| StudyError::Threads { threads, cause: why.to_string() };
    let pool = pool.map_err(|why| refused(&why))?;
    let results = Mutex::new(Vec::new());
    let keep = |result: Result<bool, StudyError>| {
        if result.is_err() {
            work.stop.store(true, Ordering::Relaxed);
        }
        results.lock().unwrap_or_else(PoisonError::into_inner).push(result);
    };
    // On a thread of its own: one of the pool would take up whole cells wherever a network waits for its other threads.
    std::thread::scope(|scope| {
        let localisers = || keep(work.localisers().map(|()| false));
        if let Err(why) = std::thread::Builder::new().spawn_scoped(scope, localisers) {
            keep(Err(refused(&why)));
        }
        pool.scope_fifo(|scope| {
            for cell in cells {
                scope.spawn_fifo(|_| keep(work.cell(cell)));
            }
        });
    });
    let waiting = std::mem::take(&mut *work.waiting.lock().unwrap_or_else(PoisonError::into_inner));
    if work.tellers.get().is_some() {
        pool.scope_fifo(|scope| {
            for (cell, learned) in waiting {
                scope.spawn_fifo(move |_| keep(work.finish(&cell, learned, Ok(()))));
            }
        });
    }
    let results = results.into_inner().unwrap_or_else(PoisonError::into_inner);
    let finished = results.into_iter().collect::<Result<Vec<bool>, StudyError>>()?;
    Ok(finished.into_iter().filter(|finished| *finished).count())
}
