//! The learners: kernels, networks, replay, and the algorithms MPG, TD3, the mean of the twins and DDPG.
//!
//! A [`Learner`] is made from a [`Config`] and fed transitions; it gives actions, and at the end a
//! [`Policy`]. Training is a function of the configuration, the seed and the transitions: the same bits for
//! every vector width, after every save and restore.

mod actor_critic;
mod adam;
pub mod algorithms;
mod autodiff;
mod bytes;
mod config;
mod error;
mod health;
mod hindsight;
mod kernels;
mod learner;
pub mod measure;
mod network;
mod noise;
pub mod pendulum;
mod policy;
mod probe;
mod replay;
mod varying;

pub use algorithms::{ALGORITHMS, Algorithm};
pub use config::{
    Backend, Bound, Config, Count, CriticPair, Decay, DeltaKind, InnerBatch, NoiseReading, Polyak, SETTINGS,
};
pub use error::LearnError;
pub use kernels::{Activation, force_simd, simd_level};
pub use learner::Learner;
pub use policy::Policy;
pub use replay::Transition;
pub use varying::Varying;
