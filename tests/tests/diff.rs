//! Differences of meaning, told in words; and hashes that agree with them.

#![allow(clippy::unwrap_used)]

use mpgx_lang::diff::{diff, render};
use mpgx_lang::plan::Plan;
use mpgx_lang::problem::render_short;
use mpgx_lang::source::NoFiles;
use mpgx_lang::{compile, meaning_hash};
use mpgx_tests::{compiled, golden, root, scenarios_in};

const SQUARE: &str = include_str!("../../scenarios/square_unison.scn");

fn plan(text: &str) -> Plan {
    let it = compile("a.scn", text.to_owned(), &[], &NoFiles);
    it.plan.unwrap_or_else(|| panic!("{}", render_short(&it.problems, &it.sources)))
}

/// The text with replacements, each of which must be one.
fn changed(edits: &[(&str, &str)]) -> String {
    edits.iter().fold(SQUARE.to_owned(), |text, (from, to)| {
        assert_eq!(text.matches(from).count(), 1, "{from}");
        text.replace(from, to)
    })
}

fn told(edits: &[(&str, &str)]) -> String {
    render(&diff(&plan(SQUARE), &plan(&changed(edits))))
}

#[test]
fn layout_comments_order_and_names_of_indices_are_no_difference() {
    let same = [
        ("// on each axis", ""),
        ("0.4 m in 0.1 m", "40 cm in 100 mm"),
        ("/// Edge of the square.", "/// Another comment."),
        ("-sum(i in follower) |p[i] - F[i]|", "-sum(k in follower) |p[k]\n - F[k]|"),
    ];
    assert_eq!(told(&same), "");
    assert_eq!(meaning_hash(&plan(&changed(&same))), meaning_hash(&plan(SQUARE)));
    // The order of terms decides the order in which they are added, so the hash knows it.
    let swapped = [
        ("    gap   = -sum(i in follower) |p[i] - F[i]|\n", ""),
        ("collisions()\n}", "collisions()\n    gap = -sum(i in follower) |p[i] - F[i]|\n}"),
    ];
    assert_eq!(told(&swapped), "");
}

#[test]
fn which_of_two_indices_stands_where_is_a_difference() {
    let gap = "-sum(i in follower) |p[i] - F[i]|";
    let [one, same, other] = [
        "i, j in pairs(follower)) |p[i] - F[j]|",
        "a, b in pairs(follower)) |p[a] - F[b]|",
        "i, j in pairs(follower)) |p[j] - F[i]|",
    ]
    .map(|sum| plan(&changed(&[(gap, &format!("-sum({sum}"))])));
    assert_eq!(diff(&one, &same).len(), 0);
    assert_eq!(diff(&one, &other).len(), 1);
}

#[test]
fn differences_are_told_in_the_words_of_the_scenario() {
    let edits = [
        ("side = 0.4 m", "side = 0.5 m"),
        ("crash = -k_c", "crash = -2 * k_c"),
        ("lost  when", "gone when"),
        ("random_velocity(1 m/s)", "random_velocity(2 m/s)"),
        ("hand = 0.15 m", "hand = 0.2 m"),
        ("> 2 *", "> 3 *"),
        ("observe { F[i] - p[i] for i in follower }", "observe { F[i]-p[i] for i in follower, p[leader] }"),
        ("compare { td3, oracle", "compare { oracle"),
        ("steps = 20000", "steps = 300"),
        ("seeds 10", "seeds 5"),
        ("evaluate random  { episodes = 100 }", "evaluate other { episodes = 3 }"),
        ("pace = 0.3 m/s", "pace = 0.4 m/s"),
        ("expect random.error < 0.12 m at 95%", ""),
    ];
    assert_eq!(
        told(&edits),
        "\
- expect: random.error < 0.12 m at 95%
+ end gone: ∃i ∈ follower : p_i ∉ A_i
- end lost: ∃i ∈ follower : p_i ∉ A_i
~ agents follower body hand: 0.15 → 0.2
~ agents leader motion velocity: (normal(0, 1), normal(0, 1)) → (normal(0, 2), normal(0, 2))
~ learner mpg steps: 20000 → 300
- learner td3
+ observe: p[leader]
~ param side: 0.4 m → 0.5 m
+ evaluate other
- evaluate random
~ evaluate regular agents leader motion state way next
    - mod(s_0 + 0.3 ⋅ Δt, 4 ⋅ (1.2 − 2 ⋅ 0.3 + 0.3 ⋅ (π / 2)))
    + mod(s_0 + 0.4 ⋅ Δt, 4 ⋅ (1.2 − 2 ⋅ 0.3 + 0.3 ⋅ (π / 2)))
- require: ∀i < j ∈ all : ‖p_i − p_j‖ > 2 ⋅ C
+ require: ∀i < j ∈ all : ‖p_i − p_j‖ > 3 ⋅ C
~ reward crash
    - −k_c ⋅ #{i < j ∈ all : d(i, j) < C}
    + −2 ⋅ k_c ⋅ #{i < j ∈ all : d(i, j) < C}
~ seeds: 10 → 5
"
    );
}

/// Whatever the hash tells apart, but for order, so do the differences.
#[test]
fn plans_of_other_meaning_differ() {
    let mut files = scenarios_in(&root().join("scenarios"));
    files.extend(scenarios_in(&golden::folder("plan")));
    let plans: Vec<Plan> = files.iter().map(|path| compiled(path).plan.unwrap()).collect();
    for a in &plans {
        for b in &plans {
            assert_eq!(
                diff(a, b).is_empty(),
                meaning_hash(a) == meaning_hash(b),
                "{} and {}",
                a.name,
                b.name
            );
        }
    }
}
