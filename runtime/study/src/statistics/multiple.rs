//! Several tests at once.

/// Holm's step-down adjustment, in the order given: rejecting what lies below α then keeps the chance of any
/// false rejection below α.
pub fn holm(p: &[f64]) -> Vec<f64> {
    let mut ascending: Vec<(f64, usize)> = p.iter().copied().zip(0..).collect();
    ascending.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut adjusted = vec![0.0; p.len()];
    let mut reached = 0.0f64;
    for (rank, (p, place)) in ascending.iter().enumerate() {
        reached = reached.max((ascending.len() - rank) as f64 * p).min(1.0);
        adjusted[*place] = reached;
    }
    adjusted
}
