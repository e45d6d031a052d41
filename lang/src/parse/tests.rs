use super::*;
use crate::problem::{Style, render, render_short};
use crate::stdlib;

const SCENARIOS: [&str; 2] = [
    include_str!("../../../scenarios/square_unison.scn"),
    include_str!("../../../scenarios/track_random.scn"),
];

/// The tree, and the problems one a line.
fn parsed(text: &str) -> (File, String) {
    let (mut sources, mut problems) = (Sources::default(), Problems::default());
    let file = sources.add("a.scn", text.to_owned());
    let tree = parse(&sources, file, &mut problems);
    if text.len() < 10_000 {
        render(&problems, &sources, Style::Plain);
    }
    (tree, render_short(&problems, &sources))
}

fn codes(text: &str) -> Vec<String> {
    let code = |line: &str| line.split(['[', ']']).nth(1).unwrap_or_default().to_owned();
    parsed(text).1.lines().map(code).collect()
}

#[test]
fn the_standard_library_and_the_scenarios_parse() {
    for text in stdlib::MODULES.iter().map(|(_, text)| *text).chain(SCENARIOS) {
        let (file, problems) = parsed(text);
        assert_eq!(problems, "");
        assert!(!file.items.is_empty() && !file.doc.is_empty());
    }
}

#[test]
fn a_mark_and_line_ends_of_windows_change_nothing() {
    for text in SCENARIOS {
        let windows = format!("\u{feff}{}", text.replace('\n', "\r\n"));
        let (file, problems) = parsed(&windows);
        assert_eq!(problems, "");
        assert_eq!(file.doc, parsed(text).0.doc);
        assert_eq!(file.items.len(), parsed(text).0.items.len());
    }
}

#[test]
fn characters_that_deceive_are_refused_with_their_byte() {
    for (text, byte) in [("let a\r= 1", 5), ("// \0", 3), ("// é \u{202e}", 6), ("let a = 1\u{7f}", 9)] {
        let (file, problems) = parsed(text);
        assert!(
            problems.contains("[forbidden-character]") && problems.contains(&format!("byte {byte}\n")),
            "{problems}"
        );
        assert!(file.items.is_empty());
    }
}

#[test]
fn size_is_limited() {
    let fill = |bytes: usize| format!("let a = 1\n//{}", "x".repeat(bytes - 12));
    assert_eq!(codes(&fill(MAX_BYTES)), [""; 0]);
    assert_eq!(codes(&fill(MAX_BYTES + 1)), ["file-too-large"]);
}

/// Texts that grow in one direction: what stands before, what is repeated, the middle, what is repeated after.
const SHAPES: [(&str, &str, &str); 13] = [
    ("(", "1", ")"),
    ("[", "1", "]"),
    ("f(", "1", ")"),
    ("min(x, ", "1", ")"),
    ("a[", "1", "]"),
    ("|", "1", "|"),
    ("-", "1", ""),
    ("not ", "a", ""),
    ("if a then b else ", "c", ""),
    ("if if ", "a", " then b else c then d else e"),
    ("sum(i in a) ", "x", ""),
    ("any(i in all(j in b) c) ", "x", ""),
    ("(1, ", "1", ")"),
];

#[test]
#[expect(clippy::disallowed_types, reason = "the stack of a thread is measured")]
fn nesting_is_limited_whatever_nests_and_needs_little_stack() {
    let run = || {
        for (open, middle, close) in SHAPES {
            let nested = |times| format!("let a = {}{middle}{}", open.repeat(times), close.repeat(times));
            assert_eq!(codes(&nested(40)), [""; 0], "{open}");
            assert_eq!(codes(&nested(1_000)), ["nested-too-deeply"], "{open}");
            assert!(
                ["nested-too-deeply", "too-complex"].contains(&codes(&nested(30_000))[0].as_str()),
                "{open}"
            );
        }
        for chain in [" + x", " * x", "^x", " and x", ".x", "[1]"] {
            assert_eq!(codes(&format!("let a = x{}", chain.repeat(100))), [""; 0], "{chain}");
            assert_eq!(codes(&format!("let a = x{}", chain.repeat(200))), ["nested-too-deeply"], "{chain}");
            assert_eq!(codes(&format!("let a = x{}", chain.repeat(10_000)))[1..], [""; 0], "{chain}");
        }
    };
    std::thread::Builder::new().stack_size(1 << 20).spawn(run).unwrap().join().unwrap();
}

#[test]
fn problems_of_items_do_not_hide_each_other() {
    let (file, problems) =
        parsed("let a = 1\nlte b = 2\nworld { dt 1 s }\nlet c = (1\nlet d = 1e999\nlet e = 2");
    let codes: Vec<&str> = problems.lines().filter_map(|line| line.split(['[', ']']).nth(1)).collect();
    assert_eq!(codes, ["unknown-item", "syntax", "unbalanced-brackets", "number-too-large"]);
    assert_eq!(file.items.len(), 2);
}

#[test]
fn no_text_makes_it_panic() {
    let mut state = 1_u64;
    let mut random = move |below: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below
    };
    let texts: Vec<&str> = stdlib::MODULES.iter().map(|(_, text)| *text).chain(SCENARIOS).collect();
    let words = [
        "(", ")", "{", "}", "|", "if ", " else ", "-", "^", "..", "\n", "1e9", " m", "é", "///", "reward",
        "\t", "=",
    ];
    for _ in 0..1500 {
        let mut text = texts[random(texts.len())].to_owned();
        for _ in 0..=random(4) {
            let cut =
                |text: &str, at: usize| (0..=at).rev().find(|at| text.is_char_boundary(*at)).unwrap_or(0);
            let (from, to) = (random(text.len() + 1), random(12));
            let from = cut(&text, from);
            let to = cut(&text, (from + to).min(text.len())).max(from);
            text.replace_range(from..to, words[random(words.len())]);
        }
        parsed(&text);
    }
}
