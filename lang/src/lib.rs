pub mod ast;
pub mod codes;
pub mod parse;
pub mod plan;
pub mod problem;
pub mod source;
pub mod stdlib;
