//! Reports as Markdown, LaTeX and two studies beside each other: whole, and no name becomes a mark.

#![allow(clippy::unwrap_used)]

#[allow(dead_code)]
mod sample;

use mpgx_report::{Compared, Document, Side, compare_html, compare_tables, study_tables};
use mpgx_study::Study;
use pulldown_cmark::{Event, Options, Parser, Tag};
use sample::hostile::{self, NAMES};

fn tables(name: &str) -> Document {
    let study = hostile::named(name);
    study_tables(&study.plan.name, &study.plan, &study.summary)
}

fn compared<R>(a: &Study, b: &Study, show: impl Fn(&Compared) -> R) -> R {
    let side =
        |name: &str, study| Side { name: name.into(), study, summary: study.summary.as_ref().unwrap() };
    show(&Compared::new(side("before", a), side("after", b)))
}

/// The text of each table's cells, and whatever there is but tables, headings, paragraphs and bold captions.
fn read(markdown: &str) -> (Vec<String>, Vec<String>) {
    let (mut cells, mut foreign) = (Vec::new(), Vec::new());
    let mut inside = false;
    // Curly quotes would be no harm.
    let extensions = Options::all() - Options::ENABLE_SMART_PUNCTUATION;
    for event in Parser::new_ext(markdown, extensions) {
        match event {
            Event::Start(Tag::TableCell) => {
                inside = true;
                cells.push(String::new());
            }
            Event::End(pulldown_cmark::TagEnd::TableCell) => inside = false,
            Event::Text(text) if inside => cells.last_mut().unwrap().push_str(&text),
            Event::Text(_) | Event::End(_) => {}
            Event::Start(
                Tag::Table(_)
                | Tag::TableHead
                | Tag::TableRow
                | Tag::Heading { .. }
                | Tag::Paragraph
                | Tag::Strong,
            ) => {}
            other => foreign.push(format!("{other:?}")),
        }
    }
    (cells, foreign)
}

/// Seen to fail when marks are not escaped.
#[test]
fn markdown_shows_every_name_as_it_is() {
    for name in NAMES {
        let (cells, foreign) = read(&tables(name).markdown());
        assert_eq!(foreign, Vec::<String>::new(), "{name:?}");
        let shown = name.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(cells.contains(&shown), "{shown:?} is not among {cells:?}");
    }
}

/// What LaTeX makes of it is checked with LaTeX, by .ci/report. Seen to fail when symbols are written as they are.
#[test]
fn latex_escapes_every_name() {
    for name in NAMES {
        let latex = tables(name).latex();
        let body = latex.replace("\\\\\n", "").replace("\\&", "").replace("\\%", "");
        for line in body.lines().filter(|line| line.contains(" & ")) {
            assert!(!line.contains("\\input") && !line.contains("\\end"), "{line}");
        }
        let balanced = latex.replace("\\{", "").replace("\\}", "");
        assert_eq!(balanced.matches('{').count(), balanced.matches('}').count(), "{name:?}");
    }
    let tricky = tables("a_b&c%d$e#f~g^h\\i{j}[k]--l");
    assert!(tricky.latex().contains(
        "a\\_b\\&c\\%d\\$e\\#f\\textasciitilde{}g\\textasciicircum{}h\\textbackslash{}i\\{j\\}{[}k]-{}-l & "
    ));
}

#[test]
fn two_studies_have_a_whole_page() {
    let a = sample::study(10, &["random", "regular"]).finished();
    let mut b = sample::study(10, &["random", "circle"]).finished();
    b.plan.world.safety_m = 0.2;
    let html = compared(&a, &b, |it| compare_html(it).unwrap());
    for part in ["verdict", "meaning", "comparison", "learning", "provenance"] {
        assert!(html.contains(&format!("<section id=\"{part}\"")), "{part}");
    }
    for text in ["before: mpg", "after: td3", "safety", "0.2 m", "before has “regular”; after has “circle”"]
    {
        assert!(html.contains(text), "{text}");
    }
    assert!(html.contains("What is evaluated is not the same in both"));
    assert_eq!(html, compared(&a, &b, |it| compare_html(it).unwrap()), "equal records give equal bytes");

    let same = compared(&a, &a, |it| compare_html(it).unwrap());
    assert!(same.contains("both mean the same") && same.contains("taken seed by seed"));
}

#[test]
fn few_seeds_decide_nothing_between_studies() {
    let words = |seeds: u32| {
        let study = sample::study(seeds, &["random"]).finished();
        compared(&study, &study, |it| (compare_html(it).unwrap(), it.json()))
    };
    for (seeds, verdict) in [(3, "too few seeds"), (7, "exploratory")] {
        let (html, json) = words(seeds);
        assert!(html.contains(&format!("<span class=\"badge\">{verdict}")), "{seeds} seeds");
        let pairs = json["evaluations"][0]["pairs"].as_array().unwrap();
        assert!(!pairs.is_empty() && pairs.iter().all(|pair| pair["verdict"] == verdict), "{pairs:?}");
    }
}

#[test]
fn no_name_becomes_markup_beside_another_study() {
    for name in NAMES {
        let study = hostile::named(name).finished();
        let html = compared(&study, &study, |it| compare_html(it).unwrap());
        assert!(!html.contains("<script>alert") && !html.contains("<img"), "{name:?}");
        let document = compared(&study, &study, compare_tables);
        assert_eq!(read(&document.markdown()).1, Vec::<String>::new(), "{name:?}");
    }
}

#[test]
fn numbers_and_words_are_those_of_the_summary() {
    let mut study = sample::study(10, &["random", "regular"]);
    sample::fail(study.records.get_mut("td3-003").unwrap());
    let study = sample::Sample::new(study.plan, study.records);
    let markdown = study_tables("square_unison", &study.plan, &study.summary).markdown();
    golden(&markdown, "tests/sample/study.md");
    golden(&study_tables("square_unison", &study.plan, &study.summary).latex(), "tests/sample/study.tex");
}

/// The text of a golden file; `MPGX_BLESS=1` writes it.
fn golden(text: &str, file: &str) {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
    if std::env::var_os("MPGX_BLESS").is_some() {
        std::fs::write(&path, text).unwrap();
    }
    assert_eq!(text, std::fs::read_to_string(&path).unwrap_or_default(), "{file}; MPGX_BLESS=1 writes it");
}
