//! The kernels against plain sums in f64, and every width against the scalar one, bit for bit.

use mpgx_random::{Address, Purpose, Stream};

use super::lanes::Lanes;
use super::*;

/// Batches: one, a part of a panel, a whole one, a little more, many.
const BATCHES: [usize; 5] = [1, 15, 16, 17, 100];
/// Inputs and outputs: of every remainder that the blocks leave.
const SHAPES: [(usize, usize); 6] = [(1, 1), (3, 17), (12, 40), (19, 48), (37, 300), (64, 5)];

fn stream(part: usize) -> Stream {
    Address {
        master: 7,
        purpose: Purpose::Weights,
        protocol: 0,
        part: part as u16,
        seed: 0,
        episode: 0,
        step: 0,
    }
    .stream()
}

fn random_rows(rows: usize, features: usize, part: usize) -> Rows {
    let mut stream = stream(part);
    let mut all = Rows::new(rows, features);
    for row in 0..rows {
        all.row_mut(row).fill_with(|| stream.normal() as f32);
    }
    all
}

fn random_dense(inputs: usize, outputs: usize, part: usize) -> Dense {
    let mut stream = stream(part);
    let mut dense = Dense::new(inputs, outputs);
    dense.rows_mut().flatten().for_each(|value| *value = stream.normal() as f32);
    dense
}

/// Everything that the kernels make of one layer and one batch.
struct Outcome {
    y: Rows,
    dx: Panels,
    w: Dense,
    m: Dense,
    v: Dense,
    target: Dense,
}

const STEP: AdamStep = AdamStep { beta_1: 0.9, beta_2: 0.999, rate: 1e-2, epsilon: 1e-8, tau: 0.25 };

fn run(simd: Simd, batch: usize, inputs: usize, outputs: usize, fused: bool) -> Outcome {
    let x = random_rows(batch, inputs, 1);
    let dy = random_rows(batch, outputs, 2);
    let mut dy_panels = Panels::new(batch, outputs);
    to_panels(&dy, &mut dy_panels);
    let mut all = Outcome {
        y: Rows::new(batch, outputs),
        dx: Panels::new(batch, inputs),
        w: random_dense(inputs, outputs, 3),
        m: random_dense(inputs, outputs, 4),
        v: random_dense(inputs, outputs, 5),
        target: random_dense(inputs, outputs, 6),
    };
    all.v.rows_mut().flatten().for_each(|v| *v = v.abs());
    simd.forward(&all.w, &x, true, &mut all.y);
    let Outcome { w, m, v, target, dx, .. } = &mut all;
    if fused {
        let trained = Trained { w, m, v, target: Some(target) };
        simd.backward_update(&x, (&dy, &dy_panels), dx, &STEP, trained);
    } else {
        simd.backward(w, 0..inputs, &dy_panels, dx);
        simd.update(&x, &dy, &STEP, Trained { w, m, v, target: Some(target) });
    }
    all
}

fn bits<'a>(values: impl IntoIterator<Item = &'a f32>) -> Vec<u32> {
    values.into_iter().map(|value| value.to_bits()).collect()
}

/// All numbers, without the padding of the batch.
fn all_bits(outcome: &Outcome) -> Vec<u32> {
    let Outcome { y, dx, w, m, v, target } = outcome;
    let y_bits = (0..y.rows()).flat_map(|row| bits(y.row(row)));
    let dx_bits = (0..y.rows()).flat_map(|row| (0..dx.features()).map(move |i| dx.get(row, i).to_bits()));
    y_bits.chain(dx_bits).chain([w, m, v, target].into_iter().flat_map(|d| bits(d.data()))).collect()
}

#[test]
fn every_width_and_both_passes_give_the_same_bits() {
    let names: Vec<_> = Simd::available().map(Simd::name).collect();
    eprintln!("compared: {}", names.join(", "));
    for batch in BATCHES {
        for (inputs, outputs) in SHAPES {
            let scalar = all_bits(&run(Simd(Level::Scalar), batch, inputs, outputs, false));
            for simd in Simd::available() {
                for fused in [false, true] {
                    let other = all_bits(&run(simd, batch, inputs, outputs, fused));
                    assert!(other == scalar, "{simd:?} {batch} {inputs} {outputs} fused: {fused}");
                }
            }
        }
    }
}

fn close(a: f32, b: f64, scale: f64, what: &str) {
    assert!((f64::from(a) - b).abs() <= 1e-5 * scale, "{what}: {a} {b}");
}

#[test]
fn the_numbers_are_those_of_the_formulas() {
    for batch in BATCHES {
        for (inputs, outputs) in SHAPES {
            let outcome = run(Simd::best(), batch, inputs, outputs, true);
            let (x, dy) = (random_rows(batch, inputs, 1), random_rows(batch, outputs, 2));
            let before = [3, 4, 5, 6].map(|part| random_dense(inputs, outputs, part));
            let get = |dense: &Dense, i: usize, o: usize| f64::from(dense.data()[i * dense.stride() + o]);
            let [w, m, v, target] = &before;
            for b in 0..batch {
                for o in 0..outputs {
                    let sum: f64 = (0..inputs).map(|i| f64::from(x.row(b)[i]) * get(w, i, o)).sum();
                    let y = (sum + get(w, inputs, o)).max(0.0);
                    close(outcome.y.row(b)[o], y, inputs as f64, "y");
                }
                for i in 0..inputs {
                    let dx = (0..outputs).map(|o| f64::from(dy.row(b)[o]) * get(w, i, o)).sum();
                    close(outcome.dx.get(b, i), dx, outputs as f64, "dx");
                }
            }
            for i in 0..=inputs {
                for o in 0..outputs {
                    let x = |b: usize| if i < inputs { f64::from(x.row(b)[i]) } else { 1.0 };
                    let g: f64 = (0..batch).map(|b| x(b) * f64::from(dy.row(b)[o])).sum();
                    let m = 0.9 * get(m, i, o) + 0.1 * g;
                    let v = 0.999 * get(v, i, o).abs() + 0.001 * g * g;
                    let w = get(w, i, o) - 1e-2 * m / (v.sqrt() + 1e-8);
                    let target = get(target, i, o) + 0.25 * (w - get(target, i, o));
                    close(get(&outcome.m, i, o) as f32, m, batch as f64, "m");
                    close(get(&outcome.v, i, o) as f32, v, (batch * batch) as f64, "v");
                    close(get(&outcome.w, i, o) as f32, w, 1.0 + m.abs() / v.sqrt(), "w");
                    close(get(&outcome.target, i, o) as f32, target, 1.0 + m.abs() / v.sqrt(), "target");
                }
            }
        }
    }
}

#[test]
fn padding_stays_zero() {
    let outcome = run(Simd::best(), 17, 3, 17, true);
    for dense in [&outcome.w, &outcome.m, &outcome.v, &outcome.target] {
        assert!(dense.data().chunks_exact(32).all(|row| row[17..].iter().all(|&value| value.to_bits() == 0)));
    }
}

/// A subnormal moment would slow every later step down.
#[test]
fn subnormal_moments_become_zero() {
    for simd in Simd::available() {
        let zeros = Rows::new(16, 1);
        let [mut w, mut m, mut v] = [(); 3].map(|()| Dense::new(1, 1));
        for moment in [&mut m, &mut v] {
            moment.rows_mut().flatten().for_each(|value| *value = f32::MIN_POSITIVE);
        }
        simd.update(&zeros, &zeros, &STEP, Trained { w: &mut w, m: &mut m, v: &mut v, target: None });
        assert!(m.data().iter().chain(v.data()).all(|value| value.to_bits() == 0), "{simd:?}");
    }
}

#[test]
fn a_gradient_passes_a_relu_where_it_is_positive() {
    for simd in Simd::available() {
        for (rows, features) in [(1, 1), (16, 16), (17, 33), (100, 40)] {
            let h = random_rows(rows, features, 1);
            let before = random_rows(rows, features, 2);
            let (mut d, mut d_rows) = (Panels::new(rows, features), Rows::new(rows, features));
            to_panels(&before, &mut d);
            simd.through_relu(&h, &mut d, &mut d_rows);
            for row in 0..rows {
                for i in 0..features {
                    let expected = if h.row(row)[i] > 0.0 { before.row(row)[i] } else { 0.0 };
                    assert_eq!([d.get(row, i), d_rows.row(row)[i]], [expected; 2], "{simd:?} {row} {i}");
                }
            }
        }
    }
}

/// Numbers where rounding, signs of zero, subnormal numbers and NaN could go different ways.
const HARD: [f32; 16] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    1.000_000_1,
    3.333_333_3e-3,
    -7.123_456e7,
    f32::MIN_POSITIVE,
    -f32::MIN_POSITIVE,
    1e-40,
    -1e-45,
    f32::MAX,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::NAN,
    16_777_217.0,
];

/// Every operation on HARD, HARD turned by `shift`, and HARD turned twice.
///
/// # Safety
///
/// The CPU has the features of `L`.
#[inline(always)]
unsafe fn operations<L: Lanes>(shift: usize) -> Vec<u32> {
    let turned = |by: usize| -> [f32; 16] { std::array::from_fn(|k| HARD[(k + by) % 16]) };
    let (a, b, c) = (turned(0), turned(shift), turned(2 * shift));
    let mut out = [[0.0f32; 16]; 9];
    for k in (0..16).step_by(L::WIDTH) {
        // SAFETY: the features are the caller's promise, and k + WIDTH ≤ 16.
        unsafe {
            let [a, b, c] = [&a, &b, &c].map(|values| L::load(values.as_ptr().add(k)));
            let results = [
                a.add(b),
                a.sub(b),
                a.mul(b),
                a.div(b),
                a.sqrt(),
                a.mul_add(b, c),
                a.relu(),
                a.flush(),
                a.where_positive(b),
            ];
            for (result, out) in results.into_iter().zip(&mut out) {
                result.store(out.as_mut_ptr().add(k));
            }
        }
    }
    let canonical = |x: f32| if x.is_nan() { f32::NAN.to_bits() } else { x.to_bits() };
    out.into_iter().flatten().map(canonical).collect()
}

#[cfg(target_arch = "x86_64")]
#[test]
fn every_operation_rounds_the_same_in_every_width() {
    use std::arch::x86_64::{__m256, __m512};
    for shift in 0..16 {
        // SAFETY: scalar code needs no feature; the others run only where they were detected.
        unsafe {
            let scalar = operations::<f32>(shift);
            if Simd::named("avx2").is_some() {
                assert_eq!(scalar, operations::<__m256>(shift), "avx2, shift {shift}");
            }
            if Simd::named("avx512").is_some() {
                assert_eq!(scalar, operations::<__m512>(shift), "avx512, shift {shift}");
            }
        }
    }
}
