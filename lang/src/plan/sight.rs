//! What robots with a camera look at, and how they tell from it where they are.

use serde::{Deserialize, Serialize};

use super::{Extern, GroupId, Place};

/// The room around the agents. Its floor has the origin and the axes of the world's positions.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Scenery {
    /// The room itself, by name (`indoor`).
    pub room: Extern,
    /// The light, by name (`evening`). `None`: each trial has one of them in turn.
    pub lighting: Option<Extern>,
    pub landmarks: Vec<Landmark>,
}

/// Something that stays where it is in every trial.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Landmark {
    pub name: String,
    /// What it looks like, by name (`books`).
    pub what: Extern,
    /// Metres.
    pub position_m: (f64, f64),
    pub heading_rad: f64,
    pub at: Place,
}

/// A way to tell a robot's pose.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Localiser {
    pub name: String,
    /// By name: a network to be trained on what the cameras show (`resnet`), or the true pose with noise (`noisy`).
    pub what: Extern,
    pub at: Place,
}

/// Members of a group do not know their poses: a localiser tells them. All that is observed, and all that a controller
/// or the policy is told of their positions and headings, is what the localiser says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Localised {
    pub group: GroupId,
    /// Index into [`super::Plan::localisers`].
    pub via: usize,
    /// Whether each joins what its odometry counts to what it is told.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub odometry: bool,
    pub at: Place,
}
