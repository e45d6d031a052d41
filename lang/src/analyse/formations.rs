//! Whether a formation's distances can be kept, and what they leave open.

use super::Ground;
use super::embedding::{Length, Shortcut, embed, meets, shortcut};
use super::eval::Eval;
use super::influence::at;
use super::rigidity::{Framework, Freedom};
use super::scene::Scene;
use super::shape::{flip, is_own_mirror};
use crate::ast::Span;
use crate::hir;
use crate::plan::{Constraint, Expr, Formation, Function, Graph, World};
use crate::problem::{Code, Problem};

/// Formations of more nodes are only counted, not solved.
const SOLVED: usize = 24;

pub fn formations(scene: &Scene, ground: &mut Ground) {
    for (id, formation) in scene.world.formations.iter().enumerate() {
        let nodes = Nodes::new(scene, formation);
        match &formation.constraint {
            Constraint::Displacements { .. } => drop(ground.unconnected(id, formation, &nodes)),
            Constraint::Distances(all) => {
                let lengths: Vec<_> = all.iter().map(|one| Eval::new(scene).number(one).constant()).collect();
                distances(scene, ground, id, formation, &nodes, &lengths);
            }
        }
    }
}

/// The nodes of a formation's graph: `about`, if any, then the members.
struct Nodes<'a> {
    world: &'a World,
    formation: &'a Formation,
    count: usize,
}

impl<'a> Nodes<'a> {
    fn new(scene: &Scene<'a>, formation: &'a Formation) -> Nodes<'a> {
        let members = scene.world.groups.get(formation.group).map_or(0, |group| group.size);
        Nodes { world: scene.world, formation, count: members + usize::from(formation.about.is_some()) }
    }

    fn agent(&self, node: usize) -> usize {
        match (self.formation.about, node) {
            (Some(about), 0) => about,
            (Some(_), node) => self.world.first_of(self.formation.group) + node - 1,
            (None, node) => self.world.first_of(self.formation.group) + node,
        }
    }

    fn name(&self, node: usize) -> String {
        format!("`{}`", agent_name(self.world, self.agent(node)))
    }

    fn names(&self, nodes: &[usize]) -> String {
        let names: Vec<String> = nodes.iter().map(|node| self.name(*node)).collect();
        match names.split_last() {
            Some((last, [])) => last.clone(),
            Some((last, rest)) => format!("{} and {last}", rest.join(", ")),
            None => String::new(),
        }
    }

    fn framework(&self) -> Framework {
        let inside = |&(a, b): &(usize, usize)| a < self.count && b < self.count && a != b;
        Framework { nodes: self.count, edges: self.formation.graph.iter(self.count).filter(inside).collect() }
    }

    /// 0 for `about`, 1 for the members, which are alike.
    fn kinds(&self) -> Vec<usize> {
        (0..self.count).map(|node| usize::from(node > 0 || self.formation.about.is_none())).collect()
    }
}

/// `follower[2]`, or `leader` of a group of one.
pub fn agent_name(world: &World, agent: usize) -> String {
    let mut first = 0;
    for group in &world.groups {
        if agent < first + group.size {
            return match group.size {
                1 => group.name.clone(),
                _ => format!("{}[{}]", group.name, agent - first + 1),
            };
        }
        first += group.size;
    }
    String::new()
}

fn distances(
    scene: &Scene,
    ground: &mut Ground,
    id: usize,
    formation: &Formation,
    nodes: &Nodes,
    lengths: &[Option<f64>],
) {
    let one = lengths.len() == 1;
    if nodes.count < 2 || ground.unconnected(id, formation, nodes) {
        return;
    }
    if let Some(negative) = lengths.iter().flatten().find(|length| **length < 0.0) {
        let message = format!("a distance of {} m cannot be", shown(*negative));
        return ground.unrealisable(id, Problem::error(&UNREALISABLE, message), &[]);
    }
    if one && formation.graph == Graph::Complete && nodes.count > 3 {
        let message =
            format!("{} nodes cannot all have the same distance from each other in the plane", nodes.count);
        let help = "three can; give each edge its distance, or use fewer edges";
        return ground.unrealisable(id, Problem::error(&UNREALISABLE, message).help(help), &[]);
    }
    let full = (2 * nodes.count).saturating_sub(3);
    if nodes.count > SOLVED {
        if formation.graph.edges(nodes.count) < full {
            ground.flexible(id, nodes, formation.graph.edges(nodes.count), full, None);
        }
        return;
    }
    let framework = nodes.framework();
    let length_of = |k: usize| lengths.get(if one { 0 } else { k }).copied().flatten();
    let known: Option<Vec<Length>> =
        framework.edges.iter().enumerate().map(|(k, &(a, b))| Some((a, b, length_of(k)?))).collect();
    let mut places = None;
    if let Some(lengths) = known.filter(|lengths| lengths.iter().all(|length| length.2 > 0.0)) {
        if let Some(shortcut) = shortcut(nodes.count, &lengths) {
            return ground.too_far(id, nodes, &lengths, &shortcut);
        }
        let embedding = embed(nodes.count, &lengths);
        if !meets(&embedding, &lengths) {
            return ground.not_found(id, nodes, &lengths, embedding.edge, embedding.worst);
        }
        places = Some(embedding.places);
    }
    let freedom = framework.freedom();
    if freedom.rank < full {
        return ground.flexible(id, nodes, freedom.rank, full, Some((&framework, &freedom)));
    }
    let Some(places) = places.filter(|_| nodes.count > 2 && only_distances(scene.world)) else { return };
    match flip(&framework, &places) {
        Some(flip) if nodes.count > 3 => ground.ambiguous(id, nodes, &flip.part, flip.axis),
        _ if !is_own_mirror(&places, &nodes.kinds()) => ground.mirrored(id, nodes),
        _ => {}
    }
}

/// Whether the reward can only tell distances: mirror images have the same.
fn only_distances(world: &World) -> bool {
    fn sided(expr: &Expr) -> bool {
        matches!(
            expr,
            Expr::Slot(..) | Expr::Call(Function::Cross | Function::Atan2 | Function::X | Function::Y, _)
        ) || expr.parts().into_iter().any(sided)
    }
    !world.reward.iter().any(|term| sided(&term.value))
}

impl Ground<'_> {
    fn unconnected(&mut self, id: usize, formation: &Formation, nodes: &Nodes) -> bool {
        if !matches!(formation.graph, Graph::Edges(_)) || nodes.count < 2 {
            return false;
        }
        let parts = nodes.framework().parts(&[]);
        let [first, second, ..] = parts.as_slice() else { return false };
        let rest = if second.len() < first.len() { second } else { first };
        let message = format!("the graph of `{}` falls apart", formation.name);
        let alone = match rest.as_slice() {
            [node] => format!("{} has no neighbour", nodes.name(*node)),
            few if few.len() <= 5 => format!("no edge joins {} to the others", nodes.names(few)),
            many => format!("it has {} parts, one of {} nodes", parts.len(), many.len()),
        };
        let problem = at(Problem::warning(&UNCONNECTED, message), self.formation_span(id), alone);
        let (a, b) = (first.first().copied().unwrap_or(0), second.first().copied().unwrap_or(0));
        self.problems.push(problem.help(format!(
            "join the parts, for example by an edge between {} and {}",
            nodes.name(a),
            nodes.name(b)
        )));
        true
    }

    /// Says that distances cannot be; `edges` are those to blame, the worst first, with what is to be said of them.
    fn unrealisable(&mut self, id: usize, problem: Problem, edges: &[(usize, String)]) {
        let places =
            edges.iter().filter_map(|(edge, text)| Some((self.edge_span(id, *edge)?, text.as_str())));
        let places: Vec<_> = places.collect();
        let problem = match places.split_first() {
            Some(((span, text), rest)) => {
                rest.iter().fold(problem.at(*span, *text), |problem, (span, text)| problem.with(*span, *text))
            }
            None => at(problem, self.formation_span(id), "no places have these distances"),
        };
        self.problems.push(problem);
    }

    fn edge_span(&self, formation: usize, edge: usize) -> Option<Span> {
        match &self.hir.world.formations.get(formation)?.shape.as_ref()?.what.slots {
            hir::Slots::Edges(edges) => edges.get(edge).map(|edge| edge.span),
            _ => None,
        }
    }

    fn too_far(&mut self, id: usize, nodes: &Nodes, lengths: &[Length], shortcut: &Shortcut) {
        let Some(&(a, b, length)) = lengths.get(shortcut.edge) else { return };
        let between = shortcut.way.get(1..shortcut.way.len().saturating_sub(1)).unwrap_or_default();
        let message = format!(
            "{} and {} should be {} m apart, but by way of {} they are at most {} m apart",
            nodes.name(a),
            nodes.name(b),
            shown(length),
            nodes.names(between),
            shown(shortcut.length)
        );
        let mut edges = vec![(shortcut.edge, "too long".to_owned())];
        for (from, to) in shortcut.way.iter().zip(shortcut.way.iter().skip(1)) {
            let joins = |&(a, b, _): &Length| (a, b) == (*from, *to) || (b, a) == (*from, *to);
            let shortest = lengths.iter().enumerate().filter(|(_, length)| joins(length));
            let shortest = shortest.min_by(|a, b| a.1.2.total_cmp(&b.1.2));
            edges.extend(shortest.map(|(edge, length)| (edge, format!("{} m", shown(length.2)))));
        }
        let problem = Problem::error(&UNREALISABLE, message);
        let most = shown(shortcut.length);
        let help = format!("their distance can be {most} m at most, or one of the others must be longer");
        self.unrealisable(id, problem.help(help), &edges);
    }

    fn not_found(&mut self, id: usize, nodes: &Nodes, lengths: &[Length], edge: usize, worst: f64) {
        let Some(&(a, b, length)) = lengths.get(edge) else { return };
        let message =
            format!("no places in the plane were found with the distances of `{}`", self.formation_name(id));
        let note = format!(
            "in the nearest that was found, {} and {} miss their {} m by {} m",
            nodes.name(a),
            nodes.name(b),
            shown(length),
            shown(worst)
        );
        let problem = Problem::warning(&UNREALISABLE, message).note(note);
        let label = format!("misses {} m by {} m", shown(length), shown(worst));
        self.unrealisable(id, problem.help("change that distance, or take out an edge"), &[(edge, label)]);
    }

    fn flexible(
        &mut self,
        id: usize,
        nodes: &Nodes,
        rank: usize,
        full: usize,
        solved: Option<(&Framework, &Freedom)>,
    ) {
        let message = format!("`{}` is not rigid: {}", self.formation_name(id), free(full - rank));
        let problem = Problem::warning(&NOT_RIGID, message);
        let label = format!("its distances fix {rank} of the {full} motions of {} nodes", nodes.count);
        let mut problem = at(problem, self.formation_span(id), label);
        let Some((framework, freedom)) = solved else {
            self.problems.push(problem.help(format!("{} more distances are needed", full - rank)));
            return;
        };
        let moving: Vec<usize> = (0..nodes.count).filter(|node| !freedom.body.contains(node)).collect();
        for node in &moving {
            if let [neighbour] = framework.neighbours(*node).as_slice() {
                problem =
                    problem.note(format!("{} can swing about {}", nodes.name(*node), nodes.name(*neighbour)));
            }
        }
        let hinged: Vec<usize> = moving.into_iter().filter(|node| framework.degree(*node) > 1).collect();
        if !hinged.is_empty() {
            let note =
                format!("with {} held, {} can still move", nodes.names(&freedom.body), nodes.names(&hinged));
            problem = problem.note(note);
        }
        self.problems.push(match freedom.missing {
            Some((a, b)) => problem.help(format!(
                "{} needed, for example between {} and {}",
                if full - rank == 1 {
                    "one more distance is".into()
                } else {
                    format!("{} more distances are", full - rank)
                },
                nodes.name(a),
                nodes.name(b)
            )),
            None => problem,
        });
    }

    fn ambiguous(&mut self, id: usize, nodes: &Nodes, part: &[usize], axis: (usize, usize)) {
        let message =
            format!("the distances of `{}` are kept by more than one shape", self.formation_name(id));
        let label = format!(
            "{} can flip over the line through {} and {}",
            nodes.names(part),
            nodes.name(axis.0),
            nodes.name(axis.1)
        );
        let problem = at(Problem::warning(&AMBIGUOUS_SHAPE, message), self.formation_span(id), label);
        let other = (0..nodes.count).find(|node| !part.contains(node) && *node != axis.0 && *node != axis.1);
        let end = part.first().copied().zip(other);
        self.problems.push(match end {
            Some((a, b)) => problem.help(format!(
                "give a distance between {} and {}, or use places instead of distances",
                nodes.name(a),
                nodes.name(b)
            )),
            None => problem,
        });
    }

    fn mirrored(&mut self, id: usize, nodes: &Nodes) {
        let message = format!(
            "the mirror image of `{}` is as good as `{}`",
            self.formation_name(id),
            self.formation_name(id)
        );
        let label = format!("the distances of {} nodes do not tell left from right", nodes.count);
        let problem = at(Problem::warning(&MIRROR_IMAGE, message), self.formation_span(id), label);
        self.problems.push(
            problem
                .note("nothing in the reward tells them apart")
                .help("if it matters, use places (displacements from the leader) instead of distances"),
        );
    }
}

fn free(count: usize) -> String {
    match count {
        1 => "one motion keeps all its distances".to_owned(),
        _ => format!("{count} motions keep all its distances"),
    }
}

fn shown(metres: f64) -> f64 {
    (metres * 1e6).round() / 1e6
}

pub const UNREALISABLE: Code = Code {
    name: "unrealisable",
    explain: "\
No places in the plane have the distances of a formation. A distance cannot be longer than any way round by other
neighbours (the triangle inequality); four robots cannot all have the same distance from each other; and every distance
beyond those that make a formation rigid (2 n - 3 of n nodes) has only a few values that fit the others.

    a - b = 1 m, b - c = 1 m, a - c = 2.5 m         // by way of b, a and c are at most 2 m apart

It is an error where it can be proved, and a warning where a search found no such places.",
};

pub const NOT_RIGID: Code = Code {
    name: "not-rigid",
    explain: "\
The agents of a formation can move against each other although all its distances are kept. In the plane n nodes need
at least 2 n - 3 distances, in the right places: a square of four edges swings, with a diagonal it does not. The number
of distances that count is the rank of the rigidity matrix.

If some freedom is meant, this can be ignored: any of these shapes has the full reward.",
};

pub const AMBIGUOUS_SHAPE: Code = Code {
    name: "ambiguous-shape",
    explain: "\
A formation is rigid, but a part of it hangs on two agents only: reflected over the line through those two, it keeps all
its distances, and the shape is another one. Which of them the agents find is chance. One more distance, across that line,
decides it; so do places instead of distances.",
};

pub const MIRROR_IMAGE: Code = Code {
    name: "mirror-image",
    explain: "\
Distances do not tell left from right: a shape and its mirror image have the same. Here they are different shapes, also if
agents of one group swap their places, and the reward knows distances only, so agents may settle in either. If it
matters, say where each belongs: a formation of displacements from the leader.",
};

pub const UNCONNECTED: Code = Code {
    name: "unconnected",
    explain: "\
The edges of a formation leave agents, or groups of agents, that no edge joins to the others: nothing holds these parts
together. Add an edge between them, or use a graph such as `ring` or `complete`.",
};
