//! Reports as tables: what [`crate::html`] shows in a page, for papers and notes.

use std::collections::BTreeMap;

use mpgx_lang::plan::Plan;
use mpgx_study::suite::Suite;
use mpgx_study::summary::{ClaimResult, Comparison, Statistic, Summary};

use crate::compare::{Compared, shown_p};
use crate::suite::{Member, besides, format, metric};
use crate::text::{Format, plural};

mod latex;
mod markdown;

/// A few tables with words between them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Document {
    pub blocks: Vec<Block>,
}

#[derive(Clone, Debug, PartialEq)]
pub enum Block {
    Heading(String),
    Text(String),
    Table(Table),
}

/// Every row has one cell a column.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    pub caption: String,
    pub columns: Vec<(String, Align)>,
    pub rows: Vec<Vec<String>>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Align {
    Left,
    Right,
    /// Words that may need several lines.
    Wide,
}

impl Document {
    fn push(&mut self, caption: impl Into<String>, columns: Vec<(String, Align)>, rows: Vec<Vec<String>>) {
        if !rows.is_empty() {
            self.blocks.push(Block::Table(Table { caption: caption.into(), columns, rows }));
        }
    }

    fn say(&mut self, text: impl Into<String>) {
        self.blocks.push(Block::Text(text.into()));
    }

    /// This, then the other.
    pub fn then(mut self, other: Document) -> Document {
        self.blocks.extend(other.blocks);
        self
    }
}

/// Results of each evaluation, comparisons, claims and failures of a study.
pub fn study_tables(name: &str, plan: &Plan, summary: &Summary) -> Document {
    let mut document = Document { blocks: vec![Block::Heading(name.to_string())] };
    document.say(setting(summary.seeds));
    for protocol in &plan.protocols {
        let Some(measured) = summary.protocols.get(&protocol.name) else { continue };
        let methods = plan.learners.iter().chain(&plan.controllers);
        let rows = methods.filter_map(|it| Some((it.label.clone(), measured.get(&it.label)?)));
        let episodes = plural(protocol.episodes, "held-out episode");
        results(&mut document, format!("{}: {}, {episodes}", name, protocol.name), "Method", rows.collect());
    }
    for protocol in &plan.protocols {
        let of = summary.comparisons.iter().filter(|it| it.protocol == protocol.name);
        let caption = format!("{name}: comparisons on {}", protocol.name);
        document.push(caption, contrast_columns(), of.map(contrast).collect());
    }
    claims(&mut document, name, &summary.expect);
    let failures = summary.failures.iter().map(|it| {
        vec![
            format!("{}, seed {}", it.algorithm, it.seed),
            it.step.to_string(),
            it.cause.clone(),
            it.at.clone(),
        ]
    });
    let columns = vec![
        ("Failed".into(), Align::Left),
        ("Step".into(), Align::Right),
        ("Cause".into(), Align::Wide),
        ("Place".into(), Align::Left),
    ];
    document.push(format!("{name}: seeds that failed"), columns, failures.collect());
    document
}

/// What differs, both studies' results, and their differences.
pub fn compare_tables(compared: &Compared) -> Document {
    let title = compared.title();
    let mut document = Document { blocks: vec![Block::Heading(title.clone())] };
    let [a, b] = &compared.sides;
    if compared.changes.is_empty() {
        document.say("Both scenarios mean the same.");
    }
    let rows = compared.changes.iter().map(|it| Compared::told(it).to_vec());
    let columns = vec![
        ("What differs".into(), Align::Wide),
        (a.name.clone(), Align::Wide),
        (b.name.clone(), Align::Wide),
    ];
    document.push(format!("{title}: what differs"), columns, rows.collect());
    document.say(setting(a.summary.seeds.min(b.summary.seeds)));
    for meeting in &compared.meetings {
        let rows = compared.rows(&meeting.protocol);
        let rows = rows.iter().map(|row| (row.label.clone(), row.metrics)).collect();
        results(&mut document, format!("{title}: {}", meeting.protocol), "Study and method", rows);
        document.say(compared.rules(meeting));
        let rows = meeting.pairs.iter().map(|pair| contrast(&pair.comparison));
        let caption = format!("{title}: differences on {}", meeting.protocol);
        document.push(caption, contrast_columns(), rows.collect());
    }
    if !compared.alone().is_empty() {
        document.say(format!("Not compared: {}.", compared.alone().join("; ")));
    }
    document
}

/// Published values with ours, then what each study claims.
pub fn suite_tables(suite: &Suite, members: &[Member]) -> Document {
    let mut document = Document { blocks: vec![Block::Heading(suite.title.clone())] };
    for table in besides(suite, members) {
        let mut columns = left(&["Row", "Metric"]);
        let methods = table.methods.iter().map(|label| label.to_string());
        let numbers =
            ["Published".to_string()].into_iter().chain(methods).chain(["Ours over published".into()]);
        columns.extend(numbers.map(|head| (head, Align::Right)));
        let rows = table.lines.iter().map(|line| {
            let unit = if line.unit.is_empty() { String::new() } else { format!(", {}", line.unit) };
            let dash = |text: &Option<String>| text.clone().unwrap_or_else(|| "–".into());
            let ours = line.ours.iter().map(|cell| match cell {
                Some(cell) => spaced(&cell.value, cell.interval.as_deref()),
                None => "–".into(),
            });
            let head = [line.name.to_string(), format!("{}{unit}", line.metric), dash(&line.published)];
            head.into_iter().chain(ours).chain([dash(&line.over_published)]).collect()
        });
        document.push(format!("{} ({})", table.title, table.source), columns, rows.collect());
        let notes = table.lines.iter().filter(|line| !line.note.is_empty());
        notes.for_each(|line| document.say(format!("{}: {}", line.name, line.note)));
        if !table.note.is_empty() {
            document.say(table.note);
        }
    }
    for member in members {
        claims(&mut document, &member.name(), &member.summary.expect);
    }
    document
}

fn setting(seeds: usize) -> String {
    let caution = match seeds {
        0..5 => " Fewer than 5 seeds give no interval and no comparison.",
        5..10 => " Fewer than 10 seeds make every comparison exploratory.",
        _ => "",
    };
    format!(
        "Interquartile mean over {} on held-out episodes, with its 95 % bootstrap interval.{caution}",
        plural(seeds, "seed")
    )
}

fn left(heads: &[&str]) -> Vec<(String, Align)> {
    heads.iter().map(|head| (head.to_string(), Align::Left)).collect()
}

/// One line a method.
fn results(
    document: &mut Document,
    caption: String,
    head: &str,
    rows: Vec<(String, &BTreeMap<String, Statistic>)>,
) {
    let largest = |metric: &str| {
        let values = rows.iter().filter_map(|(_, metrics)| metrics.get(metric));
        values.map(|statistic| statistic.iqm.abs()).fold(0.0, f64::max)
    };
    let error = Format::length(largest("error_m"));
    let all = [
        (format!("Distance ({})", error.unit), "error_m", error),
        ("× oracle".into(), "error_over_oracle", Format::ratio()),
        ("Return".into(), "return", Format::number(largest("return"))),
        ("Collisions (%)".into(), "collision_episodes", Format::percent(0.01)),
        ("Hits (%)".into(), "hit_episodes", Format::percent(0.01)),
    ];
    let measured = |metric: &str| rows.iter().any(|(_, metrics)| metrics.contains_key(metric));
    let shown: Vec<_> = all.into_iter().filter(|(_, metric, _)| measured(metric)).collect();
    let row = |(label, metrics): &(String, &BTreeMap<String, Statistic>)| {
        let cells = shown.iter().map(|(_, metric, format)| match metrics.get(*metric) {
            Some(it) => spaced(&format.plain(it.iqm), format.interval(it.lo, it.hi).as_deref()),
            None => "–".into(),
        });
        [label.clone()].into_iter().chain(cells).collect()
    };
    let mut columns = left(&[head]);
    columns.extend(shown.iter().map(|(head, ..)| (head.clone(), Align::Right)));
    let rows = rows.iter().map(row).collect();
    document.push(caption, columns, rows);
}

fn contrast_columns() -> Vec<(String, Align)> {
    let columns = [
        ("Methods", Align::Left),
        ("Metric", Align::Left),
        ("Difference", Align::Right),
        ("P(better) (%)", Align::Right),
        ("p, adjusted", Align::Right),
        ("The first is", Align::Left),
    ];
    columns.map(|(head, align)| (head.to_string(), align)).to_vec()
}

fn contrast(it: &Comparison) -> Vec<String> {
    let format = format(&it.metric, it.difference);
    let percent = Format { digits: 0, ..Format::percent(1.0) };
    let unit = if format.unit.is_empty() { String::new() } else { format!(", {}", format.unit) };
    let plus = if it.difference > 0.0 { "+" } else { "" };
    let chance = percent.interval(it.probability_lo, it.probability_hi);
    vec![
        format!("{} − {}", it.a, it.b),
        format!("{}{unit}", metric(&it.metric)),
        spaced(&format!("{plus}{}", format.plain(it.difference)), format.interval(it.lo, it.hi).as_deref()),
        spaced(&percent.plain(it.probability_of_improvement), chance.as_deref()),
        it.p_holm.map_or("–".into(), shown_p),
        it.verdict.clone(),
    ]
}

fn claims(document: &mut Document, name: &str, claims: &[ClaimResult]) {
    let columns =
        vec![("Claim".into(), Align::Wide), ("Holds".into(), Align::Left), ("Because".into(), Align::Wide)];
    let yes = |holds: bool| if holds { "yes" } else { "no" }.to_string();
    let rows = claims.iter().map(|it| vec![it.text.clone(), yes(it.holds), it.because.clone()]);
    document.push(format!("{name}: claims"), columns, rows.collect());
}

/// A value and its interval.
fn spaced(value: &str, interval: Option<&str>) -> String {
    interval.map_or(value.to_string(), |interval| format!("{value} {interval}"))
}

/// Text without line breaks, double spaces and what disturbs a terminal or turns the direction of text.
fn one_line(text: &str) -> String {
    let turns =
        |c: char| matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    let shown = |c: char| if c.is_control() || turns(c) { char::REPLACEMENT_CHARACTER } else { c };
    let fixed = |c: char| matches!(c, '\u{a0}' | '\u{202f}');
    let words = text.split(|c: char| c.is_whitespace() && !fixed(c)).filter(|word| !word.is_empty());
    words.map(|word| word.chars().map(shown).collect::<String>()).collect::<Vec<_>>().join(" ")
}
