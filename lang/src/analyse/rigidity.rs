//! Which motions a graph of distances leaves free in the plane.
//!
//! The rigidity matrix has a row for each edge: how its length changes as the nodes move. Its rank is at most 2n − 3;
//! with that rank nothing can move but the whole. (Asimow and Roth, The rigidity of graphs, 1978.)

use nalgebra::{DMatrix, SymmetricEigen};

/// What of the largest eigenvalue counts as zero; the eigenvalues are squares.
const ZERO: f64 = 1e-10;

/// Nodes in a plane, and the pairs of them whose distance is given.
#[derive(Clone, Debug)]
pub struct Framework {
    pub nodes: usize,
    pub edges: Vec<(usize, usize)>,
}

/// What can still move.
#[derive(Clone, Debug, PartialEq)]
pub struct Freedom {
    /// Of the rigidity matrix.
    pub rank: usize,
    /// The largest part that is rigid in itself, or all nodes.
    pub body: Vec<usize>,
    /// A pair, not yet joined, whose distance changes as the rest moves.
    pub missing: Option<(usize, usize)>,
}

impl Framework {
    /// The rank of something rigid.
    pub fn full_rank(&self) -> usize {
        (2 * self.nodes).saturating_sub(3)
    }

    pub fn degree(&self, node: usize) -> usize {
        self.neighbours(node).len()
    }

    pub fn neighbours(&self, node: usize) -> Vec<usize> {
        let ends = self.edges.iter().filter_map(|&(a, b)| match node {
            _ if a == node => Some(b),
            _ if b == node => Some(a),
            _ => None,
        });
        let mut neighbours: Vec<usize> = ends.collect();
        neighbours.sort_unstable();
        neighbours.dedup();
        neighbours
    }

    /// The parts that hang together when some nodes are taken out.
    pub fn parts(&self, without: &[usize]) -> Vec<Vec<usize>> {
        let mut near = vec![Vec::new(); self.nodes];
        for &(a, b) in &self.edges {
            near.iter_mut().skip(a).take(1).for_each(|near| near.push(b));
            near.iter_mut().skip(b).take(1).for_each(|near| near.push(a));
        }
        let mut seen: Vec<bool> = (0..self.nodes).map(|node| without.contains(&node)).collect();
        let mut parts = Vec::new();
        for first in 0..self.nodes {
            let mut open = vec![first];
            let mut part = Vec::new();
            while let Some(node) = open.pop() {
                if seen.get(node) != Some(&false) {
                    continue;
                }
                seen.iter_mut().skip(node).take(1).for_each(|seen| *seen = true);
                part.push(node);
                open.extend(near.get(node).into_iter().flatten());
            }
            if !part.is_empty() {
                part.sort_unstable();
                parts.push(part);
            }
        }
        parts
    }

    /// What can move, from places that have no symmetry.
    pub fn freedom(&self) -> Freedom {
        let places = scattered(self.nodes);
        let place = |node: usize| places.get(node).copied().unwrap_or_default();
        let mut matrix = DMatrix::<f64>::zeros(self.edges.len(), 2 * self.nodes);
        for (row, &(a, b)) in self.edges.iter().enumerate() {
            let (pa, pb) = (place(a), place(b));
            for axis in 0..2 {
                let along = pa[axis] - pb[axis];
                matrix[(row, 2 * a + axis)] = along;
                matrix[(row, 2 * b + axis)] = -along;
            }
        }
        let eigen = SymmetricEigen::new(matrix.transpose() * matrix);
        let largest = eigen.eigenvalues.iter().copied().fold(0.0, f64::max);
        let free: Vec<usize> = (0..2 * self.nodes)
            .filter(|k| eigen.eigenvalues.get(*k).is_none_or(|value| *value <= ZERO * largest))
            .collect();
        // Whether two nodes keep their distance in all that can happen.
        let tied = |a: usize, b: usize| {
            free.iter().all(|&k| {
                let motion = |node: usize, axis: usize| eigen.eigenvectors[(2 * node + axis, k)];
                let (pa, pb) = (place(a), place(b));
                let change: f64 =
                    (0..2).map(|axis| (pa[axis] - pb[axis]) * (motion(a, axis) - motion(b, axis))).sum();
                change.abs() < 1e-6
            })
        };
        let bodies = self.edges.iter().map(|&(a, b)| {
            (0..self.nodes).filter(|&c| (c == a || tied(a, c)) && (c == b || tied(b, c))).collect::<Vec<_>>()
        });
        let body = bodies.fold(Vec::new(), |best, body| if body.len() > best.len() { body } else { best });
        let pairs = (0..self.nodes).flat_map(|a| (a + 1..self.nodes).map(move |b| (a, b)));
        let missing = pairs.into_iter().find(|&(a, b)| !tied(a, b));
        Freedom { rank: 2 * self.nodes - free.len(), body, missing }
    }
}

/// Places without symmetry, the same on every machine: steps of irrational length.
pub fn scattered(nodes: usize) -> Vec<[f64; 2]> {
    const STEP: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];
    (1..=nodes).map(|k| STEP.map(|step| (k as f64 * step).fract() * 2.0 - 1.0)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn framework(nodes: usize, edges: &[(usize, usize)]) -> Framework {
        Framework { nodes, edges: edges.to_vec() }
    }

    #[test]
    fn ranks_are_those_of_the_textbook() {
        let complete = |n: usize| (0..n).flat_map(|a| (a + 1..n).map(move |b| (a, b))).collect::<Vec<_>>();
        for n in 2..9 {
            let freedom = framework(n, &complete(n)).freedom();
            assert_eq!((freedom.rank, freedom.body.len(), freedom.missing), (2 * n - 3, n, None));
        }
        // A square swings until it has a diagonal.
        let square = [(0, 1), (1, 2), (2, 3), (3, 0)];
        let freedom = framework(4, &square).freedom();
        assert_eq!((freedom.rank, freedom.body.len(), freedom.missing), (4, 2, Some((0, 2))));
        assert_eq!(framework(4, &[square.as_slice(), &[(0, 2)]].concat()).freedom().rank, 5);
        // The complete bipartite graph of 3 and 3 is rigid, two triangles with one common node are not.
        let k33: Vec<_> = (0..3).flat_map(|a| (3..6).map(move |b| (a, b))).collect();
        assert_eq!(framework(6, &k33).freedom().rank, 9);
        let bow = framework(5, &[(0, 1), (1, 2), (2, 0), (2, 3), (3, 4), (4, 2)]).freedom();
        assert_eq!((bow.rank, bow.body), (6, vec![0, 1, 2]));
        // Enough edges in the wrong places: four nodes complete, the fifth on one edge.
        let lollipop = [complete(4).as_slice(), &[(3, 4)]].concat();
        let freedom = framework(5, &lollipop).freedom();
        assert_eq!((freedom.rank, freedom.body), (6, vec![0, 1, 2, 3]));
    }

    #[test]
    fn parts_fall_apart_where_they_are_cut() {
        let path = framework(5, &[(0, 1), (1, 2), (3, 4)]);
        assert_eq!(path.parts(&[]), [vec![0, 1, 2], vec![3, 4]]);
        assert_eq!(path.parts(&[1]), [vec![0], vec![2], vec![3, 4]]);
        assert_eq!((path.degree(1), path.neighbours(0)), (2, vec![1]));
    }
}
