//! The transitions that mini-batches are drawn from.

use crate::error::LearnError;

/// One step of the environment: from `state`, `action` led to `next` and gave `reward`. `failure`: the
/// episode ended in a failure, not at its time limit.
#[derive(Clone, Copy, Debug)]
pub struct Transition<'a> {
    pub state: &'a [f32],
    pub action: &'a [f32],
    pub reward: f32,
    pub next: &'a [f32],
    pub failure: bool,
}

/// Rows that there is room for at first.
const FIRST_ROWS: usize = 1024;

/// The last `capacity` transitions; the oldest go first.
pub(crate) struct Replay {
    state: usize,
    action: usize,
    capacity: usize,
    /// Transition n is row n mod capacity: state, action, reward, failure (1 or 0), next.
    rows: Vec<f32>,
    pushed: u64,
}

impl Replay {
    /// Lengths of a state and an action, and how many transitions are kept.
    pub(crate) fn new(state: usize, action: usize, capacity: usize) -> Self {
        Self { state, action, capacity, rows: Vec::new(), pushed: 0 }
    }

    /// Floats of a transition.
    fn width(&self) -> usize {
        2 * self.state + self.action + 2
    }

    pub(crate) fn state_len(&self) -> usize {
        self.state
    }

    pub(crate) fn action_len(&self) -> usize {
        self.action
    }

    pub(crate) fn row_bytes(&self) -> usize {
        4 * self.width()
    }

    pub(crate) fn clear(&mut self) {
        self.rows.clear();
        self.pushed = 0;
    }

    /// Transitions kept.
    pub(crate) fn len(&self) -> usize {
        self.rows.len() / self.width()
    }

    /// Transitions ever pushed.
    pub(crate) fn pushed(&self) -> u64 {
        self.pushed
    }

    fn slot(&self, transition: u64) -> usize {
        (transition % self.capacity as u64) as usize
    }

    pub(crate) fn push(&mut self, t: Transition<'_>) {
        let tail = [t.reward, f32::from(u8::from(t.failure))];
        self.push_row([t.state, t.action, &tail, t.next].into_iter().flatten().copied());
    }

    fn push_row(&mut self, row: impl Iterator<Item = f32>) {
        let start = self.slot(self.pushed) * self.width();
        if start == self.rows.len() {
            self.grow();
            self.rows.extend(row);
        } else {
            for (old, new) in self.rows[start..].iter_mut().zip(row) {
                *old = new;
            }
        }
        self.pushed += 1;
    }

    /// Makes room for a row: twice what there was, at least [`FIRST_ROWS`], never more than the capacity.
    fn grow(&mut self) {
        if self.rows.len() == self.rows.capacity() {
            let more = self.len().max(FIRST_ROWS).min(self.capacity - self.len());
            self.rows.reserve_exact(more * self.width());
        }
    }

    /// The transition `ago` pushes back, 1 to `len`; 1 is the last.
    pub(crate) fn back(&self, ago: usize) -> Transition<'_> {
        self.get(self.slot(self.pushed - ago as u64))
    }

    /// The transition in row `index` < `len`.
    pub(crate) fn get(&self, index: usize) -> Transition<'_> {
        let row = &self.rows[index * self.width()..][..self.width()];
        let (state, rest) = row.split_at(self.state);
        let (action, rest) = rest.split_at(self.action);
        Transition { state, action, reward: rest[0], failure: rest[1] != 0.0, next: &rest[2..] }
    }

    /// Appends the transitions pushed from number `from` on; those that have been dropped since as zeros.
    pub(crate) fn write(&self, from: u64, out: &mut Vec<u8>) {
        for transition in from..self.pushed {
            let start = self.slot(transition) * self.width();
            let kept = self.pushed - transition <= self.capacity as u64;
            for &value in &self.rows[start..start + self.width()] {
                out.extend_from_slice(&if kept { value } else { 0.0 }.to_le_bytes());
            }
        }
    }

    /// Pushes transitions as [`Replay::write`] gives them.
    pub(crate) fn read(&mut self, bytes: &[u8]) -> Result<(), LearnError> {
        if !bytes.len().is_multiple_of(self.row_bytes()) {
            return Err(LearnError::Damaged { reason: "its replay does not hold whole transitions" });
        }
        for row in bytes.chunks_exact(self.row_bytes()) {
            self.push_row(row.as_chunks().0.iter().copied().map(f32::from_le_bytes));
        }
        Ok(())
    }
}
