//! Comparing by rank.

/// P(X > Y) of finite samples, ties one half: Mann and Whitney's U over n_x n_y; NaN if a sample is empty.
pub fn probability_of_improvement(x: &[f64], y: &[f64]) -> f64 {
    let mut u = 0.0;
    for a in x {
        for b in y {
            if a > b {
                u += 1.0;
            } else if a == b {
                u += 0.5;
            }
        }
    }
    u / (x.len() as f64 * y.len() as f64)
}
