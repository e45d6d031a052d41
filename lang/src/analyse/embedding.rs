//! Whether distances can be met in the plane, and by which places.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::rigidity::scattered;

/// Two nodes and the distance they should have, m.
pub type Length = (usize, usize, f64);

/// A distance that cannot be: what it is, and the way round by other nodes that is shorter.
#[derive(Clone, Debug, PartialEq)]
pub struct Shortcut {
    pub edge: usize,
    /// From one end to the other.
    pub way: Vec<usize>,
    /// m
    pub length: f64,
}

/// Places and by how much a distance is missed, at most, m.
#[derive(Clone, Debug, PartialEq)]
pub struct Embedding {
    pub places: Vec<[f64; 2]>,
    pub worst: f64,
    /// The edge that is missed most.
    pub edge: usize,
}

/// Relative error at which a distance counts as met.
const MET: f64 = 1e-6;
/// Places that the search begins at.
const STARTS: usize = 8;
const ROUNDS: usize = 100;

/// The lengths of the shortest ways, and the node before the last on each.
fn ways(nodes: usize, lengths: &[Length]) -> (DMatrix<f64>, DMatrix<usize>) {
    let mut far = DMatrix::from_element(nodes, nodes, f64::INFINITY);
    let mut before = DMatrix::from_fn(nodes, nodes, |a, _| a);
    (0..nodes).for_each(|node| far[(node, node)] = 0.0);
    for &(a, b, length) in lengths {
        for (a, b) in [(a, b), (b, a)] {
            far[(a, b)] = far[(a, b)].min(length);
        }
    }
    for via in 0..nodes {
        for a in 0..nodes {
            for b in 0..nodes {
                let round = far[(a, via)] + far[(via, b)];
                if round < far[(a, b)] {
                    far[(a, b)] = round;
                    before[(a, b)] = before[(via, b)];
                }
            }
        }
    }
    (far, before)
}

/// The distance that is most at odds with a way round.
pub fn shortcut(nodes: usize, lengths: &[Length]) -> Option<Shortcut> {
    let (far, before) = ways(nodes, lengths);
    let excess = |&(a, b, length): &Length| length - far[(a, b)];
    let broken = lengths.iter().enumerate().filter(|(_, length)| excess(length) > MET * length.2);
    let (edge, &(a, b, _)) = broken.max_by(|x, y| excess(x.1).total_cmp(&excess(y.1)))?;
    let mut way = vec![b];
    while let Some(&last) = way.last()
        && last != a
        && way.len() <= nodes
    {
        way.push(before[(a, last)]);
    }
    way.reverse();
    Some(Shortcut { edge, way, length: far[(a, b)] })
}

/// The best places that are found: exact ones if there are any, as a rule.
pub fn embed(nodes: usize, lengths: &[Length]) -> Embedding {
    let mut best: Option<Embedding> = None;
    let size = lengths.iter().map(|length| length.2).fold(0.0, f64::max);
    for start in 0..STARTS {
        let places = match start {
            0 => scaled(nodes, lengths),
            _ => {
                let all = scattered(nodes * (start + 1));
                all.into_iter().skip(nodes * start).map(|place| place.map(|x| x * size)).collect()
            }
        };
        let found = settled(places, lengths);
        if best.as_ref().is_none_or(|best| found.worst < best.worst) {
            best = Some(found);
        }
        if best.as_ref().is_some_and(|best| best.worst <= MET * size) {
            break;
        }
    }
    best.unwrap_or(Embedding { places: Vec::new(), worst: 0.0, edge: 0 })
}

/// Whether an embedding meets the distances.
pub fn meets(embedding: &Embedding, lengths: &[Length]) -> bool {
    embedding.worst <= MET * lengths.iter().map(|length| length.2).fold(0.0, f64::max)
}

/// Classical scaling: the plane that keeps the lengths of the shortest ways best. (Torgerson, 1952.)
fn scaled(nodes: usize, lengths: &[Length]) -> Vec<[f64; 2]> {
    let (far, _) = ways(nodes, lengths);
    let longest = far.iter().copied().filter(|x| x.is_finite()).fold(0.0, f64::max);
    let squares = far.map(|x| if x.is_finite() { x * x } else { longest * longest });
    let means: Vec<f64> = squares.column_iter().map(|column| column.mean()).collect();
    let mean = squares.mean();
    let at = |k: usize| means.get(k).copied().unwrap_or_default();
    let centred = DMatrix::from_fn(nodes, nodes, |a, b| -(squares[(a, b)] - at(a) - at(b) + mean) / 2.0);
    let eigen = SymmetricEigen::new(centred);
    let mut order: Vec<usize> = (0..nodes).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let axis = |place: usize, k: usize| {
        order.get(k).map_or(0.0, |&k| eigen.eigenvalues[k].max(0.0).sqrt() * eigen.eigenvectors[(place, k)])
    };
    // A little off, so that what lies on a line can leave it.
    let off = scattered(nodes);
    let place = |(node, off): (usize, &[f64; 2])| {
        [axis(node, 0) + 1e-3 * longest * off[0], axis(node, 1) + 1e-3 * longest * off[1]]
    };
    off.iter().enumerate().map(place).collect()
}

fn missed(places: &[[f64; 2]], &(a, b, length): &Length) -> (f64, [f64; 2]) {
    let place = |node: usize| places.get(node).copied().unwrap_or_default();
    let along = [place(a)[0] - place(b)[0], place(a)[1] - place(b)[1]];
    let apart = (along[0] * along[0] + along[1] * along[1]).sqrt();
    let direction = if apart > 0.0 { along.map(|x| x / apart) } else { [1.0, 0.0] };
    (apart - length, direction)
}

/// Levenberg's and Marquardt's method on the missed lengths.
fn settled(mut places: Vec<[f64; 2]>, lengths: &[Length]) -> Embedding {
    let cost = |places: &[[f64; 2]]| -> f64 {
        lengths.iter().map(|length| missed(places, length).0).map(|miss| miss * miss).sum()
    };
    let size = 2 * places.len();
    let mut damping = 1e-3;
    let mut now = cost(&places);
    for _ in 0..ROUNDS {
        let mut normal = DMatrix::<f64>::zeros(size, size);
        let mut slope = DVector::<f64>::zeros(size);
        for length in lengths {
            let (miss, direction) = missed(&places, length);
            for i in 0..2 {
                for (node, sign) in [(length.0, 1.0), (length.1, -1.0)] {
                    slope[2 * node + i] -= sign * direction[i] * miss;
                    for j in 0..2 {
                        for (other, opposite) in [(length.0, 1.0), (length.1, -1.0)] {
                            normal[(2 * node + i, 2 * other + j)] +=
                                sign * opposite * direction[i] * direction[j];
                        }
                    }
                }
            }
        }
        (0..size).for_each(|k| normal[(k, k)] += damping);
        let Some(step) = normal.cholesky().map(|normal| normal.solve(&slope)) else { break };
        let moved: Vec<[f64; 2]> = places
            .iter()
            .enumerate()
            .map(|(node, place)| [place[0] + step[2 * node], place[1] + step[2 * node + 1]])
            .collect();
        let then = cost(&moved);
        let gained = now - then;
        if then < now {
            (places, now, damping) = (moved, then, damping * 0.3);
        } else {
            damping *= 10.0;
        }
        if now == 0.0 || damping > 1e9 || (gained > 0.0 && gained < 1e-16 * now) {
            break;
        }
    }
    let misses = lengths.iter().map(|length| missed(&places, length).0.abs()).enumerate();
    let (edge, worst) = misses.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, 0.0));
    Embedding { places, worst, edge }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_way_round_that_is_too_short_is_found() {
        let triangle = |c: f64| [(0, 1, 1.0), (1, 2, 1.0), (0, 2, c)];
        assert_eq!(shortcut(3, &triangle(1.9)), None);
        assert_eq!(shortcut(3, &triangle(2.0)), None, "on a line");
        let found = shortcut(3, &triangle(2.5));
        assert_eq!(found, Some(Shortcut { edge: 2, way: vec![0, 1, 2], length: 2.0 }));
        let round = [(0, 1, 1.0), (1, 2, 1.0), (2, 3, 1.0), (3, 0, 5.0)];
        assert_eq!(shortcut(4, &round).map(|it| (it.edge, it.way)), Some((3, vec![3, 2, 1, 0])));
    }

    #[test]
    fn distances_of_real_places_are_met_and_others_are_not() {
        for nodes in 3..10 {
            let places = scattered(nodes);
            let apart = |a: usize, b: usize| {
                ((places[a][0] - places[b][0]).powi(2) + (places[a][1] - places[b][1]).powi(2)).sqrt()
            };
            let pairs: Vec<_> = (0..nodes).flat_map(|a| (a + 1..nodes).map(move |b| (a, b))).collect();
            let mut lengths: Vec<Length> = pairs.iter().map(|&(a, b)| (a, b, apart(a, b))).collect();
            assert!(meets(&embed(nodes, &lengths), &lengths), "{nodes}");
            // Ways round stay longer, but no plane has room for it.
            if nodes > 3 {
                lengths[0].2 *= 1.02;
                assert!(!meets(&embed(nodes, &lengths), &lengths), "{nodes}");
            }
        }
        // Four nodes, each one metre from each other, and a rhombus.
        let unit: Vec<Length> = (0..4).flat_map(|a| (a + 1..4).map(move |b| (a, b, 1.0))).collect();
        assert!(!meets(&embed(4, &unit), &unit));
        assert!(meets(&embed(4, &unit[..5]), &unit[..5]));
        let line = [(0, 1, 1.0), (1, 2, 1.0), (0, 2, 2.0)];
        assert!(meets(&embed(3, &line), &line));
    }
}
