//! The simulator: a [`World`](mpgx_lang::plan::World) of the Plan becomes a [`Task`], a Task steps
//! [`Episode`]s, and a [`Controller`] may steer them.
//!
//! Everything is a function of the Plan and the [`EpisodeKey`]: the same bits on every machine.

mod batch;
mod belief;
mod body;
mod control;
mod episode;
mod error;
mod filter;
mod lanes;
mod look;
mod maths;
mod observe;
mod outline;
mod program;
#[cfg(test)]
mod sample;
mod script;
mod settings;
mod step;
mod task;
mod trial;

pub use batch::Batch;
pub use body::{BODIES, body_settings};
pub use control::{CONTROLLERS, Controller, controller, controller_settings};
pub use episode::{Episode, EpisodeKey};
pub use error::{Flaw, SimError};
pub use filter::{FILTERS, filter_settings};
pub use look::Worth;
pub use step::{Fault, Mode, Step};
pub use task::Task;
pub use trial::{TestFailure, run_test};
