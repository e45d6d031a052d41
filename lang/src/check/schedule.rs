//! Numbers that change over training.

use super::Checker;
use super::value::OUT_OF_RANGE;
use crate::hir::Expr;
use crate::plan::Curve;
use crate::problem::Problem;

impl Checker<'_> {
    /// Reports a schedule that no curve fits. `parts`: from, to, begin and end.
    pub fn schedule(&mut self, curve: Curve, parts: &[Expr]) {
        let values: Vec<Option<f64>> =
            parts.iter().map(|part| self.constant(part, &"a part of a schedule")).collect();
        if curve == Curve::Geometric {
            for (part, value) in parts.iter().zip(&values).take(2) {
                if value.is_some_and(|value| value <= 0.0) {
                    let problem =
                        Problem::error(&OUT_OF_RANGE, "`geometric` multiplies, so both ends are above 0");
                    self.report(
                        problem
                            .at(part.span, "not above 0")
                            .help("use `linear` or `cosine`, or a small number"),
                    );
                }
            }
        }
        if let ([_, _, Some(begin), Some(end)], [.., begins, ends]) = (values.as_slice(), parts)
            && begin > end
        {
            let problem = Problem::error(&OUT_OF_RANGE, "a schedule ends after it begins");
            let (begin, end) = (100.0 * begin, 100.0 * end);
            self.report(
                problem
                    .at(ends.span, format!("ends at {end}%"))
                    .with(begins.span, format!("begins at {begin}%")),
            );
        }
    }
}
