//! What a run tells while it goes on.

use crate::cell::Cell;
use crate::record::{CellRecord, LocaliserRecord, Timing};

/// Listens to a run; called from several threads. Every function may be left out.
pub trait Progress: Sync {
    /// The cell was finished by an earlier run.
    fn cell_kept(&self, _cell: &Cell, _record: &CellRecord) {}

    /// Work on the cell begins; `steps` of `of` were done by an earlier run.
    fn cell_started(&self, _cell: &Cell, _steps: u64, _of: u64) {}

    /// An episode of training has ended after `steps` of at most `of` in all.
    fn episode(&self, _cell: &Cell, _steps: u64, _of: u64, _last_return: f64, _error_m: f64) {}

    /// The cell's record is on disk.
    fn cell_finished(&self, _cell: &Cell, _record: &CellRecord, _timing: &Timing) {}

    /// Training of a localiser begins; `steps` of `of` were done by an earlier run.
    fn localiser_started(&self, _name: &str, _steps: u64, _of: u64) {}

    /// So many steps of its training are done; the mean absolute error of position in the last, % of the range.
    fn localiser_step(&self, _name: &str, _steps: u64, _of: u64, _error_percent: f64) {}

    /// The localiser's record is on disk, or was there already.
    fn localiser_finished(&self, _record: &LocaliserRecord) {}

    /// Something the user should know of the whole run.
    fn remark(&self, _text: &str) {}

    /// Something the user should know, such as a damaged checkpoint that was passed over.
    fn warning(&self, _cell: &Cell, _text: &str) {}
}

/// Tells nobody.
pub struct Silent;

impl Progress for Silent {}
