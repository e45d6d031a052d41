//! Two studies beside each other: what they mean otherwise, how their learners differ, and by how much we know it.

use minijinja::value::Serde;
use minijinja::{Value, context};
use mpgx_lang::diff::{Change, diff};
use mpgx_lang::plan::{Method, Plan};
use mpgx_study::summary::{Pair, Statistic, Summary};
use mpgx_study::{Meeting, Study, between};
use serde::Serialize;
use serde_json::json;

use crate::strips::{Spread, Strips, strips};
use crate::suite::{format, metric};
use crate::text::{Format, escape, plural};
use crate::{Page, ReportError, Section, embed, page, render};

mod curves;

/// A finished study and what to call it.
pub struct Side<'a> {
    pub name: String,
    pub study: &'a Study,
    pub summary: &'a Summary,
}

/// Two studies and what lies between them.
pub struct Compared<'a> {
    pub sides: [Side<'a>; 2],
    /// From the first to the second.
    pub changes: Vec<Change>,
    pub meetings: Vec<Meeting>,
}

impl<'a> Compared<'a> {
    pub fn new(a: Side<'a>, b: Side<'a>) -> Compared<'a> {
        let changes = diff(&a.study.plan, &b.study.plan);
        let meetings = between(a.study, b.study);
        Compared { sides: [a, b], changes, meetings }
    }

    /// Both summaries under their names, what differs, and every comparison.
    pub fn json(&self) -> serde_json::Value {
        let change = |it: &Change| json!({ "what": it.what, "before": it.before, "after": it.after });
        let side = |side: &Side| json!({ "name": side.name, "summary": side.summary });
        json!({
            "studies": self.sides.iter().map(side).collect::<Vec<_>>(),
            "changes": self.changes.iter().map(change).collect::<Vec<_>>(),
            "evaluations": self.meetings,
        })
    }

    pub(crate) fn title(&self) -> String {
        let [a, b] = &self.sides;
        format!("{} against {}", a.name, b.name)
    }

    /// What, then how it is in each study.
    pub(crate) fn told(change: &Change) -> [String; 3] {
        let side = |text: &Option<String>| match text.as_deref() {
            None => "–".into(),
            Some("") => "yes".into(),
            Some(text) => text.to_string(),
        };
        [change.what.clone(), side(&change.before), side(&change.after)]
    }

    /// What is compared how, in a sentence.
    pub(crate) fn rules(&self, meeting: &Meeting) -> String {
        let paired = meeting.pairs.iter().filter(|pair| pair.paired).count();
        let episodes = match (meeting.same_episodes, paired) {
            (false, _) => {
                "What is evaluated is not the same in both: differences are those of independent samples."
            }
            (true, 0) => {
                "The held-out episodes are the same, the seeds are not: differences are those of independent samples."
            }
            (true, _) => {
                "The held-out episodes and the seeds are the same: differences are taken seed by seed."
            }
        };
        let reward =
            if meeting.same_reward { "" } else { " The rewards differ, so returns are not compared." };
        format!("{episodes}{reward}")
    }

    /// Evaluations of only one of them.
    pub(crate) fn alone(&self) -> Vec<String> {
        let met = |name: &String| self.meetings.iter().any(|meeting| meeting.protocol == *name);
        let of = |side: &Side| {
            let names = side.summary.protocols.keys().filter(|name| !met(name));
            names.map(|name| format!("{} has “{name}”", side.name)).collect::<Vec<_>>()
        };
        self.sides.iter().flat_map(of).collect()
    }

    /// Every method with its statistics under an evaluation: learners of one label beside each other, then
    /// controllers.
    pub(crate) fn rows<'s>(&'s self, protocol: &str) -> Vec<Entry<'s>> {
        let learners = labels(&self.sides, |plan| &plan.learners);
        let controllers = labels(&self.sides, |plan| &plan.controllers);
        let of = |label: &str, look: &dyn Fn(usize) -> (&'static str, bool)| {
            let entry = |(k, side): (usize, &'s Side<'a>)| {
                let metrics = side.summary.protocols.get(protocol)?.get(label)?;
                let (style, learned) = look(k);
                Some(Entry { label: format!("{}: {label}", side.name), style, learned, metrics })
            };
            self.sides.iter().enumerate().filter_map(entry).collect::<Vec<_>>()
        };
        let learned =
            learners.iter().enumerate().flat_map(|(n, label)| of(label, &|k| (style(2 * n + k), true)));
        learned.chain(controllers.iter().flat_map(|label| of(label, &|_| ("ref", false)))).collect()
    }
}

/// Labels of methods in either study, in order.
fn labels<'s>(sides: &'s [Side; 2], methods: fn(&Plan) -> &[Method]) -> Vec<&'s str> {
    let mut labels: Vec<&str> = Vec::new();
    for method in sides.iter().flat_map(|side| methods(&side.study.plan)) {
        if !labels.contains(&method.label.as_str()) {
            labels.push(&method.label);
        }
    }
    labels
}

/// A method of one of the studies under an evaluation.
pub(crate) struct Entry<'a> {
    pub label: String,
    pub style: &'static str,
    pub learned: bool,
    pub metrics: &'a std::collections::BTreeMap<String, Statistic>,
}

/// Class of a learner's colour, dash and marker; controllers are grey.
fn style(k: usize) -> &'static str {
    const STYLES: [&str; 6] = ["m0", "m1", "m2", "m3", "m4", "m5"];
    STYLES[k % STYLES.len()]
}

/// The page as HTML text.
///
/// # Errors
/// [`ReportError`], if a template does not fit.
pub fn compare_html(compared: &Compared) -> Result<String, ReportError> {
    let fill = |id: &'static str, title: &'static str, template: &str, context: Value| {
        Ok(Section::still(id, title, render("compare", template, context)?))
    };
    let changes: Vec<[String; 3]> = compared.changes.iter().map(Compared::told).collect();
    let meanings = context! { changes => Serde(changes), names => names(compared) };
    let parts: Vec<Part> = compared.meetings.iter().map(|meeting| part(compared, meeting)).collect();
    let results = context! { parts => Serde(parts), names => names(compared), alone => compared.alone() };
    let mut sections = vec![
        fill("verdict", "Verdict", include_str!("compare/verdict.html"), verdict(compared))?,
        fill("meaning", "What differs", include_str!("compare/meaning.html"), meanings)?,
        fill("comparison", "Comparison", include_str!("compare/results.html"), results)?,
    ];
    let curves = curves::figures(compared);
    if !curves.is_empty() {
        let data = json!({ "charts": curves.iter().map(|it| &it.data).collect::<Vec<_>>() });
        let data = embed(&data).map_err(|source| ReportError::Data { panel: "learning", source })?;
        let context = context! { figures => Serde(&curves) };
        sections.push(Section {
            data: Some(data),
            script: Some(Value::from_safe_string(include_str!("script/samples.js").into())),
            ..fill("learning", "Learning", include_str!("compare/curves.html"), context)?
        });
    }
    let studies: Vec<About> = compared.sides.iter().map(about).collect();
    let context = context! { studies => Serde(studies) };
    sections.push(fill("provenance", "Provenance", include_str!("compare/studies.html"), context)?);
    page(&Page {
        name: &compared.title(),
        about: "",
        version: env!("CARGO_PKG_VERSION"),
        sections: &sections,
    })
}

fn names(compared: &Compared) -> Vec<String> {
    compared.sides.iter().map(|side| side.name.clone()).collect()
}

fn verdict(compared: &Compared) -> Value {
    let seeds: Vec<usize> = compared.sides.iter().map(|side| side.summary.seeds).collect();
    let fewest = seeds.iter().copied().min().unwrap_or(0);
    let of = |side: &Side| format!("{} of {}", plural(side.summary.seeds, "seed"), side.name);
    let badge = match fewest {
        0..5 => Some("too few seeds to compare"),
        5..10 => Some("exploratory"),
        _ => None,
    };
    context! {
        sentence => Value::from_safe_string(sentence(compared)),
        seeds => compared.sides.iter().map(of).collect::<Vec<_>>(),
        badge => badge,
        evidence => evidence(compared),
        same => compared.changes.is_empty(),
    }
}

/// One sentence in plain words, as HTML: the first learner, by its distance, under the first common evaluation.
fn sentence(compared: &Compared) -> String {
    let first = compared.meetings.iter().flat_map(|meeting| &meeting.pairs);
    let Some(pair) = first.clone().find(|pair| pair.comparison.metric == "error_m") else {
        return "The two studies have no learner and no evaluation in common.".into();
    };
    let [a, b] = &compared.sides;
    let it = &pair.comparison;
    let of = |side: &Side, label: &str, style: &str| {
        format!(r#"<span class="name {style}">{}</span> of {}"#, escape(label), escape(&side.name))
    };
    let format = Format::length(it.difference);
    let by = format.full(it.difference.abs());
    let words = match (it.verdict.as_str(), it.difference < 0.0) {
        ("better", _) => format!("is <b>{by}</b> closer to its place than"),
        ("worse", _) => format!("is <b>{by}</b> farther from its place than"),
        ("no difference shown", _) => "is not shown to differ from".into(),
        (_, true) => format!("was <b>{by}</b> closer to its place than"),
        (_, false) => format!("was <b>{by}</b> farther from its place than"),
    };
    format!("{} {words} {} on “{}”.", of(a, &it.a, "m0"), of(b, &it.b, "m1"), escape(&it.protocol))
}

/// The numbers behind the sentence.
fn evidence(compared: &Compared) -> Option<String> {
    let mut pairs = compared.meetings.iter().flat_map(|meeting| &meeting.pairs);
    let it = &pairs.find(|pair| pair.comparison.metric == "error_m")?.comparison;
    let format = Format::length(it.difference);
    let interval = format.interval(it.lo, it.hi)?;
    let p = it.p_holm.map(|p| {
        format!(", p\u{a0}{}{} after adjustment", if p < 0.001 { "" } else { "=\u{a0}" }, shown_p(p))
    });
    Some(format!("{} {interval}{}", format.full(it.difference), p.unwrap_or_default()))
}

#[derive(Serialize)]
struct Part<'a> {
    name: &'a str,
    rules: String,
    error_unit: &'static str,
    hits: bool,
    rows: Vec<Row>,
    pairs: Vec<Contrast<'a>>,
    strips: Vec<Strips<'a>>,
}

#[derive(Serialize)]
struct Row {
    label: String,
    style: &'static str,
    cells: Vec<Option<Cell>>,
}

#[derive(Serialize)]
struct Cell {
    value: String,
    interval: Option<String>,
}

#[derive(Serialize)]
struct Contrast<'a> {
    a: &'a str,
    b: &'a str,
    metric: String,
    unit: &'static str,
    difference: Cell,
    chance: Cell,
    p: Option<String>,
    verdict: &'a str,
}

fn part<'a>(compared: &'a Compared, meeting: &'a Meeting) -> Part<'a> {
    let rows = compared.rows(&meeting.protocol);
    let largest = |metric: &str| {
        let values = rows.iter().filter_map(|row| row.metrics.get(metric));
        values.map(|statistic| statistic.iqm.abs()).fold(0.0, f64::max)
    };
    let error = Format::length(largest("error_m"));
    let hits = rows.iter().any(|row| row.metrics.contains_key("hit_episodes"));
    let mut columns = vec![
        ("error_m", error),
        ("error_over_oracle", Format::ratio()),
        ("return", Format::number(largest("return"))),
        ("collision_episodes", Format::percent(0.01)),
    ];
    columns.extend(hits.then_some(("hit_episodes", Format::percent(0.01))));
    let cells = |row: &Entry| {
        let cell = |(metric, format): &(&str, Format)| {
            let it = row.metrics.get(*metric)?;
            Some(Cell { value: format.plain(it.iqm), interval: format.interval(it.lo, it.hi) })
        };
        columns.iter().map(cell).collect()
    };
    let plots = [
        plot(&rows, "error_m", ("Distance from the slots", "less is better"), Format::length),
        plot(&rows, "return", ("Return", "more is better"), Format::number).filter(|_| meeting.same_reward),
    ];
    Part {
        name: &meeting.protocol,
        rules: compared.rules(meeting),
        error_unit: error.unit,
        hits,
        pairs: meeting.pairs.iter().map(contrast).collect(),
        strips: plots.into_iter().flatten().collect(),
        rows: rows
            .iter()
            .map(|row| Row { label: row.label.clone(), style: row.style, cells: cells(row) })
            .collect(),
    }
}

fn contrast(pair: &Pair) -> Contrast<'_> {
    let it = &pair.comparison;
    let format = format(&it.metric, it.difference);
    let percent = Format { digits: 0, ..Format::percent(1.0) };
    let plus = if it.difference > 0.0 { "+" } else { "" };
    Contrast {
        a: &it.a,
        b: &it.b,
        metric: metric(&it.metric),
        unit: format.unit,
        difference: Cell {
            value: format!("{plus}{}", format.plain(it.difference)),
            interval: format.interval(it.lo, it.hi),
        },
        chance: Cell {
            value: percent.plain(it.probability_of_improvement),
            interval: percent.interval(it.probability_lo, it.probability_hi),
        },
        p: it.p_holm.map(shown_p),
        verdict: &it.verdict,
    }
}

/// A p-value as people read it.
pub(crate) fn shown_p(p: f64) -> String {
    if p < 0.001 { "< 0.001".into() } else { format!("{p:.3}") }
}

fn plot<'a>(
    rows: &[Entry],
    metric: &str,
    words: (&'static str, &'static str),
    format: fn(f64) -> Format,
) -> Option<Strips<'a>> {
    let spread = |row: &Entry| {
        let statistic = row.metrics.get(metric)?;
        // A controller has one value; the mark stands for it.
        let points = statistic.per_seed.iter().flatten().copied().filter(|_| row.learned);
        Some(Spread {
            label: row.label.clone(),
            style: row.style,
            points: points.collect(),
            mid: statistic.iqm,
            interval: statistic.lo.zip(statistic.hi),
        })
    };
    strips(words, &rows.iter().filter_map(spread).collect::<Vec<_>>(), None, format)
}

#[derive(Serialize)]
struct About<'a> {
    name: &'a str,
    scenario: &'a str,
    version: &'a str,
    numerics: u32,
    seeds: String,
    meaning: &'a str,
    hash: &'a str,
    failures: usize,
}

fn about<'a>(side: &'a Side) -> About<'a> {
    let (plan, summary) = (&side.study.plan, side.summary);
    let last = (plan.first_seed + plan.seeds).saturating_sub(1);
    About {
        name: &side.name,
        scenario: &plan.name,
        version: &summary.version,
        numerics: summary.numerics_version,
        seeds: format!("{} to {last}", plan.first_seed),
        meaning: &summary.meaning_hash,
        hash: &summary.study_hash,
        failures: summary.failures.len(),
    }
}
