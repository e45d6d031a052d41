//! A trained study under another Plan: its policies are evaluated in other worlds, and nothing is trained.

use mpgx_lang::plan::{Place, Plan};
use mpgx_learn::Policy;
use mpgx_sim::Task;

use crate::cell::{Cell, CellId, Role, cells};
use crate::error::StudyError;
use crate::folder::{self, Study};
use crate::hash::Identity;
use crate::progress::Progress;
use crate::record::CellRecord;
use crate::run::{Options, Outcome, run_cells};
use crate::sealed::Damage;
use crate::storage::Storage;
use crate::team;

/// A study that was trained, and where its policies lie.
pub struct Trained<'a> {
    pub study: Study,
    storage: &'a dyn Storage,
}

impl<'a> Trained<'a> {
    /// Reads a study; nothing is written to its storage.
    pub fn load(storage: &'a dyn Storage) -> Result<Trained<'a>, StudyError> {
        Ok(Trained { study: folder::load(storage)?, storage })
    }

    /// The cells of learners that are not finished, and so have no policy.
    pub fn unfinished(&self) -> Result<Vec<CellId>, StudyError> {
        let ids = cells(&self.study.plan)?.into_iter().filter(|cell| !self.has(cell)).map(|cell| cell.id);
        Ok(ids.collect())
    }

    /// Whether a cell can be evaluated; a controller always can.
    pub(crate) fn has(&self, cell: &Cell) -> bool {
        cell.role == Role::Controller || self.study.records.contains_key(&cell.id)
    }

    pub(crate) fn record(&self, cell: &Cell) -> Option<&CellRecord> {
        self.study.records.get(&cell.id)
    }

    /// What a cell that did not fail has learned: a policy for these sizes of state and action.
    pub(crate) fn policy(&self, cell: &Cell, sizes: (usize, usize)) -> Result<Policy, StudyError> {
        let bytes = folder::read_policy(self.storage, cell)?;
        let policy = Policy::from_bytes(&bytes).ok();
        policy.filter(|policy| (policy.state_len(), policy.action_len()) == sizes).ok_or_else(|| {
            StudyError::Damaged { path: format!("cells/{}/policy.bin", cell.id), damage: Damage::Broken }
        })
    }

    pub(crate) fn identity(&self) -> Result<Identity, StudyError> {
        folder::read_identity(self.storage)
    }
}

/// The Plan of an evaluation: the worlds, controllers, evaluations and claims of `plan`, the learners and seeds of
/// what was trained.
///
/// # Errors
/// If the policies see or command something else in these worlds; the error tells the entries.
pub fn transferred(trained: &Study, plan: &Plan) -> Result<Plan, StudyError> {
    let at = plan.learners.first().map(|learner| learner.at.clone()).unwrap_or_default();
    fits(&trained.plan, plan, &at)?;
    let learners = trained.plan.learners.iter().cloned();
    Ok(Plan {
        learners: learners.map(|learner| mpgx_lang::plan::Method { at: at.clone(), ..learner }).collect(),
        first_seed: trained.plan.first_seed,
        seeds: trained.plan.seeds,
        stages: Vec::new(),
        variants: Vec::new(),
        tests: Vec::new(),
        ..plan.clone()
    })
}

/// Evaluates every finished cell of what was trained, and the controllers, by the protocols of a Plan that
/// [`transferred`] gave. A cell whose training failed is a failed one here, too. As [`crate::run`] otherwise: called
/// again it goes on, and the result is the same for any number of threads.
///
/// The folder is bound to the study that was trained: another one may not share it.
pub fn transfer(
    trained: &Trained,
    plan: &Plan,
    source: &[(String, String)],
    storage: &dyn Storage,
    options: &Options,
    progress: &dyn Progress,
) -> Result<Outcome, StudyError> {
    run_cells(plan, source, storage, options, progress, Some(trained), |_| {})
}

/// A policy that was learned for one world must see and command the same in the other.
fn fits(trained: &Plan, plan: &Plan, at: &Place) -> Result<(), StudyError> {
    let wrong = |cause: String, at: &Place| StudyError::Plan { cause, at: at.clone() };
    let layout = |plan: &Plan| {
        let task = Task::new(plan, &plan.world).map_err(|why| wrong(why.to_string(), at))?;
        let (state, action) = (task.observation_names(), task.action_names());
        let own = team::sizes(&task).1;
        Ok::<_, StudyError>((state, action.into_iter().take(own).collect::<Vec<_>>()))
    };
    let (learned, asked) = (layout(trained)?, layout(plan)?);
    let differing = differences("state", &learned.0, &asked.0).into_iter();
    let differing: Vec<String> = differing.chain(differences("action", &learned.1, &asked.1)).collect();
    if differing.is_empty() {
        return Ok(());
    }
    let cause = format!("the policies do not fit `{}`: {}", plan.name, differing.join("; "));
    Err(wrong(cause, plan.world.observe.first().map_or(at, |observation| &observation.at)))
}

/// Entries that are told one by one, at most.
const TOLD: usize = 4;

/// In words, what is not the same.
fn differences(what: &str, learned: &[String], asked: &[String]) -> Vec<String> {
    let name = |of: &[String], k: usize| of.get(k).map_or("nothing".to_owned(), |name| format!("`{name}`"));
    let longest = learned.len().max(asked.len());
    let differing: Vec<usize> = (0..longest).filter(|k| learned.get(*k) != asked.get(*k)).collect();
    let told = differing.iter().take(TOLD).map(|&k| {
        let (learned, asked) = (name(learned, k), name(asked, k));
        format!("entry {} of the {what} was {learned} when they learned and is {asked} here", k + 1)
    });
    let more = differing.len().saturating_sub(TOLD);
    told.chain((more > 0).then(|| format!("{more} more of the {what}"))).collect()
}
