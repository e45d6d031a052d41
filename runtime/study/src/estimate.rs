//! What a run will take, before it begins.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use mpgx_lang::plan::{Plan, Protocol, World};
use mpgx_sim::{EpisodeKey, Task};

use crate::cell::{Cell, Role, cells};
use crate::error::StudyError;
use crate::evaluation::{Driver, RECORDED, evaluate, knows_all};
use crate::folder::Study;
use crate::localisers::{self, Measured, Time};
use crate::run::REPORTING_MASTER;
use crate::sight::ROOMS_SIDE_BY_SIDE;
use crate::team;
use crate::training::Trainer;
use crate::worlds::Worlds;

/// Of a process that does little and writes a report, and of a report without its records (bytes, measured).
const PROGRAM: f64 = 15e6;
const REPORT: f64 = 110e3;
/// Time for a look at how fast training and evaluation go.
const LOOK: Duration = Duration::from_millis(200);
/// Held-out episodes that are looked at.
const LOOKED_AT: usize = 16;

/// What is left to do of a study.
#[derive(Clone, Debug, Default)]
pub struct Todo {
    pub cells: Vec<Cell>,
    /// Networks that are to be trained, by their places in the Plan.
    pub networks: Vec<usize>,
}

impl Todo {
    /// Of a Plan whose finished part, if there is any, was loaded from its folder.
    pub fn of(plan: &Plan, finished: Option<&Study>) -> Result<Todo, StudyError> {
        let mut cells = cells(plan)?;
        cells.retain(|cell| finished.is_none_or(|study| !study.records.contains_key(&cell.id)));
        let is_trained = |number: &usize| {
            let name = plan.localisers.get(*number).map(|localiser| localiser.name.as_str());
            finished.zip(name).is_some_and(|(study, name)| study.localisers.contains_key(name))
        };
        let networks = localisers::networks(plan).filter(|number| !is_trained(number)).collect();
        Ok(Todo { cells, networks })
    }
}

/// What cells and networks take at most; episodes that end early take less.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    pub cells: usize,
    /// Environment steps of training.
    pub steps: u64,
    pub updates: u64,
    pub memory_bytes: f64,
    /// Of what is left at the end, and of the most that lies there while it runs.
    pub disk_bytes: f64,
    pub most_disk_bytes: f64,
}

/// Of one cell of a learner.
#[derive(Clone, Copy, Debug, Default)]
struct OfCell {
    steps: u64,
    updates: u64,
    memory: f64,
    /// Its checkpoints and its replay log.
    unfinished: f64,
    /// Its policy and its record.
    finished: f64,
}

/// What the rest of a Plan takes, `threads` cells side by side and the networks one after the other beside them.
pub fn estimate(plan: &Plan, todo: &Todo, threads: usize) -> Result<Estimate, StudyError> {
    let cells = &todo.cells;
    let worlds = Worlds::new(plan)?;
    let held_out: f64 = (plan.protocols.iter())
        .zip(&worlds.held_out)
        .map(|(protocol, task)| held_out_bytes(task, protocol.episodes))
        .sum();
    let records = cells.len() as f64 * held_out;
    let side_by_side = threads.min(cells.len()) as f64;
    let mut sum =
        Estimate { cells: cells.len(), disk_bytes: REPORT + 4.0 / 3.0 * records, ..Estimate::default() };
    let (mut memory, mut unfinished) = (0.0f64, 0.0f64);
    for learner in learners(cells) {
        let of = of_cell(plan, &worlds, learner[0])?;
        let count = learner.len() as u64;
        sum.steps += count * of.steps;
        sum.updates += count * of.updates;
        sum.disk_bytes += count as f64 * of.finished;
        memory = memory.max(of.memory);
        unfinished = unfinished.max(of.unfinished);
    }
    sum.most_disk_bytes = sum.disk_bytes + side_by_side * unfinished;
    let (mut of_networks, mut room) = (0.0f64, BTreeMap::new());
    for number in localisers::networks(plan) {
        let size = localisers::size(plan, number)?;
        room.insert(number, size.room);
        if todo.networks.contains(&number) {
            of_networks = of_networks.max(size.memory);
            sum.disk_bytes += size.file;
            sum.most_disk_bytes += size.most_file;
        }
    }
    // Every group that looks has a room of its own in each episode.
    let of_world =
        |world: &World| world.localised.iter().filter_map(|localised| room.get(&localised.via)).sum::<f64>();
    let rooms =
        localisers::worlds(plan).map(of_world).fold(0.0, f64::max) * side_by_side * ROOMS_SIDE_BY_SIDE as f64;
    // The report is made of all records at once.
    sum.memory_bytes =
        PROGRAM + (side_by_side * (memory + held_out) + of_networks + rooms).max(3.0 * records);
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
    let rows = steps as f64 * members as f64;
    let (networks, policy, row) = trainer.bytes();
    let [networks, policy, row] = [networks, policy, row].map(|bytes| bytes as f64);
    let units = config.hidden.iter().sum::<usize>() as f64;
    let batch = 4.0 * config.batch as f64 * (6.0 * units + 8.0 * row);
    let episodes = steps as f64 / plan.world.horizon as f64;
    let course = episodes * (25.0 + 8.0 * plan.world.reward.len() as f64) + updates as f64 / 500.0 * 48.0;
    Ok(OfCell {
        steps,
        updates,
        // A checkpoint is copied twice before it is on disk.
        memory: 3.0 * networks + policy + batch + row * rows.min(config.replay as f64),
        unfinished: 2.0 * networks + row * rows,
        finished: policy + course,
    })
}

/// Of the record of one protocol.
fn held_out_bytes(task: &Task, episodes: usize) -> f64 {
    let (steps, terms) = (task.horizon() as f64, task.term_count() as f64);
    let frame = 12.0 * task.agents() as f64 + 8.0 * task.slot_count() as f64;
    let trajectory = (steps + 1.0) * frame + steps * (4.0 * terms + 5.0 + 4.0 * task.action_len() as f64);
    episodes as f64 * (24.0 + 8.0 * terms) + trajectory * episodes.min(RECORDED as usize) as f64
}

/// Seconds that the rests of Plans take on this machine one after the other, `threads` cells side by side: a short look at
/// training and evaluation, which another look may contradict.
pub fn seconds(rests: &[(&Plan, Todo)], threads: usize) -> Result<f64, StudyError> {
    let mut measured = Measured::default();
    rests.iter().map(|(plan, todo)| of_rest(plan, todo, threads, &mut measured)).sum()
}

fn of_rest(plan: &Plan, todo: &Todo, threads: usize, measured: &mut Measured) -> Result<f64, StudyError> {
    let worlds = Worlds::new(plan)?;
    let mut all = 0.0;
    for learner in learners(&todo.cells) {
        let trainer = Trainer::new(&worlds.training, &plan.stages, learner[0], REPORTING_MASTER)?;
        all += learner.len() as f64 * look(plan, &worlds, trainer);
    }
    let looks = |cell: &&Cell| cell.role == Role::Learner || !knows_all(&cell.method.what);
    let who_look = todo.cells.iter().filter(looks).count() as f64;
    let (mut training, mut rendering, mut looking) = (0.0, 0.0, 0.0);
    for number in localisers::networks(plan) {
        let time = localisers::time(plan, number, !todo.networks.contains(&number), measured)?;
        training += time.training;
        rendering += time.rendering;
        looking += who_look * in_rooms(plan, number, time);
    }
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let side_by_side = threads.min(todo.cells.len()).clamp(1, cores) as f64;
    Ok(together(all, [training, rendering], side_by_side, cores as f64) + looking / side_by_side)
}

/// Networks are trained one after the other, while `cells` are trained `side_by_side` and images are made on what cores
/// there are.
fn together(cells: f64, [training, rendering]: [f64; 2], side_by_side: f64, cores: f64) -> f64 {
    (cells / side_by_side).max(training).max((training + rendering + cells) / cores)
}

/// What looking around adds to one cell's evaluations.
fn in_rooms(plan: &Plan, network: usize, time: Time) -> f64 {
    let of = |protocol: &Protocol| {
        let world = protocol.world.as_deref().unwrap_or(&plan.world);
        let groups = world.localised.iter().filter(|localised| localised.via == network);
        let robots = groups.filter_map(|localised| world.groups.get(localised.group)).map(|group| group.size);
        let looks = world.horizon * robots.sum::<usize>();
        if looks > 0 { protocol.episodes as f64 * (time.room + looks as f64 * time.look) } else { 0.0 }
    };
    plan.protocols.iter().map(of).sum()
}

/// Of one cell. What fails here will fail in the run, where it is told.
fn look(plan: &Plan, worlds: &Worlds, mut trainer: Trainer) -> f64 {
    let (most, started) = (trainer.most_steps(), Instant::now());
    // The first steps fill a mini-batch and are quicker than all others.
    let (mut began, mut first) = (started, 0);
    while began.elapsed() < LOOK && started.elapsed() < 3 * LOOK && trainer.course.steps < first + most / 10 {
        if trainer.step().is_err() {
            return 0.0;
        }
        if trainer.course.training.updates == 0 {
            (began, first) = (Instant::now(), trainer.course.steps);
        }
    }
    let steps = (trainer.course.steps - first).max(1);
    let training = began.elapsed().as_secs_f64() / steps as f64 * most as f64;
    let mut driver = Driver::Policy(trainer.finish().1);
    let mut held_out = 0.0;
    for (protocol, task) in plan.protocols.iter().zip(&worlds.held_out) {
        let (began, episodes) = (Instant::now(), protocol.episodes.min(LOOKED_AT));
        let seen =
            evaluate(task, None, &mut driver, EpisodeKey::default(), episodes, || began.elapsed() > LOOK);
        let whole = protocol.episodes as f64 / episodes.max(1) as f64;
        held_out += if seen.is_ok() { whole * began.elapsed().as_secs_f64() } else { 0.0 };
    }
    training + held_out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::storage::{SimulatedDisk, Storage};
    use crate::tests::sample;

    fn of(plan: &Plan, threads: usize) -> Estimate {
        estimate(plan, &Todo::of(plan, None).unwrap(), threads).unwrap()
    }

    /// Thirty steps a cell; mini-batches of three need three steps, or two of two robots.
    #[test]
    fn steps_and_updates_are_counted() {
        let it = of(&sample::plan(), 2);
        assert_eq!((it.cells, it.steps, it.updates), (5, 4 * 30, 4 * 28));
        let it = of(&sample::shared(), 2);
        assert_eq!((it.cells, it.steps, it.updates), (5, 4 * 30, 4 * 29));
        let mut todo = Todo::of(&sample::plan(), None).unwrap();
        todo.cells.truncate(1);
        assert_eq!(estimate(&sample::plan(), &todo, 2).unwrap().steps, 30);
        assert!(seconds(&[(&sample::plan(), todo)], 2).unwrap() > 0.0);
    }

    /// Networks alone, cells alone, and both on fewer cores than there is work for.
    #[test]
    fn networks_are_trained_beside_the_cells() {
        assert_eq!(together(0.0, [60.0, 20.0], 2.0, 2.0), 60.0);
        assert_eq!(together(60.0, [0.0, 0.0], 2.0, 2.0), 30.0);
        assert_eq!(together(60.0, [10.0, 5.0], 1.0, 4.0), 60.0);
        assert_eq!(together(60.0, [50.0, 20.0], 2.0, 2.0), 65.0);
    }

    /// A study without its report and its small text files.
    #[test]
    fn the_disk_is_within_half_of_what_is_used() {
        for mut plan in [sample::plan(), sample::shared()] {
            plan.world.horizon = 100;
            plan.protocols.iter_mut().for_each(|protocol| protocol.episodes = 40);
            let disk = SimulatedDisk::default();
            sample::hash_of(&disk, &plan);
            let files = disk.list("cells").unwrap().into_iter().filter(|file| file.ends_with(".bin"));
            let used: usize = files.map(|file| disk.read(&format!("cells/{file}")).unwrap().len()).sum();
            let records = 5.0
                * Worlds::new(&plan)
                    .unwrap()
                    .held_out
                    .iter()
                    .map(|task| held_out_bytes(task, 40))
                    .sum::<f64>();
            let told = of(&plan, 2).disk_bytes - REPORT - records / 3.0;
            let ratio = told / used as f64;
            assert!((1.0 / 1.5..1.5).contains(&ratio), "{told} for {used}");
        }
    }
}
