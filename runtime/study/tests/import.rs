//! marl-eval's JSON: numbers by hand, a file as BenchMARL writes it, and every error with its place.

#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;

use mpgx_study::import::{ImportError, Results, import};
use mpgx_study::statistics::{bootstrap, bootstrap_two, mean};

/// `e`, task `t`: of each algorithm the absolute values of `score`, by run.
fn file(algorithms: &[(&str, &[(&str, &str)])]) -> String {
    let runs = |(name, values): &(&str, &str)| {
        format!(
            "\"{name}\": {{\"step_0\": {{\"step_count\": 0}}, \"absolute_metrics\": {{\"score\": {values}}}}}"
        )
    };
    let algorithm = |(name, of): &(&str, &[(&str, &str)])| {
        format!("\"{name}\": {{{}}}", of.iter().map(runs).collect::<Vec<_>>().join(", "))
    };
    let algorithms = algorithms.iter().map(algorithm).collect::<Vec<_>>().join(", ");
    format!("{{\"e\": {{\"t\": {{{algorithms}}}}}}}")
}

fn only(text: &str) -> Results {
    let mut all = import(text).unwrap();
    assert_eq!(all.len(), 1);
    all.remove(0)
}

/// Runs 0, 1, … with these values.
fn samples(algorithms: &[(&str, &[f64])], run: impl Fn(&str, usize) -> String) -> Results {
    let one = |(name, values): &(&str, &[f64])| {
        let runs = values.iter().enumerate().map(|(k, value)| {
            format!("\"{}\": {{\"absolute_metrics\": {{\"score\": [{value}]}}}}", run(name, k))
        });
        format!("\"{name}\": {{{}}}", runs.collect::<Vec<_>>().join(", "))
    };
    let all = algorithms.iter().map(one).collect::<Vec<_>>().join(", ");
    only(&format!("{{\"e\": {{\"t\": {{{all}}}}}}}"))
}

#[test]
fn a_run_is_worth_the_mean_of_its_absolute_metric_and_one_without_counts_as_the_worst() {
    let text = file(&[
        ("a", &[("run_1", "[1, 2]"), ("run_2", "[3]"), ("run_3", "[5.5, 4.5]")]),
        ("b", &[("run_1", "[0.5]"), ("run_2", "[]"), ("run_3", "[null, 7]"), ("run_4", "[NaN]")]),
    ]);
    let results = only(&text);
    assert_eq!((results.environment.as_str(), results.task.as_str()), ("e", "t"));
    assert_eq!(results.metric, "score");
    let [a, b] = results.algorithms.as_slice() else { panic!("{results:?}") };
    assert_eq!(a.scores, [1.5, 3.0, 5.0]);
    assert_eq!(b.scores, [0.5; 4]);
    assert_eq!(b.statistic.per_seed, [Some(0.5), None, None, None]);
    assert!((a.statistic.iqm - 9.5 / 3.0).abs() < 1e-15 && a.statistic.lo.is_none());
    assert_eq!((b.statistic.iqm, b.statistic.mean), (0.5, 0.5));
    let pair = &results.pairs[0];
    assert!(!pair.paired);
    assert_eq!((pair.comparison.a.as_str(), pair.comparison.b.as_str()), ("a", "b"));
    assert_eq!((pair.comparison.probability_of_improvement, pair.comparison.p), (1.0, None));
    assert_eq!(pair.comparison.verdict, "too few seeds");
}

#[test]
fn without_an_absolute_metric_the_largest_step_count_decides_whatever_the_steps_are_called() {
    let text = r#"{"e": {"t": {"a": {"seed_0": {
        "step_9": {"step_count": 900, "score": [2, 4], "elapsed_time": 12},
        "step_10": {"step_count": 1000, "score": [10, 20]},
        "step_1": {"step_count": 100, "score": [1]}
    }}}}}"#;
    let results = only(text);
    assert_eq!(results.algorithms[0].scores, [15.0]);
    assert_eq!(results.algorithms[0].curves, [vec![(100.0, 1.0), (900.0, 3.0), (1000.0, 15.0)]]);
    assert_eq!((results.absolute, results.largest), (0, false));
    let with = |absolute: &str| {
        text.replace("\"step_9\"", &format!("\"absolute_metrics\": {{\"score\": [{absolute}]}}, \"step_9\""))
    };
    assert!(only(&with("20")).largest, "the largest of all episodes");
    assert!(!only(&with("19")).largest);
    assert_eq!(only(&with("19")).algorithms[0].scores, [19.0]);
}

#[test]
fn runs_are_paired_only_if_they_have_the_same_names() {
    let a: Vec<f64> = (0..10).map(|k| f64::from(k * 7 % 10)).collect();
    let b: Vec<f64> = (0..10).map(|k| f64::from(k * 7 % 10) - 1.0 - 0.1 * f64::from(k % 3)).collect();
    let results = samples(&[("a", &a), ("b", &b)], |_, k| format!("seed_{k}"));
    let differences: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a - b).collect();
    let paired = &results.pairs[0];
    let interval = bootstrap(&differences, 0.95, mean).unwrap();
    assert!(paired.paired);
    assert_eq!((paired.comparison.lo, paired.comparison.hi), (Some(interval.lo), Some(interval.hi)));

    let results = samples(&[("a", &a), ("b", &b)], |name, k| format!("{name}_{k}"));
    let apart = &results.pairs[0];
    let interval = bootstrap_two(&a, &b, 0.95, |x, y| mean(x) - mean(y)).unwrap();
    assert!(!apart.paired);
    assert_eq!((apart.comparison.lo, apart.comparison.hi), (Some(interval.lo), Some(interval.hi)));
    assert!(interval.lo < 0.0 && interval.hi > 0.0, "unpaired, the same values say nothing");
    assert!((apart.comparison.difference - paired.comparison.difference).abs() < 1e-12);
}

#[test]
fn words_need_runs_and_hold_against_all_comparisons_of_the_file() {
    let verdict = |n: usize, gap: f64| {
        let low: Vec<f64> = (0..n).map(|k| k as f64 * 0.1).collect();
        let high: Vec<f64> = low.iter().map(|value| value + gap).collect();
        samples(&[("high", &high), ("low", &low)], |name, k| format!("{name}{k}")).pairs[0].comparison.clone()
    };
    assert_eq!(verdict(4, 9.0).verdict, "too few seeds");
    assert_eq!(verdict(9, 9.0).verdict, "exploratory");
    assert_eq!(verdict(10, 9.0).verdict, "better");
    assert_eq!(verdict(10, -9.0).verdict, "worse");
    assert_eq!(verdict(10, 0.01).verdict, "no difference shown");

    let low: Vec<f64> = (0..10).map(|k| f64::from(k) * 0.1).collect();
    let high: Vec<f64> = low.iter().map(|value| value + 0.3).collect();
    let results = samples(&[("a", &high), ("b", &low), ("c", &low)], |name, k| format!("{name}{k}"));
    let [first, _, last] = results.pairs.as_slice() else { panic!() };
    assert!((first.comparison.p_holm.unwrap() - 3.0 * first.comparison.p.unwrap()).abs() < 1e-12);
    assert_eq!(last.comparison.p_holm, Some(1.0));
}

#[test]
fn a_file_as_benchmarl_writes_it() {
    type Truth = BTreeMap<String, BTreeMap<String, [f64; 4]>>;
    let truth: Truth = serde_json::from_str(include_str!("fixtures/marl_eval_truth.json")).unwrap();
    let all = import(include_str!("fixtures/marl_eval.json")).unwrap();
    let names: Vec<(&str, &str)> = all.iter().map(|it| (it.task.as_str(), it.metric.as_str())).collect();
    let metrics = ["agents_return", "return"];
    assert_eq!(names, ["balance", "navigation"].map(|task| metrics.map(|metric| (task, metric))).concat());
    for results in &all {
        assert!(results.largest);
        assert_eq!(results.algorithms.len(), truth[&results.task].len());
        for it in &results.algorithms {
            let failed = it.statistic.per_seed.iter().filter(|value| value.is_none()).count();
            let ours = [it.statistic.iqm, it.statistic.mean, it.scores.len() as f64, failed as f64];
            let theirs = truth[&results.task][&it.name];
            assert!(near(&ours, &theirs), "{} {}: {ours:?}, not {theirs:?}", results.task, it.name);
        }
    }
    assert!(all[0].pairs.iter().all(|pair| pair.paired) && all[2].pairs.iter().all(|pair| !pair.paired));
}

fn near(ours: &[f64], theirs: &[f64]) -> bool {
    ours.iter().zip(theirs).all(|(ours, theirs)| (ours - theirs).abs() <= 1e-12 * theirs.abs())
}

#[test]
fn every_error_has_its_place_and_a_remedy() {
    let told = |text: &str| {
        let error = import(text).unwrap_err();
        assert!(!error.remedy().is_empty());
        error.to_string()
    };
    let run = |run: &str| told(&format!(r#"{{"e": {{"t": {{"a": {{"seed_0": {run}}}}}}}}}"#));
    assert!(told("{\"e\": {").starts_with("it is not JSON: EOF"), "{}", told("{\"e\": {"));
    assert!(told("").starts_with("it is not JSON"));
    assert!(told(&"[".repeat(100_000)).contains("recursion limit"));
    assert!(run(r#"{"step_0": {"step_count": 1e999}}"#).contains("number out of range"));
    assert_eq!(told("[]"), "the file should be an object, but is a list");
    assert_eq!(told("{}"), "the file holds no environment");
    assert_eq!(told(r#"{"e": 3}"#), "e should be an object, but is a number");
    assert_eq!(told(r#"{"e": {}}"#), "e holds no task");
    assert_eq!(told(r#"{"e": {"t": {}}}"#), "e/t holds no algorithm");
    assert_eq!(told(r#"{"e": {"t": {"a": {}}}}"#), "e/t/a holds no run");
    assert_eq!(run("{}"), "e/t/a/seed_0 holds no step");
    assert_eq!(run(r#"{"step_0": [1]}"#), "e/t/a/seed_0/step_0 should be an object, but is a list");
    assert_eq!(run(r#"{"step_0": {"score": [1]}}"#), "e/t/a/seed_0/step_0 has no step_count");
    assert_eq!(
        run(r#"{"step_0": {"step_count": NaN}}"#),
        "e/t/a/seed_0/step_0/step_count should be a number, but is null"
    );
    assert_eq!(
        run(r#"{"absolute_metrics": {"score": 3}}"#),
        "e/t/a/seed_0/absolute_metrics/score should be a list of numbers, but is a number"
    );
    assert_eq!(
        run(r#"{"absolute_metrics": {"score": [1, "2"]}}"#),
        "e/t/a/seed_0/absolute_metrics/score[1] should be a number, but is text"
    );
}

#[test]
fn sizes_are_limited() {
    let text = |algorithms: usize, n: usize| {
        let runs = (0..n).map(|k| format!("\"r{k}\": {{\"absolute_metrics\": {{\"m\": [0]}}}}"));
        let runs = runs.collect::<Vec<_>>().join(",");
        let all = (0..algorithms).map(|k| format!("\"a{k}\": {{{runs}}}")).collect::<Vec<_>>().join(",");
        format!("{{\"e\": {{\"t\": {{{all}}}}}}}")
    };
    let found = |text: &str| match import(text) {
        Err(ImportError::TooMany { what, found, .. }) => (what, found),
        other => panic!("{other:?}"),
    };
    assert_eq!(found(&text(51, 1)), ("algorithms", 51));
    assert_eq!(found(&text(1, 1001)), ("runs", 1001));
    assert_eq!(found(&text(4, 600)), ("pairs of runs to compare", 6 * 600 * 600));
    let metrics = (0..201).map(|k| format!("\"m{k}\": [0]")).collect::<Vec<_>>().join(",");
    let wide = format!("{{\"e\": {{\"t\": {{\"a\": {{\"r\": {{\"absolute_metrics\": {{{metrics}}}}}}}}}}}}}");
    assert_eq!(found(&wide), ("metrics of tasks", 201));
}

#[test]
fn what_cannot_be_counted_is_left_out_and_names_are_made_plain() {
    let nothing = file(&[("a", &[("r", "[NaN, Infinity]")]), ("b", &[("r", "[-Infinity]")])]);
    assert_eq!(import(&nothing), Ok(vec![]));
    let long = "x".repeat(200);
    let text = file(&[
        ("\\u001b[31mred\\u202e NaN \\\"Infinity", &[("r", "[-Infinity]")]),
        (&long, &[("r", "[1]")]),
    ]);
    let results = only(&text);
    assert_eq!(results.algorithms[0].name, "\u{fffd}[31mred\u{fffd} NaN \"Infinity");
    assert_eq!(results.algorithms[1].name.chars().count(), 81);
    assert_eq!(import(&format!("\u{feff}{text}")), import(&text));
}
