pub mod record;
pub mod summary;
