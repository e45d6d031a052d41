//! What the kernels work on: padded, cache-line aligned matrices whose sizes cannot be wrong.

use std::ops::{Deref, DerefMut};

/// Floats in a cache line. Rows are padded to a multiple of it; a panel holds this many rows of a batch.
pub(crate) const BLOCK: usize = 16;

/// `n` rounded up to whole blocks.
pub(crate) fn padded(n: usize) -> usize {
    n.next_multiple_of(BLOCK)
}

#[derive(Clone, Copy)]
#[repr(C, align(64))]
struct Line([f32; BLOCK]);

/// Floats that begin at a cache line.
#[derive(Clone)]
struct Buffer(Vec<Line>);

impl Buffer {
    /// Zeros; `len` is a multiple of [`BLOCK`].
    fn new(len: usize) -> Self {
        Self(vec![Line([0.0; BLOCK]); len / BLOCK])
    }
}

impl Deref for Buffer {
    type Target = [f32];

    fn deref(&self) -> &[f32] {
        // SAFETY: a `Line` is `BLOCK` floats without padding (repr(C), 64 bytes), and the lines are contiguous.
        unsafe { std::slice::from_raw_parts(self.0.as_ptr().cast(), self.0.len() * BLOCK) }
    }
}

impl DerefMut for Buffer {
    fn deref_mut(&mut self) -> &mut [f32] {
        // SAFETY: as in `deref`; the borrow is exclusive.
        unsafe { std::slice::from_raw_parts_mut(self.0.as_mut_ptr().cast(), self.0.len() * BLOCK) }
    }
}

/// Features of a batch, one row a sample: `[rows][stride]`, with room for whole panels.
#[derive(Clone)]
pub(crate) struct Rows {
    rows: usize,
    features: usize,
    data: Buffer,
}

impl Rows {
    pub(crate) fn new(rows: usize, features: usize) -> Self {
        Self { rows, features, data: Buffer::new(padded(rows) * padded(features)) }
    }

    pub(crate) fn rows(&self) -> usize {
        self.rows
    }

    /// Uses the first `rows` of the rows that there is room for.
    pub(crate) fn set_rows(&mut self, rows: usize) {
        assert!(rows * self.stride() <= self.data.len(), "{rows} rows do not fit");
        self.rows = rows;
    }

    pub(crate) fn features(&self) -> usize {
        self.features
    }

    pub(crate) fn stride(&self) -> usize {
        padded(self.features)
    }

    pub(crate) fn row(&self, row: usize) -> &[f32] {
        let start = row * self.stride();
        &self.data[start..start + self.features]
    }

    pub(crate) fn row_mut(&mut self, row: usize) -> &mut [f32] {
        let start = row * self.stride();
        &mut self.data[start..start + self.features]
    }

    /// The rows in use, padding included.
    pub(super) fn used(&self) -> &[f32] {
        &self.data[..self.rows * self.stride()]
    }

    pub(super) fn used_mut(&mut self) -> &mut [f32] {
        let len = self.rows * self.stride();
        &mut self.data[..len]
    }

    /// All rows that there is room for, padding included.
    pub(super) fn data(&self) -> &[f32] {
        &self.data
    }

    pub(super) fn data_mut(&mut self) -> &mut [f32] {
        &mut self.data
    }
}

/// Features of a batch, transposed in panels of [`BLOCK`] samples: `[panel][stride][sample]`. What samples
/// beyond the batch and features beyond the last hold is never used.
#[derive(Clone)]
pub(crate) struct Panels {
    panels: usize,
    features: usize,
    data: Buffer,
}

impl Panels {
    /// Room for `rows` samples.
    pub(crate) fn new(rows: usize, features: usize) -> Self {
        let panels = rows.div_ceil(BLOCK);
        Self { panels, features, data: Buffer::new(panels * padded(features) * BLOCK) }
    }

    pub(crate) fn panels(&self) -> usize {
        self.panels
    }

    pub(crate) fn features(&self) -> usize {
        self.features
    }

    pub(crate) fn stride(&self) -> usize {
        padded(self.features)
    }

    pub(crate) fn get(&self, row: usize, feature: usize) -> f32 {
        self.data[self.place(row, feature)]
    }

    pub(crate) fn set(&mut self, row: usize, feature: usize, value: f32) {
        let place = self.place(row, feature);
        self.data[place] = value;
    }

    fn place(&self, row: usize, feature: usize) -> usize {
        ((row / BLOCK) * self.stride() + feature) * BLOCK + row % BLOCK
    }

    pub(super) fn data(&self) -> &[f32] {
        &self.data
    }

    pub(super) fn data_mut(&mut self) -> &mut [f32] {
        &mut self.data
    }
}

/// The weights of a dense layer or something of their shape: `[inputs + 1][stride]`, one row an input, the
/// last row the biases. Padding is zero and stays zero.
#[derive(Clone)]
pub(crate) struct Dense {
    inputs: usize,
    outputs: usize,
    data: Buffer,
}

impl Dense {
    pub(crate) fn new(inputs: usize, outputs: usize) -> Self {
        Self { inputs, outputs, data: Buffer::new((inputs + 1) * padded(outputs)) }
    }

    pub(crate) fn inputs(&self) -> usize {
        self.inputs
    }

    pub(crate) fn outputs(&self) -> usize {
        self.outputs
    }

    pub(crate) fn stride(&self) -> usize {
        padded(self.outputs)
    }

    /// The weights row by row, then the biases; without padding.
    pub(crate) fn rows(&self) -> impl Iterator<Item = &[f32]> {
        self.data.chunks_exact(self.stride()).map(|row| &row[..self.outputs])
    }

    pub(crate) fn rows_mut(&mut self) -> impl Iterator<Item = &mut [f32]> {
        let (stride, outputs) = (self.stride(), self.outputs);
        self.data.chunks_exact_mut(stride).map(move |row| &mut row[..outputs])
    }

    pub(super) fn data(&self) -> &[f32] {
        &self.data
    }

    pub(super) fn data_mut(&mut self) -> &mut [f32] {
        &mut self.data
    }
}
