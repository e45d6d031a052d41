//! Many environments of one task, stepped together.

use crate::episode::{Episode, EpisodeKey};
use crate::error::SimError;
use crate::lanes::{LANES, Lanes, Mask, Plane, at, put};
use crate::maths::Vec2;
use crate::program::{Crowd, ManyDraws};
use crate::step::{Mode, Step};
use crate::task::Task;

/// Episodes of one task that begin and step together, made by [`Task::batch`] for that task alone.
///
/// Positions, velocities and all else that changes lie in columns of environments side by side, and each
/// instruction of a program runs for all of them before the next. Every environment gets the bits that
/// [`Task::step`] gives it. Holonomic bodies, limits of the acceleration, outlines other than discs, agents that
/// obstacles stop, `libm` and random numbers go through their environments one by one, inside the batch.
#[derive(Clone, Debug)]
pub struct Batch {
    count: usize,
    /// Steps done.
    step: usize,
    tiles: Vec<Tile>,
    steps: Vec<Step>,
    scratch: Scratch,
}

/// What is written over and over.
#[derive(Clone, Debug)]
pub(crate) struct Scratch {
    pub episode: Episode,
    pub draws: ManyDraws,
}

/// The columns of [`Episode`] for environments side by side. Lanes that are not in use hold copies of the last.
#[derive(Clone, Debug)]
pub(crate) struct Tile {
    pub keys: [EpisodeKey; LANES],
    pub agents: Crowd,
    pub params: Vec<Lanes>,
    pub asked: Vec<Plane>,
    pub before: Vec<Plane>,
    pub memory: Vec<Plane>,
    pub fresh: Vec<Plane>,
    pub outputs: Vec<Plane>,
    pub slots: Vec<Plane>,
    pub terms: Vec<Lanes>,
    pub rewards: Vec<Lanes>,
    pub late: Vec<Lanes>,
}

impl Task {
    /// Buffers for `count` episodes of this task; [`Task::reset_batch`] begins them.
    pub fn batch(&self, count: usize) -> Batch {
        let episode = self.episode();
        let address = episode.key.address(mpgx_random::Purpose::Motion, 0, 0);
        let tile = Tile::new(&episode);
        Batch {
            count,
            step: 0,
            tiles: vec![tile; count.div_ceil(LANES)],
            steps: vec![Step::default(); count],
            scratch: Scratch { episode, draws: ManyDraws::new([address; LANES]) },
        }
    }

    /// Begins the episodes of `keys`, as [`Task::reset`].
    ///
    /// # Errors
    /// As [`Task::reset`].
    ///
    /// # Panics
    /// If there are not as many keys as episodes.
    pub fn reset_batch(&self, batch: &mut Batch, keys: &[EpisodeKey]) -> Result<(), SimError> {
        assert_eq!(keys.len(), batch.count, "number of keys");
        batch.step = 0;
        for (tile, keys) in batch.tiles.iter_mut().zip(keys.chunks(LANES)) {
            for (lane, key) in keys.iter().enumerate() {
                self.reset(&mut batch.scratch.episode, *key)?;
                tile.put(lane, &batch.scratch.episode);
            }
            for lane in keys.len()..LANES {
                tile.put(lane, &batch.scratch.episode);
            }
        }
        Ok(())
    }

    /// One step of every episode, as [`Task::step`]. `actions` is `[episodes][action]`; gives what the step gave
    /// to each.
    ///
    /// # Panics
    /// If `actions` has another length, or if the batch is of another task.
    pub fn step_batch<'a>(&self, batch: &'a mut Batch, actions: &[f32], mode: Mode) -> &'a [Step] {
        let row = self.action_len();
        assert_eq!(actions.len(), batch.count * row, "length of the actions");
        batch.step += 1;
        let steps = batch.steps.chunks_mut(LANES);
        for (k, (tile, steps)) in batch.tiles.iter_mut().zip(steps).enumerate() {
            let first = k * LANES * row;
            let actions = &actions[first..first + steps.len() * row];
            self.step_lanes(tile, batch.step, actions, mode, &mut batch.scratch, steps);
        }
        &batch.steps
    }

    /// Writes the states of every episode, `[episodes][members][state]`; without a shared policy there is one
    /// member.
    ///
    /// # Panics
    /// If `out` has another length, or if the batch is of another task.
    pub fn observe_batch(&self, batch: &Batch, out: &mut [f32]) {
        let row = self.members() * self.state_len;
        assert_eq!(out.len(), batch.count * row, "length of the states");
        for (tile, out) in batch.tiles.iter().zip(out.chunks_mut((LANES * row).max(1))) {
            self.observe_lanes(tile, batch.step, out);
        }
    }
}

impl Batch {
    /// Number of episodes.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Steps done.
    pub fn time_steps(&self) -> usize {
        self.step
    }

    /// Copies one of the episodes as it is now.
    ///
    /// # Panics
    /// If there is no such episode, or if `episode` is of another task.
    pub fn copy_to(&self, number: usize, episode: &mut Episode) {
        assert!(number < self.count, "episode {number} of {}", self.count);
        self.tiles[number / LANES].take(number % LANES, self.step, episode);
    }

    /// Each reward term of an episode in the last step, as [`Episode::terms`].
    pub fn terms(&self, number: usize) -> impl Iterator<Item = f64> + '_ {
        self.tiles[number / LANES].terms.iter().map(move |term| term[number % LANES])
    }
}

impl Tile {
    fn new(episode: &Episode) -> Tile {
        let planes = |column: &[Vec2]| vec![Plane::default(); column.len()];
        let lanes = |column: &[f64]| vec![Lanes::default(); column.len()];
        let of = &episode.agents;
        Tile {
            keys: [episode.key; LANES],
            agents: Crowd {
                position: planes(&of.position),
                velocity: planes(&of.velocity),
                course: planes(&of.course),
                heading: lanes(&of.heading),
                command: planes(&of.command),
                last_command: planes(&of.last_command),
                outside: vec![Mask::default(); of.outside.len()],
            },
            params: lanes(&episode.params),
            asked: planes(&episode.asked),
            before: planes(&episode.before),
            memory: planes(&episode.memory),
            fresh: planes(&episode.fresh),
            outputs: planes(&episode.outputs),
            slots: planes(&episode.slots),
            terms: lanes(&episode.terms),
            rewards: lanes(&episode.rewards),
            late: lanes(&episode.late),
        }
    }

    /// Writes an episode into a lane.
    fn put(&mut self, lane: usize, from: &Episode) {
        let (to, of) = (&mut self.agents, &from.agents);
        self.keys[lane] = from.key;
        for (to, of) in [
            (&mut to.position, &of.position),
            (&mut to.velocity, &of.velocity),
            (&mut to.course, &of.course),
            (&mut to.command, &of.command),
            (&mut to.last_command, &of.last_command),
            (&mut self.asked, &from.asked),
            (&mut self.before, &from.before),
            (&mut self.memory, &from.memory),
            (&mut self.fresh, &from.fresh),
            (&mut self.outputs, &from.outputs),
            (&mut self.slots, &from.slots),
        ] {
            to.iter_mut().zip(of).for_each(|(to, of)| put(to, lane, *of));
        }
        for (to, of) in [
            (&mut to.heading, &of.heading),
            (&mut self.params, &from.params),
            (&mut self.terms, &from.terms),
            (&mut self.rewards, &from.rewards),
            (&mut self.late, &from.late),
        ] {
            to.iter_mut().zip(of).for_each(|(to, of)| to[lane] = *of);
        }
        to.outside.iter_mut().zip(&of.outside).for_each(|(to, of)| to[lane] = *of);
    }

    /// Reads a lane after `step` steps.
    pub fn take(&self, lane: usize, step: usize, to: &mut Episode) {
        let (of, into) = (&self.agents, &mut to.agents);
        (to.key, to.step) = (self.keys[lane], step);
        for (into, of) in [
            (&mut into.position, &of.position),
            (&mut into.velocity, &of.velocity),
            (&mut into.course, &of.course),
            (&mut into.command, &of.command),
            (&mut into.last_command, &of.last_command),
            (&mut to.asked, &self.asked),
            (&mut to.before, &self.before),
            (&mut to.memory, &self.memory),
            (&mut to.fresh, &self.fresh),
            (&mut to.outputs, &self.outputs),
            (&mut to.slots, &self.slots),
        ] {
            into.iter_mut().zip(of).for_each(|(into, of)| *into = at(of, lane));
        }
        for (into, of) in [
            (&mut into.heading, &of.heading),
            (&mut to.params, &self.params),
            (&mut to.terms, &self.terms),
            (&mut to.rewards, &self.rewards),
            (&mut to.late, &self.late),
        ] {
            into.iter_mut().zip(of).for_each(|(into, of)| *into = of[lane]);
        }
        into.outside.iter_mut().zip(&of.outside).for_each(|(into, of)| *into = of[lane]);
    }
}
