//! Series of numbers inside the page: packed, and thinned where they are drawn.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

/// The upper 24 bits of each number as an IEEE single, little-endian, in base64: four letters and about four
/// digits each. What is missing or no number becomes NaN.
pub fn pack(values: impl IntoIterator<Item = Option<f64>>) -> String {
    let bytes: Vec<u8> = values
        .into_iter()
        .flat_map(|value| {
            let value = value.unwrap_or(f64::NAN) as f32;
            let bits =
                if value.is_finite() { value.to_bits().saturating_add(0x80) } else { f32::NAN.to_bits() };
            bits.to_le_bytes().into_iter().skip(1)
        })
        .collect();
    STANDARD.encode(bytes)
}

/// Which points of a line to keep so that it looks the same: the largest triangle of each of `count` buckets with
/// the point kept before and the mean of the bucket after (Steinarsson 2013). Ascending; first and last stay.
pub fn lttb(points: &[(f64, f64)], count: usize) -> Vec<usize> {
    if points.len() <= count.max(3) {
        return (0..points.len()).collect();
    }
    let inner = points.len() - 2;
    let buckets = count.max(3) - 2;
    let border = |bucket: usize| 1 + bucket * inner / buckets;
    let mut kept = vec![0];
    let mut before = points.first().copied().unwrap_or_default();
    for bucket in 0..buckets {
        let after = match points.get(border(bucket + 1)..border(bucket + 2).min(points.len())) {
            Some(next) if bucket + 1 < buckets && !next.is_empty() => mean(next),
            _ => points.last().copied().unwrap_or_default(),
        };
        let area = |&(x, y): &(f64, f64)| {
            ((before.0 - after.0) * (y - before.1) - (before.0 - x) * (after.1 - before.1)).abs()
        };
        let places = border(bucket)..border(bucket + 1);
        let candidates = places.clone().zip(points.get(places).unwrap_or_default());
        if let Some((k, point)) = candidates.max_by(|(_, a), (_, b)| area(a).total_cmp(&area(b))) {
            kept.push(k);
            before = *point;
        }
    }
    kept.push(points.len() - 1);
    kept
}

fn mean(points: &[(f64, f64)]) -> (f64, f64) {
    let n = points.len() as f64;
    (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_come_back_with_four_digits() {
        let values = [0.0, 1.0, -2.5, 1234.56, -1e-7, 3e30, 20_000.0];
        let bytes = STANDARD.decode(pack(values.map(Some))).unwrap();
        assert_eq!(bytes.len(), 3 * values.len());
        for (value, b) in values.iter().zip(bytes.chunks(3)) {
            let back = f64::from(f32::from_le_bytes([0, b[0], b[1], b[2]]));
            assert!((back - value).abs() <= 2e-5 * value.abs(), "{value} came back as {back}");
        }
        let missing = STANDARD.decode(pack([None, Some(f64::INFINITY), Some(1e300)])).unwrap();
        for b in missing.chunks(3) {
            assert!(f32::from_le_bytes([0, b[0], b[1], b[2]]).is_nan());
        }
    }

    #[test]
    fn a_thinned_line_keeps_its_ends_and_peaks() {
        let height = |k: usize| if k == 437 { 9.0 } else { (k % 7) as f64 * 0.01 };
        let points: Vec<_> = (0..1000).map(|k| (k as f64, height(k))).collect();
        let kept = lttb(&points, 50);
        assert_eq!(kept.len(), 50);
        assert!(kept.is_sorted() && kept.contains(&437), "{kept:?}");
        assert_eq!((kept[0], kept[49]), (0, 999));
        assert_eq!(lttb(&points[..3], 50), [0, 1, 2]);
        assert_eq!(lttb(&[], 50), [0usize; 0]);
    }
}
