//! The kernels of the larger layer, each beside the roofline.

use mpgx_learn::measure::{self, Limits, Shape};

use super::Figure;
use super::stopwatch::{Windows, seconds_a_run};

/// What the machine can do, then each kernel at this mini-batch.
pub fn figures(windows: Windows, shape: &Shape, limits: &Limits) -> Vec<Figure> {
    let mut figures = vec![
        Figure::new("multiply-adds in registers", limits.flops_per_s / 1e9, "GFLOP/s"),
        Figure::new("reading a learner's weights", limits.read_bytes_per_s / 1e9, "GB/s"),
        Figure::new("reading and writing them", limits.bytes_per_s / 1e9, "GB/s"),
    ];
    let widest = shape.hidden.windows(2).max_by_key(|pair| pair[0] * pair[1]);
    let Some(&[inputs, outputs]) = widest else { return figures };
    for mut kernel in measure::kernels(shape.batch, [inputs, outputs]) {
        let seconds = seconds_a_run(windows, &mut kernel.run);
        let what = format!("{}, batch {}, {inputs} × {outputs}", kernel.name, shape.batch);
        let share = Some(kernel.work.bound_s(limits) / seconds);
        figures.push(Figure { share, ..Figure::new(what, seconds * 1e6, "µs") });
    }
    figures
}
