//! Studies whose every free word would do harm if it were let through.

use mpgx_study::summary::Summary;
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::{Sample, fail, study};

/// Ends attributes, elements, scripts and comments, if it is let through.
pub const PROBE: &str = r#"\"'><script>alert(1)</script><img src=x onerror=alert(2)>-->&amp;"#;

/// Names of methods that mean something in HTML, Markdown or LaTeX.
pub const NAMES: &[&str] = &[
    r#""'><script>alert(1)</script><img src=x onerror=alert(2)>-->&amp;"#,
    "a | b \\| c",
    "**bold** _it_ `code` ~~gone~~ $x$ [a](javascript:alert(1)) ![i](x)",
    "http://example.org www.example.org a@example.org <http://example.org>",
    "# head\n\n- list\n1. one\n***\n",
    "- minus",
    "1. one",
    "+ plus",
    ":smile: #12 @someone ^[note] {.class} ==mark==",
    r"\input{/etc/passwd} \end{tabular} % gone & & \\",
    "[opt] * star",
    "_^~{}$#&%\\'\"`<>|",
    "ﬁ 中文 é ß Ø π → ∞ 𝒳 --- ,, ?` !`",
];

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

/// A short study whose first learner has this name.
pub fn named(name: &str) -> Sample {
    let mut study = study(2, &["random"]);
    study.plan.learners[0].label = name.into();
    study.records.values_mut().filter(|it| it.method == "mpg").for_each(|it| it.method = name.into());
    Sample::new(study.plan, study.records)
}

/// A whole study with a failed seed, where [`PROBE`] stands behind every free word.
pub fn everywhere() -> Sample {
    let mut clean = study(10, &["random", "regular"]);
    if let Some(record) = clean.records.get_mut("td3-003") {
        fail(record);
    }
    let clean = Sample::new(clean.plan, clean.records);
    let probe = PROBE.replace("\\\"", "\"");
    Sample {
        plan: poison(&clean.plan),
        records: poison(&clean.records),
        timings: clean.timings.clone(),
        localisers: clean.localisers.clone(),
        summary: poison::<Summary>(&clean.summary),
        source: poison(&vec![("square_unison.scn".to_string(), format!("// {probe}\n{probe}\n"))]),
    }
}

fn poison<T: Serialize + DeserializeOwned>(value: &T) -> T {
    let mut text = serde_json::to_string(value).unwrap();
    for word in WORDS {
        text = text.replace(&format!("\"{word}\""), &format!("\"{word}{PROBE}\""));
    }
    serde_json::from_str(&text).unwrap()
}
