//! Episodes played back on a canvas, two methods side by side; a still picture without a script.

use std::fmt::Write;

use minijinja::{Value, context};
use mpgx_lang::plan::{Control, Extern, Setting, Solid, World};
use mpgx_study::record::Trajectory;
use serde::Serialize;

use super::{Content, Panel};
use crate::film::film;
use crate::text::plural;
use crate::tracks::{Pool, Track, formations_of_places};
use crate::view::View;

pub const PANEL: Panel = Panel {
    id: "playback",
    title: "Playback",
    template: include_str!("playback.html"),
    script: Some(concat!(
        include_str!("../script/player/tracks.js"),
        include_str!("../script/player/scene.js"),
        include_str!("../script/player/lanes.js"),
        include_str!("../script/player/film.js"),
        include_str!("../script/player/files.js"),
        include_str!("../script/player/player.js")
    )),
    fills: true,
    content,
};

/// Bytes of all tracks, and what else the panel may need: the last track, the still picture, lists.
const MOST: usize = 1_300_000;
const RESERVE: usize = 120_000;

/// Episodes shown of each cell.
const EPISODES: usize = 2;

#[derive(Serialize)]
struct Stage<'a> {
    name: &'a str,
    dt_s: f64,
    safety_m: f64,
    agents: Vec<Agent<'a>>,
    /// The agent that each slot belongs to, and the one it is about.
    slots: Vec<(usize, usize)>,
    terms: Vec<&'a str>,
    /// Arenas: x from, to, y from, to.
    arenas: Vec<[f64; 4]>,
    /// What the picture of each episode must show, in the same order.
    frames: Vec<[f64; 4]>,
}

#[derive(Serialize)]
struct Agent<'a> {
    group: &'a str,
    learned: bool,
    radius_m: f64,
    /// Distance of the axle behind the hand point, m; `None` for bodies without a heading.
    hand_m: Option<f64>,
    /// The outline of an obstacle.
    solid: Option<&'a Solid>,
}

#[derive(Serialize)]
struct Actor<'a> {
    label: &'a str,
    style: &'a str,
}

fn content(view: &View) -> Option<Content> {
    let plan = view.input.plan;
    let film = film(view);
    let taken = RESERVE + film.as_ref().map_or(0, |film| film.src.len());
    let mut pool = Pool::new(view.room.saturating_sub(taken).min(MOST));
    let mut tracks = Vec::new();
    let mut complete = true;
    for (episode, (method, seed), protocol) in order(view) {
        let Some((trajectory, world)) = trajectory(view, protocol, method, seed, episode) else { continue };
        if !pool.has_room() {
            complete = false;
            break;
        }
        if let Some(track) = pool.track(world, trajectory) {
            tracks.push(Track { protocol, method, seed, episode, ..track });
        }
    }
    let first = tracks.first()?;
    let (still_of, world) = trajectory(view, first.protocol, first.method, first.seed, first.episode)?;
    let stages: Vec<_> =
        plan.protocols.iter().map(|protocol| stage(view, &protocol.name, view.world(protocol))).collect();
    let frame = *stages.get(first.protocol)?.frames.get(first.episode)?;
    let caption = format!(
        "{}, seed {}, first held-out episode of “{}”",
        view.methods.get(first.method)?.label,
        first.seed,
        plan.protocols.get(first.protocol)?.name
    );
    let obstacles = plan.world.groups.iter().any(|group| group.solid.is_some());
    let context = context! {
        still => Value::from_safe_string(still(world, still_of, frame, &view.methods.get(first.method)?.style)),
        caption,
        episodes => plural(tracks.len(), "episode"),
        complete,
        obstacles => obstacles,
        film => film.as_ref().map(|film| context! {
            protocol => plan.protocols.get(film.protocol).map(|protocol| &protocol.name),
            method => view.methods.get(film.method).map(|method| method.label),
            seed => film.seed,
        }),
        margins => obstacles && plan.world.safety_m > 0.0,
    };
    let methods: Vec<_> =
        view.methods.iter().map(|method| Actor { label: method.label, style: &method.style }).collect();
    let data = serde_json::json!({
        "stages": stages, "methods": methods, "blocks": pool.blocks, "tracks": tracks, "film": film
    });
    Some(Content { context, data: Some(data) })
}

/// Episode, (method, seed), protocol: what matters most comes first, as the room is limited.
fn order<'v>(view: &'v View) -> impl Iterator<Item = (usize, (usize, u32), usize)> + 'v {
    let mut cells: Vec<(u32, usize)> = view
        .methods
        .iter()
        .enumerate()
        .flat_map(|(method, entry)| entry.records.iter().map(move |record| (record.seed, method)))
        .collect();
    cells.sort();
    let protocols = view.input.plan.protocols.len();
    (0..EPISODES).flat_map(move |episode| {
        cells
            .clone()
            .into_iter()
            .flat_map(move |(seed, method)| (0..protocols).map(move |p| (episode, (method, seed), p)))
    })
}

fn trajectory<'v>(
    view: &'v View,
    protocol: usize,
    method: usize,
    seed: u32,
    episode: usize,
) -> Option<(&'v Trajectory, &'v World)> {
    let protocol = view.input.plan.protocols.get(protocol)?;
    let (_, evaluation) =
        view.methods.get(method)?.evaluations(&protocol.name).find(|(other, _)| *other == seed)?;
    Some((evaluation.trajectories.get(episode)?, view.world(protocol)))
}

fn stage<'v>(view: &'v View, name: &'v str, world: &'v World) -> Stage<'v> {
    let agents = world.groups.iter().flat_map(|group| {
        let agent = move |_| Agent {
            group: &group.name,
            learned: group.control == Control::Learned,
            radius_m: group.radius_m,
            hand_m: hand(&group.body),
            solid: group.solid.as_ref(),
        };
        (0..group.size).map(agent)
    });
    let slots = formations_of_places(world).flat_map(|formation| {
        let size = world.groups.get(formation.group).map_or(0, |group| group.size);
        let about = formation.about.into_iter();
        about.flat_map(move |about| {
            (0..size).map(move |member| (world.first_of(formation.group) + member, about))
        })
    });
    let arenas: Vec<[f64; 4]> = world
        .groups
        .iter()
        .filter_map(|group| group.arena)
        .map(|area| [area.x_m.0, area.x_m.1, area.y_m.0, area.y_m.1])
        .collect();
    Stage {
        name,
        dt_s: world.dt_s,
        safety_m: world.safety_m,
        agents: agents.collect(),
        slots: slots.collect(),
        terms: world.reward.iter().map(|term| term.name.as_str()).collect(),
        arenas,
        frames: (0..EPISODES).map(|episode| frame(view, name, world, episode)).collect(),
    }
}

/// Distance of the hand point ahead of the axle, for bodies that have one.
fn hand(body: &Extern) -> Option<f64> {
    match body.settings.get("hand") {
        Some(Setting::Number(hand_m)) => Some(*hand_m),
        _ => None,
    }
}

/// Where the agents were seen in an episode, all cells together, with room for their bodies.
fn frame(view: &View, protocol: &str, world: &World, episode: usize) -> [f64; 4] {
    let seen = view
        .methods
        .iter()
        .flat_map(|method| method.evaluations(protocol))
        .filter_map(|(_, evaluation)| evaluation.trajectories.get(episode))
        .flat_map(|trajectory| &trajectory.agents)
        .filter(|[x, y, _]| x.is_finite() && y.is_finite())
        .map(|&[x, y, _]| (f64::from(x), f64::from(y)));
    let [x0, x1, y0, y1] = seen.fold([f64::MAX, f64::MIN, f64::MAX, f64::MIN], |[x0, x1, y0, y1], (x, y)| {
        [x0.min(x), x1.max(x), y0.min(y), y1.max(y)]
    });
    if x0 > x1 {
        return [-1.0, 1.0, -1.0, 1.0];
    }
    let hand_m = world.groups.iter().filter_map(|group| hand(&group.body)).fold(0.0, f64::max);
    let reach = |corner: &(f64, f64)| libm::hypot(corner.0, corner.1);
    let outline_m = world.groups.iter().filter_map(|group| group.solid.as_ref()).map(|solid| match solid {
        Solid::Disc { radius_m } => *radius_m,
        Solid::Segment { to_m } => reach(to_m),
        Solid::Polygon { corners_m } => corners_m.iter().map(reach).fold(0.0, f64::max),
    });
    let body_m = outline_m.fold(hand_m, f64::max);
    let margin = (0.04 * (x1 - x0).max(y1 - y0).max(0.1)).max(world.safety_m) + body_m;
    [x0 - margin, x1 + margin, y0 - margin, y1 + margin]
}

/// Trails of the whole episode, the slots and the agents at its end.
fn still(world: &World, trajectory: &Trajectory, frame: [f64; 4], style: &str) -> String {
    let [x0, x1, y0, y1] = frame;
    let scale = 1000.0 / (x1 - x0).max(y1 - y0);
    let known = |value: f32, or: f64| if value.is_finite() { f64::from(value) } else { or };
    let place = |x: f32, y: f32| ((known(x, x0) - x0) * scale, (y1 - known(y, y1)) * scale);
    let agents = world.agents();
    let learned = world.learned();
    let slots = trajectory.slots.len() / (trajectory.agents.len() / agents.max(1)).max(1);
    let mut body = String::new();
    let solids: Vec<Option<&Solid>> =
        world.groups.iter().flat_map(|group| vec![group.solid.as_ref(); group.size]).collect();
    let is_agent = |agent: usize| solids.get(agent).is_some_and(Option::is_none);
    for agent in (0..agents).filter(|agent| is_agent(*agent)) {
        let class = if learned.contains(&agent) { style } else { "leader" };
        let points = trajectory.agents.iter().skip(agent).step_by(agents).map(|&[x, y, _]| place(x, y));
        let trail: Vec<String> = points.map(|(x, y)| format!("{x:.0},{y:.0}")).collect();
        let _ = write!(body, r#"<polyline class="trail {class}" points="{}"/>"#, trail.join(" "));
    }
    let last_slots = trajectory.slots.len().saturating_sub(slots);
    for &[x, y] in trajectory.slots.iter().skip(last_slots) {
        let (x, y) = place(x, y);
        let _ = write!(body, r#"<circle class="slot" cx="{x:.0}" cy="{y:.0}" r="14"/>"#);
    }
    let last_agents = trajectory.agents.len().saturating_sub(agents);
    for (agent, &[x, y, _]) in trajectory.agents.iter().skip(last_agents).enumerate() {
        if let Some(Some(solid)) = solids.get(agent) {
            let at = |dx: f64, dy: f64| place(x + dx as f32, y + dy as f32);
            let corners = |all: &[(f64, f64)]| {
                let points = all.iter().map(|&(dx, dy)| at(dx, dy)).map(|(x, y)| format!("{x:.0},{y:.0}"));
                points.collect::<Vec<_>>().join(" ")
            };
            let (cx, cy) = at(0.0, 0.0);
            let _ = match solid {
                Solid::Disc { radius_m } => {
                    let r = radius_m * scale;
                    write!(body, r#"<circle class="obstacle" cx="{cx:.0}" cy="{cy:.0}" r="{r:.0}"/>"#)
                }
                Solid::Segment { to_m } => {
                    let points = corners(&[(0.0, 0.0), *to_m]);
                    write!(body, r#"<polyline class="obstacle" points="{points}"/>"#)
                }
                Solid::Polygon { corners_m } => {
                    write!(body, r#"<polygon class="obstacle" points="{}"/>"#, corners(corners_m))
                }
            };
            continue;
        }
        let class = if learned.contains(&agent) { style } else { "leader" };
        let (x, y) = place(x, y);
        let _ = write!(body, r#"<circle class="agent {class}" cx="{x:.0}" cy="{y:.0}" r="9"/>"#);
    }
    let (width, height) = ((x1 - x0) * scale, (y1 - y0) * scale);
    format!(
        r#"<svg class="still" role="img" aria-label="Trails of the agents over one episode" viewBox="0 0 {width:.0} {height:.0}">{body}</svg>"#
    )
}
