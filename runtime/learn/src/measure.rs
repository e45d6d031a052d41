//! What there is to measure: the limits of the machine, the kernels of a layer, and the work of an update.
//! Nothing here looks at a clock; whoever does divides by it.

use std::hint::black_box;

use crate::adam::Adam;
use crate::kernels::{Activation, Dense, Panels, Rows, Simd, Trained};

/// Something that can be run again and again, and what one run of it does.
pub struct Kernel {
    pub name: &'static str,
    pub work: Work,
    pub run: Box<dyn FnMut() + Send>,
}

/// Floating-point operations, and bytes that are read and written, each array once.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Work {
    pub flops: f64,
    pub read: f64,
    pub written: f64,
}

/// What one core can do at most, as measured with [`machine`].
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    pub flops_per_s: f64,
    /// Reading arrays as large as all that a learner trains.
    pub read_bytes_per_s: f64,
    /// Reading and writing them.
    pub bytes_per_s: f64,
}

impl Work {
    /// The least time within the limits, seconds: of computing or of moving, whichever is longer.
    ///
    /// Source: Williams, Waterman and Patterson, Roofline, Communications of the ACM 52(4), 2009.
    pub fn bound_s(&self, limits: &Limits) -> f64 {
        let moving = if self.written > 0.0 {
            (self.read + self.written) / limits.bytes_per_s
        } else {
            self.read / limits.read_bytes_per_s
        };
        moving.max(self.flops / limits.flops_per_s)
    }

    fn times(self, share: f64) -> Self {
        Self { flops: share * self.flops, read: share * self.read, written: share * self.written }
    }
}

/// The networks of a learner and its mini-batch.
#[derive(Clone, Debug)]
pub struct Shape {
    pub state: usize,
    pub action: usize,
    pub hidden: Vec<usize>,
    pub batch: usize,
    /// Critic updates for each actor and target update.
    pub delay: usize,
}

impl Shape {
    /// Inputs and outputs of each layer of the actor.
    fn actor(&self) -> Vec<[usize; 2]> {
        layers(self.state, &self.hidden, self.action)
    }

    /// Inputs and outputs of each layer of a critic.
    fn critic(&self) -> Vec<[usize; 2]> {
        layers(self.state + self.action, &self.hidden, 1)
    }

    /// Weights and biases of the actor and of both critics.
    fn parameters(&self) -> usize {
        let count = |layers: Vec<[usize; 2]>| layers.iter().map(|[i, o]| (i + 1) * o).sum::<usize>();
        count(self.actor()) + 2 * count(self.critic())
    }

    /// The parts of an update as the algorithms here need them (two critics, two targets, one actor), by layer;
    /// what is done at every `delay`-th update counts in that share.
    pub fn update(&self) -> Vec<Work> {
        let rows = self.batch as f64;
        let often = 1.0 / self.delay as f64;
        let multiply = |[i, o]: [usize; 2]| 2.0 * rows * i as f64 * o as f64;
        let bytes = |[i, o]: [usize; 2]| 4.0 * (i + 1) as f64 * o as f64;
        let pass = |layer| Work { flops: multiply(layer), read: bytes(layer), written: 0.0 };
        // The gradients of weights and inputs, Adam, and perhaps the target.
        let descend = |(l, layer): (usize, [usize; 2]), target: f64| Work {
            flops: multiply(layer) * if l == 0 { 1.0 } else { 2.0 }
                + (ADAM + 3.0 * target) * bytes(layer) / 4.0,
            read: (3.0 + target) * bytes(layer),
            written: (3.0 + target) * bytes(layer),
        };
        let (actor, critic) = (self.actor(), self.critic());
        let mut parts = Vec::new();
        let forward = |layers: &[[usize; 2]], times: f64, parts: &mut Vec<Work>| {
            parts.extend(layers.iter().map(|&layer| pass(layer).times(times)));
        };
        // π(s′), Q̂₁ and Q̂₂ there, Q₁ and Q₂; at a delayed update also π(s) and Q₁ there, with its gradient.
        forward(&actor, 1.0 + often, &mut parts);
        forward(&critic, 4.0 + 2.0 * often, &mut parts);
        for layer in critic.into_iter().enumerate() {
            parts.push(descend(layer, 0.0).times(2.0 * (1.0 - often)));
            parts.push(descend(layer, 1.0).times(2.0 * often));
        }
        parts.extend(actor.into_iter().enumerate().map(|layer| descend(layer, 0.0).times(often)));
        parts
    }
}

/// Operations of Adam for one weight, of which one is a division and one a square root.
const ADAM: f64 = 12.0;

fn layers(inputs: usize, hidden: &[usize], outputs: usize) -> Vec<[usize; 2]> {
    let sizes = [&[inputs][..], hidden, &[outputs]].concat();
    sizes.windows(2).map(|pair| [pair[0], pair[1]]).collect()
}

/// The kernels that tell the [`Limits`], in the order of its fields.
pub fn machine(shape: &Shape) -> [Kernel; 3] {
    const ROUNDS: usize = 10_000;
    let simd = Simd::best();
    let one = Dense::new(shape.parameters().div_ceil(1024), 1024);
    let bytes = 4.0 * 1024.0 * (one.inputs() + 1) as f64;
    let mut four: [Dense; 4] = std::array::from_fn(|_| one.clone());
    let flops = 2.0 * simd.multiply_adds(ROUNDS).1 as f64;
    [
        Kernel {
            name: "multiply-adds in registers",
            work: Work { flops, ..Work::default() },
            run: Box::new(move || {
                black_box(simd.multiply_adds(black_box(ROUNDS)));
            }),
        },
        Kernel {
            name: "reading",
            work: Work { read: bytes, ..Work::default() },
            run: Box::new(move || {
                black_box(simd.read(black_box(&one)));
            }),
        },
        Kernel {
            name: "reading and writing",
            work: Work { read: 4.0 * bytes, written: 4.0 * bytes, ..Work::default() },
            run: Box::new(move || simd.read_and_write(black_box(&mut four))),
        },
    ]
}

/// The kernels of a layer with so many inputs and outputs, for mini-batches of `rows`. Each run takes the next
/// of three layers, as an update does, so that its weights come from where they would.
pub fn kernels(rows: usize, [inputs, outputs]: [usize; 2]) -> [Kernel; 4] {
    let simd = Simd::best();
    let layer = || Dense::new(inputs, outputs);
    let multiply = 2.0 * (rows * inputs * outputs) as f64;
    let weights = ((inputs + 1) * outputs) as f64;
    let pass = Work { flops: multiply, read: 4.0 * weights, written: 0.0 };
    let trained = Work { flops: multiply + 15.0 * weights, read: 16.0 * weights, written: 16.0 * weights };
    let x = || {
        let mut x = Rows::new(rows, inputs);
        (0..rows).for_each(|row| x.row_mut(row).fill(0.1));
        x
    };
    let dy = || {
        let mut dy = Panels::new(rows, outputs);
        (0..rows).for_each(|row| (0..outputs).for_each(|o| dy.set(row, o, 1e-3)));
        dy
    };
    let dy_rows = || {
        let mut dy = Rows::new(rows, outputs);
        (0..rows).for_each(|row| dy.row_mut(row).fill(1e-3));
        dy
    };
    let mut turn = (0..3).cycle();
    let mut next = move || turn.next().unwrap_or(0);
    let three: [Dense; 3] = std::array::from_fn(|_| layer());
    let sets = || -> [[Dense; 4]; 3] { std::array::from_fn(|_| std::array::from_fn(|_| layer())) };
    let step = Adam::new(&[1, 1]).advance(1e-3, 0.005);
    [
        Kernel {
            name: "forward",
            work: pass,
            run: {
                let (three, x, mut y, mut next) =
                    (three.clone(), x(), Rows::new(rows, outputs), next.clone());
                Box::new(move || simd.forward(&three[next()], &x, Some(Activation::Relu), &mut y))
            },
        },
        Kernel {
            name: "backward to the inputs",
            work: pass,
            run: {
                let (dy, mut dx, mut next) = (dy(), Panels::new(rows, inputs), next.clone());
                Box::new(move || simd.backward(&three[next()], 0..inputs, &dy, &mut dx))
            },
        },
        Kernel {
            name: "gradient, Adam and target",
            work: trained,
            run: {
                let (mut sets, x, dy, mut next) = (sets(), x(), dy_rows(), next.clone());
                Box::new(move || {
                    let [w, m, v, target] = &mut sets[next()];
                    simd.update(&x, &dy, &step, Trained { w, m, v, target: Some(target) });
                })
            },
        },
        Kernel {
            name: "both in one pass",
            work: Work { flops: trained.flops + multiply, ..trained },
            run: {
                let (mut sets, x, rows_of, panels, mut dx) =
                    (sets(), x(), dy_rows(), dy(), Panels::new(rows, inputs));
                Box::new(move || {
                    let [w, m, v, target] = &mut sets[next()];
                    let trained = Trained { w, m, v, target: Some(target) };
                    simd.backward_update(&x, (&rows_of, &panels), &mut dx, &step, trained);
                })
            },
        },
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One layer of 2 × 3, batch 5: counted by hand.
    #[test]
    fn the_work_of_an_update_by_hand() {
        let shape = Shape { state: 2, action: 1, hidden: vec![], batch: 5, delay: 2 };
        // Actor 2 → 1: 20 flops and 12 bytes a pass; critic 3 → 1: 30 flops and 16 bytes.
        let total = |of: fn(&Work) -> f64| shape.update().iter().map(of).sum::<f64>();
        let adam = [12.0 * 3.0 * 0.5, 12.0 * 4.0 * 2.0 + 3.0 * 4.0];
        assert_eq!(
            total(|part| part.flops),
            20.0 * 1.5 + 30.0 * 5.0 + 20.0 * 0.5 + 30.0 * 2.0 + adam[0] + adam[1]
        );
        assert_eq!(total(|part| part.written), 12.0 * 3.0 * 0.5 + 16.0 * (3.0 + 4.0));
        let limits = Limits { flops_per_s: 10.0, read_bytes_per_s: 4.0, bytes_per_s: 2.0 };
        let part = Work { flops: 20.0, read: 6.0, written: 6.0 };
        assert_eq!(part.bound_s(&limits), 6.0);
        assert_eq!(Work { written: 0.0, ..part }.bound_s(&limits), 2.0);
    }

    #[test]
    fn every_kernel_runs() {
        let shape = Shape { state: 2, action: 1, hidden: vec![20, 7], batch: 3, delay: 2 };
        for mut kernel in machine(&shape).into_iter().chain(kernels(3, [20, 7])) {
            (kernel.run)();
            (kernel.run)();
            assert!(kernel.work.flops + kernel.work.read > 0.0, "{}", kernel.name);
        }
    }
}
