//! The strokes of a picture: numbers, texts, lines and markers as SVG. Lengths are points, y grows downwards.

use mpgx_lang::plan::{Control, GroupId, World};

use crate::text::escape;

pub const INK: &str = "#1b1d22";
pub const SOFT: &str = "#6a6f78";

/// Safe for the colour blind on white; the report's own.
const COLOURS: [&str; 6] = ["#0072b2", "#c4500a", "#00805c", "#a3457f", "#8a6200", "#3b6ea8"];
/// Of agents that are not learned.
const LEADING: &str = "#3d424b";

const FAR: f64 = 1e4;

/// Longer names are cut.
const LONGEST: usize = 40;

/// With two digits behind the point at most. What lies far outside is kept near, and so is what is no number.
pub fn num(x: f64) -> String {
    let text = format!("{:.2}", if x.is_nan() { -FAR } else { x.clamp(-FAR, FAR) });
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

/// A text of the scenario as text of the picture.
pub fn plain(text: &str) -> String {
    let visible =
        |c: char| if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') { '\u{fffd}' } else { c };
    let mut short: String = text.chars().take(LONGEST).map(visible).collect();
    if text.chars().nth(LONGEST).is_some() {
        short.push('…');
    }
    escape(&short)
}

/// Path data through points; `end` is `z` to close it.
pub fn path(points: impl IntoIterator<Item = [f64; 2]>, end: &str) -> String {
    let mut data = String::new();
    for [x, y] in points {
        data += if data.is_empty() { "M" } else { "L" };
        data += &format!("{} {}", num(x), num(y));
    }
    data + end
}

/// Path data of a circle.
pub fn circle([x, y]: [f64; 2], radius: f64) -> String {
    let (left, y, r, d) = (num(x - radius), num(y), num(radius), num(2.0 * radius));
    format!("M{left} {y}a{r} {r} 0 1 0 {d} 0a{r} {r} 0 1 0 -{d} 0z")
}

/// How a group looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Style {
    pub colour: &'static str,
    shape: usize,
}

/// Colours tell learned groups apart; all groups have a marker of their own, as far as there are any.
pub fn style(world: &World, group: GroupId) -> Style {
    let agents = |to: usize| world.groups.iter().take(to).filter(|group| group.solid.is_none());
    let learned = |to: usize| agents(to).filter(|group| group.control == Control::Learned).count();
    let is_learned = learned(group + 1) > learned(group);
    let colour = COLOURS.get(learned(group) % COLOURS.len()).filter(|_| is_learned);
    Style { colour: colour.unwrap_or(&LEADING), shape: agents(group).count() }
}

impl Style {
    /// Path data of the marker; all have about the area of a circle of this radius.
    pub fn marker(&self, at: [f64; 2], radius: f64) -> String {
        let corners = |turn: f64, count: usize, size: f64| {
            let corner = move |k: usize| {
                let angle = (turn + k as f64 / count as f64) * std::f64::consts::TAU;
                [at[0] + size * radius * libm::sin(angle), at[1] - size * radius * libm::cos(angle)]
            };
            path((0..count).map(corner), "z")
        };
        match self.shape % 6 {
            0 => corners(0.125, 4, 1.25),
            1 => circle(at, radius),
            2 => corners(0.0, 3, 1.5),
            3 => corners(0.0, 4, 1.3),
            4 => corners(0.5, 3, 1.5),
            _ => corners(0.0, 6, 1.1),
        }
    }
}

/// A star with four points.
pub fn star([x, y]: [f64; 2], radius: f64) -> String {
    let point = |k: usize| {
        let size = if k.is_multiple_of(2) { radius } else { 0.36 * radius };
        let angle = k as f64 / 8.0 * std::f64::consts::TAU;
        [x + size * libm::sin(angle), y - size * libm::cos(angle)]
    };
    path((0..8).map(point), "z")
}

/// Path data of the head of an arrow at the end of a line.
pub fn arrow_head(line: &[[f64; 2]]) -> Option<String> {
    let (tip, before) = (line.last()?, line.iter().rev().nth(1)?);
    let (dx, dy) = (tip[0] - before[0], tip[1] - before[1]);
    let length = libm::hypot(dx, dy);
    let (dx, dy) = (dx / length, dy / length);
    let wing = |side: f64| [tip[0] - 4.0 * dx - 1.6 * side * dy, tip[1] - 4.0 * dy + 1.6 * side * dx];
    (length > 0.0).then(|| path([wing(1.0), *tip, wing(-1.0)], "z"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        let all = [12.0, -0.001, 0.1, -3.456, 100.0].map(num);
        assert_eq!(all, ["12", "0", "0.1", "-3.46", "100"]);
    }

    /// Seen to fail when texts are written as they are.
    #[test]
    fn texts_are_inert_and_short() {
        assert_eq!(plain("<a>&\"'\u{1}"), "&lt;a&gt;&amp;&quot;&#x27;\u{fffd}");
        assert_eq!(plain(&"x".repeat(50)), format!("{}…", "x".repeat(40)));
    }

    #[test]
    fn arrows_point_along_the_end() {
        assert_eq!(arrow_head(&[[0.0, 0.0], [10.0, 0.0]]).unwrap(), "M6 1.6L10 0L6 -1.6z");
        assert_eq!(arrow_head(&[[1.0, 1.0], [1.0, 1.0]]), None);
        assert_eq!(arrow_head(&[[1.0, 1.0]]), None);
    }
}
