//! Formations: who belongs where, or at which distance from whom.

use std::sync::Arc;

use super::feasible::counted;
use super::fits::{UNKNOWN_WORD, Wanted};
use super::settings::MISSING;
use super::{Checker, Scope};
use crate::ast::{self, EdgeDecl, ExprAt, FormationDecl, Item, Name, Span};
use crate::dim::Substitution;
use crate::hir::{Called, Edge, Expr, Formation, Kind, Shape, Slots, Type};
use crate::plan::{Frame, Graph, GroupId};
use crate::problem::{Code, Problem};
use crate::resolve::{Space, listed};

const GRAPHS: [&str; 4] = ["complete", "ring", "star", "path"];

impl<'a> Checker<'a> {
    pub fn formations(&mut self) {
        let mut declared = Vec::new();
        for (_, item) in self.main_items() {
            let Item::Formation(decl) = &item.node else { continue };
            let group = self.group_of_name(&decl.group);
            let about = decl.about.as_ref().map(|about| self.leader_of_formation(about));
            if let (Some(group), Some(Some(about))) = (group, about)
                && group == about
            {
                let problem = Problem::error(
                    &super::expr::CIRCULAR,
                    format!("`{}` is about its own member", decl.name.node),
                );
                self.report(problem.at(item.span, "").help("a formation is about an agent of another group"));
            }
            let unknown = usize::MAX;
            self.hir.world.formations.push(Formation {
                name: decl.name.node.clone(),
                group: group.unwrap_or(unknown),
                about: about.map(|about| about.unwrap_or(unknown)),
                shape: None,
                frame: if decl.frame.is_some() { Frame::Heading } else { Frame::Global },
                graph: Graph::Star,
                span: decl.name.span,
            });
            declared.push((decl, item.span, group.is_some() && about != Some(None)));
        }
        for (number, (decl, span, known)) in declared.into_iter().enumerate() {
            let graph = decl.graph.as_ref().map(|graph| self.graph(graph));
            let shape = self.shape_of(decl, span, number);
            let fits = shape.as_ref().is_some_and(|shape| self.arrangement(decl, shape));
            if let Some(formation) = self.hir.world.formations.get_mut(number) {
                formation.graph = graph.flatten().unwrap_or(Graph::Star);
                formation.shape = shape.filter(|_| known && fits);
            }
        }
    }

    fn shape_of(&mut self, decl: &'a FormationDecl, span: Span, number: usize) -> Option<Called<Shape>> {
        match (&decl.shape, decl.edges.as_slice()) {
            (Some(call), []) => {
                let id = self.item_named(Space::Shape, &call.name)?;
                let (params, what) = self.shape(id)?;
                let mut scope = Scope::of(self.program.main);
                let args =
                    self.bind(&mut scope, call, call.name.span, &params, (&[], &mut Substitution::default()));
                let span = call.args.last().map_or(call.name.span, |last| call.name.span.to(last.value.span));
                (!args.iter().any(Expr::is_poison)).then_some(Called { what, args, span })
            }
            (Some(call), [edge, ..]) => {
                let problem = Problem::error(
                    &super::settings::GIVEN_TWICE,
                    format!("`{}` has a shape and edges of its own", decl.name.node),
                );
                let problem = problem.at(edge.from.span, "an edge").with(call.name.span, "the shape");
                self.report(problem.help("keep one of the two"));
                None
            }
            (None, []) => {
                let problem =
                    Problem::error(&MISSING, format!("nothing tells how `{}` is arranged", decl.name.node));
                let group = &decl.group.node;
                self.report(problem.at(span, "has neither a shape nor edges").help(format!(
                    "write for example `formation {} of {group} = line(0.4 m) about leader`",
                    decl.name.node
                )));
                None
            }
            (None, edges) => {
                let edges = self.edges(edges, &mut Scope::of(self.program.main), Some(number))?;
                let what = Arc::new(Shape { name: decl.name.node.clone(), slots: Slots::Edges(edges) });
                Some(Called { what, args: Vec::new(), span: decl.name.span })
            }
        }
    }

    /// Whether a shape goes with what else a formation says.
    fn arrangement(&mut self, decl: &'a FormationDecl, shape: &Called<Shape>) -> bool {
        let name = &decl.name.node;
        let distances = shape.what.slots.are_distances();
        let problem = match (distances, &decl.about, decl.frame, &decl.graph) {
            (false, None, ..) => Problem::error(&MISSING, format!("`{name}` is about nobody"))
                .at(shape.span, "these are places beside an agent")
                .help("say beside which: `… about leader`"),
            (true, _, Some(frame), _) => Problem::error(&BAD_EDGE, "distances are the same in every frame")
                .at(frame, "a frame for distances")
                .with(shape.span, "these are distances")
                .help("leave out `in its frame`"),
            (true, _, _, Some(graph)) => {
                Problem::error(&BAD_EDGE, format!("`{}` has edges already", shape.what.name))
                    .at(graph.span, "a second graph")
                    .with(shape.span, "the edges")
                    .help(format!("leave out `over {}`", graph.node))
            }
            _ => return true,
        };
        self.report(problem);
        false
    }

    pub fn graph(&mut self, name: &Name) -> Option<Graph> {
        Some(match name.node.as_str() {
            "complete" => Graph::Complete,
            "ring" => Graph::Ring,
            "star" => Graph::Star,
            "path" => Graph::Path,
            other => {
                let problem = Problem::error(&UNKNOWN_WORD, format!("there is no graph `{other}`"));
                self.report(problem.at(name.span, "").help(match self.meant(other, GRAPHS) {
                    Some(meant) => format!("did you mean `{meant}`?"),
                    None => format!("it is one of {}", listed(GRAPHS)),
                }));
                return None;
            }
        })
    }

    /// Edges of a shape (nodes by number), or of a formation of the scenario (agents by name).
    pub fn edges(
        &mut self,
        edges: &'a [EdgeDecl],
        scope: &mut Scope,
        formation: Option<usize>,
    ) -> Option<Vec<Edge>> {
        let length = Type::Number(self.units.base("length"));
        let mut checked: Vec<Edge> = Vec::new();
        let mut whole = true;
        for edge in edges {
            let span = edge.from.span.to(edge.to.span);
            let distance =
                self.wanted(scope, &edge.distance, &length, &Wanted::by("the distance of two neighbours"));
            let (from, to) = (self.node(&edge.from, formation), self.node(&edge.to, formation));
            let (Some(from), Some(to)) = (from, to) else {
                whole = false;
                continue;
            };
            whole &= !distance.is_poison();
            let nodes = (from.min(to), from.max(to));
            if from == to {
                let problem = Problem::error(&BAD_EDGE, "an edge joins two different nodes");
                self.report(problem.at(span, "both ends are the same"));
                whole = false;
            } else if let Some(first) = checked.iter().find(|first| first.nodes == nodes) {
                let problem = Problem::error(&BAD_EDGE, "these two are joined already");
                self.report(problem.at(span, "again here").with(first.span, "first here"));
                whole = false;
            }
            checked.push(Edge { nodes, distance, span });
        }
        whole.then_some(checked)
    }

    /// The number, from 0, of one end of an edge.
    fn node(&mut self, at: &'a ExprAt, formation: Option<usize>) -> Option<usize> {
        let Some(formation) = formation else {
            return match &at.node {
                ast::Expr::Number { value, unit: None } if *value >= 1.0 => Some(*value as usize - 1),
                _ => {
                    let problem = Problem::error(&BAD_EDGE, "the nodes of a shape are numbered from 1");
                    self.report(
                        problem.at(at.span, "not a number from 1").help("write for example `edge 1 - 2 = …`"),
                    );
                    None
                }
            };
        };
        if let ast::Expr::Number { .. } = &at.node {
            let group = self.hir.world.formations.get(formation)?.group;
            let name = self.hir.world.groups.get(group)?.name.clone();
            let text = self.sources.text(at.span).to_owned();
            let problem = Problem::error(&BAD_EDGE, "in a scenario edges join agents by name");
            self.report(problem.at(at.span, "a number").help(format!("write for example `{name}[{text}]`")));
            return None;
        }
        let agent = self.wanted(
            &mut Scope::of(self.program.main),
            at,
            &Type::Agent(None),
            &Wanted::by("an end of an edge"),
        );
        let Kind::Fixed(group, member) = agent.kind else { return None };
        let of = self.hir.world.formations.get(formation)?;
        let after = usize::from(of.about.is_some());
        if Some(group) == of.about {
            return Some(0);
        }
        if group == of.group {
            return Some(member + after);
        }
        let (name, own, span) = (of.name.clone(), of.group, of.span);
        let text = self.sources.text(at.span).to_owned();
        let own = self.hir.world.groups.get(own).map_or(String::new(), |group| group.name.clone());
        let problem = Problem::error(&BAD_EDGE, format!("`{text}` does not belong to `{name}`"))
            .at(at.span, "")
            .with(span, format!("a formation of `{own}`"));
        self.report(problem.help(format!("`formation {name} of {own} with {text}` takes it in")));
        None
    }

    fn group_of_name(&mut self, name: &Name) -> Option<GroupId> {
        let groups =
            || self.hir.world.groups.iter().filter(|group| !group.obstacle).map(|group| group.name.as_str());
        if let Some(group) = self.hir.world.groups.iter().position(|group| group.name == name.node) {
            let Some(obstacle) = self.hir.world.groups.get(group).filter(|group| group.obstacle) else {
                return Some(group);
            };
            let span = obstacle.span;
            let problem = Problem::error(&super::expr::WRONG_KIND, format!("`{}` is an obstacle", name.node))
                .at(name.span, "a formation is of agents")
                .with(span, "declared here");
            self.report(problem.help(format!("groups of agents are {}", listed(groups()))));
            return None;
        }
        if self.program.is_unknown(self.program.main, Space::Value, &name.node) {
            return None;
        }
        let problem =
            Problem::error(&super::expr::UNKNOWN_NAME, format!("there is no group `{}`", name.node));
        let help = match self.meant(&name.node, groups()) {
            Some(meant) => format!("did you mean `{meant}`?"),
            None => format!("`agent` and `agents` declare {}", listed(groups())),
        };
        self.report(problem.at(name.span, "").help(help));
        None
    }

    fn leader_of_formation(&mut self, name: &Name) -> Option<GroupId> {
        let group = self.group_of_name(name)?;
        let (size, span) = self.hir.world.groups.get(group).map(|group| (group.size, group.span))?;
        if size > 1 {
            let problem =
                Problem::error(&super::index::GROUP_AS_AGENT, format!("`{}` is {size} agents", name.node))
                    .at(name.span, "a formation is about one agent")
                    .with(span, format!("a group of {size}"));
            self.report(problem.help("name a group of one, such as `agent leader : …` declares"));
            return None;
        }
        Some(group)
    }
}

/// Tells if a shape joins more or fewer nodes than a formation has.
pub fn other_nodes(shape: &Called<Shape>, nodes: usize, members: Span) -> Option<Problem> {
    let Slots::Edges(edges) = &shape.what.slots else { return None };
    let largest = edges.iter().map(|edge| edge.nodes.1 + 1).max()?;
    if largest == nodes {
        return None;
    }
    let message = format!("`{}` joins {} but there are {nodes}", shape.what.name, counted(largest, "node"));
    Some(
        Problem::error(&super::feasible::SLOT_COUNT, message)
            .at(shape.span, format!("has {}", counted(largest, "node")))
            .with(members, format!("{} take part", counted(nodes, "agent")))
            .help("the nodes are the agent after `with` or `about`, if any, and the members of the group"),
    )
}

pub const BAD_EDGE: Code = Code {
    name: "bad-edge",
    explain: "\
An edge joins two different agents of a formation and tells their distance; each two are joined once. In a shape
nodes are numbered from 1; in a scenario agents are named.

    formation triangle(side : length) { edge 1 - 2 = side, edge 2 - 3 = side, edge 3 - 1 = side }

    formation T of follower with leader {
        edge leader - follower[1] = 0.5 m
        edge leader - leader = 0.5 m            // wrong: the same agent
    }

Edges are for distances, which are the same in every frame; places (`slots`) take a frame and a graph:

    formation F of follower = square(0.4 m) about leader in its frame over ring",
};
