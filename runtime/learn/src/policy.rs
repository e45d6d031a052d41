//! The trained policy: states in, actions out.

use crate::bytes::{Reader, Writer};
use crate::error::LearnError;
use crate::kernels::{Activation, Dense, Rows, Simd};
use crate::network::{Activations, Mlp};

/// States that are evaluated together.
const ROWS: usize = 16;
/// Sizes of layers that stored policies may have.
const LARGEST: u64 = 65536;

/// tanh of every entry, `libm`'s: the same bits everywhere.
pub(crate) fn squash(z: &[f32], u: &mut [f32]) {
    for (u, z) in u.iter_mut().zip(z) {
        *u = libm::tanhf(*z);
    }
}

/// Buffers to evaluate an actor.
#[derive(Clone)]
pub(crate) struct Evaluation {
    x: Rows,
    h: Activations,
}

impl Evaluation {
    /// Of actors with these sizes of layers.
    pub(crate) fn new(sizes: &[usize]) -> Self {
        Self { x: Rows::new(ROWS, sizes[0]), h: Activations::new(sizes, ROWS) }
    }

    /// Whole rows of states in, as many rows of actions out.
    pub(crate) fn act(&mut self, simd: Simd, actor: &Mlp, states: &[f32], actions: &mut [f32]) {
        self.outputs(simd, actor, states, actions);
        actions.iter_mut().for_each(|u| *u = libm::tanhf(*u));
    }

    /// Of any network, not squashed: whole rows of inputs in, as many rows of outputs out.
    pub(crate) fn outputs(&mut self, simd: Simd, network: &Mlp, inputs: &[f32], outputs: &mut [f32]) {
        let (width_in, width_out) = (self.x.features(), self.h.output().features());
        for (inputs, outputs) in inputs.chunks(ROWS * width_in).zip(outputs.chunks_mut(ROWS * width_out)) {
            self.x.set_rows(inputs.len() / width_in);
            for (row, input) in inputs.chunks_exact(width_in).enumerate() {
                self.x.row_mut(row).copy_from_slice(input);
            }
            network.forward(simd, &self.x, &mut self.h);
            for (row, output) in outputs.chunks_exact_mut(width_out).enumerate() {
                output.copy_from_slice(self.h.output().row(row));
            }
        }
    }
}

/// A deterministic policy π(s), without noise.
#[derive(Clone)]
pub struct Policy {
    simd: Simd,
    actor: Mlp,
    evaluation: Evaluation,
}

impl Policy {
    pub(crate) fn new(simd: Simd, actor: Mlp) -> Self {
        let evaluation = Evaluation::new(&actor.sizes());
        Self { simd, actor, evaluation }
    }

    /// Entries of a state.
    pub fn state_len(&self) -> usize {
        self.evaluation.x.features()
    }

    /// Entries of an action.
    pub fn action_len(&self) -> usize {
        self.evaluation.h.output().features()
    }

    /// π of every row of `states`, `[rows][state]`, into `actions`, `[rows][action]`, each in [−1, 1]. A row
    /// gets the same bits whatever the other rows are.
    ///
    /// # Panics
    ///
    /// If a slice has another length.
    pub fn act(&mut self, states: &[f32], rows: usize, actions: &mut [f32]) {
        let expected = (rows * self.state_len(), rows * self.action_len());
        assert_eq!((states.len(), actions.len()), expected, "states and actions of {rows} rows");
        self.evaluation.act(self.simd, &self.actor, states, actions);
    }

    /// Weights `[outputs][inputs]` and biases of each layer, as other programs have them. After each layer but the
    /// last comes [`Policy::activation`], after the last tanh.
    pub fn layers(&self) -> Vec<(Vec<Vec<f32>>, Vec<f32>)> {
        let of = |layer: &Dense| {
            let rows: Vec<&[f32]> = layer.rows().collect();
            let (biases, weights) =
                rows.split_last().map_or((&[][..], &[][..]), |(last, rest)| (*last, rest));
            let column = |k: usize| weights.iter().filter_map(|row| row.get(k).copied()).collect();
            ((0..biases.len()).map(column).collect(), biases.to_vec())
        };
        self.actor.layers().iter().map(of).collect()
    }

    /// Of the hidden layers.
    pub fn activation(&self) -> Activation {
        self.actor.activation()
    }

    /// Sizes of the layers, the activation (0: ReLU, 1: tanh), then the weights.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut writer = Writer(&mut bytes);
        let sizes = self.actor.sizes();
        writer.count(sizes.len() as u64);
        sizes.iter().for_each(|&size| writer.count(size as u64));
        writer.count(self.actor.activation() as u64);
        writer.network(&self.actor);
        bytes
    }

    /// Reads what [`Policy::to_bytes`] gave; refuses everything else before it takes memory for it.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, LearnError> {
        let mut reader = Reader(bytes);
        let layers = reader.count()?;
        if !(2..=32).contains(&layers) {
            return Err(LearnError::Damaged { reason: "it has no such number of layers" });
        }
        let sizes = (0..layers).map(|_| reader.count()).collect::<Result<Vec<u64>, _>>()?;
        if !sizes.iter().all(|size| (1..=LARGEST).contains(size)) {
            return Err(LearnError::Damaged { reason: "a layer has no such size" });
        }
        let activation = match reader.count()? {
            0 => Activation::Relu,
            1 => Activation::Tanh,
            _ => return Err(LearnError::Damaged { reason: "it has no such activation" }),
        };
        let floats: u64 = sizes.windows(2).map(|pair| (pair[0] + 1) * pair[1]).sum();
        let (expected, found) = (4 * floats as usize, reader.0.len());
        if expected != found {
            return Err(LearnError::WrongSize { expected, found });
        }
        let sizes: Vec<usize> = sizes.into_iter().map(|size| size as usize).collect();
        let mut actor = Mlp::zeros(&sizes).with(activation);
        reader.network(&mut actor)?;
        Ok(Self::new(Simd::best(), actor))
    }
}
