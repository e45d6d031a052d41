//! Lines of equal value over a grid (marching squares), and lines with fewer points.

use std::collections::BTreeMap;

/// Values at the nodes of a grid, row by row. Nodes are told by column and row; what is not finite is below
/// every level.
pub struct Field<'a> {
    pub columns: usize,
    pub values: &'a [f64],
}

/// A node of the grid with a ring of nodes around it: the grid's own begin at (1, 1).
type Node = (usize, usize);

impl Field<'_> {
    pub fn rows(&self) -> usize {
        self.values.len() / self.columns.max(1)
    }

    fn value(&self, (i, j): Node) -> Option<f64> {
        let (i, j) = (i.checked_sub(1)?, j.checked_sub(1)?);
        let value = if i < self.columns { self.values.get(j * self.columns + i) } else { None };
        value.copied().filter(|value| value.is_finite())
    }

    fn is_above(&self, node: Node, level: f64) -> bool {
        self.value(node).is_some_and(|value| value >= level)
    }

    /// Column and row; those of the ring lie on the border of the grid.
    fn place(&self, (i, j): Node) -> [f64; 2] {
        let within = |k: usize, count: usize| k.saturating_sub(1).min(count.saturating_sub(1)) as f64;
        [within(i, self.columns), within(j, self.rows())]
    }

    /// Where the values between two nodes, one above the level and one below, pass it.
    fn crossing(&self, a: Node, b: Node, level: f64) -> [f64; 2] {
        let (inside, outside) = if self.is_above(a, level) { (a, b) } else { (b, a) };
        let (from, to) = (self.place(inside), self.place(outside));
        let share = match (self.value(inside), self.value(outside)) {
            (Some(high), Some(low)) => (high - level) / (high - low),
            _ => 0.0,
        };
        [from[0] + share * (to[0] - from[0]), from[1] + share * (to[1] - from[1])]
    }

    /// The borders of the region at or above a level, as closed lines in columns and rows with the region to
    /// their left. Where it reaches the border of the grid, they run along it.
    pub fn loops(&self, level: f64) -> Vec<Vec<[f64; 2]>> {
        let width = self.columns + 2;
        // An edge is told by its lower left node and its direction.
        let edge = |(i, j): Node, upwards: bool| 2 * (j * width + i) + usize::from(upwards);
        let mut next = BTreeMap::new();
        for j in 0..=self.rows() {
            for i in 0..=self.columns {
                let corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
                let above = corners.map(|corner| self.is_above(corner, level));
                let [a, b, c, d] = above;
                let edges = [
                    edge((i, j), false),
                    edge((i + 1, j), true),
                    edge((i, j + 1), false),
                    edge((i, j), true),
                ];
                let leaves = [a && !b, b && !c, c && !d, d && !a];
                let enters = [!a && b, !b && c, !c && d, !d && a];
                let joined = a == c && b == d && self.mean(corners).is_some_and(|mean| mean >= level);
                for k in (0..4).filter(|&k| leaves[k]) {
                    // Forwards round the corner that is below, or backwards round the one above.
                    let partner = (1..4).map(|n| if joined { (k + n) % 4 } else { (k + 4 - n) % 4 });
                    if let Some(end) = partner.into_iter().find(|&end| enters[end]) {
                        next.insert(edges[k], edges[end]);
                    }
                }
            }
        }
        let point = |edge: usize| {
            let (node, upwards) = (edge / 2, edge % 2);
            let (i, j) = (node % width, node / width);
            self.crossing((i, j), if upwards == 1 { (i, j + 1) } else { (i + 1, j) }, level)
        };
        let mut loops = Vec::new();
        while let Some((first, mut edge)) = next.pop_first() {
            let mut points = vec![point(first)];
            while let Some(after) = next.remove(&edge) {
                points.push(point(edge));
                edge = after;
            }
            loops.push(points);
        }
        loops
    }

    fn mean(&self, corners: [Node; 4]) -> Option<f64> {
        let [a, b, c, d] = corners.map(|corner| self.value(corner));
        Some((a? + b? + c? + d?) / 4.0)
    }
}

/// The closed line with fewer points; those left out are at most `tolerance` away from it.
pub fn simplified_loop(mut points: Vec<[f64; 2]>, tolerance: f64) -> Vec<[f64; 2]> {
    points.extend(points.first().copied());
    let mut kept = simplified(&points, tolerance);
    kept.pop();
    kept
}

/// The line with fewer points; those left out are at most `tolerance` away from it (Douglas and Peucker 1973).
pub fn simplified(points: &[[f64; 2]], tolerance: f64) -> Vec<[f64; 2]> {
    let mut kept: Vec<bool> = points.iter().map(|_| false).collect();
    let mut parts = vec![(0, points.len().saturating_sub(1))];
    while let Some((first, last)) = parts.pop() {
        [first, last].into_iter().for_each(|end| kept.get_mut(end).into_iter().for_each(|kept| *kept = true));
        let (Some(a), Some(b)) = (points.get(first), points.get(last)) else { continue };
        let between = points.iter().enumerate().take(last).skip(first + 1);
        let far = between.map(|(k, p)| (k, distance(*p, *a, *b))).max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((k, far)) = far
            && far > tolerance
        {
            parts.extend([(first, k), (k, last)]);
        }
    }
    points.iter().zip(kept).filter(|(_, kept)| *kept).map(|(point, _)| *point).collect()
}

/// Of a point from the straight line between two others.
fn distance(p: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
    let along = [b[0] - a[0], b[1] - a[1]];
    let away = [p[0] - a[0], p[1] - a[1]];
    let square = along[0] * along[0] + along[1] * along[1];
    let share =
        if square > 0.0 { ((away[0] * along[0] + away[1] * along[1]) / square).clamp(0.0, 1.0) } else { 0.0 };
    libm::hypot(away[0] - share * along[0], away[1] - share * along[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Twice the area, positive if anticlockwise.
    fn area(points: &[[f64; 2]]) -> f64 {
        let next = points.iter().cycle().skip(1);
        points.iter().zip(next).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum()
    }

    #[test]
    fn one_high_node_gives_one_diamond() {
        let values = [0.0, 0.0, 0.0, 0.0, 4.0, 0.0, 0.0, 0.0, 0.0];
        let loops = Field { columns: 3, values: &values }.loops(1.0);
        assert_eq!(loops.len(), 1);
        let mut corners = loops[0].clone();
        corners.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
        assert_eq!(corners, [[0.25, 1.0], [1.0, 0.25], [1.0, 1.75], [1.75, 1.0]]);
        assert!(area(&loops[0]) > 0.0, "the region is to the left");
    }

    #[test]
    fn a_region_that_reaches_the_border_is_closed_along_it() {
        let values = [5.0, 0.0, 5.0, 0.0];
        let loops = Field { columns: 2, values: &values }.loops(2.5);
        assert_eq!(loops.len(), 1);
        assert_eq!(area(&loops[0]) / 2.0, 0.5);
        let all = Field { columns: 2, values: &[1.0; 6] }.loops(0.0);
        assert_eq!((all.len(), area(&all[0]) / 2.0), (1, 2.0));
        assert!(Field { columns: 2, values: &[1.0; 6] }.loops(2.0).is_empty());
    }

    /// Between the two high corners of a saddle the mean decides.
    #[test]
    fn saddles_are_parted_or_joined_by_their_mean() {
        let saddle = |low: f64| [3.0, low, low, 3.0];
        let count = |values: &[f64]| Field { columns: 2, values }.loops(1.0).len();
        assert_eq!(count(&saddle(-2.0)), 2);
        assert_eq!(count(&saddle(0.5)), 1);
    }

    #[test]
    fn what_is_not_finite_belongs_to_no_region() {
        let mut values = [1.0; 9];
        values[4] = f64::NAN;
        let loops = Field { columns: 3, values: &values }.loops(0.0);
        let mut areas: Vec<f64> = loops.iter().map(|points| area(points) / 2.0).collect();
        areas.sort_by(f64::total_cmp);
        assert_eq!(areas, [-2.0, 4.0], "a hole between the nodes around it");
    }

    /// Every point of every line lies on the level, by interpolation along the edge of the grid that it is on.
    #[test]
    fn points_of_contours_have_the_level() {
        let (columns, rows) = (23, 17);
        let value = |x: f64, y: f64| libm::sin(0.7 * x) * libm::cos(0.5 * y) + 0.03 * x;
        let values: Vec<f64> =
            (0..rows).flat_map(|j| (0..columns).map(move |i| value(i as f64, j as f64))).collect();
        let field = Field { columns, values: &values };
        let (mut inner, mut border) = (0, 0);
        for level in [-0.6, -0.1, 0.0, 0.2, 0.75] {
            for [x, y] in field.loops(level).into_iter().flatten() {
                let (i, j) = (x.floor() as usize, y.floor() as usize);
                let (next_i, next_j) = (x.ceil() as usize, y.ceil() as usize);
                assert!(x == x.floor() || y == y.floor(), "({x}, {y}) is on no edge");
                let (a, b) = (values[j * columns + i], values[next_j * columns + next_i]);
                let share = (x - x.floor()) + (y - y.floor());
                if (a + share * (b - a) - level).abs() < 1e-9 {
                    inner += 1;
                } else {
                    let on = |k: f64, last: usize| k == 0.0 || k == last as f64;
                    assert!(on(x, columns - 1) || on(y, rows - 1), "({x}, {y}) is not on {level}");
                    assert!(a >= level);
                    border += 1;
                }
            }
        }
        assert!(inner > 200 && border > 50, "{inner} {border}");
    }

    #[test]
    fn simpler_lines_stay_near() {
        let circle: Vec<[f64; 2]> = (0..1000)
            .map(|k| f64::from(k) * std::f64::consts::TAU / 1000.0)
            .map(|angle| [100.0 * libm::cos(angle), 100.0 * libm::sin(angle)])
            .collect();
        let simpler = simplified_loop(circle, 0.05);
        assert!((60..200).contains(&simpler.len()), "{}", simpler.len());
        let ideal = std::f64::consts::TAU * 1e4;
        assert!((area(&simpler) - ideal).abs() < 0.001 * ideal);
        assert_eq!(simplified(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]], 0.1), [[0.0, 0.0], [2.0, 0.0]]);
        assert_eq!(simplified(&[], 0.1), [[0.0; 2]; 0]);
        assert_eq!(simplified(&[[1.0, 2.0]], 0.1), [[1.0, 2.0]]);
    }
}
