//! What a run will take, before it begins.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use mpgx_lang::plan::Plan;
use mpgx_sim::{EpisodeKey, Task};

use crate::cell::{Cell, Role};
use crate::error::StudyError;
use crate::evaluation::{Driver, RECORDED, evaluate};
use crate::run::REPORTING_MASTER;
use crate::team;
use crate::training::Trainer;
use crate::worlds::Worlds;

/// Of a process with nothing to do, and of a report without its records (bytes, measured).
const PROGRAM: u64 = 12_000_000;
const REPORT: u64 = 110_000;
/// Time for a look at how fast training and evaluation go.
const LOOK: Duration = Duration::from_millis(200);
/// Held-out episodes that are looked at.
const LOOKED_AT: usize = 16;

/// What cells take at most; episodes that end early take less.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Estimate {
    pub cells: usize,
    /// Environment steps of training.
    pub steps: u64,
    pub updates: u64,
    pub memory_bytes: u64,
    /// Of what is left at the end, and of the most that lies there while it runs.
    pub disk_bytes: u64,
    pub most_disk_bytes: u64,
}

/// Of one cell of a learner.
#[derive(Clone, Copy, Debug, Default)]
struct OfCell {
    steps: u64,
    updates: u64,
    memory: u64,
    /// Its checkpoints and its replay log.
    unfinished: u64,
    /// Its policy and its record.
    finished: u64,
}

/// What these cells of a Plan take, `threads` of them side by side.
pub fn estimate(plan: &Plan, cells: &[Cell], threads: usize) -> Result<Estimate, StudyError> {
    let worlds = Worlds::new(plan)?;
    let held_out: u64 = (plan.protocols.iter())
        .zip(&worlds.held_out)
        .map(|(protocol, task)| held_out_bytes(task, protocol.episodes))
        .sum();
    let records = cells.len() as u64 * held_out;
    let side_by_side = threads.min(cells.len()) as u64;
    let mut sum =
        Estimate { cells: cells.len(), disk_bytes: REPORT + 4 * records / 3, ..Estimate::default() };
    let (mut memory, mut unfinished) = (0, 0);
    for learner in learners(cells) {
        let of = of_cell(plan, &worlds, learner[0])?;
        let count = learner.len() as u64;
        sum.steps += count * of.steps;
        sum.updates += count * of.updates;
        sum.disk_bytes += count * of.finished;
        memory = memory.max(of.memory);
        unfinished = unfinished.max(of.unfinished);
    }
    // The report is made of all records at once.
    sum.memory_bytes = PROGRAM + (side_by_side * (memory + held_out)).max(3 * records);
    sum.most_disk_bytes = sum.disk_bytes + side_by_side * unfinished;
    Ok(sum)
}

/// The cells of each learner.
fn learners(cells: &[Cell]) -> Vec<Vec<&Cell>> {
    let mut learners: BTreeMap<&str, Vec<&Cell>> = BTreeMap::new();
    for cell in cells.iter().filter(|cell| cell.role == Role::Learner) {
        learners.entry(&cell.method.label).or_default().push(cell);
    }
    learners.into_values().collect()
}

fn of_cell(plan: &Plan, worlds: &Worlds, cell: &Cell) -> Result<OfCell, StudyError> {
    let trainer = Trainer::new(&worlds.training, &plan.stages, cell, REPORTING_MASTER)?;
    let (config, steps) = (trainer.config(), trainer.most_steps());
    let members = team::members(&worlds.training[plan.stages.len()].task) as u64;
    let before_updates = (config.batch as u64).div_ceil(members.max(1)) - 1;
    let updates = steps.saturating_sub(before_updates) * config.inner;
    let (networks, policy, row) = trainer.bytes();
    let rows = steps.saturating_mul(members);
    let units = config.hidden.iter().sum::<usize>() as u64;
    let batch = 4 * config.batch as u64 * (6 * units + 8 * row);
    let episodes = steps.div_ceil(plan.world.horizon.max(1) as u64);
    let course = episodes * (25 + 8 * plan.world.reward.len() as u64) + updates / 500 * 36;
    Ok(OfCell {
        steps,
        updates,
        // A checkpoint is copied twice before it is on disk.
        memory: 3 * networks + policy + batch + row * rows.min(config.replay as u64),
        unfinished: 2 * networks + row * rows,
        finished: policy + course,
    })
}

/// Of the record of one protocol.
fn held_out_bytes(task: &Task, episodes: usize) -> u64 {
    let (steps, terms) = (task.horizon(), task.term_count());
    let frame = 12 * task.agents() + 8 * task.slot_count();
    let trajectory = (steps + 1) * frame + steps * (4 * terms + 4 + 4 * task.action_len() + 1);
    (episodes * (24 + 8 * terms) + trajectory * episodes.min(RECORDED as usize)) as u64
}

/// Seconds that these cells take on this machine, `threads` of them side by side: a short look at training and
/// evaluation, which another look may contradict.
pub fn seconds(plan: &Plan, cells: &[Cell], threads: usize) -> Result<f64, StudyError> {
    let worlds = Worlds::new(plan)?;
    let mut all = 0.0;
    for learner in learners(cells) {
        let trainer = Trainer::new(&worlds.training, &plan.stages, learner[0], REPORTING_MASTER)?;
        all += learner.len() as f64 * look(plan, &worlds, trainer);
    }
    Ok(all / threads.min(cells.len()).max(1) as f64)
}

/// Of one cell. What fails here will fail in the run, where it is told.
fn look(plan: &Plan, worlds: &Worlds, mut trainer: Trainer) -> f64 {
    while trainer.course.training.updates == 0 && !trainer.is_done() {
        if trainer.step().is_err() {
            return 0.0;
        }
    }
    let (began, first) = (Instant::now(), trainer.course.steps);
    while began.elapsed() < LOOK && !trainer.is_done() && trainer.step().is_ok() {}
    let steps = (trainer.course.steps - first).max(1);
    let training = began.elapsed().as_secs_f64() / steps as f64 * trainer.most_steps() as f64;
    let mut driver = Driver::Policy(trainer.finish().1);
    let mut held_out = 0.0;
    for (protocol, task) in plan.protocols.iter().zip(&worlds.held_out) {
        let (began, episodes) = (Instant::now(), protocol.episodes.min(LOOKED_AT));
        let seen = evaluate(task, &mut driver, EpisodeKey::default(), episodes, || began.elapsed() > LOOK);
        let whole = protocol.episodes as f64 / episodes.max(1) as f64;
        held_out += if seen.is_ok() { whole * began.elapsed().as_secs_f64() } else { 0.0 };
    }
    training + held_out
}
