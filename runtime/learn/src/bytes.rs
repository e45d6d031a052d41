//! The binary form of saved state: little-endian numbers, one after another.

use crate::error::LearnError;
use crate::network::Mlp;

/// Appends numbers to bytes.
pub(crate) struct Writer<'a>(pub(crate) &'a mut Vec<u8>);

impl Writer<'_> {
    pub(crate) fn count(&mut self, value: u64) {
        self.0.extend_from_slice(&value.to_le_bytes());
    }

    pub(crate) fn real(&mut self, value: f64) {
        self.0.extend_from_slice(&value.to_le_bytes());
    }

    pub(crate) fn floats(&mut self, values: &[f32]) {
        for value in values {
            self.0.extend_from_slice(&value.to_le_bytes());
        }
    }

    pub(crate) fn network(&mut self, network: &Mlp) {
        for layer in network.layers() {
            for row in layer.rows() {
                self.floats(row);
            }
        }
    }
}

/// Takes numbers off the front of bytes.
pub(crate) struct Reader<'a>(pub(crate) &'a [u8]);

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], LearnError> {
        let (first, rest) =
            self.0.split_first_chunk().ok_or(LearnError::Damaged { reason: "it ends too early" })?;
        self.0 = rest;
        Ok(*first)
    }

    pub(crate) fn count(&mut self) -> Result<u64, LearnError> {
        Ok(u64::from_le_bytes(self.take()?))
    }

    pub(crate) fn real(&mut self) -> Result<f64, LearnError> {
        Ok(f64::from_le_bytes(self.take()?))
    }

    pub(crate) fn floats(&mut self, values: &mut [f32]) -> Result<(), LearnError> {
        for value in values {
            *value = f32::from_le_bytes(self.take()?);
        }
        Ok(())
    }

    pub(crate) fn network(&mut self, network: &mut Mlp) -> Result<(), LearnError> {
        for layer in network.layers_mut() {
            for row in layer.rows_mut() {
                self.floats(row)?;
            }
        }
        Ok(())
    }
}
