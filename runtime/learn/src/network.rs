//! A multi-layer perceptron: dense layers with an activation between them, the last one linear.

use std::ops::Range;

use mpgx_random::Stream;

use crate::adam::Adam;
use crate::kernels::{Activation, AdamStep, Dense, Panels, Rows, Simd, Trained, to_panels};

/// The weights of a network, or anything of their shape.
#[derive(Clone)]
pub(crate) struct Mlp {
    layers: Vec<Dense>,
    /// Of the hidden layers.
    activation: Activation,
}

impl Mlp {
    /// Zeros, with ReLU. `sizes`: inputs, each hidden layer, outputs.
    pub(crate) fn zeros(sizes: &[usize]) -> Self {
        let layers = sizes.windows(2).map(|pair| Dense::new(pair[0], pair[1])).collect();
        Self { layers, activation: Activation::Relu }
    }

    /// The same weights with another activation.
    pub(crate) fn with(self, activation: Activation) -> Self {
        Self { activation, ..self }
    }

    pub(crate) fn activation(&self) -> Activation {
        self.activation
    }

    /// Weights and biases drawn uniformly from ±1/√fan_in, with ReLU.
    pub(crate) fn random(sizes: &[usize], stream: &mut Stream) -> Self {
        let mut network = Self::zeros(sizes);
        for layer in &mut network.layers {
            let bound = 1.0 / libm::sqrt(layer.inputs() as f64);
            for value in layer.rows_mut().flatten() {
                *value = ((2.0 * stream.uniform() - 1.0) * bound) as f32;
            }
        }
        network
    }

    pub(crate) fn layers(&self) -> &[Dense] {
        &self.layers
    }

    pub(crate) fn layers_mut(&mut self) -> &mut [Dense] {
        &mut self.layers
    }

    /// Inputs, each hidden layer, outputs.
    pub(crate) fn sizes(&self) -> Vec<usize> {
        let inputs = self.layers.first().map(Dense::inputs);
        inputs.into_iter().chain(self.layers.iter().map(Dense::outputs)).collect()
    }

    /// Leaves the output of every layer in `h`; that of the last is not yet squashed. x: `[rows][inputs]`.
    pub(crate) fn forward(&self, simd: Simd, x: &Rows, h: &mut Activations) {
        let last = self.layers.len() - 1;
        for (l, layer) in self.layers.iter().enumerate() {
            let (below, here) = h.0.split_at_mut(l);
            let activation = (l < last).then_some(self.activation);
            simd.forward(layer, below.last().unwrap_or(x), activation, &mut here[0]);
        }
    }

    /// The gradient with respect to some of the inputs, into `d.input`, from that in `d.output_mut()`.
    pub(crate) fn backward(&self, simd: Simd, inputs: Range<usize>, h: &Activations, d: &mut Gradients) {
        d.spread_output();
        for (l, layer) in self.layers.iter().enumerate().rev() {
            let (below, here) = d.panels.split_at_mut(l);
            match below.last_mut() {
                Some(below) => {
                    simd.backward(layer, 0..layer.inputs(), &here[0], below);
                    simd.through(self.activation, &h.0[l - 1], below, &mut d.rows[l - 1]);
                }
                None => simd.backward(layer, inputs.clone(), &here[0], &mut d.input),
            }
        }
    }

    /// One step of Adam down the gradient in `d.output_mut()`, and of the target after the weights.
    /// `x` and `h` are those of the last [`Mlp::forward`].
    pub(crate) fn descend(
        &mut self,
        simd: Simd,
        (x, h): (&Rows, &Activations),
        d: &mut Gradients,
        (adam, step): (&mut Adam, &AdamStep),
        mut target: Option<&mut Mlp>,
    ) {
        d.spread_output();
        for (l, w) in self.layers.iter_mut().enumerate().rev() {
            let (m, v) = (&mut adam.m.layers[l], &mut adam.v.layers[l]);
            let target = target.as_deref_mut().map(|target| &mut target.layers[l]);
            let trained = Trained { w, m, v, target };
            let (below, here) = d.panels.split_at_mut(l);
            match below.last_mut() {
                Some(below) => {
                    let h = &h.0[l - 1];
                    simd.backward_update(h, (&d.rows[l], &here[0]), below, step, trained);
                    simd.through(self.activation, h, below, &mut d.rows[l - 1]);
                }
                None => simd.update(x, &d.rows[l], step, trained),
            }
        }
    }
}

/// The outputs of all layers for a batch.
#[derive(Clone)]
pub(crate) struct Activations(Vec<Rows>);

impl Activations {
    /// For networks of these sizes and batches of at most `rows`.
    pub(crate) fn new(sizes: &[usize], rows: usize) -> Self {
        Self(sizes[1..].iter().map(|&features| Rows::new(rows, features)).collect())
    }

    /// Of the network: `[rows][outputs]`.
    pub(crate) fn output(&self) -> &Rows {
        &self.0[self.0.len() - 1]
    }
}

/// Gradients of the loss with respect to the outputs of all layers before their activation, in both layouts, and
/// with respect to the inputs.
pub(crate) struct Gradients {
    rows: Vec<Rows>,
    panels: Vec<Panels>,
    pub(crate) input: Panels,
}

impl Gradients {
    /// For networks of these sizes and batches of `rows`.
    pub(crate) fn new(sizes: &[usize], rows: usize) -> Self {
        Self {
            rows: sizes[1..].iter().map(|&features| Rows::new(rows, features)).collect(),
            panels: sizes[1..].iter().map(|&features| Panels::new(rows, features)).collect(),
            input: Panels::new(rows, sizes[0]),
        }
    }

    /// With respect to the outputs of the network, `[rows][outputs]`: where backward passes begin.
    pub(crate) fn output_mut(&mut self) -> &mut Rows {
        let last = self.rows.len() - 1;
        &mut self.rows[last]
    }

    fn spread_output(&mut self) {
        let last = self.rows.len() - 1;
        to_panels(&self.rows[last], &mut self.panels[last]);
    }
}

#[cfg(test)]
mod shapes;
#[cfg(test)]
mod tests;
