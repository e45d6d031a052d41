//! Records: what a finished cell leaves on disk. They are the truth; reports, tables and exports read them.
//!
//! Nothing here depends on the clock, the machine or the schedule, except [`Timing`], which is kept apart
//! and never hashed.

use std::collections::BTreeMap;

pub use mpgx_vision::Reliability;
pub use mpgx_vision::measure::Evaluation as LocalisationTable;
use serde::{Deserialize, Serialize};

/// One cell: a method trained with one seed, or a controller (seed 0).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CellRecord {
    /// Label of the method in the Plan.
    pub method: String,
    pub seed: u32,
    /// `None` for controllers.
    pub training: Option<Training>,
    /// Why the cell failed, if it did; then `protocols` is empty.
    pub failure: Option<Failure>,
    /// By protocol name.
    pub protocols: BTreeMap<String, Evaluation>,
}

/// Why a cell failed: NaN, divergence or a panic.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Failure {
    /// Environment step of training, from 0.
    pub step: u64,
    pub cause: String,
    /// `file:line:column` in the scenario.
    pub at: String,
}

/// The course of training: one entry of each column an episode.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Training {
    /// Environment steps done when the episode ended.
    pub steps: Vec<u64>,
    /// Sum of the rewards (costs of ends included).
    pub returns: Vec<f64>,
    /// Mean distance of the followers from their slots over the episode, m.
    pub error_m: Vec<f64>,
    /// Sum of each reward term over the episode, in the Plan's order.
    pub terms: Vec<Vec<f64>>,
    /// Index of the end that stopped it (the first that held) in the `ends` of its world; `None`: the horizon.
    pub ended: Vec<Option<u16>>,
    /// Where each stage of the curriculum ended, in order; one that never ended has no entry.
    #[serde(default)]
    pub stages: Vec<StageEnd>,
    /// Updates done in all.
    pub updates: u64,
    /// What the learner says of itself, one entry at each `health.updates`.
    pub health: Health,
}

/// The end of a stage, always that of an episode.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct StageEnd {
    /// Environment steps done in all.
    pub steps: u64,
    /// Episodes done in all.
    pub episodes: u32,
}

/// Means since the entry before, at a fixed cadence of updates.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Health {
    /// Updates done.
    pub updates: Vec<u64>,
    /// Metric name (`loss/critic`, `q/q1`, `q/gap`, `q/delta_adj`, `noise/explore`, …) to its column.
    pub columns: BTreeMap<String, Vec<f32>>,
}

/// Held-out episodes of the final policy, no noise: one entry of each column an episode.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Evaluation {
    /// Sum of the rewards over the whole horizon; an episode goes on after a failure.
    pub returns: Vec<f64>,
    /// Mean distance from the slots over followers and the second half of the steps, m.
    pub error_m: Vec<f64>,
    /// Sum of each reward term, in the Plan's order.
    pub terms: Vec<Vec<f64>>,
    /// Steps with at least one colliding pair.
    pub collision_steps: Vec<u32>,
    /// The same after step 40.
    pub late_collision_steps: Vec<u32>,
    /// Steps with an agent outside its arena.
    pub outside_steps: Vec<u32>,
    /// Steps in which an agent hit an obstacle.
    #[serde(default)]
    pub hit_steps: Vec<u32>,
    /// The same after step 40.
    #[serde(default)]
    pub late_hit_steps: Vec<u32>,
    /// The first few episodes, whole, for playback.
    pub trajectories: Vec<Trajectory>,
    /// Where robots do not know their poses: what they were told.
    pub told: Option<Told>,
}

/// What localisers told robots of their poses. One entry of each column an episode.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Told {
    /// Who was told, as indices of all agents.
    pub agents: Vec<u32>,
    /// Mean distance of the place that was told from the true one, over these agents and all steps, m.
    pub position_error_m: Vec<f64>,
    /// Mean angle between the heading that was told and the true one, rad.
    pub heading_error_rad: Vec<f64>,
    /// Of the recorded episodes, frame-major without the last frame: x, y (m) and heading (rad) that each of `agents` was
    /// told, as [`Trajectory::agents`] has the true ones.
    pub poses: Vec<Vec<[f32; 3]>>,
}

/// One episode, `horizon + 1` frames (the start first).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Trajectory {
    /// Frame-major: x, y (m) and heading (rad) of each agent.
    pub agents: Vec<[f32; 3]>,
    /// Frame-major: x, y (m) of the slot of each agent of each formation, formations in order.
    pub slots: Vec<[f32; 2]>,
    /// Step-major (no entry for the start): each reward term.
    pub terms: Vec<f32>,
    /// Step-major: mean distance from the slots, m.
    pub error_m: Vec<f32>,
    /// Step-major: the action, in [−1, 1].
    pub actions: Vec<f32>,
    /// Step-major: colliding pairs.
    pub collisions: Vec<u16>,
}

/// A network that was trained to tell poses from images, measured on trials that it has not seen.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LocaliserRecord {
    /// Name in the Plan.
    pub name: String,
    /// BLAKE3 of the network's file.
    pub weights: String,
    pub parameters: u64,
    /// Images that were learnt from, repetitions counted.
    pub images: u64,
    /// Steps done at the end of each entry of the course of its training, and the mean absolute errors since the entry
    /// before: of position, orientation and distances to landmarks, % of their ranges.
    pub steps: Vec<u64>,
    pub errors_percent: Vec<[f64; 3]>,
    /// On held-out trials: errors over the variances told with them, and how alike they are one step of the scenario apart.
    pub reliability: Reliability,
    pub network: LocalisationTable,
    /// The pose of the most similar image known.
    pub retrieval: LocalisationTable,
    /// Going on at constant velocity from poses that are told every five seconds.
    pub reckoning: LocalisationTable,
}

/// How long a cell took. Kept beside the record, never hashed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Timing {
    /// Training, over all resumes.
    pub training_s: f64,
    pub evaluation_s: f64,
}
