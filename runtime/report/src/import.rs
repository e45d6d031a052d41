//! The report over results of another program: tables, comparisons, profiles and curves of each task.

use std::collections::BTreeSet;

use minijinja::value::Serde;
use minijinja::{Value, context};
use mpgx_study::import::{Algorithm, Results};
use mpgx_study::summary::Pair;
use serde::Serialize;

use crate::band::{Estimate, Resamples};
use crate::lines::{Drawing, Line, Lines, lines};
use crate::profile::{Profile, Sample, profile};
use crate::strips::{Spread, Strips, strips};
use crate::text::{Format, plural};
use crate::{Page, ReportError, Section, embed, page, render};

/// Most points of a curve.
const POINTS: usize = 200;

#[derive(Serialize)]
struct Part<'a> {
    environment: &'a str,
    task: &'a str,
    metric: &'a str,
    rows: Vec<Row<'a>>,
    pairs: Vec<Contrast<'a>>,
    strips: Option<Strips<'a>>,
    profile: Option<Profile>,
    curves: Option<Lines>,
    note: Option<String>,
}

#[derive(Serialize)]
struct Row<'a> {
    label: &'a str,
    style: &'static str,
    iqm: Cell,
    mean: Cell,
    runs: usize,
    failed: usize,
}

#[derive(Serialize)]
struct Cell {
    value: String,
    interval: Option<String>,
}

#[derive(Serialize)]
struct Contrast<'a> {
    a: &'a str,
    a_style: &'static str,
    b: &'a str,
    b_style: &'static str,
    difference: Cell,
    chance: Cell,
    p: Option<String>,
    verdict: &'a str,
    how: &'static str,
}

/// The page as HTML text. `name` is what the results are called.
///
/// # Errors
/// [`ReportError`], if a template does not fit.
pub fn import_html(name: &str, results: &[Results]) -> Result<String, ReportError> {
    let parts: Vec<Part> = results.iter().enumerate().map(|(k, results)| part(k, results)).collect();
    let profiles = parts.iter().filter_map(|part| part.profile.as_ref().map(|it| &it.data));
    let curves = parts.iter().filter_map(|part| part.curves.as_ref().map(|it| &it.data));
    let data = serde_json::json!({ "charts": profiles.chain(curves).collect::<Vec<_>>() });
    let data = embed(&data).map_err(|source| ReportError::Data { panel: "results", source })?;
    let script = Value::from_safe_string(include_str!("script/samples.js").into());
    let sections = [
        Section::still(
            "verdict",
            "Verdict",
            render("import", include_str!("import/verdict.html"), verdict(results))?,
        ),
        Section {
            data: Some(data),
            script: Some(script),
            ..Section::still(
                "results",
                "Results",
                render("import", include_str!("import/results.html"), context! { parts => Serde(&parts) })?,
            )
        },
    ];
    page(&Page { name, about: "", version: env!("CARGO_PKG_VERSION"), sections: &sections })
}

fn verdict(results: &[Results]) -> Value {
    let names: BTreeSet<&str> = algorithms(results).map(|it| it.name.as_str()).collect();
    let tasks: BTreeSet<(&str, &str)> =
        results.iter().map(|it| (it.environment.as_str(), it.task.as_str())).collect();
    let runs = || algorithms(results).map(|it| it.scores.len());
    let verdicts = || results.iter().flat_map(|it| &it.pairs).map(|pair| pair.comparison.verdict.as_str());
    context! {
        algorithms => plural(names.len(), "algorithm"),
        tasks => plural(tasks.len(), "task"),
        comparisons => plural(verdicts().count(), "comparison"),
        decided => verdicts().filter(|verdict| ["better", "worse"].contains(verdict)).count(),
        fewest => runs().min().unwrap_or(0),
        most => runs().max().unwrap_or(0),
        failed => algorithms(results).map(failed).sum::<usize>(),
    }
}

fn algorithms(results: &[Results]) -> impl Iterator<Item = &Algorithm> {
    results.iter().flat_map(|it| &it.algorithms)
}

fn failed(algorithm: &Algorithm) -> usize {
    algorithm.statistic.per_seed.iter().filter(|value| value.is_none()).count()
}

/// Class of the k-th algorithm's colour, dash and marker.
fn style(k: usize) -> &'static str {
    const STYLES: [&str; 6] = ["m0", "m1", "m2", "m3", "m4", "m5"];
    STYLES[k % STYLES.len()]
}

fn part(k: usize, results: &Results) -> Part<'_> {
    let Results { environment, task, metric, algorithms, pairs, .. } = results;
    let sizes = algorithms.iter().map(|it| it.statistic.iqm.abs());
    let format = Format::number(sizes.fold(0.0, f64::max));
    let with_style = || algorithms.iter().enumerate().map(|(k, it)| (it, style(k)));
    let rows = with_style().map(|(it, style)| row(it, style, format));
    let spreads = with_style().map(|(it, style)| Spread {
        label: it.name.clone(),
        style,
        points: it.statistic.per_seed.iter().flatten().copied().collect(),
        mid: it.statistic.iqm,
        interval: it.statistic.lo.zip(it.statistic.hi),
    });
    let samples =
        with_style().map(|(it, style)| Sample { label: &it.name, style, scores: it.scores.clone() });
    let samples: Vec<Sample> = samples.collect();
    Part {
        environment,
        task,
        metric,
        rows: rows.collect(),
        pairs: pairs.iter().map(|pair| contrast(pair, algorithms, format)).collect(),
        strips: strips((metric, "more is better"), &spreads.collect::<Vec<_>>(), None, Format::number),
        profile: profile(&format!("profile-{k}"), metric, &samples, true, Format::number),
        curves: curves(&format!("curve-{k}"), results),
        note: note(results),
    }
}

fn row<'a>(algorithm: &'a Algorithm, style: &'static str, format: Format) -> Row<'a> {
    let Algorithm { name, statistic, scores, .. } = algorithm;
    let cell = |value: f64, lo, hi| Cell { value: format.plain(value), interval: format.interval(lo, hi) };
    Row {
        label: name,
        style,
        iqm: cell(statistic.iqm, statistic.lo, statistic.hi),
        mean: cell(statistic.mean, statistic.mean_lo, statistic.mean_hi),
        runs: scores.len(),
        failed: failed(algorithm),
    }
}

fn contrast<'a>(pair: &'a Pair, algorithms: &[Algorithm], format: Format) -> Contrast<'a> {
    let it = &pair.comparison;
    let of = |name: &str| style(algorithms.iter().position(|other| other.name == name).unwrap_or(0));
    let percent = Format { digits: 0, ..Format::percent(1.0) };
    let plus = if it.difference > 0.0 { "+" } else { "" };
    Contrast {
        a: &it.a,
        a_style: of(&it.a),
        b: &it.b,
        b_style: of(&it.b),
        difference: Cell {
            value: format!("{plus}{}", format.plain(it.difference)),
            interval: format.interval(it.lo, it.hi),
        },
        chance: Cell {
            value: percent.plain(it.probability_of_improvement),
            interval: percent.interval(it.probability_lo, it.probability_hi),
        },
        p: it.p_holm.map(|p| if p < 0.001 { "< 0.001".into() } else { format!("{p:.3}") }),
        verdict: &it.verdict,
        how: if pair.paired { "paired by run" } else { "unpaired" },
    }
}

/// What the values are, where they are not all the same thing.
fn note(results: &Results) -> Option<String> {
    let runs: usize = results.algorithms.iter().map(|it| it.scores.len()).sum();
    let source = match results.absolute {
        0 => "A value is the mean of the last evaluation.".to_string(),
        all if all == runs => "A value is the mean of the absolute metric.".to_string(),
        some => format!(
            "A value is the mean of the absolute metric in {some} of {runs} runs and of the last evaluation in the others."
        ),
    };
    let largest = " The absolute metric here is the largest value of any one evaluation episode, as BenchMARL \
                   writes it: it grows with the number of evaluations, and says more of luck than a held-out evaluation does.";
    Some(if results.largest { source + largest } else { source })
}

/// Interquartile means at each `step_count` with their bands. `None` if there are less than two of them.
fn curves(id: &str, results: &Results) -> Option<Lines> {
    let mut counts: Vec<f64> =
        results.algorithms.iter().flat_map(|it| &it.curves).flatten().map(|(count, _)| *count).collect();
    counts.sort_unstable_by(f64::total_cmp);
    counts.dedup();
    let every = counts.len().div_ceil(POINTS);
    let kept = counts.iter().enumerate().filter(|(k, _)| k % every == 0 || k + 1 == counts.len());
    let counts: Vec<f64> = kept.map(|(_, count)| *count).collect();
    let all = results.algorithms.iter().enumerate();
    let drawn: Vec<Line> =
        all.map(|(k, it)| Line { label: &it.name, style: style(k), points: band(it, &counts) }).collect();
    let title = format!("{} while training", results.metric);
    lines(&Drawing { id, title: &title, x_name: "step_count", format: Format::number }, &counts, &drawn)
}

/// Over the runs that were evaluated at each count; an interval where that is all of them.
fn band(algorithm: &Algorithm, counts: &[f64]) -> Vec<Option<Estimate>> {
    let resamples = Resamples::new(algorithm.curves.len());
    let at = |count: &f64| {
        let value = |curve: &Vec<(f64, f64)>| {
            let place = curve.binary_search_by(|(other, _)| other.total_cmp(count)).ok()?;
            curve.get(place).map(|(_, value)| *value)
        };
        resamples.estimate(&algorithm.curves.iter().filter_map(value).collect::<Vec<_>>())
    };
    counts.iter().map(at).collect()
}
