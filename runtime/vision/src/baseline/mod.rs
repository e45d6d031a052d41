//! What a network has to be better than.

mod dead_reckoning;
mod retrieval;

pub use dead_reckoning::dead_reckoning;
pub use retrieval::Retrieval;
