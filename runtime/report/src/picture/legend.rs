//! What the marks stand for, beside the drawings and true to scale.

use mpgx_lang::plan::{Control, Group};

use super::landscape::{Best, Values, hatching, peak};
use super::palette::colour;
use super::pen::{INK, SOFT, arrow_head, circle, num, path, plain, style};
use super::scene::{MARKER, moves, ruler};
use super::{Frame, Landscape, Moment, group_of, groups, names};
use crate::text::Format;

const LINE: f64 = 11.5;
const SYMBOLS: f64 = 40.0;

/// The legend from a corner down, and its height, points.
pub fn legend(
    moment: &Moment,
    land: &Landscape,
    values: &Values,
    frame: &Frame,
    [left, top]: [f64; 2],
) -> (String, f64) {
    let rows = rows(moment, land, values, frame);
    let mut out = String::new();
    for (k, (symbol, text)) in rows.iter().enumerate() {
        let (x, y) = (num(left + SYMBOLS / 2.0), num(top + k as f64 * LINE));
        out += &format!(
            r#"<g transform="translate({x} {y})">{symbol}<text x="{}" y="2.5">{text}</text></g>
"#,
            num(SYMBOLS / 2.0 + 4.0)
        );
    }
    (format!("<g>{out}</g>\n"), rows.len() as f64 * LINE)
}

/// A symbol around the origin and its text, of each line.
fn rows(moment: &Moment, land: &Landscape, values: &Values, frame: &Frame) -> Vec<(String, String)> {
    let world = moment.world;
    let mut rows = Vec::new();
    for (id, group, _) in groups(world).filter(|(_, group, _)| group.solid.is_none()) {
        let look = style(world, id);
        let arena = group.arena.map(|_| dashes(look.colour)).unwrap_or_default();
        let marker = format!(r#"<path d="{}" fill="{}"/>"#, look.marker([0.0; 2], MARKER), look.colour);
        let its = if group.arena.is_some() { "; arena" } else { "" };
        rows.push((arena + &marker, format!("{}{its}", agents(group))));
    }
    if let Some((k, _)) = moment.places_m.iter().enumerate().find(|(_, places)| !places.is_empty())
        && let Some(formation) = world.formations.get(k)
    {
        let look = style(world, formation.group);
        let data = look.marker([-6.0, 0.0], MARKER);
        let symbol = format!(
            r##"<path d="M-6 0L8 0" stroke="{SOFT}" stroke-width=".5"/><path d="{data}" fill="#fff" stroke="{}" stroke-width=".7"/><path d="{}" fill="{}"/>"##,
            look.colour,
            look.marker([8.0, 0.0], MARKER),
            look.colour
        );
        rows.push((symbol, "place in the formation, and who belongs there".into()));
    }
    if moment.ways_m.iter().any(|way| way.len() > 1) {
        let way = [[-14.0, 0.0], [14.0, 0.0]];
        let head = arrow_head(&way).unwrap_or_default();
        let symbol = format!(
            r#"<path d="{}" stroke="{SOFT}" stroke-width=".7"/><path d="{head}" fill="{SOFT}"/>"#,
            path(way, "")
        );
        rows.push((symbol, "way over the episode while those that learn stand still".into()));
    }
    let obstacles: Vec<String> = groups(world)
        .filter(|(_, group, _)| group.solid.is_some())
        .map(|(_, group, _)| format!("{}{}", plain(&group.name), if moves(group) { " (moves)" } else { "" }))
        .collect();
    if !obstacles.is_empty() {
        let symbol = r##"<rect x="-8" y="-3" width="16" height="6" fill="#c9ccd1" stroke="#4a4e56" stroke-width=".7"/>"##;
        rows.push((symbol.into(), format!("obstacles: {}", obstacles.join(", "))));
    }
    rows.extend(scales(moment, frame));
    rows.extend(worth(moment, land, values));
    rows
}

/// `follower 1–3: unicycle, learned`.
fn agents(group: &Group) -> String {
    let members = if group.size > 1 { format!(" 1–{}", group.size) } else { String::new() };
    let control = match &group.control {
        Control::Still => "stands still".into(),
        Control::Learned => "learned".into(),
        Control::Motion(motion) => format!("moves by {}", plain(&motion.name)),
    };
    format!("{}{members}: {}, {control}", plain(&group.name), plain(&group.body.name))
}

/// Lengths, as long as they are in the drawings.
fn scales(moment: &Moment, frame: &Frame) -> Vec<(String, String)> {
    let world = moment.world;
    let mut rows = Vec::new();
    let length = |size: f64, unit: &'static str| Format { unit, ..Format::number(size) }.full(size);
    if world.safety_m > 0.0 {
        let radius = world.safety_m * frame.scale() / 2.0;
        if radius < LINE / 2.0 {
            let data = circle([0.0; 2], radius);
            let symbol = format!(r#"<path d="{data}" fill="none" stroke="{INK}" stroke-width=".6"/>"#);
            rows.push((symbol, format!("safety distance {}, true to scale", length(world.safety_m, "m"))));
        }
    }
    let learned = world.groups.iter().filter(|group| group.control == Control::Learned);
    let speed = learned.map(|group| group.speed_mps.0.abs().max(group.speed_mps.1.abs())).fold(0.0, f64::max);
    if speed > 0.0 && speed * frame.scale() <= SYMBOLS {
        rows.push((
            ruler([0.0; 2], speed * frame.scale()),
            format!("how far one gets in 1\u{202f}s at {} along an axis", length(speed, "m/s")),
        ));
    }
    rows
}

fn worth(moment: &Moment, land: &Landscape, values: &Values) -> Vec<(String, String)> {
    let mut rows = Vec::new();
    let swatch = |share: f64, x: f64| {
        format!(r#"<rect x="{x}" y="-4" width="14" height="8" fill="{}"/>"#, colour(share))
    };
    if let Some(step) = values.step() {
        let line = format!(r#"<path d="M0 -4L0 4" stroke="{INK}" stroke-width=".3"/>"#);
        let symbol = swatch(0.4, -14.0) + &swatch(0.55, 0.0) + &line;
        rows.push((
            symbol,
            format!("lines every {}; all others stay where they are", values.format.full(step)),
        ));
    }
    if land.failed.contains(&true) {
        let failures = moment.world.ends.iter().filter(|end| end.failure);
        let names: Vec<String> = failures.map(|end| plain(&end.name)).collect();
        let symbol = swatch(0.75, -14.0) + &swatch(0.75, 0.0) + &hatching(-14.0, -4.0, 28.0, 8.0, |_| true);
        rows.push((symbol, format!("the episode fails: {}", names.join(" or "))));
    }
    let mark = if let Best::Peak(..) = values.best { peak([0.0; 2]) } else { String::new() };
    rows.push((mark, values.best_text()));
    if let Some((id, _)) = group_of(moment.world, land.agent) {
        let data = style(moment.world, id).marker([0.0; 2], MARKER);
        let symbol = format!(r#"<path d="{data}" fill="none" stroke="{INK}" stroke-width=".9"/>"#);
        let name = names(moment.world).get(land.agent).map(|name| plain(name)).unwrap_or_default();
        rows.push((symbol, format!("where {name} is")));
    }
    rows
}

/// The border of an arena.
fn dashes(colour: &str) -> String {
    format!(r#"<path d="M-16 0L16 0" stroke="{colour}" stroke-width=".6" stroke-dasharray="3 2"/>"#)
}
