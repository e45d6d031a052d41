//! Summaries of hand-made records.

use std::collections::BTreeMap;

use mpgx_lang::plan::*;
use mpgx_study::record::{CellRecord, Evaluation, Failure, Timing, Training};
use mpgx_study::statistics::{Interval, bootstrap, iqm, mean, t_interval, welch_test};
use mpgx_study::summarise::summarise;
use mpgx_study::summary::{Comparison, Statistic, Summary};

type Records = BTreeMap<String, CellRecord>;

fn method(label: &str) -> Method {
    let what = Extern { name: label.into(), settings: BTreeMap::new() };
    Method { label: label.into(), what, at: Place::default() }
}

/// One protocol `random`; terms `gap` and `crash`.
fn plan(learners: &[&str], controllers: &[&str], claims: Vec<ClaimKind>) -> Plan {
    let place = Place { file: "a.scn".into(), line: 7, column: 1 };
    let term = |name: &str| Term {
        name: name.into(),
        doc: String::new(),
        value: Expr::Number(0.0),
        dimension: "length".into(),
        at: Place::default(),
    };
    let claim = |kind| Claim { text: "as written".into(), kind, at: place.clone() };
    Plan {
        name: "hand_made".into(),
        world: World {
            dt_s: 0.1,
            horizon: 200,
            safety_m: 0.1,
            reward: vec![term("gap"), term("crash")],
            ..World::default()
        },
        learners: learners.iter().map(|label| method(label)).collect(),
        controllers: controllers.iter().map(|label| method(label)).collect(),
        seeds: 10,
        protocols: vec![Protocol { name: "random".into(), episodes: 2, world: None, at: place.clone() }],
        claims: claims.into_iter().map(claim).collect(),
        ..Plan::default()
    }
}

/// Two episodes with these means, half a unit to each side.
fn evaluation(returned: f64, error_m: f64) -> Evaluation {
    Evaluation {
        returns: vec![returned - 0.5, returned + 0.5],
        error_m: vec![error_m - 0.25, error_m + 0.25],
        terms: vec![vec![returned, 0.0], vec![returned, -3.0]],
        collision_steps: vec![0, 3],
        late_collision_steps: vec![0, 0],
        outside_steps: vec![1, 1],
        hit_steps: vec![2, 5],
        late_hit_steps: vec![0, 1],
        trajectories: vec![],
        told: None,
    }
}

fn add(records: &mut Records, method: &str, seed: u32, held_out: Evaluation) {
    let protocols = BTreeMap::from([("random".to_string(), held_out)]);
    let record = CellRecord { method: method.into(), seed, training: None, failure: None, protocols };
    records.insert(format!("{method}-{seed:03}"), record);
}

fn add_failed(records: &mut Records, method: &str, seed: u32) {
    let failure = Failure { step: 812, cause: "the critic is NaN".into(), at: "a.scn:31:5".into() };
    let failure = Some(failure);
    let record =
        CellRecord { method: method.into(), seed, training: None, failure, protocols: BTreeMap::new() };
    records.insert(format!("{method}-{seed:03}"), record);
}

/// Seeds 0, 1, … with these returns; the error is minus a tenth of the return.
fn study(methods: &[(&str, &[f64])]) -> Records {
    let mut records = Records::new();
    for (method, returns) in methods {
        for (seed, returned) in (0..).zip(*returns) {
            add(&mut records, method, seed, evaluation(*returned, -0.1 * returned));
        }
    }
    records
}

/// Leaves the return alone to be compared.
fn without_errors(mut records: Records) -> Records {
    records.values_mut().flat_map(|record| record.protocols.values_mut()).for_each(|of| of.error_m.clear());
    records
}

fn summary(plan: &Plan, records: &Records) -> Summary {
    summarise(plan, records, &BTreeMap::new())
}

fn statistic<'a>(summary: &'a Summary, method: &str, metric: &str) -> &'a Statistic {
    &summary.protocols["random"][method][metric]
}

fn comparison<'a>(summary: &'a Summary, metric: &str, b: &str) -> &'a Comparison {
    let found = summary.comparisons.iter().find(|c| c.metric == metric && c.a == "mpg" && c.b == b);
    found.unwrap_or_else(|| panic!("{metric} against {b}"))
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-12 * b.abs().max(1.0)
}

const TEN: [f64; 10] = [-3.0, -1.0, -9.0, -4.0, -2.0, -5.0, -6.0, -8.0, -7.0, -10.0];
/// Ahead of [`TEN`] by 6 on average: Welch's p is 0.0003.
const AHEAD: [f64; 10] = [3.0, 5.1, -2.8, 2.3, 3.6, 1.5, -0.4, -2.3, -0.8, -4.2];
/// Ahead of [`TEN`] by 2.9 on average: Welch's p is 0.045.
const NEARLY: [f64; 10] = [-1.0, 2.1, -5.8, -0.7, 0.6, -1.5, -3.4, -5.3, -3.8, -7.2];

#[test]
fn the_numbers_are_those_of_the_records() {
    let records = study(&[("mpg", &TEN), ("oracle", &[-2.0])]);
    let summary = summary(&plan(&["mpg"], &["oracle", "proportional"], vec![]), &records);
    assert_eq!((summary.scenario.as_str(), summary.seeds), ("hand_made", 10));
    assert_eq!(summary.failures, []);

    let of_return = statistic(&summary, "mpg", "return");
    assert_eq!(of_return.per_seed, TEN.map(Some));
    assert!(close(of_return.iqm, -5.5) && close(of_return.mean, -5.5));
    let Interval { lo, hi } = bootstrap(&TEN, 0.95, iqm).unwrap();
    assert_eq!((of_return.lo, of_return.hi), (Some(lo), Some(hi)));
    let Interval { lo, hi } = t_interval(&TEN, 0.95).unwrap();
    assert_eq!((of_return.mean_lo, of_return.mean_hi), (Some(lo), Some(hi)));

    let iqm = |metric| statistic(&summary, "mpg", metric).iqm;
    assert!(close(iqm("error_m"), 0.55));
    assert!(close(iqm("error_over_oracle"), 0.55 / 0.2));
    assert!(close(iqm("collision_episodes"), 0.5));
    assert_eq!(iqm("late_collision_episodes"), 0.0);
    assert_eq!(iqm("outside_episodes"), 1.0);
    assert!(close(iqm("reward/gap"), -5.5));
    assert!(close(iqm("reward/crash"), -1.5));

    let oracle = statistic(&summary, "oracle", "return");
    let alone = Statistic {
        iqm: -2.0,
        lo: None,
        hi: None,
        mean: -2.0,
        mean_lo: None,
        mean_hi: None,
        per_seed: vec![Some(-2.0)],
    };
    assert_eq!(*oracle, alone);
    assert!(close(statistic(&summary, "oracle", "error_over_oracle").iqm, 1.0));
    assert!(!summary.protocols["random"].contains_key("proportional"), "it left no record");
}

#[test]
fn without_an_oracle_there_is_no_ratio_to_it() {
    let records = study(&[("mpg", &TEN), ("proportional", &[-2.0])]);
    let summary = summary(&plan(&["mpg"], &["proportional"], vec![]), &records);
    assert!(!summary.protocols["random"]["mpg"].contains_key("error_over_oracle"));
}

#[test]
fn terms_are_those_of_the_protocols_world() {
    let mut plan = plan(&["mpg"], &[], vec![]);
    let mut world = plan.world.clone();
    world.reward.reverse();
    plan.protocols[0].world = Some(Box::new(world));
    let summary = summary(&plan, &study(&[("mpg", &TEN)]));
    assert!(close(statistic(&summary, "mpg", "reward/crash").iqm, -5.5));
}

#[test]
fn intervals_need_five_seeds_and_two_for_the_mean() {
    let of = |n: usize| {
        let records = study(&[("mpg", &TEN[..n])]);
        statistic(&summary(&plan(&["mpg"], &[], vec![]), &records), "mpg", "return").clone()
    };
    let known = |statistic: Statistic| (statistic.lo.is_some(), statistic.mean_lo.is_some());
    assert_eq!(
        [1, 2, 4, 5].map(|n| known(of(n))),
        [(false, false), (false, true), (false, true), (true, true)]
    );
}

#[test]
fn a_failed_seed_counts_as_the_worst_of_all_methods() {
    let mut records = study(&[("mpg", &TEN), ("td3", &TEN)]);
    add_failed(&mut records, "mpg", 3);
    add(&mut records, "td3", 5, evaluation(-40.0, 4.0));
    let mut not_a_number = evaluation(-1.0, 0.1);
    not_a_number.error_m[1] = f64::NAN;
    add(&mut records, "td3", 6, not_a_number);
    let summary = summary(&plan(&["mpg", "td3"], &[], vec![]), &records);

    let of_return = statistic(&summary, "mpg", "return");
    assert_eq!((of_return.per_seed[2], of_return.per_seed[3]), (Some(-9.0), None));
    assert!(close(of_return.mean, (-55.0 + 4.0 - 40.0) / 10.0), "{}", of_return.mean);
    let of_error = statistic(&summary, "td3", "error_m");
    assert_eq!((of_error.per_seed[5], of_error.per_seed[6]), (Some(4.0), None));
    assert!(close(of_error.mean, (5.5 - 0.5 - 0.6 + 4.0 + 4.0) / 10.0), "{}", of_error.mean);

    assert_eq!(summary.failures.len(), 1);
    let failed = &summary.failures[0];
    assert_eq!((failed.algorithm.as_str(), failed.seed, failed.step), ("mpg", 3, 812));
    assert_eq!((failed.cause.as_str(), failed.at.as_str()), ("the critic is NaN", "a.scn:31:5"));
    assert_eq!(summary.seeds, 10);
}

#[test]
fn words_need_seeds() {
    let verdict = |n: usize| {
        let records = study(&[("mpg", &AHEAD[..n]), ("td3", &TEN[..n])]);
        let summary = summary(&plan(&["mpg", "td3"], &[], vec![]), &records);
        let c = comparison(&summary, "return", "td3");
        (c.verdict.clone(), c.lo.is_some(), c.p.is_some(), c.probability_lo.is_some())
    };
    assert_eq!(verdict(4), ("too few seeds".into(), false, false, false));
    assert_eq!(verdict(5), ("exploratory".into(), true, true, true));
    assert_eq!(verdict(9), ("exploratory".into(), true, true, true));
    assert_eq!(verdict(10), ("better".into(), true, true, true));
}

#[test]
fn a_comparison_is_the_difference_seed_by_seed() {
    let records = study(&[("mpg", &AHEAD), ("td3", &TEN)]);
    let summary = summary(&plan(&["mpg", "td3"], &[], vec![]), &records);
    assert_eq!(summary.comparisons.len(), 2);
    let by_return = comparison(&summary, "return", "td3");
    let differences: Vec<f64> = AHEAD.iter().zip(TEN).map(|(a, b)| a - b).collect();
    let Interval { lo, hi } = bootstrap(&differences, 0.95, mean).unwrap();
    assert!(close(by_return.difference, 6.0), "{}", by_return.difference);
    assert!(close(by_return.lo.unwrap(), lo) && close(by_return.hi.unwrap(), hi));
    assert!(close(by_return.p.unwrap(), welch_test(&AHEAD, &TEN).unwrap().p));
    assert!(close(by_return.p_holm.unwrap(), 2.0 * by_return.p.unwrap()));

    let by_error = comparison(&summary, "error_m", "td3");
    assert!(close(by_error.difference, -0.6), "{}", by_error.difference);
    assert!(by_error.hi.unwrap() < 0.0);
    assert_eq!(by_error.probability_of_improvement, by_return.probability_of_improvement);
    assert!(by_error.probability_of_improvement > 0.8);
    assert_eq!((by_return.verdict.as_str(), by_error.verdict.as_str()), ("better", "better"));
}

#[test]
fn holm_allows_for_every_comparison() {
    let records = study(&[("mpg", &NEARLY), ("td3", &TEN)]);
    let plan = plan(&["mpg", "td3"], &[], vec![]);
    let of_two = summary(&plan, &records);
    let by_return = comparison(&of_two, "return", "td3");
    assert!(by_return.lo.unwrap() > 0.0 && by_return.p.unwrap() < 0.05 && by_return.p_holm.unwrap() > 0.05);
    assert_eq!(by_return.verdict, "no difference shown");

    let of_one = summary(&plan, &without_errors(records));
    assert_eq!((of_one.comparisons.len(), of_one.comparisons[0].verdict.as_str()), (1, "better"));
}

#[test]
fn better_needs_the_interval_too() {
    let opposed = TEN.map(|returned| -returned - 7.9);
    let records = without_errors(study(&[("mpg", &opposed), ("td3", &TEN)]));
    let summary = summary(&plan(&["mpg", "td3"], &[], vec![]), &records);
    let c = comparison(&summary, "return", "td3");
    assert!(c.p_holm.unwrap() < 0.05 && c.lo.unwrap() < 0.0 && c.hi.unwrap() > 0.0, "{c:?}");
    assert_eq!(c.verdict, "no difference shown");
}

#[test]
fn a_controller_is_one_value() {
    let records = study(&[("mpg", &TEN), ("oracle", &[-1.5]), ("proportional", &[-40.0])]);
    let summary = summary(&plan(&["mpg"], &["oracle", "proportional"], vec![]), &records);
    let verdict = |metric, b| comparison(&summary, metric, b).verdict.as_str();
    assert_eq!((verdict("return", "oracle"), verdict("error_m", "oracle")), ("worse", "worse"));
    assert_eq!((verdict("return", "proportional"), verdict("error_m", "proportional")), ("better", "better"));
    let by_return = comparison(&summary, "return", "oracle");
    assert!(close(by_return.difference, -4.0));
    assert!(close(by_return.probability_of_improvement, 0.1), "one seed of ten reached -1");
    assert!(close(comparison(&summary, "error_m", "oracle").probability_of_improvement, 0.1));
}

#[test]
fn seeds_are_paired_by_number_not_by_place() {
    let mut records = study(&[("mpg", &TEN), ("td3", &TEN)]);
    records.remove("td3-000");
    let moved = records.remove("mpg-009").unwrap();
    records.insert("mpg-0010".into(), moved);
    let summary = summary(&plan(&["mpg", "td3"], &[], vec![]), &records);
    assert_eq!(statistic(&summary, "mpg", "return").per_seed, TEN.map(Some));
    let c = comparison(&summary, "return", "td3");
    assert_eq!((c.difference, c.verdict.as_str()), (0.0, "exploratory"));
}

fn bound(metric: &str, method: &str, below: bool, bound: f64) -> ClaimKind {
    let (protocol, metric, method) = ("random".into(), metric.into(), method.into());
    ClaimKind::Bound { protocol, metric, method, below, bound, confidence: 0.95 }
}

fn beats(better: &str, worse: &str, metric: &str) -> ClaimKind {
    let (better, worse, metric) = (better.into(), worse.into(), metric.into());
    ClaimKind::Beats { better, worse, protocol: "random".into(), metric, confidence: 0.95 }
}

fn decided(records: &Records, claims: Vec<ClaimKind>) -> Vec<(bool, String)> {
    let plan = plan(&["mpg", "td3"], &["oracle", "proportional"], claims);
    summary(&plan, records).expect.into_iter().map(|claim| (claim.holds, claim.because)).collect()
}

#[test]
fn a_bound_needs_the_whole_interval() {
    let records = study(&[("mpg", &TEN), ("oracle", &[-1.5])]);
    let Interval { lo, hi } = bootstrap(&TEN, 0.95, iqm).unwrap();
    let claims = vec![
        bound("return", "mpg", false, lo - 0.01),
        bound("return", "mpg", false, lo + 0.01),
        bound("return", "mpg", true, hi + 0.01),
        bound("return", "mpg", true, hi - 0.01),
        bound("error_m", "oracle", true, 0.16),
        bound("error_m", "oracle", true, 0.15),
        bound("reward/lost", "mpg", true, 0.0),
    ];
    let decided = decided(&records, claims);
    let holds: Vec<bool> = decided.iter().map(|claim| claim.0).collect();
    assert_eq!(holds, [true, false, true, false, true, false, false]);
    assert_eq!(decided[4].1, "error of oracle is 0.15 m, below 0.16 m");
    assert_eq!(decided[5].1, "error of oracle is 0.15 m, not below 0.15 m");
    assert_eq!(decided[6].1, "reward term lost of mpg was not measured under random");
}

#[test]
fn reasons_are_plain_words() {
    let mut records = study(&[("mpg", &TEN)]);
    add_failed(&mut records, "mpg", 9);
    let claims = vec![bound("error_m", "mpg", true, 0.12), bound("collision_episodes", "mpg", true, 0.03)];
    let decided = decided(&records, claims);
    assert_eq!(
        decided[0].1,
        "error of mpg is 0.55 m (interquartile mean over 10 seeds, 1 of them failed and counted as the worst), \
         95 % interval 0.3167 m to 0.7667 m, not all of it below 0.12 m"
    );
    assert!(decided[1].1.contains("is 50 % (") && decided[1].1.ends_with("not all of it below 3 %"));
}

#[test]
fn claims_need_seeds() {
    let claims = |n: usize| {
        let records = study(&[("mpg", &AHEAD[..n]), ("td3", &TEN[..n]), ("proportional", &[-40.0])]);
        let claims = vec![
            bound("return", "mpg", true, 100.0),
            beats("mpg", "td3", "return"),
            beats("mpg", "proportional", "error_m"),
        ];
        let decided = decided(&records, claims);
        (decided.iter().map(|claim| claim.0).collect::<Vec<_>>(), decided[1].1.contains("exploratory"))
    };
    assert_eq!(claims(4), (vec![false; 3], false));
    assert_eq!(claims(5), (vec![true, false, false], true));
    assert_eq!(claims(9), (vec![true, false, false], true));
    assert_eq!(claims(10), (vec![true; 3], false));
}

#[test]
fn beating_has_a_direction() {
    let records = study(&[("mpg", &AHEAD), ("td3", &TEN), ("oracle", &[-1.0]), ("proportional", &[-5.0])]);
    let claims = vec![
        beats("mpg", "td3", "error_m"),
        beats("td3", "mpg", "error_m"),
        beats("oracle", "td3", "return"),
        beats("oracle", "proportional", "error_m"),
        beats("proportional", "oracle", "return"),
        beats("mpg", "ddpg", "return"),
    ];
    let decided = decided(&records, claims);
    let holds: Vec<bool> = decided.iter().map(|claim| claim.0).collect();
    assert_eq!(holds, [true, false, true, true, false, false]);
    assert_eq!(decided[3].1, "oracle is ahead of proportional by 0.4 m on error");
    assert_eq!(decided[5].1, "return of ddpg was not measured under random");
}

#[test]
fn nothing_in_the_output_is_not_a_number() {
    let mut records = study(&[("mpg", &AHEAD), ("td3", &TEN), ("oracle", &[0.0])]);
    for (seed, bad) in (0..).zip([f64::NAN, f64::INFINITY, f64::MIN, f64::MAX]) {
        let mut held_out = evaluation(bad, bad);
        held_out.terms = vec![vec![bad]];
        add(&mut records, "mpg", seed, held_out);
    }
    add(&mut records, "td3", 0, Evaluation::default());
    add_failed(&mut records, "proportional", 0);
    let claims = vec![bound("return", "mpg", true, f64::INFINITY), beats("td3", "mpg", "return")];
    let timings = records.keys().map(|id| (id.clone(), Timing::default())).collect();
    let plan = plan(&["mpg", "td3"], &["oracle", "proportional"], claims);
    let summary = summarise(&plan, &records, &timings);
    assert!(!summary.protocols["random"]["mpg"].contains_key("error_over_oracle"), "the oracle has no error");
    // JSON writes what is not finite as null, and no number reads null.
    let read: Summary = serde_json::from_str(&serde_json::to_string(&summary).unwrap()).unwrap();
    assert_eq!(read, summary);
}

#[test]
fn a_study_that_failed_whole_still_has_a_summary() {
    let mut records = Records::new();
    (0..10).for_each(|seed| add_failed(&mut records, "mpg", seed));
    let plan = plan(&["mpg"], &["oracle"], vec![bound("return", "mpg", true, 0.0)]);
    let summary = summary(&plan, &records);
    assert_eq!((summary.failures.len(), summary.comparisons.len()), (10, 0));
    assert!(summary.protocols["random"].is_empty());
    assert!(!summary.expect[0].holds);
}

#[test]
fn speed_is_of_the_training_alone() {
    let mut records = study(&[("mpg", &TEN[..3])]);
    for record in records.values_mut() {
        record.training = Some(Training { updates: 2000, ..Training::default() });
    }
    let timing = |training_s| Timing { training_s, evaluation_s: 100.0 };
    let timings = [("mpg-000", 1.0), ("mpg-001", 0.0), ("mpg-002", 3.0)];
    let timings = timings.map(|(id, seconds)| (id.to_string(), timing(seconds))).into();
    let summary = summarise(&plan(&["mpg", "td3"], &[], vec![]), &records, &timings);
    let of_mpg = &summary.training["mpg"];
    assert_eq!((of_mpg.updates, of_mpg.updates_per_s_per_core), (4000, 1000.0));
    assert_eq!(of_mpg.seconds_per_seed, [1.0, 3.0]);
    assert!(!summary.training.contains_key("td3"));
}

#[test]
fn hits_are_told_where_there_is_something_to_hit() {
    let mut records = Records::new();
    (0..5).for_each(|seed| add(&mut records, "mpg", seed, evaluation(1.0, 0.5)));
    let mut plan = plan(&["mpg"], &[], vec![]);
    let metrics =
        |plan: &Plan| summarise(plan, &records, &BTreeMap::new()).protocols["random"]["mpg"].clone();
    assert!(!metrics(&plan).contains_key("hit_episodes"));
    let pillar = Group { size: 1, solid: Some(Solid::Disc { radius_m: 0.1 }), ..Group::default() };
    plan.world.groups.push(pillar);
    let metrics = metrics(&plan);
    assert_eq!((metrics["hit_episodes"].mean, metrics["late_hit_episodes"].mean), (1.0, 0.5));
}
