//! Which other shapes have the same distances: mirror images.

use super::rigidity::Framework;

/// A part of a shape that can be reflected by itself, over the line through two nodes.
#[derive(Clone, Debug, PartialEq)]
pub struct Flip {
    pub part: Vec<usize>,
    pub axis: (usize, usize),
}

/// Lengths that differ by less than this share of the size count as equal.
const EQUAL: f64 = 1e-5;

fn apart(a: [f64; 2], b: [f64; 2]) -> f64 {
    ((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1])).sqrt()
}

fn size(places: &[[f64; 2]]) -> f64 {
    let first = places.first().copied().unwrap_or_default();
    places.iter().map(|place| apart(first, *place)).fold(0.0, f64::max)
}

/// How far a place is from the line through two others.
fn off_line(place: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
    let cross = (b[0] - a[0]) * (place[1] - a[1]) - (b[1] - a[1]) * (place[0] - a[0]);
    cross.abs() / apart(a, b).max(f64::MIN_POSITIVE)
}

/// A part that hangs on two nodes only: reflected over their line, it has the same distances from all it is tied to.
/// Both sides are reflections of each other, so the smaller is named.
pub fn flip(framework: &Framework, places: &[[f64; 2]]) -> Option<Flip> {
    let pairs = (0..framework.nodes).flat_map(|a| (a + 1..framework.nodes).map(move |b| (a, b)));
    let place = |node: usize| places.get(node).copied().unwrap_or_default();
    let tolerance = EQUAL * size(places);
    for axis in pairs {
        let parts = framework.parts(&[axis.0, axis.1]);
        let moves = |part: &Vec<usize>| {
            part.iter().any(|node| off_line(place(*node), place(axis.0), place(axis.1)) > tolerance)
        };
        let moving: Vec<&Vec<usize>> = parts.iter().filter(|part| moves(part)).collect();
        if moving.len() > 1 {
            // Nodes that come last were declared last.
            let part = moving.into_iter().rev().min_by_key(|part| part.len())?.clone();
            return Some(Flip { part, axis });
        }
    }
    None
}

/// Whether a shape can be turned into its mirror image, if nodes of equal `kind` may swap their places.
pub fn is_own_mirror(places: &[[f64; 2]], kinds: &[usize]) -> bool {
    let tolerance = EQUAL * size(places);
    let mirrored: Vec<[f64; 2]> = places.iter().map(|place| [place[0], -place[1]]).collect();
    let Some(&first) = places.first() else { return true };
    let Some(far) = (0..places.len()).max_by(|a, b| {
        let length = |k: &usize| places.get(*k).map_or(0.0, |place| apart(first, *place));
        length(a).total_cmp(&length(b))
    }) else {
        return true;
    };
    let Some(&second) = places.get(far) else { return true };
    let length = apart(first, second);
    if length <= tolerance {
        return true;
    }
    let kind = |k: usize| kinds.get(k).copied();
    // Turns and shifts of the mirror image that put two of its nodes where two of the shape are.
    for (a, &image) in mirrored.iter().enumerate().filter(|(a, _)| kind(*a) == kind(0)) {
        for (b, &other) in mirrored.iter().enumerate().filter(|(b, _)| kind(*b) == kind(far)) {
            if a == b || (apart(image, other) - length).abs() > tolerance {
                continue;
            }
            let from = [other[0] - image[0], other[1] - image[1]];
            let to = [second[0] - first[0], second[1] - first[1]];
            let scale = from[0] * from[0] + from[1] * from[1];
            let cos = (from[0] * to[0] + from[1] * to[1]) / scale;
            let sin = (from[0] * to[1] - from[1] * to[0]) / scale;
            let moved = |place: [f64; 2]| {
                let [x, y] = [place[0] - image[0], place[1] - image[1]];
                [first[0] + cos * x - sin * y, first[1] + sin * x + cos * y]
            };
            let fits = mirrored.iter().enumerate().all(|(k, place)| {
                let place = moved(*place);
                let mut same = places.iter().enumerate().filter(|(other, _)| kind(*other) == kind(k));
                same.any(|(_, there)| apart(place, *there) <= 10.0 * tolerance)
            });
            if fits {
                return true;
            }
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_node_on_two_others_flips_over_their_line() {
        let places = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let square = Framework { nodes: 4, edges: vec![(0, 1), (1, 2), (2, 3), (3, 0), (0, 2)] };
        assert_eq!(flip(&square, &places), Some(Flip { part: vec![3], axis: (0, 2) }));
        let braced = Framework { edges: [square.edges.as_slice(), &[(1, 3)]].concat(), ..square };
        assert_eq!(flip(&braced, &places), None);
        let line = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.5, 0.5]];
        let on_line = Framework { nodes: 4, edges: vec![(0, 1), (1, 2), (2, 3), (3, 0), (0, 2)] };
        assert_eq!(flip(&on_line, &line), None, "a node on the line stays where it is");
    }

    #[test]
    fn only_shapes_without_symmetry_differ_from_their_mirror_image() {
        let scalene = [[0.0, 0.0], [3.0, 0.0], [0.5, 1.0]];
        assert!(!is_own_mirror(&scalene, &[0, 1, 1]));
        assert!(!is_own_mirror(&scalene, &[1, 1, 1]), "swapping does not help");
        let isosceles = [[0.0, 0.0], [1.0, 2.0], [-1.0, 2.0]];
        assert!(is_own_mirror(&isosceles, &[0, 1, 1]), "the two followers swap");
        assert!(!is_own_mirror(&isosceles, &[1, 0, 1]), "these two are not alike");
        assert!(is_own_mirror(&[[0.0, 0.0], [1.0, 1.0], [3.0, 3.0]], &[0, 1, 1]), "a line");
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        assert!(is_own_mirror(&square, &[0, 1, 1, 1]));
    }
}
