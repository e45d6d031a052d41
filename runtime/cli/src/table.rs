//! The table at the end of a run.

use std::collections::BTreeMap;

use mpgx_report::Member;
use mpgx_study::suite::Suite;
use mpgx_study::summary::{Statistic, Summary};

use crate::layout::{self, MISSING, fold};

/// Results by protocol, a line a method, then comparisons, claims and failures. `width`: that of the terminal.
pub fn results(summary: &Summary, width: Option<usize>) -> String {
    let mut out = String::new();
    for (protocol, methods) in &summary.protocols {
        let lines = methods.iter().map(|(label, metrics)| (label.clone(), metrics));
        out += "\n";
        out += &measured(protocol, lines.collect(), width);
    }
    if !summary.comparisons.is_empty() {
        out += "\n";
    }
    for it in &summary.comparisons {
        let interval = match (it.lo, it.hi) {
            (Some(lo), Some(hi)) => format!(" [{lo:+.4}, {hi:+.4}]"),
            _ => String::new(),
        };
        let who = format!("{}: {} against {} on {}", it.protocol, it.a, it.b, it.metric);
        out += &fold(&format!("{who}: {:+.4}{interval}  {}", it.difference, it.verdict), 2, width);
    }
    for claim in &summary.expect {
        let mark = if claim.holds { "✓" } else { "✗" };
        out += "\n";
        out += &fold(&format!("{mark} {}", claim.text), 2, width);
        out += &fold(&format!("  {}", claim.because), 2, width);
    }
    for failure in &summary.failures {
        let what = format!("✗ {} seed {} failed at step {}", failure.algorithm, failure.seed, failure.step);
        out += "\n";
        out += &fold(&format!("{what}: {} ({})", failure.cause, failure.at), 2, width);
    }
    out
}

/// Several studies with what each measured: by protocol, a line a study and method.
pub fn side_by_side(studies: &[(String, Summary)], width: Option<usize>) -> String {
    let mut protocols: Vec<&String> = Vec::new();
    for protocol in studies.iter().flat_map(|(_, summary)| summary.protocols.keys()) {
        if !protocols.contains(&protocol) {
            protocols.push(protocol);
        }
    }
    let mut tables = Vec::new();
    for protocol in protocols {
        let mut lines = Vec::new();
        for (name, summary) in studies {
            let methods = summary.protocols.get(protocol).into_iter().flatten();
            lines.extend(methods.map(|(label, metrics)| (format!("{name}: {label}"), metrics)));
        }
        tables.push(measured(protocol, lines, width));
    }
    tables.join("\n")
}

/// Published values and ours, a table each.
pub fn beside(suite: &Suite, members: &[Member], width: Option<usize>) -> String {
    let mut out = String::new();
    for table in &suite.tables {
        out += "\n";
        out += &fold(&format!("{} ({})", table.title, table.source), 2, width);
        let name = table.rows.iter().map(|row| row.name.chars().count()).max().unwrap_or(0);
        for row in &table.rows {
            let member = members.iter().find(|it| it.plan.name == row.scenario && it.variant == row.variant);
            let of = |label: &str| member?.summary.protocols.get(&row.protocol)?.get(label)?.get(&row.metric);
            let published = row.published.map_or(MISSING.to_string(), |value| format!("{value}"));
            let methods = member.iter().flat_map(|it| it.plan.learners.iter().chain(&it.plan.controllers));
            let ours = methods
                .filter_map(|method| Some(format!("{} {}", method.label, interval(of(&method.label)?))));
            let ours = ours.collect::<Vec<_>>().join("   ");
            let line = format!("  {:<name$}  {:<24} published {published:>8}   {ours}", row.name, row.metric);
            out += &fold(&line, 6, width);
        }
    }
    out
}

/// One line each, under a head; hits only where there was something to hit.
fn measured(head: &str, lines: Vec<(String, &BTreeMap<String, Statistic>)>, width: Option<usize>) -> String {
    let hits = lines.iter().any(|(_, metrics)| metrics.contains_key("hit_episodes"));
    let shown = if hits { 6 } else { 5 };
    let titles = [head, "return [95 %]", "error", "× oracle", "collisions", "hits"];
    let titles: Vec<String> = titles.into_iter().take(shown).map(String::from).collect();
    let row = |(label, metrics): &(String, &BTreeMap<String, Statistic>)| {
        let cell = |name: &str, show: &dyn Fn(&Statistic) -> String| {
            metrics.get(name).map_or(MISSING.to_string(), show)
        };
        let share = |share: &Statistic| format!("{:.1} %", 100.0 * share.mean);
        let cells = [
            label.clone(),
            cell("return", &interval),
            cell("error_m", &|error| format!("{:.1} mm", 1000.0 * error.iqm)),
            cell("error_over_oracle", &|ratio| format!("{:.3}", ratio.iqm)),
            cell("collision_episodes", &share),
            cell("hit_episodes", &share),
        ];
        cells.into_iter().take(shown).collect()
    };
    layout::table(&titles, &lines.iter().map(row).collect::<Vec<Vec<String>>>(), width)
}

fn interval(statistic: &Statistic) -> String {
    match (statistic.lo, statistic.hi) {
        (Some(lo), Some(hi)) => format!("{:.3} [{lo:.3}, {hi:.3}]", statistic.iqm),
        _ => format!("{:.3}", statistic.iqm),
    }
}
