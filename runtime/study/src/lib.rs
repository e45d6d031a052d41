//! Studies: the cells of a Plan run side by side, what they leave on disk, and what it tells.
//!
//! [`run`] brings every cell of a Plan to its end and writes the summary; called again it goes on where it
//! stopped. [`load`] reads a study back. All reading and writing goes through [`storage::Storage`].

mod between;
mod cell;
mod checkpoint;
mod curriculum;
mod error;
mod estimate;
mod evaluation;
pub mod export;
mod film;
mod folder;
mod hash;
pub mod import;
mod localisers;
mod owner;
mod places;
mod progress;
pub mod record;
mod run;
mod sealed;
mod sight;
pub mod statistics;
pub mod storage;
pub mod suite;
pub mod summarise;
pub mod summary;
mod team;
#[cfg(test)]
mod tests;
mod training;
mod transfer;
mod variants;
mod work;
mod worlds;

pub use between::{Meeting, between};
pub use cell::{Cell, CellId, Role, cells};
pub use error::StudyError;
pub use estimate::{Estimate, Todo, estimate, seconds};
pub use film::film;
pub use folder::{Study, load, read_policy};
pub use hash::study_hash;
pub use owner::Owner;
pub use progress::{Progress, Silent};
pub use run::{Options, Outcome, REPORTING_MASTER, run};
pub use sealed::{Damage, NUMERICS_VERSION};
pub use transfer::{Trained, transfer, transferred};
pub use variants::{Part, parts};
