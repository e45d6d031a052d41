//! The scene: arenas, obstacles, agents, their places and ways.

use mpgx_lang::plan::{Control, Graph, Group, Solid};

use super::contour::simplified;
use super::pen::{INK, SOFT, Style, arrow_head, circle, path, style};
use super::{Frame, Moment, groups};

/// Radius of the marker of an agent that is smaller, points.
pub const MARKER: f64 = 2.7;
/// Edges of a formation of distances that are drawn, at most.
const MOST_EDGES: usize = 2000;
/// Corners left out of a way are at most this far away from it, points.
const SMOOTH: f64 = 0.15;

/// The scene as an SVG group, without axes.
pub fn scene(moment: &Moment, frame: &Frame) -> String {
    let drawing = [
        arenas(moment, frame),
        ways(moment, frame),
        obstacles(moment, frame),
        links(moment, frame),
        agents(moment, frame),
    ];
    format!("<g>{}</g>\n", frame.clipped(&drawing.concat()))
}

fn arenas(moment: &Moment, frame: &Frame) -> String {
    let mut out = String::new();
    for (id, group, _) in groups(moment.world).filter(|(_, group, _)| group.solid.is_none()) {
        let Some(arena) = group.arena else { continue };
        let (x, y) = (arena.x_m, arena.y_m);
        let corners = [[x.0, y.0], [x.1, y.0], [x.1, y.1], [x.0, y.1]].map(|corner| frame.at(corner));
        let (data, colour) = (path(corners, "z"), style(moment.world, id).colour);
        out += &format!(
            r#"<path d="{data}" fill="none" stroke="{colour}" stroke-width=".6" stroke-dasharray="3 2"/>"#
        );
    }
    out
}

fn ways(moment: &Moment, frame: &Frame) -> String {
    let mut out = String::new();
    for (id, group, members) in groups(moment.world) {
        let colour = if group.solid.is_some() { SOFT } else { style(moment.world, id).colour };
        for way in moment.ways_m.iter().take(members.end).skip(members.start) {
            let points: Vec<[f64; 2]> = way.iter().map(|p| frame.at(*p)).collect();
            let points = simplified(&points, SMOOTH);
            if points.len() < 2 {
                continue;
            }
            let data = path(points.iter().copied(), "");
            out += &format!(
                r#"<path d="{data}" fill="none" stroke="{colour}" stroke-width=".7" opacity=".45"/>"#
            );
            if let Some(head) = arrow_head(&points) {
                out += &format!(r#"<path d="{head}" fill="{colour}" opacity=".6"/>"#);
            }
        }
    }
    out
}

/// Path data of the outline of an obstacle at a position.
fn outline(group: &Group, at: [f64; 2], frame: &Frame) -> Option<String> {
    let corner = |way: &(f64, f64)| frame.at([at[0] + way.0, at[1] + way.1]);
    Some(match group.solid.as_ref()? {
        Solid::Disc { radius_m } => circle(frame.at(at), radius_m * frame.scale()),
        Solid::Segment { to_m } => path([frame.at(at), corner(to_m)], ""),
        Solid::Polygon { corners_m } => path(corners_m.iter().map(corner), "z"),
    })
}

/// All obstacles.
pub fn obstacles(moment: &Moment, frame: &Frame) -> String {
    let mut out = String::new();
    for (_, group, members) in groups(moment.world) {
        for at in moment.positions_m.iter().take(members.end).skip(members.start) {
            let Some(data) = outline(group, *at, frame) else { continue };
            let width = if matches!(group.solid, Some(Solid::Segment { .. })) { "1.6" } else { ".7" };
            out += &format!(
                r##"<path d="{data}" fill="#c9ccd1" stroke="#4a4e56" stroke-width="{width}" stroke-linecap="round"/>"##
            );
        }
    }
    out
}

/// Lines from members to their places, and between neighbours that keep a distance.
fn links(moment: &Moment, frame: &Frame) -> String {
    let mut out = String::new();
    let world = moment.world;
    for (k, formation) in world.formations.iter().enumerate() {
        let look = style(world, formation.group);
        let first = world.first_of(formation.group);
        let members = moment.positions_m.iter().skip(first);
        let (mut lines, mut hollow) = (String::new(), String::new());
        for (place, member) in moment.places_m.get(k).into_iter().flatten().zip(members) {
            lines += &path([frame.at(*place), frame.at(*member)], "");
            hollow += &look.marker(frame.at(*place), MARKER);
        }
        if moment.lengths_m.get(k).is_some_and(|lengths| !lengths.is_empty()) {
            lines += &edges(moment, k, frame);
        }
        if !lines.is_empty() {
            out += &format!(r#"<path d="{lines}" fill="none" stroke="{SOFT}" stroke-width=".5"/>"#);
        }
        if !hollow.is_empty() {
            out +=
                &format!(r##"<path d="{hollow}" fill="#fff" stroke="{}" stroke-width=".7"/>"##, look.colour);
        }
    }
    out
}

/// Path data of the edges between the agents of a formation.
fn edges(moment: &Moment, formation: usize, frame: &Frame) -> String {
    let world = moment.world;
    let Some(it) = world.formations.get(formation) else { return String::new() };
    let Some(group) = world.groups.get(it.group) else { return String::new() };
    let first = world.first_of(it.group);
    let nodes: Vec<usize> = it.about.into_iter().chain(first..first + group.size).collect();
    let at = |node: usize| moment.positions_m.get(*nodes.get(node)?).map(|p| frame.at(*p));
    let graph: &Graph = &it.graph;
    let lines = graph.iter(nodes.len()).take(MOST_EDGES).filter_map(|(a, b)| Some([at(a)?, at(b)?]));
    lines.map(|line| path(line, "")).collect()
}

fn agents(moment: &Moment, frame: &Frame) -> String {
    let mut out = String::new();
    let poses = || moment.positions_m.iter().zip(&moment.headings);
    for (id, group, members) in groups(moment.world).filter(|(_, group, _)| group.solid.is_none()) {
        let look = style(moment.world, id);
        let (mut markers, mut bodies, mut noses) = (String::new(), String::new(), String::new());
        for (at, heading) in poses().take(members.end).skip(members.start) {
            let at = frame.at(*at);
            markers += &look.marker(at, MARKER);
            let radius = group.radius_m * frame.scale();
            if radius > MARKER {
                bodies += &circle(at, radius);
            }
            if let Some(heading) = heading {
                let reach = radius.max(MARKER) + 4.5;
                let tip = [at[0] + reach * libm::cos(*heading), at[1] - reach * libm::sin(*heading)];
                noses += &path([at, tip], "");
            }
        }
        out += &drawn(&look, &markers, &bodies, &noses);
    }
    out
}

fn drawn(look: &Style, markers: &str, bodies: &str, noses: &str) -> String {
    let mut out = String::new();
    let colour = look.colour;
    if !bodies.is_empty() {
        out += &format!(
            r#"<path d="{bodies}" fill="{colour}" fill-opacity=".15" stroke="{colour}" stroke-width=".6"/>"#
        );
    }
    if !noses.is_empty() {
        out += &format!(
            r#"<path d="{noses}" fill="none" stroke="{colour}" stroke-width="1.2" stroke-linecap="round"/>"#
        );
    }
    out + &format!(r##"<path d="{markers}" fill="{colour}" stroke="#fff" stroke-width=".4"/>"##)
}

/// The others and the agent that is looked at, on top of a landscape.
pub fn bystanders(moment: &Moment, agent: usize, frame: &Frame) -> String {
    let mut out = obstacles(moment, frame);
    for (id, _, members) in groups(moment.world).filter(|(_, group, _)| group.solid.is_none()) {
        let look = style(moment.world, id);
        for (k, at) in moment.positions_m.iter().enumerate().take(members.end).skip(members.start) {
            let data = look.marker(frame.at(*at), MARKER);
            out += &if k == agent {
                format!(
                    r##"<path d="{data}" fill="none" stroke="#fff" stroke-width="2"/><path d="{data}" fill="none" stroke="{INK}" stroke-width=".9"/>"##
                )
            } else {
                format!(r##"<path d="{data}" fill="{}" stroke="#fff" stroke-width=".7"/>"##, look.colour)
            };
        }
    }
    out
}

/// Whether a group is moved by itself.
pub fn moves(group: &Group) -> bool {
    matches!(group.control, Control::Motion(_))
}

/// A line of a length, with ends.
pub fn ruler([x, y]: [f64; 2], length: f64) -> String {
    let (from, to) = (x - length / 2.0, x + length / 2.0);
    let line = path([[from, y], [to, y]], "");
    let ends = [from, to].map(|x| path([[x, y - 2.0], [x, y + 2.0]], "")).concat();
    format!(r#"<path d="{line}{ends}" fill="none" stroke="{INK}" stroke-width=".8"/>"#)
}
