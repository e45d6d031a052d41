//! Passes through networks of every depth and of odd widths, for odd batches: against plain sums in f64, and
//! bit for bit between the widths of vectors.

use mpgx_random::{Address, Purpose};

use super::{Activations, Gradients, Mlp};
use crate::adam::Adam;
use crate::kernels::{Activation, AdamStep, Rows, Simd};

/// Sizes of layers, and batches.
const CASES: [(&[usize], &[usize]); 8] = [
    (&[7, 1], &[1, 15, 16, 17, 100, 256]),
    (&[3, 17, 2], &[1, 15, 16, 17, 100, 256]),
    (&[6, 40, 30, 1], &[1, 15, 16, 17, 100, 256]),
    (&[5, 7, 1, 33, 3], &[1, 17]),
    (&[4, 16, 17, 7, 48, 20, 2], &[1, 15, 16, 17, 100, 256]),
    (&[4, 400, 300, 1], &[16]),
    (&[2, 401, 7], &[17]),
    (&[1, 300, 17, 400, 1], &[1]),
];

/// Makes the first moment the gradient itself and leaves the weights alone.
const MEASURE: AdamStep = AdamStep { beta_1: 0.0, beta_2: 0.0, rate: 0.0, epsilon: 1.0, tau: 0.0 };

struct Problem {
    network: Mlp,
    x: Rows,
    /// The gradient with respect to the outputs.
    slope: Rows,
}

fn problem(sizes: &[usize], rows: usize, activation: Activation) -> Problem {
    let address =
        Address { master: 5, purpose: Purpose::Weights, protocol: 0, part: 0, seed: 0, episode: 0, step: 0 };
    let mut stream = address.stream();
    let network = Mlp::random(sizes, &mut stream).with(activation);
    let mut random = |features| {
        let mut all = Rows::new(rows, features);
        (0..rows).for_each(|row| all.row_mut(row).fill_with(|| stream.normal() as f32));
        all
    };
    let (x, slope) = (random(sizes[0]), random(sizes[sizes.len() - 1]));
    Problem { network, x, slope }
}

/// Outputs, then the gradients with respect to the inputs and to the weights of each layer, biases last.
fn found(problem: &Problem, simd: Simd) -> Vec<f32> {
    let Problem { network, x, slope } = problem;
    let (sizes, rows) = (network.sizes(), x.rows());
    let (mut h, mut d) = (Activations::new(&sizes, rows), Gradients::new(&sizes, rows));
    network.forward(simd, x, &mut h);
    for row in 0..rows {
        d.output_mut().row_mut(row).copy_from_slice(slope.row(row));
    }
    network.backward(simd, 0..sizes[0], &h, &mut d);
    let mut all: Vec<f32> = (0..rows).flat_map(|row| h.output().row(row).to_vec()).collect();
    for row in 0..rows {
        all.extend((0..sizes[0]).map(|i| d.input.get(row, i)));
    }
    let mut adam = Adam::new(&sizes);
    network.clone().descend(simd, (x, &h), &mut d, (&mut adam, &MEASURE), None);
    all.extend(adam.m.layers().iter().flat_map(|layer| layer.rows().flatten()));
    all
}

/// What [`found`] gives, in f64.
fn plain(problem: &Problem) -> Vec<f64> {
    let Problem { network, x, slope } = problem;
    let layers: Vec<Vec<Vec<f64>>> = network
        .layers()
        .iter()
        .map(|layer| layer.rows().map(|row| row.iter().map(|&w| w.into()).collect()).collect())
        .collect();
    let mut slopes: Vec<Vec<Vec<f64>>> =
        layers.iter().map(|layer| layer.iter().map(|row| vec![0.0; row.len()]).collect()).collect();
    let (mut outputs, mut inputs) = (Vec::new(), Vec::new());
    for row in 0..x.rows() {
        let mut h = vec![x.row(row).iter().map(|&x| f64::from(x)).collect::<Vec<_>>()];
        for (l, w) in layers.iter().enumerate() {
            let (below, last) = (&h[l], l + 1 == layers.len());
            let sum = |o: usize| w[below.len()][o] + below.iter().zip(w).map(|(h, w)| h * w[o]).sum::<f64>();
            let activate = |y: f64| match network.activation() {
                _ if last => y,
                Activation::Relu => y.max(0.0),
                Activation::Tanh => y.tanh(),
            };
            h.push((0..w[0].len()).map(sum).map(activate).collect());
        }
        outputs.extend(&h[layers.len()]);
        let mut d: Vec<f64> = slope.row(row).iter().map(|&d| d.into()).collect();
        for (l, w) in layers.iter().enumerate().rev() {
            for (i, slopes) in slopes[l].iter_mut().enumerate() {
                let x = h[l].get(i).copied().unwrap_or(1.0);
                slopes.iter_mut().zip(&d).for_each(|(slope, d)| *slope += x * d);
            }
            let through = |h: f64| match network.activation() {
                _ if l == 0 => 1.0,
                Activation::Relu => f64::from(u8::from(h > 0.0)),
                Activation::Tanh => 1.0 - h * h,
            };
            let back =
                |(&h, w): (&f64, &Vec<f64>)| through(h) * w.iter().zip(&d).map(|(w, d)| w * d).sum::<f64>();
            d = h[l].iter().zip(w).map(back).collect();
        }
        inputs.extend(d);
    }
    outputs.into_iter().chain(inputs).chain(slopes.into_iter().flatten().flatten()).collect()
}

#[test]
fn passes_of_any_shape_are_plain_sums_with_the_same_bits_in_every_width() {
    for (sizes, batches) in CASES {
        for &batch in batches {
            for activation in [Activation::Relu, Activation::Tanh] {
                let problem = problem(sizes, batch, activation);
                let what = format!("{sizes:?} {batch} {activation:?}");
                let found = Simd::available().map(|simd| self::found(&problem, simd)).collect::<Vec<_>>();
                let expected = plain(&problem);
                assert_eq!(found[0].len(), expected.len(), "{what}");
                let scale = 1.0 + (batch as f64).sqrt();
                for (k, (found, expected)) in found[0].iter().zip(&expected).enumerate() {
                    let error = (f64::from(*found) - expected).abs();
                    assert!(error <= 2e-6 * scale, "{what}, entry {k}: {found}, not {expected}");
                }
                let bits = |values: &[f32]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
                assert!(found.iter().all(|other| bits(other) == bits(&found[0])), "{what}");
            }
        }
    }
}
