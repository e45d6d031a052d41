pub mod record;
pub mod statistics;
pub mod storage;
pub mod summarise;
pub mod summary;
