//! Trajectories made small: quantised, kept once where they are equal, within a budget.
//!
//! Held-out episodes are the same for all methods, so the leader and often the slots are stored once.

use std::collections::BTreeMap;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use mpgx_lang::plan::{Constraint, Formation, World};
use mpgx_study::record::Trajectory;
use serde::Serialize;

/// Most frames of an episode; longer ones are thinned.
const FRAMES: usize = 1000;

/// About the bytes of the entry of a track.
const ENTRY: usize = 260;

/// Numbers as `bytes` little-endian bytes each: 0 is `lo`, the greatest is `hi`.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct Block {
    /// As text, so that blocks can be told apart exactly.
    lo: String,
    hi: String,
    bytes: usize,
    data: String,
}

/// One episode: indices of its blocks, frame after frame in each.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Track {
    pub protocol: usize,
    pub method: usize,
    pub seed: u32,
    pub episode: usize,
    pub frames: usize,
    /// Steps between two frames.
    pub stride: usize,
    /// x, y of the agents that are not learned.
    pub scripted: usize,
    /// x, y of the slots.
    pub slots: usize,
    /// x, y of the learned agents.
    pub learned: usize,
    /// Heading of the learned agents.
    pub headings: usize,
    /// Each reward term, from the first step on.
    pub terms: usize,
    pub error: usize,
    pub actions: usize,
    /// Frames with a collision.
    pub collisions: Vec<usize>,
}

/// The blocks of all tracks.
#[derive(Default)]
pub struct Pool {
    /// Bytes that may be taken.
    room: usize,
    pub blocks: Vec<Block>,
    index: BTreeMap<Block, usize>,
    bytes: usize,
}

impl Pool {
    pub fn new(room: usize) -> Pool {
        Pool { room, ..Pool::default() }
    }

    /// Whether another track may come.
    pub fn has_room(&self) -> bool {
        self.bytes < self.room
    }

    fn add(&mut self, values: &[f32], bytes: usize) -> usize {
        let block = quantise(values, bytes);
        if let Some(&index) = self.index.get(&block) {
            return index;
        }
        self.bytes += block.data.len() + 40;
        self.blocks.push(block.clone());
        self.index.insert(block, self.blocks.len() - 1);
        self.blocks.len() - 1
    }

    /// `None` if the columns do not fit the world: then the record is of another study or damaged.
    pub fn track(&mut self, world: &World, trajectory: &Trajectory) -> Option<Track> {
        let agents = world.agents();
        let learned = world.learned();
        let slots: usize = formations_of_places(world)
            .filter_map(|f| world.groups.get(f.group))
            .map(|group| group.size)
            .sum();
        let steps = trajectory.error_m.len();
        let fits = agents > 0
            && steps > 0
            && trajectory.agents.len() == (steps + 1) * agents
            && trajectory.slots.len() == (steps + 1) * slots
            && trajectory.terms.len() == steps * world.reward.len()
            && trajectory.actions.len() == steps * 2 * learned.len()
            && trajectory.collisions.len() == steps;
        if !fits {
            return None;
        }
        let stride = (steps + 1).div_ceil(FRAMES);
        self.bytes += ENTRY;
        let (mut scripted, mut moved, mut headings) = (Vec::new(), Vec::new(), Vec::new());
        for frame in trajectory.agents.chunks_exact(agents).step_by(stride) {
            for (agent, [x, y, heading]) in frame.iter().enumerate() {
                if learned.contains(&agent) {
                    moved.extend([x, y]);
                    headings.push(*heading);
                } else {
                    scripted.extend([x, y]);
                }
            }
        }
        let slots = thin(trajectory.slots.as_flattened(), 2 * slots, stride);
        let steps_of = |values: &[f32], width: usize| thin(values, width, stride);
        Some(Track {
            protocol: 0,
            method: 0,
            seed: 0,
            episode: 0,
            frames: steps / stride + 1,
            stride,
            scripted: self.add(&scripted, 2),
            slots: self.add(&slots, 2),
            learned: self.add(&moved, 2),
            headings: self.add(&headings, 2),
            terms: self.add(&steps_of(&trajectory.terms, world.reward.len()), 2),
            error: self.add(&steps_of(&trajectory.error_m, 1), 2),
            actions: self.add(&steps_of(&trajectory.actions, 2 * learned.len()), 1),
            collisions: (0..steps)
                .filter(|&step| trajectory.collisions.get(step).is_some_and(|&pairs| pairs > 0))
                .map(|step| (step + 1) / stride)
                .collect(),
        })
    }
}

/// Every `stride`-th row.
fn thin(values: &[f32], width: usize, stride: usize) -> Vec<f32> {
    values.chunks_exact(width.max(1)).step_by(stride).flatten().copied().collect()
}

fn quantise(values: &[f32], bytes: usize) -> Block {
    let finite = || values.iter().copied().filter(|value| value.is_finite());
    let (lo, hi) = finite().fold((f32::MAX, f32::MIN), |(lo, hi), value| (lo.min(value), hi.max(value)));
    let (lo, hi) =
        if lo < hi { (lo, hi) } else { (finite().next().unwrap_or(0.0), finite().next().unwrap_or(0.0)) };
    let levels = f64::from((1u32 << (8 * bytes)) - 1);
    let scale = if hi > lo { levels / (f64::from(hi) - f64::from(lo)) } else { 0.0 };
    let data: Vec<u8> = values
        .iter()
        .map(|value| ((f64::from(*value) - f64::from(lo)) * scale).round().clamp(0.0, levels) as u32)
        .flat_map(|level| level.to_le_bytes().into_iter().take(bytes))
        .collect();
    Block { lo: lo.to_string(), hi: hi.to_string(), bytes, data: STANDARD.encode(data) }
}

/// Those whose members have slots; in the others neighbours keep distances.
pub fn formations_of_places(world: &World) -> impl Iterator<Item = &Formation> {
    world.formations.iter().filter(|it| matches!(it.constraint, Constraint::Displacements { .. }))
}

#[cfg(test)]
mod tests {
    use mpgx_lang::plan::{Graph, Place};

    use super::*;

    fn read(block: &Block) -> Vec<f64> {
        let (lo, hi): (f64, f64) = (block.lo.parse().unwrap(), block.hi.parse().unwrap());
        let levels = f64::from((1u32 << (8 * block.bytes)) - 1);
        let data = STANDARD.decode(&block.data).unwrap();
        let level = |bytes: &[u8]| bytes.iter().rev().fold(0u32, |sum, &byte| sum << 8 | u32::from(byte));
        data.chunks(block.bytes).map(|bytes| lo + f64::from(level(bytes)) * (hi - lo) / levels).collect()
    }

    #[test]
    fn numbers_come_back_within_half_a_level() {
        let values: Vec<f32> = (0..100).map(|k| (k as f32 * 0.37).fract() * 3.0 - 1.0).collect();
        for (bytes, levels) in [(1, 255.0), (2, 65535.0)] {
            for (value, back) in values.iter().zip(read(&quantise(&values, bytes))) {
                assert!((f64::from(*value) - back).abs() <= 0.5 * 3.0 / levels + 1e-7);
            }
        }
    }

    #[test]
    fn constants_and_what_is_no_number_do_no_harm() {
        assert_eq!(read(&quantise(&[2.5; 3], 2)), [2.5; 3]);
        assert_eq!(read(&quantise(&[f32::NAN, 1.0, 2.0], 1)), [1.0, 1.0, 2.0]);
        assert_eq!(read(&quantise(&[], 1)), [0.0; 0]);
    }

    #[test]
    fn equal_columns_are_kept_once() {
        let mut pool = Pool::default();
        assert_eq!(pool.add(&[1.0, 2.0], 2), 0);
        assert_eq!(pool.add(&[1.0, 3.0], 2), 1);
        assert_eq!(pool.add(&[1.0, 2.0], 2), 0);
        assert_eq!(pool.blocks.len(), 2);
    }

    /// One step of two robots that keep a distance: nobody has a slot.
    #[test]
    fn robots_that_keep_distances_are_played_too() {
        let formation = Formation {
            name: "T".into(),
            shape: "mutual".into(),
            group: 0,
            about: None,
            constraint: Constraint::Distances(Vec::new()),
            graph: Graph::Complete,
            at: Place::default(),
        };
        let group = mpgx_lang::plan::Group { size: 2, ..Default::default() };
        let world = World { groups: vec![group], formations: vec![formation], ..World::default() };
        let trajectory = Trajectory {
            agents: vec![[0.0; 3]; 4],
            error_m: vec![0.1],
            collisions: vec![0],
            ..Trajectory::default()
        };
        let track = Pool::default().track(&world, &trajectory);
        assert!(track.is_some());
    }
}
