//! Where a sample lies and how far it spreads.

/// Arithmetic mean; NaN of an empty sample.
///
/// Summed as distances from the first value, so that equal values have exactly that mean and no variance.
pub fn mean(x: &[f64]) -> f64 {
    let origin = x.first().copied().unwrap_or_default();
    origin + x.iter().map(|value| value - origin).sum::<f64>() / x.len() as f64
}

/// Sample variance with n − 1 in the denominator; NaN below two values.
pub fn variance(x: &[f64]) -> f64 {
    if x.len() < 2 {
        return f64::NAN;
    }
    let centre = mean(x);
    x.iter().map(|value| (value - centre) * (value - centre)).sum::<f64>() / (x.len() - 1) as f64
}

/// Interquartile mean: the mean of what is left when ⌊n/4⌋ values are dropped at each end; NaN of an empty
/// sample. (Agarwal et al., "Deep RL at the edge of the statistical precipice", 2021.)
pub fn iqm(x: &[f64]) -> f64 {
    let mut sorted = x.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let cut = sorted.len() / 4;
    mean(sorted.get(cut..sorted.len() - cut).unwrap_or_default())
}

/// The q-quantile of an ascending sample, linear between neighbours (type 7 of Hyndman and Fan, NumPy's
/// default); `q` is clamped to [0, 1]. `None` of an empty sample.
pub fn quantile(ascending: &[f64], q: f64) -> Option<f64> {
    let last = ascending.len().checked_sub(1)?;
    let place = q.clamp(0.0, 1.0) * last as f64;
    let below = *ascending.get(place as usize)?;
    let above = *ascending.get((place as usize + 1).min(last))?;
    Some(below + (above - below) * place.fract())
}
