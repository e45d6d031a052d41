//! Norms of gradients, which are never stored: told by what a step adds to Adam's first moment.
//!
//! m′ = β₁ m + (1 − β₁) g, so g = (m′ − β₁ m) / (1 − β₁), to the rounding of m. A few updates in a thousand pay
//! for it, and every backend and vector width gives the bits of its own moments.

use crate::adam::{Adam, BETA_1};

/// Updates between two looks at a network's gradient.
pub(crate) const PROBE_EVERY: u64 = 250;

/// The first moment of one network before a step.
pub(crate) struct Probe {
    before: Vec<f32>,
}

impl Probe {
    /// With room for the moments of `adam`.
    pub(crate) fn new(adam: &Adam) -> Self {
        Self { before: Vec::with_capacity(moments(adam).count()) }
    }

    pub(crate) fn begin(&mut self, adam: &Adam) {
        self.before.clear();
        self.before.extend(moments(adam));
    }

    /// ‖g‖₂ of the step since [`Probe::begin`].
    pub(crate) fn norm(&self, adam: &Adam) -> f32 {
        let gradient =
            |(m, before): (f32, &f32)| (f64::from(m) - BETA_1 * f64::from(*before)) / (1.0 - BETA_1);
        let squares = moments(adam).zip(&self.before).map(gradient).map(|g| g * g);
        libm::sqrt(squares.sum()) as f32
    }
}

fn moments(adam: &Adam) -> impl Iterator<Item = f32> + '_ {
    adam.m.layers().iter().flat_map(|layer| layer.rows().flatten().copied())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two weights and a bias, whose gradients (3, 0, −4) and moments (1, −2, 5) are put in by hand.
    #[test]
    fn the_norm_is_that_of_what_was_added() {
        let mut adam = Adam::new(&[2, 1]);
        let put = |adam: &mut Adam, values: [f32; 3]| {
            let layers = adam.m.layers_mut().iter_mut();
            let rows = layers.flat_map(|layer| layer.rows_mut().flatten());
            rows.zip(values).for_each(|(m, value)| *m = value);
        };
        put(&mut adam, [1.0, -2.0, 5.0]);
        let mut probe = Probe::new(&adam);
        probe.begin(&adam);
        put(&mut adam, [0.9 + 0.3, -1.8, 4.5 - 0.4]);
        assert!((probe.norm(&adam) - 5.0).abs() < 1e-5, "{}", probe.norm(&adam));
    }
}
