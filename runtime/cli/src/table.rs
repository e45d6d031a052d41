//! The table at the end of a run.

use std::collections::BTreeMap;
use std::fmt::Write;

use mpgx_report::Member;
use mpgx_study::suite::Suite;
use mpgx_study::summary::{Statistic, Summary};

/// Results by protocol, a line a method, then comparisons, claims and failures.
pub fn results(summary: &Summary) -> String {
    let mut out = String::new();
    for (protocol, methods) in &summary.protocols {
        let lines = methods.iter().map(|(label, metrics)| (label.clone(), metrics));
        out += "\n";
        out += &measured(protocol, lines.collect());
    }
    if !summary.comparisons.is_empty() {
        out += "\n";
    }
    for comparison in &summary.comparisons {
        let _ = writeln!(
            out,
            "{}: {} against {} on {}: {:+.4}{}  {}",
            comparison.protocol,
            comparison.a,
            comparison.b,
            comparison.metric,
            comparison.difference,
            match (comparison.lo, comparison.hi) {
                (Some(lo), Some(hi)) => format!(" [{lo:+.4}, {hi:+.4}]"),
                _ => String::new(),
            },
            comparison.verdict,
        );
    }
    for claim in &summary.expect {
        let _ =
            writeln!(out, "\n{} {}\n  {}", if claim.holds { "✓" } else { "✗" }, claim.text, claim.because);
    }
    for failure in &summary.failures {
        let _ = writeln!(
            out,
            "\n✗ {} seed {} failed at step {}: {} ({})",
            failure.algorithm, failure.seed, failure.step, failure.cause, failure.at
        );
    }
    out
}

/// Several studies with what each measured: by protocol, a line a study and method.
pub fn side_by_side(studies: &[(String, Summary)]) -> String {
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
        tables.push(measured(protocol, lines));
    }
    tables.join("\n")
}

/// Published values and ours, a table each.
pub fn beside(suite: &Suite, members: &[Member]) -> String {
    let mut out = String::new();
    for table in &suite.tables {
        let _ = writeln!(out, "\n{} ({})", table.title, table.source);
        let width = table.rows.iter().map(|row| row.name.chars().count()).max().unwrap_or(0);
        for row in &table.rows {
            let member = members.iter().find(|it| it.plan.name == row.scenario && it.variant == row.variant);
            let of = |label: &str| member?.summary.protocols.get(&row.protocol)?.get(label)?.get(&row.metric);
            let published = row.published.map_or("–".to_string(), |value| format!("{value}"));
            let methods = member.iter().flat_map(|it| it.plan.learners.iter().chain(&it.plan.controllers));
            let ours = methods
                .filter_map(|method| Some(format!("{} {}", method.label, interval(of(&method.label)?))));
            let ours = ours.collect::<Vec<_>>().join("   ");
            let _ =
                writeln!(out, "  {:<width$}  {:<24} published {published:>8}   {ours}", row.name, row.metric);
        }
    }
    out
}

/// One line each, under a head; hits only where there was something to hit.
fn measured(head: &str, lines: Vec<(String, &BTreeMap<String, Statistic>)>) -> String {
    let width = lines.iter().map(|(label, _)| label.chars().count()).chain([head.chars().count(), 6]).max();
    let width = width.unwrap_or(0);
    let hits = lines.iter().any(|(_, metrics)| metrics.contains_key("hit_episodes"));
    let row = |label: &str, cells: [&str; 5]| {
        let [total, error, ratio, collisions, hit] = cells;
        let hit = if hits { format!("  {hit:>8}") } else { String::new() };
        format!("{label:<width$}  {total:>24}  {error:>9}  {ratio:>9}  {collisions:>10}{hit}\n")
    };
    let mut out = row(head, ["return [95 %]", "error", "× oracle", "collisions", "hits"]);
    for (label, metrics) in &lines {
        let cell =
            |name: &str, show: &dyn Fn(&Statistic) -> String| metrics.get(name).map_or("–".to_string(), show);
        let share = |share: &Statistic| format!("{:.1} %", 100.0 * share.mean);
        let cells = [
            cell("return", &interval),
            cell("error_m", &|error| format!("{:.1} mm", 1000.0 * error.iqm)),
            cell("error_over_oracle", &|ratio| format!("{:.3}", ratio.iqm)),
            cell("collision_episodes", &share),
            cell("hit_episodes", &share),
        ];
        out += &row(label, cells.each_ref().map(String::as_str));
    }
    out
}

fn interval(statistic: &Statistic) -> String {
    match (statistic.lo, statistic.hi) {
        (Some(lo), Some(hi)) => format!("{:.3} [{lo:.3}, {hi:.3}]", statistic.iqm),
        _ => format!("{:.3}", statistic.iqm),
    }
}
