pub mod check;
pub mod compile;
pub mod explain;
pub mod hash;
pub mod list;
pub mod report;
pub mod run;
pub mod test;
