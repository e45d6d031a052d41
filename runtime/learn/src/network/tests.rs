//! Gradients against central differences in f64 and against dfdx.

use dfdx::prelude::*;
use mpgx_random::{Address, Purpose};

use super::{Activations, Gradients as Slopes, Mlp};
use crate::adam::Adam;
use crate::kernels::{AdamStep, Rows, Simd};

const SIZES: [usize; 4] = [5, 24, 17, 3];
const ROWS: usize = 17;
/// Makes the first moment the gradient itself and leaves the weights alone.
const MEASURE: AdamStep = AdamStep { beta_1: 0.0, beta_2: 0.0, rate: 0.0, epsilon: 1.0, tau: 0.0 };

/// A network, a batch of inputs, and the outputs that are wanted.
fn problem() -> (Mlp, Rows, Rows) {
    let address =
        Address { master: 3, purpose: Purpose::Weights, protocol: 0, part: 0, seed: 0, episode: 0, step: 0 };
    let mut stream = address.stream();
    let network = Mlp::random(&SIZES, &mut stream);
    let (mut x, mut wanted) = (Rows::new(ROWS, SIZES[0]), Rows::new(ROWS, SIZES[3]));
    for rows in [&mut x, &mut wanted] {
        (0..ROWS).for_each(|row| rows.row_mut(row).fill_with(|| stream.normal() as f32));
    }
    (network, x, wanted)
}

/// Of the sum over the outputs of the mean over the batch of (y − wanted)²: with respect to the weights, in
/// the order of [`flat`], and with respect to the inputs.
fn gradient(network: &Mlp, x: &Rows, wanted: &Rows) -> (Vec<f32>, Vec<f32>) {
    let simd = Simd::best();
    let (mut h, mut d) = (Activations::new(&SIZES, ROWS), Slopes::new(&SIZES, ROWS));
    network.forward(simd, x, &mut h);
    for row in 0..ROWS {
        let outputs = h.output().row(row).iter().zip(wanted.row(row));
        for ((y, wanted), d) in outputs.zip(d.output_mut().row_mut(row)) {
            *d = 2.0 * (y - wanted) / ROWS as f32;
        }
    }
    network.backward(simd, 0..SIZES[0], &h, &mut d);
    let inputs = (0..ROWS).flat_map(|row| (0..SIZES[0]).map(move |i| (row, i)));
    let inputs = inputs.map(|(row, i)| d.input.get(row, i)).collect();
    let mut adam = Adam::new(&SIZES);
    network.clone().descend(simd, (x, &h), &mut d, (&mut adam, &MEASURE), None);
    (flat(&adam.m), inputs)
}

/// Layer by layer, the weights row by row, then the biases.
fn flat(network: &Mlp) -> Vec<f32> {
    network.layers().iter().flat_map(|layer| layer.rows().flatten()).copied().collect()
}

/// The loss in f64, for weights as [`flat`] orders them.
fn loss(weights: &[f64], x: &[f64], wanted: &Rows) -> f64 {
    let mut total = 0.0;
    for (row, x) in x.chunks_exact(SIZES[0]).enumerate() {
        let (mut h, mut weights) = (x.to_vec(), weights);
        for (l, outputs) in SIZES[1..].iter().copied().enumerate() {
            let (w, rest) = weights.split_at(h.len() * outputs);
            let (bias, rest) = rest.split_at(outputs);
            let sum =
                |o: usize| bias[o] + h.iter().enumerate().map(|(i, h)| h * w[i * outputs + o]).sum::<f64>();
            h = (0..outputs).map(sum).map(|y| if l < 2 { y.max(0.0) } else { y }).collect();
            weights = rest;
        }
        total += h.iter().zip(wanted.row(row)).map(|(y, t)| (y - f64::from(*t)).powi(2)).sum::<f64>();
    }
    total / ROWS as f64
}

/// Every entry within 1e-4 of the greatest.
fn assert_close(found: &[f32], expected: &[f64]) {
    assert_eq!(found.len(), expected.len());
    let scale = expected.iter().fold(0.0f64, |scale, value| scale.max(value.abs()));
    for (k, (found, expected)) in found.iter().zip(expected).enumerate() {
        assert!((f64::from(*found) - expected).abs() <= 1e-4 * scale, "entry {k}: {found}, not {expected}");
    }
}

#[test]
fn gradients_are_central_differences() {
    let (network, x, wanted) = problem();
    let (weights, inputs) = gradient(&network, &x, &wanted);
    let wide = |values: Vec<f32>| values.into_iter().map(f64::from).collect::<Vec<_>>();
    let at = wide(flat(&network));
    let x = wide((0..ROWS).flat_map(|row| x.row(row).to_vec()).collect());
    const H: f64 = 1e-6;
    let slope = |from: &[f64], k: usize, f: &dyn Fn(&[f64]) -> f64| {
        let mut moved = from.to_vec();
        moved[k] = from[k] + H;
        let above = f(&moved);
        moved[k] = from[k] - H;
        (above - f(&moved)) / (2.0 * H)
    };
    let by_weight: Vec<f64> =
        (0..at.len()).map(|k| slope(&at, k, &|weights| loss(weights, &x, &wanted))).collect();
    let by_input: Vec<f64> = (0..x.len()).map(|k| slope(&x, k, &|x| loss(&at, x, &wanted))).collect();
    assert_close(&weights, &by_weight);
    assert_close(&inputs, &by_input);
}

#[test]
fn gradients_are_those_of_dfdx() {
    let (network, x, wanted) = problem();
    let (weights, inputs) = gradient(&network, &x, &wanted);
    let dev = Cpu::default();
    let tensor = |rows: &Rows, width: usize| {
        dev.tensor_from_vec((0..ROWS).flat_map(|row| rows.row(row).to_vec()).collect(), (ROWS, width))
    };
    let layers: Vec<_> = network
        .layers()
        .iter()
        .map(|layer| {
            let rows: Vec<&[f32]> = layer.rows().collect();
            let (inputs, outputs) = (layer.inputs(), layer.outputs());
            let w: Tensor<(usize, usize), f32, Cpu> =
                dev.tensor_from_vec(rows[..inputs].concat(), (inputs, outputs));
            let bias: Tensor<(usize,), f32, Cpu> = dev.tensor_from_vec(rows[inputs].to_vec(), (outputs,));
            (w, bias)
        })
        .collect();
    let x = tensor(&x, SIZES[0]);
    let mut h = x.leaky_trace();
    for (l, (w, bias)) in layers.iter().enumerate() {
        let shape = (ROWS, SIZES[l + 1]);
        let bias = bias.leaky_trace().broadcast_like::<_, Axis<0>>(&shape);
        h = h.matmul(w.clone()) + bias;
        if l < 2 {
            h = h.relu();
        }
    }
    let loss = (h - tensor(&wanted, SIZES[3])).square().sum::<Rank0, _>() / ROWS as f32;
    let slopes = loss.backward();
    let mut by_weight = Vec::new();
    for (w, bias) in &layers {
        by_weight.extend(slopes.get(w).as_vec());
        by_weight.extend(slopes.get(bias).as_vec());
    }
    let wide = |values: Vec<f32>| values.into_iter().map(f64::from).collect::<Vec<_>>();
    assert_close(&weights, &wide(by_weight));
    assert_close(&inputs, &wide(slopes.get(&x).as_vec()));
}
