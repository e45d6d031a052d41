#![allow(clippy::unwrap_used)]

mod against_torch;
mod training;
mod weights;
