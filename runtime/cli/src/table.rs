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

#[cfg(test)]
mod tests {
    use super::*;

    fn summary() -> Summary {
        let statistic = |iqm: f64, wide: f64| {
            serde_json::json!({ "iqm": iqm, "lo": iqm - wide, "hi": iqm + wide, "mean": iqm,
                "mean_lo": null, "mean_hi": null, "per_seed": [iqm] })
        };
        let method = |error: f64| {
            serde_json::json!({ "return": statistic(-600.0 * error, 0.5), "error_m": statistic(error, 0.001),
                "error_over_oracle": statistic(error / 0.0758, 0.01), "collision_episodes": statistic(0.0, 0.0) })
        };
        serde_json::from_value(serde_json::json!({
            "scenario": "square", "version": "0", "numerics_version": 1, "meaning_hash": "", "study_hash": "",
            "seeds": 10, "training": {},
            "failures": [{ "algorithm": "td3", "seed": 3, "step": 812, "at": "square.scn:36:5",
                "cause": "the reward term `gap` is not a number" }],
            "protocols": { "random": { "mpg": method(0.0788), "proportional": method(0.0834) } },
            "comparisons": [{ "protocol": "random", "metric": "return", "a": "mpg", "b": "proportional",
                "difference": 2.5, "lo": 1.9, "hi": 3.1, "probability_of_improvement": 1.0,
                "probability_lo": null, "probability_hi": null, "p": null, "p_holm": null, "verdict": "better" }],
            "expect": [{ "text": "random.error < 0.12 m at 95%", "at": "", "holds": true,
                "because": "error of mpg is 0.0788 m, 95 % interval 0.0778 m to 0.0798 m, all of it below 0.12 m" }],
        }))
        .unwrap()
    }

    #[test]
    fn results_fit_the_terminal() {
        let whole = results(&summary(), None);
        assert!(
            whole.contains("mpg           -47.280 [-47.780, -46.780]  78.8 mm     1.040       0.0 %\n"),
            "{whole}"
        );
        assert_eq!(results(&summary(), Some(200)), whole);
        for width in [30, 40, 60, 80, 100] {
            let text = results(&summary(), Some(width));
            for line in text.lines() {
                assert!(line.chars().count() <= width, "{line:?} in {width}");
            }
            let words = |text: &str| text.split_whitespace().map(String::from).collect::<Vec<_>>();
            let lost: Vec<String> =
                words(&whole).into_iter().filter(|it| !words(&text).contains(it)).collect();
            assert!(lost.is_empty(), "{lost:?} is lost at {width}");
        }
    }

    #[test]
    fn a_narrow_terminal_gets_a_list() {
        let list = "
random
  mpg
    return [95 %]  -47.280
      [-47.780, -46.780]
    error          78.8 mm
    × oracle       1.040
    collisions     0.0 %
";
        let text = results(&summary(), Some(40));
        assert!(text.starts_with(list), "{text}");
    }
}
