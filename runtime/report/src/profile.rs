//! Performance profiles (Agarwal et al. 2021): the share of seeds that reach each value of a metric, as steps with
//! a bootstrap band.

use minijinja::Value;
use mpgx_study::statistics::{performance_profile, profile_band};
use serde::Serialize;

use crate::band::FEWEST_SEEDS;
use crate::series::pack;
use crate::svg::{self, Axis, Chart};
use crate::text::{Format, escape};

/// Most steps of a drawn profile.
const MOST_STEPS: usize = 200;
const CONFIDENCE: f64 = 0.95;

/// One value a seed.
pub struct Sample<'a> {
    pub label: &'a str,
    pub style: &'a str,
    pub scores: Vec<f64>,
}

/// What `profile.html` shows.
#[derive(Serialize)]
pub struct Profile {
    title: String,
    unit: &'static str,
    chart: Value,
    legend: Vec<(String, String)>,
    /// A threshold, then the share of each method.
    rows: Vec<Vec<String>>,
    id: String,
    #[serde(skip)]
    pub data: serde_json::Value,
}

/// Shares at ascending thresholds.
struct Shares {
    at: Vec<f64>,
    mid: Vec<f64>,
    /// Empty below [`FEWEST_SEEDS`].
    band: Vec<(f64, f64)>,
}

impl Shares {
    /// Of seeds above each threshold, or at most there if less is better; so a higher line is always better.
    fn new(scores: &[f64], at: Vec<f64>, higher_is_better: bool) -> Shares {
        let flip = |share: f64| if higher_is_better { share } else { 1.0 - share };
        let band = profile_band(scores, &at, CONFIDENCE).filter(|_| scores.len() >= FEWEST_SEEDS);
        let ends = |lo: f64, hi: f64| if higher_is_better { (lo, hi) } else { (1.0 - hi, 1.0 - lo) };
        Shares {
            mid: performance_profile(scores, &at).into_iter().map(flip).collect(),
            band: band.into_iter().flatten().map(|interval| ends(interval.lo, interval.hi)).collect(),
            at,
        }
    }

    /// For the script of the page, up to the end of the axis.
    fn packed(&self, sample: &Sample, x_end: f64) -> serde_json::Value {
        let last = |values: Vec<f64>| {
            let last = values.last().copied();
            pack(values.into_iter().chain(last).map(Some))
        };
        let (lo, hi): (Vec<f64>, Vec<f64>) = self.band.iter().copied().unzip();
        let whole = |values: Vec<f64>| (!values.is_empty()).then(|| last(values));
        serde_json::json!({
            "label": sample.label, "style": sample.style,
            "x": pack(self.at.iter().copied().chain([x_end]).map(Some)),
            "mid": last(self.mid.clone()), "lo": whole(lo), "hi": whole(hi),
        })
    }

    /// Level between thresholds: each value at its own and at the next threshold.
    fn steps<'a, T: Copy>(&'a self, values: &'a [T], end: f64) -> impl Iterator<Item = (f64, T)> + 'a {
        let ends = self.at.iter().skip(1).copied().chain([end]);
        self.at.iter().zip(ends).zip(values).flat_map(|((from, to), value)| [(*from, *value), (to, *value)])
    }
}

/// `None`: nothing to draw.
pub fn profile(
    id: &str,
    quantity: &str,
    samples: &[Sample],
    higher_is_better: bool,
    format: fn(f64) -> Format,
) -> Option<Profile> {
    let samples: Vec<&Sample> = samples.iter().filter(|sample| !sample.scores.is_empty()).collect();
    let x = Axis::linear(samples.iter().flat_map(|sample| sample.scores.iter().copied()), 6, format);
    let whole = |_| Format { digits: 0, ..Format::percent(1.0) };
    let y = Axis::linear([0.0, 1.0], 4, whole);
    let mut area = String::new();
    let mut packed = Vec::new();
    for sample in &samples {
        let shares = Shares::new(&sample.scores, thresholds(&sample.scores, x.lo), higher_is_better);
        packed.push(shares.packed(sample, x.hi));
        let place = |share: f64| y.place(share);
        let region: Vec<_> = shares
            .steps(&shares.band, x.hi)
            .map(|(at, (lo, hi))| (x.place(at), place(lo), place(hi)))
            .collect();
        let mid = shares.steps(&shares.mid, x.hi).map(|(at, share)| Some((x.place(at), place(share))));
        area += &format!(
            r#"<g class="{}"><path class="band" d="{}"/><path class="mid" d="{}"/></g>"#,
            escape(sample.style),
            svg::region(&region),
            svg::line(mid)
        );
    }
    let format = format(x.lo.abs().max(x.hi.abs()));
    let side = if higher_is_better { "above" } else { "at most" };
    let title = format!("Share of seeds with {quantity} {side} a value");
    let chart = Chart {
        id,
        title: &title,
        description: &describe(&samples, side, format),
        height: 250,
        x: &x,
        y: &y,
        area: &area,
        over: "",
    };
    let at: Vec<f64> = x.ticks.iter().map(|tick| tick.value).collect();
    let columns: Vec<Shares> =
        samples.iter().map(|it| Shares::new(&it.scores, at.clone(), higher_is_better)).collect();
    let row = |(k, tick): (usize, &svg::Tick)| {
        let cell = |shares: &Shares| {
            let percent = whole(1.0);
            let mid = shares.mid.get(k).map(|share| percent.plain(*share)).unwrap_or_default();
            let band = shares.band.get(k).and_then(|(lo, hi)| percent.interval(Some(*lo), Some(*hi)));
            band.map_or(mid.clone(), |band| format!("{mid} {band}"))
        };
        [tick.label.clone()].into_iter().chain(columns.iter().map(cell)).collect()
    };
    let chart = Value::from_safe_string(chart.render());
    (!samples.is_empty()).then(|| Profile {
        unit: format.unit,
        chart,
        legend: samples.iter().map(|it| (it.label.to_string(), it.style.to_string())).collect(),
        rows: x.ticks.iter().enumerate().map(row).collect(),
        data: serde_json::json!({
            "id": id, "title": title, "name": if format.unit.is_empty() { "value" } else { format.unit },
            "across": format.factor, "unit": "%", "factor": 100, "steps": true, "middle": "share of seeds",
            "samples": packed
        }),
        id: id.to_string(),
        title,
    })
}

/// The start of the axis and each value, ascending; of very many values some.
fn thresholds(scores: &[f64], start: f64) -> Vec<f64> {
    let mut all = [&[start], scores].concat();
    all.sort_unstable_by(f64::total_cmp);
    all.dedup();
    let every = all.len().div_ceil(MOST_STEPS);
    let last = all.len() - 1;
    let kept = all.into_iter().enumerate().filter(|(k, _)| k % every == 0 || *k == last);
    kept.map(|(_, value)| value).collect()
}

/// Where half of the seeds of each method are, in words.
fn describe(samples: &[&Sample], side: &str, format: Format) -> String {
    let words = samples.iter().filter_map(|sample| {
        let mut sorted = sample.scores.clone();
        sorted.sort_unstable_by(f64::total_cmp);
        let median = mpgx_study::statistics::quantile(&sorted, 0.5)?;
        Some(format!("Half of the seeds of {} are {side} {}.", sample.label, format.at(median).full(median)))
    });
    words.collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_higher_line_is_better_whatever_the_metric() {
        let scores = [1.0, 2.0, 2.0, 4.0];
        let shares = |higher| Shares::new(&scores, vec![0.0, 1.0, 2.0, 4.0], higher);
        assert_eq!(shares(true).mid, [1.0, 0.75, 0.25, 0.0]);
        assert_eq!(shares(false).mid, [0.0, 0.25, 0.75, 1.0]);
        assert!(shares(true).band.is_empty(), "four seeds have no band");
        let five = Shares::new(&[1.0, 2.0, 3.0, 4.0, 5.0], vec![0.0, 3.0], false);
        assert_eq!(five.band[0], (0.0, 0.0));
        assert!(five.band[1].0 < 0.6 && five.band[1].1 > 0.6 && five.band[1].1 <= 1.0, "{:?}", five.band);
    }

    #[test]
    fn steps_are_level_and_jump_at_the_values() {
        let shares = Shares::new(&[1.0, 3.0], thresholds(&[3.0, 1.0], 0.0), true);
        let steps: Vec<_> = shares.steps(&shares.mid, 4.0).collect();
        assert_eq!(steps, [(0.0, 1.0), (1.0, 1.0), (1.0, 0.5), (3.0, 0.5), (3.0, 0.0), (4.0, 0.0)]);
        let many: Vec<f64> = (0..5000).map(f64::from).collect();
        let kept = thresholds(&many, -1.0);
        assert!(kept.len() <= MOST_STEPS + 1 && kept.last() == Some(&4999.0));
    }

    #[test]
    fn nothing_to_draw_is_no_figure() {
        assert!(profile("p", "return", &[], true, Format::number).is_none());
        let empty = [Sample { label: "a", style: "m0", scores: vec![] }];
        assert!(profile("p", "return", &empty, true, Format::number).is_none());
    }
}
