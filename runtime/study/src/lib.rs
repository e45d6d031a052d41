pub mod record;
pub mod storage;
pub mod summary;
