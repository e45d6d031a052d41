//! A formation by itself: who is a neighbour of whom, and how far apart they should be.

use mpgx_lang::plan::Graph;

use super::pen::{INK, SOFT, num, path, plain, style};
use super::{Moment, group_of};
use crate::text::Format;

/// With more nodes they are drawn small and without names.
const MOST_NAMES: usize = 24;
/// With more edges their lengths are not written.
const MOST_LENGTHS: usize = 12;
/// More edges are not drawn, nor used to arrange nodes.
const MOST_EDGES: usize = 2000;
/// How often each edge of a formation of distances is brought nearer to its length.
const ROUNDS: usize = 400;

/// Where the nodes should be, m, relative to each other.
struct Wanted {
    nodes: Vec<[f64; 2]>,
    /// Agent of each node.
    agents: Vec<usize>,
    /// Neighbours, and their distance, m.
    edges: Vec<(usize, usize, f64)>,
}

/// A formation as an SVG group within a box (left and top, width and height, points).
pub fn graph(moment: &Moment, formation: usize, [left, top]: [f64; 2], [width, height]: [f64; 2]) -> String {
    let Some(wanted) = wanted(moment, formation) else { return String::new() };
    let few = wanted.nodes.len() <= MOST_NAMES;
    let margin = if few { 16.0 } else { 6.0 };
    let (low, high) = bounds(&wanted.nodes);
    let room = [width - 2.0 * margin, height - 2.0 * margin];
    let scale = (0..2).map(|k| room[k] / (high[k] - low[k]).max(1e-9)).fold(f64::MAX, f64::min);
    let at = |[x, y]: [f64; 2]| {
        [
            left + width / 2.0 + scale * (x - (low[0] + high[0]) / 2.0),
            top + height / 2.0 - scale * (y - (low[1] + high[1]) / 2.0),
        ]
    };
    let places: Vec<[f64; 2]> = wanted.nodes.iter().map(|node| at(*node)).collect();
    let (mut lines, mut labels) = (String::new(), String::new());
    let format = Format { digits: 2, ..Format::length(1.0) };
    for (a, b, length) in &wanted.edges {
        let (Some(a), Some(b)) = (places.get(*a), places.get(*b)) else { continue };
        lines += &path([*a, *b], "");
        if wanted.edges.len() <= MOST_LENGTHS {
            let (x, y) = (num((a[0] + b[0]) / 2.0), num((a[1] + b[1]) / 2.0 + 2.4));
            labels += &format!(r#"<text x="{x}" y="{y}">{}</text>"#, format.full(*length));
        }
    }
    let mut out = format!(r#"<path d="{lines}" fill="none" stroke="{SOFT}" stroke-width=".8"/>"#);
    out += &format!(
        r##"<g font-size="6.5" text-anchor="middle" stroke="#fff" stroke-width="2.4" paint-order="stroke">{labels}</g>"##
    );
    let middle = left + width / 2.0;
    for (agent, place) in wanted.agents.iter().zip(&places) {
        out += &node(moment, *agent, *place, few, middle);
    }
    format!("<g>{out}</g>\n")
}

fn node(moment: &Moment, agent: usize, at: [f64; 2], named: bool, middle: f64) -> String {
    let Some((id, group)) = group_of(moment.world, agent) else { return String::new() };
    let look = style(moment.world, id);
    let data = look.marker(at, if named { 5.5 } else { 2.0 });
    let mut out = format!(r##"<path d="{data}" fill="{}" stroke="#fff" stroke-width=".8"/>"##, look.colour);
    if named && group.size > 1 {
        let (x, y, number) = (num(at[0]), num(at[1] + 2.4), agent - moment.world.first_of(id) + 1);
        out += &format!(
            r##"<text x="{x}" y="{y}" font-size="6.5" font-weight="bold" text-anchor="middle" fill="#fff">{number}</text>"##
        );
    } else if named {
        let (side, anchor) = if at[0] < middle - 1.0 { (-8.0, "end") } else { (8.0, "start") };
        let (x, y, name) = (num(at[0] + side), num(at[1] + 2.4), plain(&group.name));
        out += &format!(
            r##"<text x="{x}" y="{y}" font-size="7" text-anchor="{anchor}" fill="{INK}" stroke="#fff" stroke-width="2" paint-order="stroke">{name}</text>"##
        );
    }
    out
}

/// Whether there is more to see than a point.
pub fn is_drawable(moment: &Moment, formation: usize) -> bool {
    let Some(wanted) = wanted(moment, formation) else { return false };
    let (low, high) = bounds(&wanted.nodes);
    (0..2).any(|k| high[k] - low[k] > 1e-6)
}

fn bounds(points: &[[f64; 2]]) -> ([f64; 2], [f64; 2]) {
    let (mut low, mut high) = ([f64::MAX; 2], [f64::MIN; 2]);
    for point in points {
        low = [low[0].min(point[0]), low[1].min(point[1])];
        high = [high[0].max(point[0]), high[1].max(point[1])];
    }
    (low, high)
}

fn wanted(moment: &Moment, formation: usize) -> Option<Wanted> {
    let it = moment.world.formations.get(formation)?;
    let group = moment.world.groups.get(it.group)?;
    let first = moment.world.first_of(it.group);
    let agents: Vec<usize> = it.about.into_iter().chain(first..first + group.size).collect();
    let pairs = it.graph.iter(agents.len()).take(MOST_EDGES);
    let places = moment.places_m.get(formation).filter(|places| !places.is_empty());
    let wanted = if let Some(places) = places {
        let centre = it.about.and_then(|about| moment.positions_m.get(about));
        let nodes: Vec<[f64; 2]> = centre.into_iter().chain(places).copied().collect();
        let length = |(a, b): (usize, usize)| {
            let (p, q) = (nodes.get(a)?, nodes.get(b)?);
            Some((a, b, libm::hypot(p[0] - q[0], p[1] - q[1])))
        };
        let edges = pairs.filter_map(length).collect();
        Wanted { nodes, agents, edges }
    } else {
        let lengths = moment.lengths_m.get(formation)?;
        let edges: Vec<(usize, usize, f64)> = pairs.zip(lengths).map(|((a, b), l)| (a, b, *l)).collect();
        Wanted { nodes: arranged(agents.len(), &edges, &it.graph), agents, edges }
    };
    wanted.nodes.iter().flatten().all(|x| x.is_finite()).then_some(wanted)
}

/// Nodes whose distances come near those wanted, from a circle on: each edge in turn moves its ends by half of what
/// its length is off. Not the only arrangement, where edges leave the nodes free.
fn arranged(count: usize, edges: &[(usize, usize, f64)], graph: &Graph) -> Vec<[f64; 2]> {
    let mean = edges.iter().map(|edge| edge.2).sum::<f64>() / edges.len().max(1) as f64;
    let angle = |k: usize| (k as f64 / count as f64 + 0.25) * std::f64::consts::TAU;
    let radius = match graph {
        Graph::Ring | Graph::Path => mean * count as f64 / std::f64::consts::TAU,
        _ => mean,
    };
    let mut nodes: Vec<[f64; 2]> =
        (0..count).map(|k| [radius * libm::cos(angle(k)), radius * libm::sin(angle(k))]).collect();
    for _ in 0..ROUNDS {
        for &(a, b, length) in edges {
            let (Some(&p), Some(&q)) = (nodes.get(a), nodes.get(b)) else { continue };
            let way = [q[0] - p[0], q[1] - p[1]];
            let distance = libm::hypot(way[0], way[1]);
            if distance > 0.0 {
                let share = (distance - length) / (2.0 * distance);
                let moved = |node: [f64; 2], s: f64| [node[0] + s * way[0], node[1] + s * way[1]];
                nodes.get_mut(a).into_iter().for_each(|node| *node = moved(p, share));
                nodes.get_mut(b).into_iter().for_each(|node| *node = moved(q, -share));
            }
        }
    }
    nodes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_that_can_be_kept_are_kept() {
        let side = 0.4;
        let kite = [(0, 1, side), (1, 2, side), (2, 3, side), (3, 0, side), (0, 2, side * libm::sqrt(2.0))];
        let graph = Graph::Edges(kite.iter().map(|edge| (edge.0, edge.1)).collect());
        let nodes = arranged(4, &kite, &graph);
        for (a, b, length) in kite {
            let distance = libm::hypot(nodes[a][0] - nodes[b][0], nodes[a][1] - nodes[b][1]);
            assert!((distance - length).abs() < 1e-6, "{a} – {b}: {distance}");
        }
        let cross = libm::hypot(nodes[1][0] - nodes[3][0], nodes[1][1] - nodes[3][1]);
        assert!(cross > 0.5, "it is not folded: {cross}");
    }
}
