//! Whole studies, small ones: the same bytes whatever happens on the way.

mod faults;
mod flips;
mod numerics;
mod same_bytes;
pub mod sample;
