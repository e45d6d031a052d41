pub mod ast;
pub mod plan;
