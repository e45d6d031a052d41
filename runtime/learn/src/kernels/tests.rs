//! The kernels against plain sums in f64, and every width against the scalar one, bit for bit.

use mpgx_random::{Address, Purpose, Stream};

use super::lanes::Lanes;
use super::*;

mod tanh;

/// Batches: one, a part of a panel, a whole one, a little more, many.
const BATCHES: [usize; 6] = [1, 15, 16, 17, 100, 256];
/// Inputs and outputs: of every remainder that the blocks leave.
const SHAPES: [(usize, usize); 7] = [(1, 1), (7, 1), (3, 17), (12, 40), (19, 48), (37, 300), (64, 5)];
/// Layers of the usual size and a little more, for a few batches.
const LARGE: [(usize, usize); 4] = [(6, 400), (400, 300), (300, 1), (17, 401)];

/// Batch, inputs, outputs.
fn cases() -> impl Iterator<Item = (usize, usize, usize)> {
    let of = |batches: &'static [usize], shapes: &'static [(usize, usize)]| {
        batches.iter().flat_map(|&batch| shapes.iter().map(move |&(i, o)| (batch, i, o)))
    };
    of(&BATCHES, &SHAPES).chain(of(&[1, 17], &LARGE))
}

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

/// Divides by powers of two, up to 2¹⁴⁹, each number by another.
fn shrink<'a>(values: impl Iterator<Item = &'a mut f32>) {
    values.enumerate().for_each(|(k, value)| *value *= 0.5f32.powi((37 * k % 150) as i32));
}

/// What the kernels are given.
struct Given {
    x: Rows,
    dy: Rows,
    w: Dense,
    m: Dense,
    v: Dense,
    target: Dense,
}

fn given(batch: usize, inputs: usize, outputs: usize) -> Given {
    let [w, m, mut v, target] = [3, 4, 5, 6].map(|part| random_dense(inputs, outputs, part));
    v.rows_mut().flatten().for_each(|v| *v = v.abs());
    let (x, dy) = (random_rows(batch, inputs, 1), random_rows(batch, outputs, 2));
    Given { x, dy, w, m, v, target }
}

fn run(simd: Simd, given: &Given, fused: bool) -> Outcome {
    let Given { x, dy, w, m, v, target } = given;
    let (batch, inputs, outputs) = (x.rows(), x.features(), dy.features());
    let mut dy_panels = Panels::new(batch, outputs);
    to_panels(dy, &mut dy_panels);
    let mut all = Outcome {
        y: Rows::new(batch, outputs),
        dx: Panels::new(batch, inputs),
        w: w.clone(),
        m: m.clone(),
        v: v.clone(),
        target: target.clone(),
    };
    simd.forward(w, x, Some(Activation::Relu), &mut all.y);
    let Outcome { w, m, v, target, dx, .. } = &mut all;
    if fused {
        let trained = Trained { w, m, v, target: Some(target) };
        simd.backward_update(x, (dy, &dy_panels), dx, &STEP, trained);
    } else {
        simd.backward(w, 0..inputs, &dy_panels, dx);
        simd.update(x, dy, &STEP, Trained { w, m, v, target: Some(target) });
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

fn same_in_every_width_and_both_passes(given: &Given, what: &str) -> Outcome {
    let scalar = run(Simd(Level::Scalar), given, false);
    for simd in Simd::available() {
        for fused in [false, true] {
            let other = run(simd, given, fused);
            assert!(all_bits(&other) == all_bits(&scalar), "{simd:?} {what} fused: {fused}");
        }
    }
    scalar
}

/// Seen to fail when scalar code rounds a product before it adds, when 16 lanes sum from the end, and when the last
/// block of rows is not moved back.
#[test]
fn every_width_and_both_passes_give_the_same_bits() {
    let names: Vec<_> = Simd::available().map(Simd::name).collect();
    eprintln!("compared: {}", names.join(", "));
    for (batch, inputs, outputs) in cases() {
        let given = given(batch, inputs, outputs);
        same_in_every_width_and_both_passes(&given, &format!("{batch} {inputs} {outputs}"));
    }
}

/// Sums and products of tiny numbers, in and out; moments below the least normal number become 0.
#[test]
fn subnormal_numbers_go_the_same_way_in_every_width() {
    let mut subnormal_outputs = 0;
    for (batch, inputs, outputs) in [(1, 37, 40), (17, 19, 48), (100, 1, 300)] {
        let mut given = given(batch, inputs, outputs);
        let Given { x, dy, w, m, v, target } = &mut given;
        for rows in [x, dy] {
            for row in 0..batch {
                shrink(rows.row_mut(row).iter_mut());
            }
        }
        for dense in [w, m, v, target] {
            shrink(dense.rows_mut().flatten());
        }
        let outcome = same_in_every_width_and_both_passes(&given, &format!("{batch} {inputs} {outputs}"));
        let count =
            |dense: &Dense, test: fn(f32) -> bool| dense.rows().flatten().filter(|&&x| test(x)).count();
        let subnormal = |x: f32| x.is_subnormal();
        for (before, after) in [(&given.m, &outcome.m), (&given.v, &outcome.v)] {
            assert!(count(before, subnormal) > 10 && count(after, subnormal) == 0);
            assert!(count(after, |x| x == 0.0) > 10);
        }
        assert!(count(&outcome.w, subnormal) > 0 && count(&outcome.target, subnormal) > 0);
        let y = (0..batch).flat_map(|row| outcome.y.row(row));
        subnormal_outputs += y.filter(|y| y.is_subnormal()).count();
    }
    assert!(subnormal_outputs > 0);
}

fn close(a: f32, b: f64, scale: f64, what: &str) {
    assert!((f64::from(a) - b).abs() <= 1e-5 * scale, "{what}: {a} {b}");
}

#[test]
fn the_numbers_are_those_of_the_formulas() {
    for (batch, inputs, outputs) in cases() {
        let given = given(batch, inputs, outputs);
        let outcome = run(Simd::best(), &given, true);
        let Given { x, dy, w, m, v, target } = &given;
        let get = |dense: &Dense, i: usize, o: usize| f64::from(dense.data()[i * dense.stride() + o]);
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
                let v = 0.999 * get(v, i, o) + 0.001 * g * g;
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

#[test]
fn padding_stays_zero() {
    let outcome = run(Simd::best(), &given(17, 3, 17), true);
    for dense in [&outcome.w, &outcome.m, &outcome.v, &outcome.target] {
        assert!(dense.data().chunks_exact(32).all(|row| row[17..].iter().all(|&value| value.to_bits() == 0)));
    }
}

/// A subnormal moment would slow every later step down. Seen to fail without `flush`.
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
fn a_gradient_passes_an_activation() {
    for simd in Simd::available() {
        for (rows, features) in [(1, 1), (16, 16), (17, 33), (100, 40), (256, 7)] {
            for activation in [Activation::Relu, Activation::Tanh] {
                let h = random_rows(rows, features, 1);
                let before = random_rows(rows, features, 2);
                let (mut d, mut d_rows) = (Panels::new(rows, features), Rows::new(rows, features));
                to_panels(&before, &mut d);
                simd.through(activation, &h, &mut d, &mut d_rows);
                for row in 0..rows {
                    for i in 0..features {
                        let (h, before) = (h.row(row)[i], before.row(row)[i]);
                        let expected = match activation {
                            Activation::Relu => {
                                if h > 0.0 {
                                    before
                                } else {
                                    0.0
                                }
                            }
                            Activation::Tanh => before * (-h).mul_add(h, 1.0),
                        };
                        let found = [d.get(row, i), d_rows.row(row)[i]];
                        assert_eq!(found, [expected; 2], "{simd:?} {activation:?} {row} {i}");
                    }
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
    let mut out = [[0.0f32; 16]; 14];
    for k in (0..16).step_by(L::WIDTH) {
        // SAFETY: the features are the caller's promise, and k + WIDTH ≤ 16.
        unsafe {
            let [a, b, c]: [L; 3] = [&a, &b, &c].map(|values| L::load(values.as_ptr().add(k)));
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
                a.at_most(b),
                a.abs(),
                a.with_sign_of(b),
                a.choose_below(b, b, c),
                a.last_bits_as_exponent(),
            ];
            for (result, out) in results.into_iter().zip(&mut out) {
                result.store(out.as_mut_ptr().add(k));
            }
        }
    }
    let canonical = |x: f32| if x.is_nan() { f32::NAN.to_bits() } else { x.to_bits() };
    out.into_iter().flatten().map(canonical).collect()
}

/// Seen to fail with a scalar `relu` by `max`, with the operands of `relu` or `at_most` exchanged, and when one width
/// flushes or chooses at a limit where the others do not.
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
