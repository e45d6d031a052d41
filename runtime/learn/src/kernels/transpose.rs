//! From rows to panels and back.

use super::storage::{BLOCK, Panels, Rows};

/// Copies a batch into panels.
pub(crate) fn to_panels(rows: &Rows, panels: &mut Panels) {
    for row in 0..rows.rows() {
        for (feature, &value) in rows.row(row).iter().enumerate() {
            panels.set(row, feature, value);
        }
    }
}

/// The gradient through a ReLU, in both layouts: `d` becomes 0 where `h`, the ReLU's output, is not
/// positive, and `d_rows` becomes the same as `d`.
pub(crate) fn through_relu(h: &Rows, d: &mut Panels, d_rows: &mut Rows) {
    assert_eq!((h.features(), h.features()), (d.features(), d_rows.features()));
    d_rows.set_rows(h.rows());
    let features = h.features();
    for first in (0..h.rows()).step_by(BLOCK) {
        let samples = BLOCK.min(h.rows() - first);
        let panel = d.panel_mut(first / BLOCK);
        for sample in 0..samples {
            let h = h.row(first + sample);
            let d_row = d_rows.row_mut(first + sample);
            for feature in 0..features {
                let d = &mut panel[feature * BLOCK + sample];
                *d = if h[feature] > 0.0 { *d } else { 0.0 };
                d_row[feature] = *d;
            }
        }
    }
}
