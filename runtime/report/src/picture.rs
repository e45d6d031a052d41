//! A picture of a scenario before any training: the scene, its formations and the landscape of the reward, as a
//! figure of two columns for print.
//!
//! Pure functions of the World and a few arrays; equal input gives equal bytes. One unit of the drawing is a
//! point, 1/72 inch. [`scene`], [`graph`] and [`landscape`] draw parts, [`svg`] composes the file.

mod contour;
mod frame;
mod graph;
mod landscape;
mod legend;
mod palette;
mod pen;
mod scene;
mod start;

use mpgx_lang::plan::{Area, Group, GroupId, Plan, Solid, World};

pub use frame::Frame;
pub use graph::graph;
pub use landscape::landscape;
pub use scene::scene;
pub use start::Start;

use landscape::Values;
use pen::{INK, num, plain};

/// A moment of an episode.
#[derive(Clone, Debug)]
pub struct Moment<'a> {
    pub world: &'a World,
    /// Position of each agent and obstacle, m.
    pub positions_m: Vec<[f64; 2]>,
    /// Heading of each, rad; `None` for bodies without one.
    pub headings: Vec<Option<f64>>,
    /// The way of each over the episode, m; empty for those that nothing moves.
    pub ways_m: Vec<Vec<[f64; 2]>>,
    /// Of each formation, where each member belongs, m; empty if it tells distances.
    pub places_m: Vec<Vec<[f64; 2]>>,
    /// Of each formation, the length of each edge, m; empty if it tells places.
    pub lengths_m: Vec<Vec<f64>>,
}

/// What the present state would be worth with one agent elsewhere, at the nodes of [`nodes`] over [`extent`].
#[derive(Clone, Debug)]
pub struct Landscape {
    pub agent: usize,
    /// What is shown: `reward`, `gap`.
    pub name: String,
    /// Of the values, as in the Plan.
    pub dimension: String,
    pub columns: usize,
    /// Row by row from below; what is not finite is left blank.
    pub values: Vec<f64>,
    /// Whether an end that is a failure holds there.
    pub failed: Vec<bool>,
}

const WIDTH: f64 = 510.0;
const PLOT: f64 = 196.0;
const LEFT: f64 = 30.0;
const RIGHT: f64 = 246.0;
const TOP: f64 = 18.0;
/// Height of the drawings of formations.
const LOW: f64 = 110.0;

/// The picture as a file.
pub fn svg(plan: &Plan, moment: &Moment, land: &Landscape) -> String {
    let frame = Frame { area: extent(moment), left: LEFT, top: TOP, width: PLOT };
    let beside = Frame { left: RIGHT, ..frame };
    let names = names(moment.world);
    let agent = names.get(land.agent).map(|name| plain(name)).unwrap_or_default();
    let values = Values::new(land, &extent(moment));
    let below = frame.top + frame.height() + 40.0;
    let formations = drawable(moment);
    let (legend, legend_height) = legend::legend(moment, land, &values, &frame, [RIGHT, below]);
    let height = below + legend_height.max(if formations.is_empty() { 0.0 } else { LOW }) + 6.0;

    let mut body = heading("a", "Start of an episode", frame.left, TOP);
    body += &scene(moment, &frame);
    body += &frame.axes(true);
    let what = format!("{} over the position of {agent}", capital(&plain(&land.name)));
    body += &heading("b", &what, beside.left, TOP);
    body += &landscape(moment, land, &beside);
    body += &beside.axes(false);
    body += &landscape::colour_bar(&values, land, [beside.left + PLOT + 8.0, TOP], frame.height());
    let shown = formations.len().min(3);
    let width = (PLOT - 10.0 * (shown.max(1) - 1) as f64) / shown.max(1) as f64;
    for (k, &formation) in formations.iter().take(shown).enumerate() {
        let left = LEFT + k as f64 * (width + 10.0);
        if let Some(it) = moment.world.formations.get(formation) {
            let letter = ["c", "d", "e"].get(k).copied().unwrap_or_default();
            let title = format!("{}: {}", plain(&it.name), plain(&it.shape));
            body += &heading(letter, &title, left, below);
        }
        body += &graph(moment, formation, [left, below + 4.0], [width, LOW - 4.0]);
    }
    body += &legend;
    let (name, description) = (plain(&plan.name), describe(moment, &agent, &values));
    let height = num(height);
    format!(
        r##"<svg xmlns="http://www.w3.org/2000/svg" width="180mm" viewBox="0 0 {WIDTH} {height}" role="img" font-family="Helvetica, Arial, 'Liberation Sans', sans-serif" font-size="7.5" fill="{INK}" stroke-linejoin="round">
<title>{name}: scene and reward</title>
<desc>{description}</desc>
<rect width="{WIDTH}" height="{height}" fill="#fff"/>
{body}</svg>
"##
    )
}

/// The landscape with axes and its colours, as a file of its own.
pub fn landscape_svg(moment: &Moment, land: &Landscape) -> String {
    let frame = Frame { area: extent(moment), left: LEFT, top: 4.0, width: PLOT };
    let values = Values::new(land, &frame.area);
    let mut body = landscape(moment, land, &frame) + &frame.axes(true);
    body += &landscape::colour_bar(&values, land, [LEFT + PLOT + 8.0, 4.0], frame.height());
    let names = names(moment.world);
    let agent = names.get(land.agent).map(|name| plain(name)).unwrap_or_default();
    let words = format!("{} if {agent} were elsewhere; {}", capital(&values.name), values.best_text());
    drawing(&words, [LEFT + PLOT + 50.0, frame.top + frame.height() + 24.0], &body)
}

/// A formation as a file of its own.
pub fn graph_svg(moment: &Moment, formation: usize) -> String {
    let it = moment.world.formations.get(formation);
    let words = it.map_or(String::new(), |it| format!("Formation {}: {}", plain(&it.name), plain(&it.shape)));
    let size = [LEFT + PLOT + 50.0, 170.0];
    drawing(&words, size, &graph(moment, formation, [0.0; 2], size))
}

/// `words` are escaped.
fn drawing(words: &str, [width, height]: [f64; 2], body: &str) -> String {
    let (width, height) = (num(width), num(height));
    format!(
        r##"<svg class="picture" role="img" aria-label="{words}" viewBox="0 0 {width} {height}" font-family="Helvetica, Arial, 'Liberation Sans', sans-serif" font-size="7.5" fill="{INK}" stroke-linejoin="round">{body}</svg>"##
    )
}

/// Numbers of columns and rows of a grid over an area, of about `nodes` nodes.
pub fn grid(area: Area, nodes: usize) -> (usize, usize) {
    let aspect = (area.y_m.1 - area.y_m.0) / (area.x_m.1 - area.x_m.0);
    let columns = libm::sqrt(nodes as f64 / aspect).round().max(2.0);
    (columns as usize, (columns * aspect).round().max(2.0) as usize)
}

/// The nodes of a grid over an area, row by row from below, m.
pub fn nodes(area: Area, columns: usize, rows: usize) -> Vec<[f64; 2]> {
    let place =
        |(lo, hi): (f64, f64), k: usize, count: usize| lo + (hi - lo) * k as f64 / (count - 1).max(1) as f64;
    let row = |j| (0..columns).map(move |i| [place(area.x_m, i, columns), place(area.y_m, j, rows)]);
    (0..rows).flat_map(row).collect()
}

/// What the drawings show: all arenas, agents, obstacles, places and ways, with some room around.
pub fn extent(moment: &Moment) -> Area {
    let mut points: Vec<[f64; 2]> = moment.places_m.iter().chain(&moment.ways_m).flatten().copied().collect();
    for (_, group, members) in groups(moment.world) {
        let arena = group.arena.filter(|_| group.solid.is_none());
        points.extend(arena.iter().flat_map(|a| [[a.x_m.0, a.y_m.0], [a.x_m.1, a.y_m.1]]));
        let around = match &group.solid {
            None => square(group.radius_m),
            Some(Solid::Disc { radius_m }) => square(*radius_m),
            Some(Solid::Segment { to_m }) => vec![[0.0; 2], (*to_m).into()],
            Some(Solid::Polygon { corners_m }) => corners_m.iter().map(|&corner| corner.into()).collect(),
        };
        for at in moment.positions_m.iter().take(members.end).skip(members.start) {
            points.extend(around.iter().map(|way| [at[0] + way[0], at[1] + way[1]]));
        }
    }
    let range = |axis: fn(&[f64; 2]) -> f64| {
        let sane = points.iter().map(axis).filter(|x| x.abs() < 1e9);
        sane.fold((f64::MAX, f64::MIN), |(lo, hi), x| (lo.min(x), hi.max(x)))
    };
    let middle = |(lo, hi): (f64, f64)| if lo <= hi { (lo + hi) / 2.0 } else { 0.0 };
    let size = |(lo, hi): (f64, f64)| if lo < hi { 1.08 * (hi - lo) } else { 0.0 };
    let (x, y) = (range(|p| p[0]), range(|p| p[1]));
    let least = if size(x).max(size(y)) > 0.0 { size(x).max(size(y)) } else { 2.0 };
    let (width, height) = (size(x).max(0.8 * least), size(y).max(0.5 * least));
    let around = |middle: f64, size: f64| (middle - size / 2.0, middle + size / 2.0);
    Area { x_m: around(middle(x), width), y_m: around(middle(y), height) }
}

fn square(half: f64) -> Vec<[f64; 2]> {
    vec![[-half, -half], [half, half]]
}

/// The names of all agents and obstacles: `leader`, `follower[2]`.
pub fn names(world: &World) -> Vec<String> {
    let name = |(_, group, members): (GroupId, &Group, std::ops::Range<usize>)| -> Vec<String> {
        match members.len() {
            1 => vec![group.name.clone()],
            count => (1..=count).map(|k| format!("{}[{k}]", group.name)).collect(),
        }
    };
    groups(world).flat_map(name).collect()
}

/// Each group with its members.
fn groups(world: &World) -> impl Iterator<Item = (GroupId, &Group, std::ops::Range<usize>)> {
    world.groups.iter().enumerate().map(|(k, group)| {
        let first = world.first_of(k);
        (k, group, first..first + group.size)
    })
}

/// The group of an agent.
fn group_of(world: &World, agent: usize) -> Option<(GroupId, &Group)> {
    groups(world).find(|(_, _, members)| members.contains(&agent)).map(|(k, group, _)| (k, group))
}

/// Formations that are more than a point.
pub fn drawable(moment: &Moment) -> Vec<usize> {
    (0..moment.world.formations.len()).filter(|&k| graph::is_drawable(moment, k)).collect()
}

fn heading(letter: &str, text: &str, left: f64, top: f64) -> String {
    let (x, after, y) = (num(left), num(left + 11.0), num(top - 6.0));
    format!(
        r#"<text x="{x}" y="{y}" font-size="9" font-weight="bold">{letter}</text><text x="{after}" y="{y}" font-size="8">{text}</text>
"#
    )
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map(|first| first.to_uppercase().chain(letters).collect()).unwrap_or_default()
}

/// The picture in words.
fn describe(moment: &Moment, agent: &str, values: &Values) -> String {
    let world = moment.world;
    let count = |solid: bool| -> usize {
        world.groups.iter().filter(|group| group.solid.is_some() == solid).map(|group| group.size).sum()
    };
    let best = values.best_text();
    format!(
        "Left: {} agents and {} obstacles at the start of an episode, with {} formations. Right: the same moment, coloured by {} if {agent} were elsewhere; {best}.",
        count(false),
        count(true),
        world.formations.len(),
        values.name
    )
}
