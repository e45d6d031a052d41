//! The page as a whole: complete, inert, small, and the same for equal records.

#![allow(clippy::unwrap_used, clippy::expect_used)]

mod sample;

use std::collections::BTreeMap;

use mpgx_study::record::CellRecord;
use sample::Sample;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// Ends attributes, elements, scripts and comments, if it is let through.
const PROBE: &str = r#"\"'><script>alert(1)</script><img src=x onerror=alert(2)>-->&amp;"#;

/// Every free word of the sample.
const WORDS: &[&str] = &[
    "square_unison",
    "square_unison.scn",
    "Three robots keep a square with a leader that moves at random.",
    "Edge of the square.",
    "How far the followers are from their slots, together.",
    "the reward term `gap` is not a number",
    "square_unison.scn:36:5",
    "square_unison.scn:55:5",
    "length",
    "side",
    "k_c",
    "leader",
    "follower",
    "unicycle",
    "random_velocity",
    "gap",
    "crash",
    "lost",
    "reward/gap",
    "reward/crash",
    "q/gap",
    "gamma",
    "mpg",
    "td3",
    "proportional",
    "random",
    "regular",
    "better",
    "0.1.0",
    "random.error < 0.12 m at 95%",
];

fn page(sample: &Sample) -> String {
    mpgx_report::html(&sample.input()).unwrap()
}

fn full() -> Sample {
    let mut study = sample::study(10, &["random", "regular"]);
    sample::fail(study.records.get_mut("td3-003").unwrap());
    Sample::new(study.plan, study.records)
}

fn poison<T: Serialize + DeserializeOwned>(value: &T) -> T {
    let mut text = serde_json::to_string(value).unwrap();
    for word in WORDS {
        text = text.replace(&format!("\"{word}\""), &format!("\"{word}{PROBE}\""));
    }
    serde_json::from_str(&text).unwrap()
}

#[test]
fn no_string_of_a_study_becomes_markup() {
    let clean = full();
    let probe = PROBE.replace("\\\"", "\"");
    let poisoned = Sample {
        plan: poison(&clean.plan),
        records: poison(&clean.records),
        timings: clean.timings.clone(),
        summary: poison(&clean.summary),
        source: poison(&vec![("square_unison.scn".to_string(), format!("// {probe}\n{probe}\n"))]),
    };
    let mut input = poisoned.input();
    input.provenance.command = probe.clone();
    input.provenance.cpu = probe.clone();
    input.provenance.threads = probe.clone();
    input.provenance.duration = probe.clone();
    let html = mpgx_report::html(&input).unwrap();
    // Kept for a look with a browser.
    std::fs::write(concat!(env!("CARGO_TARGET_TMPDIR"), "/probe.html"), &html).unwrap();
    assert!(!html.contains("<script>alert") && !html.contains("<img"));
    let tags = |html: &str| elements(html).len();
    let (clean_tags, poisoned_tags) = (tags(&page(&clean)), tags(&html));
    assert!(
        poisoned_tags < clean_tags,
        "{poisoned_tags} elements; the source got shorter, so there must be fewer"
    );
    assert!(html.matches("&lt;script&gt;alert(1)&lt;").count() > 30, "the probes are shown as text");
}

#[test]
fn equal_records_give_equal_bytes() {
    assert_eq!(page(&full()), page(&full()));
}

#[test]
fn the_page_loads_nothing() {
    let html = page(&full());
    assert!(html.contains(
        r#"content="default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:""#
    ));
    let bare =
        html.replace("http://www.w3.org/2000/svg", "").replace("http://www.w3.org/1998/Math/MathML", "");
    for word in ["http://", "https://", "url(", "@import", "<iframe", "<object", "fetch(", "XMLHttpRequest"] {
        assert!(!bare.contains(word), "{word}");
    }
    for (name, attributes) in elements(&html) {
        assert!(!attributes.contains(" src="), "{name}{attributes}");
        if let Some(href) = attributes.split(" href=\"").nth(1) {
            assert!(href.starts_with('#') || href.starts_with("data:,"), "{name}{attributes}");
        }
    }
}

#[test]
fn the_page_stays_below_two_megabytes() {
    let html = page(&sample::study(10, &["random", "regular", "fast"]));
    assert!(html.len() < 2_000_000, "{} bytes", html.len());
}

#[test]
fn all_panels_are_there_and_say_what_was_measured() {
    let study = full();
    let html = page(&study);
    for id in
        ["verdict", "playback", "curves", "comparison", "health", "reward", "failures", "provenance", "data"]
    {
        assert!(html.contains(&format!("<section id=\"{id}\"")), "{id}");
    }
    let error = &study.summary.protocols["random"]["mpg"]["error_m"];
    assert!(html.contains(&format!("<p class=\"value\">{:.1}<small>", error.iqm * 1000.0)));
    assert!(
        html.contains("href=\"#src-0-39\"") && html.contains("id=\"src-0-39\""),
        "terms link to their line"
    );
    assert!(html.contains("the reward term `gap` is not a number"), "failures are told");
    assert!(!html.contains("class=\"badge\""), "ten seeds need no warning");
    assert!(html.contains(&study.summary.study_hash));
}

#[test]
fn embedded_data_is_json() {
    let html = page(&full());
    let blocks: Vec<&str> = html.split("<script type=\"application/json\"").skip(1).collect();
    assert_eq!(blocks.len(), 3);
    for block in blocks {
        let text = block.split_once('>').unwrap().1.split_once("</script>").unwrap().0;
        assert!(!text.contains('<'));
        serde_json::from_str::<serde_json::Value>(text).unwrap();
    }
}

#[test]
fn few_seeds_are_marked() {
    let html = page(&sample::study(6, &["random"]));
    assert!(html.contains("6\u{a0}seeds: exploratory"));
    let html = page(&sample::study(2, &["random"]));
    assert!(html.contains("2\u{a0}seeds: too few seeds to compare"));
    assert!(html.contains("no interval below 5 seeds"));
}

/// Studies at the edge: each must give a whole page with a verdict.
#[test]
fn poor_studies_give_whole_pages() {
    let names = ["random"];
    let one = sample::study(1, &names);
    let with = |change: &dyn Fn(&mut BTreeMap<String, CellRecord>)| {
        let mut records = one.records.clone();
        change(&mut records);
        Sample::new(one.plan.clone(), records)
    };
    let mut no_protocols = with(&|_| ());
    no_protocols.plan.protocols.clear();
    let mut no_learners = with(&|records| records.retain(|_, record| record.training.is_none()));
    no_learners.plan.learners.clear();
    let cases = [
        ("one seed", with(&|_| ())),
        ("no records", with(&BTreeMap::clear)),
        ("all failed", with(&|records| records.values_mut().for_each(sample::fail))),
        ("no controllers", with(&|records| records.retain(|_, record| record.training.is_some()))),
        (
            "no trajectories",
            with(&|records| {
                let evaluations = records.values_mut().flat_map(|record| record.protocols.values_mut());
                evaluations.for_each(|evaluation| evaluation.trajectories.clear());
            }),
        ),
        (
            "no training columns",
            with(&|records| {
                records.values_mut().for_each(|record| record.training = Some(Default::default()));
            }),
        ),
        ("no protocols", no_protocols),
        ("no learners", no_learners),
    ];
    for (name, study) in cases {
        let html = page(&study);
        assert!(!elements(&html).is_empty(), "{name}");
        assert!(html.contains("class=\"sentence\""), "{name}");
    }
}

/// Damaged columns and values that are no numbers must not reach a drawing.
#[test]
fn what_is_no_number_is_not_drawn() {
    let mut study = sample::study(6, &["random"]);
    for (k, record) in study.records.values_mut().enumerate() {
        if let Some(training) = &mut record.training {
            training.returns[k] = f64::NAN;
            training.error_m[2 * k] = f64::INFINITY;
            training.terms.truncate(40);
            training.terms[3] = vec![f64::NAN];
            training.health.columns.get_mut("q/q1").unwrap()[k] = f32::NAN;
        }
        for trajectory in record.protocols.values_mut().flat_map(|evaluation| &mut evaluation.trajectories) {
            trajectory.agents[k] = [f32::NAN, f32::INFINITY, 0.0];
            trajectory.terms[k] = f32::NEG_INFINITY;
        }
        if k % 2 == 1 {
            record.protocols.values_mut().for_each(|evaluation| {
                evaluation.trajectories.iter_mut().for_each(|trajectory| {
                    trajectory.slots.pop();
                    trajectory.actions.truncate(7);
                })
            });
        }
    }
    let html = page(&study);
    for (name, attributes) in elements(&html) {
        assert!(!attributes.contains("NaN") && !attributes.contains("inf"), "{name}{attributes}");
    }
}

/// Name and attributes of every element, having made sure that all are closed in order.
fn elements(html: &str) -> Vec<(String, String)> {
    let void = ["meta", "link", "input", "br", "img"];
    let (mut open, mut all) = (Vec::new(), Vec::new());
    let mut rest = html.strip_prefix("<!doctype html>").unwrap();
    while let Some(start) = rest.find('<') {
        let tag = &rest[start + 1..];
        let end = tag.find('>').expect("a tag that does not end");
        let (tag, after) = (&tag[..end], &tag[end + 1..]);
        rest = after;
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop().as_deref(), Some(name), "before {}", &rest[..rest.len().min(80)]);
            continue;
        }
        let at = tag.find(|c: char| c.is_whitespace() || c == '/').unwrap_or(tag.len());
        let (name, attributes) = (tag[..at].to_string(), tag[at..].to_string());
        assert!(attributes.matches('"').count() % 2 == 0, "{tag}");
        if !void.contains(&name.as_str()) && !attributes.ends_with('/') {
            open.push(name.clone());
        }
        if name == "script" || name == "style" {
            rest = &rest[rest.find(&format!("</{name}>")).unwrap()..];
        }
        all.push((name, attributes));
    }
    assert!(open.is_empty(), "{open:?} stay open");
    all
}
