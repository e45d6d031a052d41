//! What a state is worth over the position of one agent: bands of colour with lines between them.

use mpgx_lang::plan::Area;

use super::contour::{Field, simplified_loop};
use super::palette::colour;
use super::pen::{INK, SOFT, num, path, plain, star};
use super::scene::bystanders;
use super::{Frame, Landscape, Moment, nodes};
use crate::svg::round_step;
use crate::symbols::unit;
use crate::text::Format;

/// About so many bands.
const BANDS: f64 = 10.0;
/// Corners left out of a line are at most this far away from it, points.
const SMOOTH: f64 = 0.08;
/// Between two lines of a hatching, points.
const SPACING: f64 = 4.5;
/// More nodes with the greatest value are a plateau.
const PEAK: usize = 4;

/// The values as they are shown.
pub struct Values {
    /// What they are: `reward`.
    pub name: String,
    /// The border between each two bands, rising.
    pub levels: Vec<f64>,
    pub format: Format,
    pub best: Best,
}

/// Where the greatest value is.
pub enum Best {
    Nowhere,
    Plateau(f64),
    Peak(f64, [f64; 2]),
}

impl Values {
    pub fn new(land: &Landscape, area: &Area) -> Values {
        let (low, high) = range(&land.values);
        let step = if high > low { round_step((high - low) / BANDS) } else { 0.0 };
        let (first, last) =
            if step > 0.0 { ((low / step).ceil(), (high / step).floor()) } else { (1.0, 0.0) };
        let count = (last - first + 1.0).clamp(0.0, 2.0 * BANDS) as usize;
        let levels = (0..count).map(|k| (first + k as f64) * step).filter(|level| *level > low).collect();
        let unit = unit(&land.dimension).unwrap_or("SI");
        let digits =
            if step > 0.0 { (-libm::floor(libm::log10(step) + 1e-9)).clamp(0.0, 8.0) as usize } else { 2 };
        let format = Format { unit, factor: 1.0, digits };
        let columns = land.columns.max(1);
        Values {
            name: plain(&land.name),
            levels,
            format,
            best: best(&land.values, &nodes(*area, columns, land.values.len() / columns)),
        }
    }

    fn colour(&self, band: usize) -> String {
        colour((band as f64 + 0.5) / (self.levels.len() + 1) as f64)
    }

    /// The greatest value in words.
    pub fn best_text(&self) -> String {
        let value = |value: f64| self.format.at(value).full(value);
        match self.best {
            Best::Nowhere => "it is nowhere a number".into(),
            Best::Plateau(best) => format!("greatest {}: {}, at many positions", self.name, value(best)),
            Best::Peak(best, [x, y]) => {
                let metres = |x: f64| Format { unit: "m", factor: 1.0, digits: 2 }.plain(x);
                format!("greatest {}: {} at ({}, {}) m", self.name, value(best), metres(x), metres(y))
            }
        }
    }

    /// How far the lines are apart, if there are any.
    pub fn step(&self) -> Option<f64> {
        Some(self.levels.get(1)? - self.levels.first()?)
    }
}

/// What most values lie between: a few that are far off do not count.
fn range(values: &[f64]) -> (f64, f64) {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|x| x.abs() < 1e60).collect();
    sorted.sort_by(f64::total_cmp);
    let at = |share: f64| sorted.get((share * sorted.len().saturating_sub(1) as f64) as usize).copied();
    let all = (at(0.0), at(0.02), at(0.98), at(1.0));
    let (Some(least), Some(low), Some(high), Some(most)) = all else { return (0.0, 0.0) };
    let near = 0.5 * (high - low);
    let low = if low - least <= near || near == 0.0 { least } else { low };
    let high = if most - high <= near || near == 0.0 { most } else { high };
    (low, high)
}

fn best(values: &[f64], nodes: &[[f64; 2]]) -> Best {
    let finite = || values.iter().zip(nodes).filter(|(value, _)| value.is_finite());
    let Some((most, at)) = finite().fold(None::<(f64, [f64; 2])>, |best, (value, at)| match best {
        Some((most, _)) if most >= *value => best,
        _ => Some((*value, *at)),
    }) else {
        return Best::Nowhere;
    };
    let equal = finite().filter(|(value, _)| most - **value <= 1e-9 * most.abs()).count();
    if equal > PEAK { Best::Plateau(most) } else { Best::Peak(most, at) }
}

/// The landscape as an SVG group, with the others where they are, without axes.
pub fn landscape(moment: &Moment, land: &Landscape, frame: &Frame) -> String {
    let values = Values::new(land, &frame.area);
    let field = Field { columns: land.columns, values: &land.values };
    let size = [land.columns.saturating_sub(1).max(1) as f64, field.rows().saturating_sub(1).max(1) as f64];
    let place = |[i, j]: [f64; 2]| {
        [frame.left + i / size[0] * frame.width, frame.top + (1.0 - j / size[1]) * frame.height()]
    };
    let region = |level: f64| -> String {
        let loops = field.loops(level).into_iter();
        let points = loops.map(|points| simplified_loop(points.into_iter().map(place).collect(), SMOOTH));
        points.filter(|points| points.len() > 2).map(|points| path(points, "z")).collect()
    };
    let [x, y, width, height] = [frame.left, frame.top, frame.width, frame.height()].map(num);
    let mut drawing =
        format!(r##"<rect x="{x}" y="{y}" width="{width}" height="{height}" fill="#ececec"/>"##);
    drawing += &format!(r#"<path d="{}" fill="{}"/>"#, region(f64::MIN), values.colour(0));
    let above = values.levels.iter().map(|level| region(*level)).enumerate();
    for (k, data) in above.filter(|(_, data)| !data.is_empty()) {
        drawing += &format!(
            r#"<path d="{data}" fill="{}" stroke="{INK}" stroke-opacity=".5" stroke-width=".3"/>"#,
            values.colour(k + 1)
        );
    }
    let failed = |[x, y]: [f64; 2]| {
        let share = [(x - frame.left) / frame.width, (y - frame.top) / frame.height()];
        let (i, j) = ((share[0] * size[0]).round() as usize, ((1.0 - share[1]) * size[1]).round() as usize);
        land.failed.get(j * land.columns + i).is_some_and(|failed| *failed)
    };
    drawing += &hatching(frame.left, frame.top, frame.width, frame.height(), failed);
    drawing += &bystanders(moment, land.agent, frame);
    if let Best::Peak(_, at) = values.best {
        drawing += &peak(frame.at(at));
    }
    format!("<g>{}</g>\n", frame.clipped(&drawing))
}

/// The mark of the greatest value.
pub fn peak(at: [f64; 2]) -> String {
    format!(r##"<path d="{}" fill="#fff" stroke="{INK}" stroke-width=".7"/>"##, star(at, 4.6))
}

/// Slanted lines over the part of a box that is `inside`.
pub fn hatching(left: f64, top: f64, width: f64, height: f64, inside: impl Fn([f64; 2]) -> bool) -> String {
    const STEP: f64 = 0.5;
    let mut data = String::new();
    for line in 1..((width + height) / SPACING).ceil() as usize {
        let across = line as f64 * SPACING;
        // From the left or lower border up to the right.
        let from = (across - height).max(0.0);
        let to = across.min(width);
        let at = |x: f64| [left + x, top + across - x];
        let steps = ((to - from) / STEP) as usize;
        let mut begun: Option<[f64; 2]> = None;
        for k in 0..=steps {
            let point = at(from + k as f64 * STEP);
            let is_inside = inside(point);
            match begun {
                None if is_inside => begun = Some(point),
                Some(start) if !is_inside || k == steps => {
                    data += &path([start, point], "");
                    begun = None;
                }
                _ => {}
            }
        }
    }
    if data.is_empty() {
        return data;
    }
    format!(
        r##"<path d="{data}" fill="none" stroke="#fff" stroke-opacity=".55" stroke-width="1.3"/><path d="{data}" fill="none" stroke="{INK}" stroke-opacity=".7" stroke-width=".45"/>"##
    )
}

/// The colours of the bands with their borders, from a corner down.
pub fn colour_bar(values: &Values, land: &Landscape, [left, top]: [f64; 2], height: f64) -> String {
    const WIDE: f64 = 7.0;
    let bands = values.levels.len() + 1;
    let each = height / bands as f64;
    let y = |band: f64| top + height - band * each;
    let mut out = String::new();
    for band in 0..bands {
        out += &format!(
            r#"<rect x="{}" y="{}" width="{}" height="{}" fill="{}"/>"#,
            num(left),
            num(y(band as f64 + 1.0)),
            num(WIDE),
            num(each),
            values.colour(band)
        );
    }
    let (mut marks, mut labels) = (String::new(), String::new());
    let every = if bands > 14 { 2 } else { 1 };
    for (k, level) in values.levels.iter().enumerate().step_by(every) {
        let y = y(k as f64 + 1.0);
        marks += &path([[left, y], [left + WIDE + 2.0, y]], "");
        let (x, y, text) = (num(left + WIDE + 4.0), num(y + 2.4), values.format.plain(*level));
        labels += &format!(r#"<text x="{x}" y="{y}">{text}</text>"#);
    }
    let border =
        path([[left, top], [left + WIDE, top], [left + WIDE, top + height], [left, top + height]], "z");
    let longest = values.levels.iter().map(|level| values.format.plain(*level).chars().count()).max();
    let x = num(left + WIDE + 12.0 + 3.9 * longest.unwrap_or(0) as f64);
    let unit =
        if values.format.unit.is_empty() { String::new() } else { format!(" ({})", values.format.unit) };
    format!(
        r#"<g>{out}<path d="{border}{marks}" fill="none" stroke="{SOFT}" stroke-width=".6"/><g font-size="7">{labels}</g><text transform="translate({x} {}) rotate(-90)" font-size="8" text-anchor="middle">{}{unit}</text></g>
"#,
        num(top + height / 2.0),
        plain(&land.name)
    )
}
