//! The page as a whole: complete, inert, small, and the same for equal records.

#![allow(clippy::unwrap_used, clippy::expect_used)]

#[allow(dead_code)]
mod sample;

use std::collections::BTreeMap;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use mpgx_study::import::import;
use mpgx_study::record::CellRecord;
use sample::Sample;
use sample::hostile::{self, PROBE};

fn page(sample: &Sample) -> String {
    mpgx_report::html(&sample.input()).unwrap()
}

fn full() -> Sample {
    let mut study = sample::study(10, &["random", "regular"]);
    sample::fail(study.records.get_mut("td3-003").unwrap());
    Sample::new(study.plan, study.records)
}

#[test]
fn no_string_of_a_study_becomes_markup() {
    let clean = full();
    let probe = PROBE.replace("\\\"", "\"");
    let poisoned = hostile::everywhere();
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
    let html = page(&sample::learners(&["mpg", "td3", "ddpg", "mean"], 10, &["random", "regular", "fast"]));
    assert!(html.len() < 2_000_000, "{} bytes", html.len());
    let html = page(&sample::study(24, &["random", "regular", "fast"]));
    assert!(html.len() < 2_000_000, "{} bytes", html.len());
    assert!(html.contains("more were left out to keep this file small"));
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
    let line = study.plan.world.reward[0].at.line;
    assert!(html.contains(&format!("class=\"aside\" href=\"#src-0-{line}\"")), "terms link to their line");
    assert!(html.contains(&format!("id=\"src-0-{line}\"")), "the line is there");
    assert!(html.contains("the reward term `gap` is not a number"), "failures are told");
    assert!(!html.contains("class=\"badge\""), "ten seeds need no warning");
    assert!(html.contains(&study.summary.study_hash));
}

/// The JSON that a panel's script reads.
fn data(html: &str, panel: &str) -> serde_json::Value {
    let start = format!("<script type=\"application/json\" id=\"data-{panel}\">");
    let text = html.split_once(&start).unwrap().1.split_once("</script>").unwrap().0;
    assert!(!text.contains('<'), "nothing in {panel} can end its element");
    serde_json::from_str(text).unwrap()
}

#[test]
fn embedded_summary_is_the_summary() {
    let study = full();
    let html = page(&study);
    assert_eq!(data(&html, "data")["summary"], serde_json::to_value(&study.summary).unwrap());
    assert_eq!(data(&html, "curves")["charts"].as_array().unwrap().len(), 4);
}

#[test]
fn embedded_tracks_are_the_trajectories() {
    let study = full();
    let playback = data(&page(&study), "playback");
    let tracks = playback["tracks"].as_array().unwrap();
    let track = tracks.iter().find(|track| track["method"] == 1 && track["seed"] == 4).unwrap();
    let trajectory = &study.records["td3-004"].protocols["random"].trajectories[0];
    let block = |name: &str| {
        let block = &playback["blocks"][track[name].as_u64().unwrap() as usize];
        let number = |key: &str| block[key].as_str().unwrap().parse::<f64>().unwrap();
        let bytes = STANDARD.decode(block["data"].as_str().unwrap()).unwrap();
        assert_eq!(block["bytes"], 2);
        let levels = bytes.chunks(2).map(|pair| f64::from(u16::from_le_bytes([pair[0], pair[1]])));
        let (lo, hi) = (number("lo"), number("hi"));
        levels.map(|level| lo + level * (hi - lo) / 65535.0).collect::<Vec<f64>>()
    };
    let near = |kept: &[f64], of: &[f32]| {
        assert_eq!(kept.len(), of.len());
        let range = of.iter().copied().fold(f32::MIN, f32::max) - of.iter().copied().fold(f32::MAX, f32::min);
        let level = f64::from(range) / 65535.0;
        assert!(kept.iter().zip(of).all(|(kept, of)| (kept - f64::from(*of)).abs() < level));
    };
    let agents = |pick: &dyn Fn(usize, &[f32; 3]) -> Vec<f32>| {
        let frames = trajectory.agents.chunks(4);
        frames
            .flat_map(|frame| frame.iter().enumerate().flat_map(|(k, agent)| pick(k, agent)))
            .collect::<Vec<_>>()
    };
    near(&block("scripted"), &agents(&|k, [x, y, _]| if k == 0 { vec![*x, *y] } else { vec![] }));
    near(&block("learned"), &agents(&|k, [x, y, _]| if k == 0 { vec![] } else { vec![*x, *y] }));
    near(&block("headings"), &agents(&|k, [_, _, heading]| if k == 0 { vec![] } else { vec![*heading] }));
    near(&block("slots"), trajectory.slots.as_flattened());
    near(&block("terms"), &trajectory.terms);
    near(&block("error"), &trajectory.error_m);
}

/// Numbers that the page packs three bytes each.
fn unpacked(value: &serde_json::Value) -> Vec<f64> {
    let bytes = STANDARD.decode(value.as_str().unwrap()).unwrap();
    bytes.chunks(3).map(|b| f64::from(f32::from_le_bytes([0, b[0], b[1], b[2]]))).collect()
}

#[test]
fn live_curves_are_the_records() {
    let study = full();
    let curves = data(&page(&study), "curves");
    let steps: Vec<u64> = serde_json::from_value(curves["steps"].clone()).unwrap();
    let method = &curves["charts"][1]["methods"][1];
    let seed = method["seeds"].as_array().unwrap().iter().find(|seed| seed["seed"] == 4).unwrap();
    let training = study.records["td3-004"].training.as_ref().unwrap();
    let values = unpacked(&seed["values"]);
    assert_eq!(values.len(), steps.len());
    let (mut begun, mut checked) = (0, 0);
    for (end, value) in steps.iter().zip(&values) {
        let inside = training
            .steps
            .iter()
            .zip(&training.returns)
            .filter(|(step, _)| (begun + 1..=*end).contains(step));
        let inside: Vec<f64> = inside.map(|(_, value)| *value).collect();
        let mean = inside.iter().sum::<f64>() / inside.len() as f64;
        if !inside.is_empty() {
            assert!((mean - value).abs() < 1e-4 * mean.abs(), "{mean} became {value} before step {end}");
            checked += 1;
        }
        begun = *end;
    }
    assert!(checked > 50, "{checked}");
    // The middle lies in its band, and the band in the tolerance band.
    let [mid, lo, hi, low, high] = [0, 1, 2, 3, 4].map(|k| unpacked(&method["bands"][0][k]));
    for k in (0..mid.len()).filter(|k| mid[*k].is_finite()) {
        assert!(low[k] <= lo[k] && lo[k] <= mid[k] && mid[k] <= hi[k] && hi[k] <= high[k], "point {k}");
    }
    // Updates and seconds of an axis are those of the records in the end.
    let pace = &curves["paces"][1];
    let cells = || study.records.iter().filter(|(_, record)| record.method == "td3");
    let last = |of: &dyn Fn(&str, &CellRecord) -> f64| cells().map(|(id, it)| of(id, it)).sum::<f64>();
    let all = last(&|_, it| *it.training.as_ref().unwrap().steps.last().unwrap() as f64);
    let updates = last(&|_, it| it.training.as_ref().unwrap().updates as f64);
    let seconds = last(&|id, _| study.timings[id].training_s);
    assert!((pace["updates"].as_f64().unwrap() * all - updates).abs() < 1e-6 * updates);
    assert!((pace["seconds"].as_f64().unwrap() * all - seconds).abs() < 1e-6 * seconds);
}

#[test]
fn every_figure_has_a_name_and_a_live_one_its_data() {
    let html = page(&full());
    let figures: Vec<_> = elements(&html).into_iter().filter(|(name, _)| name == "figure").collect();
    assert!(figures.len() > 15);
    for (_, attributes) in &figures {
        assert!(attributes.contains(" data-name=\""), "{attributes}");
    }
    let count = |word: &str| figures.iter().filter(|(_, attributes)| attributes.contains(word)).count();
    let charts = |panel: &str| data(&html, panel)["charts"].as_array().unwrap().len();
    assert_eq!(count(" data-curve="), charts("curves"));
    assert_eq!(count(" data-health="), charts("health"));
    assert_eq!(count(" data-chart="), charts("comparison"));
}

#[test]
fn the_chart_library_is_there_once_with_its_licence() {
    let html = page(&full());
    assert_eq!(html.matches("/*! uPlot 1.6.32").count(), 1);
    assert_eq!(html.matches("Permission is hereby granted").count(), 1);
    assert_eq!(html.matches("var uPlot=function").count(), 1);
}

#[test]
fn the_reward_has_bounds_a_landscape_and_its_formations() {
    let html = page(&full());
    assert!(html.contains("from \u{2212}6.00\u{202f}m to 0\u{202f}m a step"), "six pairs can collide");
    assert!(html.contains("4\u{a0}nodes and 3\u{a0}edges. Every member has a place of its own"));
    assert!(html.contains("aria-label=\"Formation F: square\""));
    assert!(html.contains("aria-label=\"Reward if follower[1] were elsewhere; greatest reward: "));
    let rigid = page(&sample::untrained(include_str!("../../../scenarios/consensus_triangle.scn")));
    assert!(rigid.contains("3\u{a0}nodes and 3\u{a0}edges. Rigid: its distances leave only"));
    let mut open = sample::untrained(include_str!("../../../scenarios/consensus_triangle.scn"));
    open.plan.world.formations[0].graph = mpgx_lang::plan::Graph::Path;
    assert!(page(&open).contains("Not rigid: one motion keeps all distances (rank 2 of 3)."));
}

#[test]
fn settings_tell_where_they_come_from() {
    let study = full();
    let html = page(&study);
    let lines = study.source[0].1.lines();
    let line = 1 + lines.into_iter().position(|line| line.starts_with("learn mpg")).unwrap();
    let row = |name: &str| {
        let start = format!("<th scope=\"row\"><code>{name}</code></th>");
        html.split_once(&start).unwrap().1.split_once("</tr>").unwrap().0.to_string()
    };
    assert!(row("steps").contains(&format!("href=\"#src-0-{line}\">line {line}</a>")), "{}", row("steps"));
    assert!(row("rate_end").contains(">tuned</span>"), "{}", row("rate_end"));
    assert!(row("activation").contains(">default</span>"), "{}", row("activation"));
    let mut changed = full();
    changed.source[0].1 = changed.source[0].1.replace("steps = 20000", "steps = 30000");
    assert!(!page(&changed).contains(">tuned</span>"), "the source no longer means what ran");
}

#[test]
fn published_results_stand_beside_ours() {
    use mpgx_study::suite::{Row, Table};
    let study = full();
    assert!(!page(&study).contains("<section id=\"paper\""));
    let row = Row {
        name: "Random <row>".into(),
        scenario: study.plan.name.clone(),
        variant: String::new(),
        protocol: "random".into(),
        metric: "error_m".into(),
        published: Some(0.01),
        note: "It cannot be.".into(),
    };
    let tables = vec![Table {
        title: "Unison".into(),
        source: "table 7".into(),
        note: String::new(),
        rows: vec![row],
    }];
    let published = Some(mpgx_report::Published { variant: String::new(), tables });
    let html = mpgx_report::html(&mpgx_report::Input { published, ..study.input() }).unwrap();
    elements(&html);
    let section = html.split_once("<section id=\"paper\"").unwrap().1.split_once("</section>").unwrap().0;
    let ours = study.summary.protocols["random"]["mpg"]["error_m"].iqm;
    for words in ["table 7", "Random &lt;row&gt;", "It cannot be.", &format!("<td>{:.2}</td>", ours / 0.01)] {
        assert!(section.contains(words), "{words} in {section}");
    }
}

#[test]
fn steps_to_a_distance_and_time_by_phase_are_told() {
    let html = page(&full());
    let table =
        html.split_once("aria-label=\"Steps to a distance\"").unwrap().1.split_once("</table>").unwrap().0;
    assert_eq!(table.matches("10 of 10 seeds").count(), 3, "of mpg");
    assert!(table.contains("9 of 10 seeds"), "one of td3 failed");
    let times = html.split_once("Time by phase").unwrap().1.split_once("</table>").unwrap().0;
    assert_eq!(times.matches("<td class=\"number\">10 s</td>").count(), 2, "9.95 s of training each");
    assert_eq!(times.matches("0.4 s").count(), 4, "an evaluation of each method");
}

#[test]
fn obstacles_are_played_back_with_their_outlines() {
    let html = page(&sample::obstacles());
    let stage = &data(&html, "playback")["stages"][0];
    let solids: Vec<_> = stage["agents"].as_array().unwrap().iter().map(|agent| &agent["solid"]).collect();
    assert_eq!(solids.iter().filter(|solid| solid["Disc"]["radius_m"] == 0.1).count(), 3);
    assert_eq!(html.matches("class=\"obstacle\"").count(), 3, "in the still picture too");
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
                    trajectory.actions.truncate(7);
                })
            });
        }
    }
    let html = page(&study);
    let tracks = data(&html, "playback")["tracks"].as_array().unwrap().len();
    assert_eq!(tracks, 7 * 2, "two episodes of each cell that is whole");
    for (name, attributes) in elements(&html) {
        assert!(!attributes.contains("NaN") && !attributes.contains("inf"), "{name}{attributes}");
    }
}

#[test]
fn profiles_and_tolerance_bands_are_drawn_where_there_are_seeds_enough() {
    let html = page(&full());
    for id in ["profile-0", "profile-1"] {
        assert!(
            html.contains(&format!("<title id=\"{id}-t\">Share of seeds with a distance at most a value<"))
        );
        assert!(html.contains(&format!("<desc id=\"{id}-d\">Half of the seeds of mpg are at most ")));
    }
    assert!(html.contains("at least 57\u{a0}% of all seeds"), "nine of the one learner finish");
    std::fs::write(concat!(env!("CARGO_TARGET_TMPDIR"), "/whole.html"), &html).unwrap();
    let drawn = |html: &str, class: &str| {
        let empty = format!("<path class=\"{class}\" d=\"\"");
        html.matches(&format!("<path class=\"{class}\" d=")).count() - html.matches(&empty).count()
    };
    let quantities = 2 + full().plan.world.reward.len();
    assert_eq!(drawn(&html, "outer"), 2 * quantities);
    assert_eq!(drawn(&html, "band"), 2 * quantities + 2 * 2, "two learners on two protocols");
    let few = page(&sample::study(4, &["random"]));
    assert_eq!(few.matches("of all seeds").count(), 0);
}

/// The page without its scripts.
fn without_code(html: &str) -> String {
    let mut parts = html.split("<script>");
    let first = parts.next().unwrap().to_string();
    parts.fold(first, |page, part| page + part.split_once("</script>").unwrap().1)
}

fn import_page(text: &str) -> String {
    mpgx_report::import_html("results", &import(text).unwrap()).unwrap()
}

const IMPORTED: &str = include_str!("../../study/tests/fixtures/marl_eval.json");

#[test]
fn results_of_another_program_have_a_whole_page() {
    let html = import_page(IMPORTED);
    assert_eq!(html, import_page(IMPORTED));
    std::fs::write(concat!(env!("CARGO_TARGET_TMPDIR"), "/import.html"), &html).unwrap();
    elements(&html);
    for id in ["profile-0", "profile-3", "curve-0", "curve-3"] {
        assert!(html.contains(&format!("<title id=\"{id}-t\">")), "{id}");
    }
    let told =
        ["<td>79.5<small>[", "paired by run", "unpaired", "exploratory", "better", "as BenchMARL writes it"];
    for words in told {
        assert!(html.contains(words), "{words}");
    }
    let shown = without_code(&html);
    assert!(!shown.contains("NaN") && !shown.contains("inf,"));
}

#[test]
fn no_name_of_an_imported_file_becomes_markup() {
    let mut text = IMPORTED.to_string();
    for word in ["vmas", "balance", "mappo", "agents_return", "return"] {
        text = text.replace(&format!("\"{word}\""), &format!("\"{word}{PROBE}\""));
    }
    let html = import_page(&text);
    assert!(!html.contains("<script>alert") && !html.contains("<img"));
    assert_eq!(elements(&html).len(), elements(&import_page(IMPORTED)).len());
    assert!(html.matches("&lt;script&gt;alert(1)&lt;").count() > 30, "the probes are shown as text");
}

#[test]
fn poor_files_give_whole_pages() {
    let nothing = r#"{"e": {"t": {"a": {"r": {"absolute_metrics": {"m": [null]}}}}}}"#;
    let one = nothing.replace("null", "1");
    for text in [nothing, &one, &one.replace("[1]", "[1e300]"), &one.replace("[1]", "[-1e308, -1e308]")] {
        let html = import_page(text);
        elements(&html);
        assert!(html.contains("class=\"sentence\"") && !without_code(&html).contains("NaN"), "{text}");
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
