//! tanh over the whole range of f32.

use super::super::*;

const CHUNK: usize = 4096;
/// tanh rounds to 1 from a little above 9 on.
const TOP: f32 = 10.0;

fn tanh(simd: Simd, x: &[f32]) -> Vec<f32> {
    let mut y = x.to_vec();
    y.resize(x.len().next_multiple_of(BLOCK), 0.0);
    simd.tanh_of_all(&mut y);
    y.truncate(x.len());
    y
}

/// Floats from all over the range, of both signs; and the special ones.
fn sampled() -> Vec<f32> {
    let special = [0.0, 0.625, TOP, 9.01, f32::MIN_POSITIVE, 1e-45, f32::MAX, f32::INFINITY];
    let positive = (0..f32::INFINITY.to_bits()).step_by(10_007).map(f32::from_bits).chain(special);
    positive.flat_map(|x| [x, -x]).collect()
}

/// Units in the last place of f32 between `found` and the exact value.
fn ulps(found: f32, exact: f64) -> f64 {
    let nearest = (exact as f32).abs().max(f32::MIN_POSITIVE);
    let unit = f64::from(f32::from_bits(nearest.to_bits() + 1)) - f64::from(nearest);
    (f64::from(found) - exact).abs() / unit
}

#[test]
fn it_is_tanh() {
    let x = sampled();
    let worst = |x: &[f32]| {
        let all = x.iter().zip(tanh(Simd::best(), x)).map(|(&x, y)| (ulps(y, libm::tanh(x.into())), x));
        all.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap()
    };
    let (error, at) = worst(&x);
    assert!(error < 2.0, "{error} units in the last place at {at}");
    // Where most activations lie.
    let x: Vec<f32> = (0x3a00_0000..TOP.to_bits()).step_by(101).map(f32::from_bits).collect();
    let (error, at) = worst(&x);
    assert!(error < 2.0, "{error} units in the last place at {at}");
    assert!(tanh(Simd::best(), &[f32::NAN])[0].is_nan());
}

#[test]
fn it_is_odd_and_has_the_same_bits_in_every_width() {
    let x = sampled();
    let bits = |simd| tanh(simd, &x).into_iter().map(f32::to_bits).collect::<Vec<_>>();
    let scalar = bits(Simd(Level::Scalar));
    assert!(scalar.chunks_exact(2).all(|pair| pair[0] ^ pair[1] == 1 << 31));
    for simd in Simd::available() {
        assert!(bits(simd) == scalar, "{simd:?}");
    }
}

/// Every float from 2⁻¹³, below which tanh x rounds to x, to where it is 1.
#[test]
fn it_never_falls() {
    let simd = Simd::best();
    let (mut last, mut values) = (0.0, [0.0f32; CHUNK]);
    let first = 0x3900_0000;
    for start in (first..TOP.to_bits()).step_by(CHUNK) {
        (start..).zip(&mut values).for_each(|(bits, value)| *value = f32::from_bits(bits));
        simd.tanh_of_all(&mut values);
        for (bits, &value) in (start..).zip(&values) {
            assert!(last <= value, "tanh {} is {value}, before it was {last}", f32::from_bits(bits));
            last = value;
        }
    }
    assert_eq!(last, 1.0);
}
