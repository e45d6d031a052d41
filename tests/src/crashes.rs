//! A small study on a disk that stops at any operation, and again while it recovers: what a write has promised is
//! there afterwards, no finished cell is lost, and the hash is that of an undisturbed run.

mod witness;

use std::collections::BTreeSet;
use std::sync::{Mutex, PoisonError};

use mpgx_lang::plan::Plan;
use mpgx_random::{Address, Purpose, Stream};
use mpgx_study::record::{CellRecord, Timing};
use mpgx_study::storage::{Crash, Fault, SimulatedDisk, Storage};
use mpgx_study::{Cell, CellId, Options, Outcome, Owner, Progress, StudyError, run};

use witness::{Forgetful, Promises, Witness};

const SCENARIO: &str = "
scenario crashes
use std.motion.random_velocity
use std.formation.line
use std.start.{near, uniform_in}
world { dt = 0.1 s, horizon = 6 steps, safety = 0.1 m }
agent leader : point {
    arena  = box(-1 m .. 1 m, -1 m .. 1 m)
    speed  = -0.7 m/s .. 0.7 m/s
    motion = random_velocity(1 m/s)
    start  ~ uniform_in(arena)
}
agents follower[1] : point {
    arena   = box(-3 m .. 3 m, -3 m .. 3 m)
    speed   = -0.7 m/s .. 0.7 m/s
    control = learned
    start   ~ near(F[i], 0.3 m)
}
formation F of follower = line(0.4 m) about leader
observe { F[i] - p[i] for i in follower }
reward { gap = -sum(i in follower) |p[i] - F[i]| }
learn mpg with tuned { steps = 24, hidden = [4], batch = 2, replay = 20 }
compare { oracle }
seeds 1
evaluate held_out { episodes = 2 }
";

/// The study, and what comes of it undisturbed.
pub struct Sample {
    plan: Plan,
    hash: String,
    files: Vec<String>,
    /// Operations on the disk.
    pub operations: u64,
    /// Calls of fsync.
    pub syncs: u64,
}

/// Crashes that were looked at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Looked {
    /// Disks as they were found after a crash.
    pub states: u64,
    /// Those that differed from others of the same crash, each recovered to the end.
    pub recovered: u64,
    /// Crashes during such a recovery.
    pub again: u64,
}

impl Sample {
    /// # Errors
    /// If the study does not run even undisturbed.
    pub fn new() -> Result<Sample, String> {
        let compiled = mpgx_lang::compile("crashes.scn", SCENARIO.into(), &[], &mpgx_lang::source::NoFiles);
        let plan = compiled
            .plan
            .ok_or_else(|| mpgx_lang::problem::render_short(&compiled.problems, &compiled.sources))?;
        let mut sample = Sample { plan, hash: String::new(), files: Vec::new(), operations: 0, syncs: 0 };
        let disk = SimulatedDisk::default();
        let counting = Forgetful::new(&disk, None);
        sample.hash = hash(sample.run(&counting, &Cells::default()))?;
        (sample.operations, sample.syncs) = (disk.operations(), counting.syncs());
        sample.files = disk.list("").map_err(|error| error.to_string())?;
        Ok(sample)
    }

    fn run(&self, disk: &dyn Storage, cells: &Cells) -> Result<Outcome, StudyError> {
        // An owner that is dead as soon as it is looked for.
        let owner = Owner { pid: u32::MAX, began: Some(0), ..Owner::this_process() };
        let options = Options { threads: 1, checkpoint_steps: 6, owner, ..Options::default() };
        run(&self.plan, &[("crashes.scn".into(), SCENARIO.into())], disk, &options, cells)
    }

    /// The study until the machine stops at an operation. The fsync of that number does nothing.
    fn stopped(&self, operation: u64, forgotten: Option<u64>) -> (SimulatedDisk, Promises, BTreeSet<CellId>) {
        let (disk, promises, cells) = (SimulatedDisk::default(), Promises::default(), Cells::default());
        disk.inject(operation, Fault::Crash);
        let forgetful = Forgetful::new(&disk, forgotten);
        // It ends with an error, unless it was done before.
        let _ = self.run(&Witness { disk: &forgetful, promises: &promises }, &cells);
        (disk, promises, cells.finished())
    }

    /// Every crash at one operation: `crashes` of them, each different disk recovered once; some of the recoveries
    /// crash again.
    ///
    /// # Errors
    /// What was lost, and where.
    pub fn stop_at(&self, operation: u64, crashes: &[Crash], random: &mut Stream) -> Result<Looked, String> {
        let (disk, promises, finished) = self.stopped(operation, None);
        let (mut looked, mut known) = (Looked::default(), BTreeSet::new());
        for crash in crashes {
            let found = disk.after_crash(*crash);
            let about = |lost| format!("operation {operation}, {crash:?}: {lost}");
            looked.states += 1;
            let mut promises = promises.clone();
            promises.hold(&found).map_err(about)?;
            if known.insert(contents(&found)) {
                looked.recovered += 1;
                looked.again += self.recovers(found, &mut promises, &finished, random).map_err(about)?;
            }
        }
        Ok(looked)
    }

    /// Runs to the end what a crash has left; gives how often it crashed again on the way.
    fn recovers(
        &self,
        mut disk: SimulatedDisk,
        promises: &mut Promises,
        finished: &BTreeSet<CellId>,
        random: &mut Stream,
    ) -> Result<u64, String> {
        let (mut again, mut finished) = (0, finished.clone());
        while again < 3 && random.below(2) == 0 {
            let cells = Cells::default();
            disk.inject(disk.operations() + random.below(self.operations), Fault::Crash);
            let _ = self.run(&Witness { disk: &disk, promises }, &cells);
            disk = disk.after_crash(Crash::Mixed(random.below(u64::MAX)));
            promises.hold(&disk)?;
            finished.extend(cells.finished());
            again += 1;
        }
        let cells = Cells::default();
        let found = hash(self.run(&disk, &cells))?;
        let (kept, files) = (cells.kept(), disk.list("").map_err(|error| error.to_string())?);
        match found == self.hash && kept.is_superset(&finished) && files == self.files {
            true => Ok(again),
            false => Err(format!("hash {found}, finished {finished:?}, kept {kept:?}, files {files:?}")),
        }
    }

    /// Whether a disk that forgets the fsync of that number loses what a write has promised, at some crash.
    pub fn is_found_out(&self, forgotten: u64) -> bool {
        (0..=self.operations).any(|operation| {
            let (disk, promises, _) = self.stopped(operation, Some(forgotten));
            promises.clone().hold(&disk.after_crash(Crash::Forget)).is_err()
        })
    }

    /// Crashes at random until there are so many states, or until `over`.
    ///
    /// # Errors
    /// What was lost, and where.
    pub fn stop_often(&self, seed: u64, states: u64, over: impl Fn() -> bool) -> Result<Looked, String> {
        let mut sum = Looked::default();
        for step in 0.. {
            if sum.states >= states || over() {
                break;
            }
            let random = &mut stream(seed, step);
            let crashes: Vec<Crash> = (0..200).map(|_| Crash::Mixed(random.below(u64::MAX))).collect();
            let looked = self.stop_at(random.below(self.operations + 1), &crashes, random)?;
            sum.states += looked.states;
            sum.recovered += looked.recovered;
            sum.again += looked.again;
        }
        Ok(sum)
    }
}

/// Random numbers of a step of a test.
pub fn stream(seed: u64, step: u64) -> Stream {
    let purpose = Purpose::Bootstrap;
    Address { master: seed, purpose, protocol: 0, part: 1, seed: 0, episode: 0, step }.stream()
}

fn hash(outcome: Result<Outcome, StudyError>) -> Result<String, String> {
    match outcome {
        Ok(Outcome::Finished(study)) => Ok(study.summary.map(|it| it.study_hash).unwrap_or_default()),
        Ok(Outcome::Interrupted { .. }) => Err("interrupted".into()),
        Err(error) => Err(error.to_string()),
    }
}

fn contents(disk: &SimulatedDisk) -> Vec<(String, Vec<u8>)> {
    let names = disk.list("").unwrap_or_default().into_iter();
    names.map(|name| (name.clone(), disk.read(&name).unwrap_or_default())).collect()
}

/// Writes down the cells that are finished, and those that were.
#[derive(Default)]
struct Cells {
    finished: Mutex<BTreeSet<CellId>>,
    kept: Mutex<BTreeSet<CellId>>,
}

impl Cells {
    fn finished(&self) -> BTreeSet<CellId> {
        self.finished.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn kept(&self) -> BTreeSet<CellId> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

impl Progress for Cells {
    fn cell_kept(&self, cell: &Cell, _: &CellRecord) {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner).insert(cell.id.clone());
    }

    fn cell_finished(&self, cell: &Cell, _: &CellRecord, _: &Timing) {
        self.finished.lock().unwrap_or_else(PoisonError::into_inner).insert(cell.id.clone());
    }
}
