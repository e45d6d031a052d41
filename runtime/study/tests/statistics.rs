//! The statistics against rliable, SciPy, statsmodels and NumPy (`fixtures/make_statistics.py`), to 1e-12.

use mpgx_study::statistics::*;
use serde::Deserialize;

#[derive(Deserialize)]
struct Case {
    case: String,
    of: String,
    #[serde(default)]
    x: Vec<f64>,
    #[serde(default)]
    y: Vec<f64>,
    #[serde(default)]
    confidence: f64,
    #[serde(default)]
    share: f64,
    #[serde(default)]
    q: f64,
    #[serde(default)]
    thresholds: Vec<f64>,
    #[serde(default)]
    expected: f64,
    #[serde(default)]
    t: f64,
    #[serde(default)]
    df: f64,
    value: Vec<f64>,
}

fn ends(interval: Option<Interval>) -> Vec<f64> {
    interval.map_or(vec![], |ends| vec![ends.lo, ends.hi])
}

fn parts(test: Option<TTest>) -> Vec<f64> {
    test.map_or(vec![], |test| vec![test.statistic, test.df, test.p])
}

fn ours(case: &Case) -> Vec<f64> {
    let Case { x, y, confidence, .. } = case;
    match case.case.as_str() {
        "mean" => vec![mean(x)],
        "variance" => vec![variance(x)],
        "iqm" => vec![iqm(x)],
        "quantile" => {
            let mut sorted = x.clone();
            sorted.sort_by(f64::total_cmp);
            quantile(&sorted, case.q).into_iter().collect()
        }
        "profile" => performance_profile(x, &case.thresholds),
        "profile band" => {
            let band = profile_band(x, &case.thresholds, *confidence).unwrap_or_default();
            band.into_iter().flat_map(|interval| ends(Some(interval))).collect()
        }
        "tolerance" => {
            tolerance(x, case.share, *confidence).map_or(vec![], |it| vec![it.lo, it.hi, it.share])
        }
        "bootstrap iqm" => ends(bootstrap(x, *confidence, iqm)),
        "bootstrap mean" => ends(bootstrap(x, *confidence, mean)),
        "t interval" => ends(t_interval(x, *confidence)),
        "t test" => parts(t_test(x, case.expected)),
        "improvement" => vec![probability_of_improvement(x, y)],
        "bootstrap improvement" => ends(bootstrap_two(x, y, *confidence, probability_of_improvement)),
        "welch" => parts(welch_test(x, y)),
        "paired difference" => {
            let differences: Vec<f64> = x.iter().zip(y).map(|(a, b)| a - b).collect();
            ends(bootstrap(&differences, *confidence, mean))
        }
        "two-sided p" => vec![two_sided_p(case.t, case.df)],
        "critical value" => vec![critical_value(*confidence, case.df)],
        "holm" => holm(x),
        other => panic!("no such case: {other}"),
    }
}

#[test]
fn every_function_agrees_with_the_references() {
    let cases: Vec<Case> = serde_json::from_str(include_str!("fixtures/statistics.json")).unwrap();
    assert!(cases.len() >= 200, "{}", cases.len());
    let mut wrong = Vec::new();
    for case in &cases {
        let ours = ours(case);
        let close = |(ours, theirs): (&f64, &f64)| (ours - theirs).abs() <= 1e-12 * theirs.abs().max(1e-300);
        if ours.len() != case.value.len() || !ours.iter().zip(&case.value).all(close) {
            wrong.push(format!("{} of {}: {ours:?}, not {:?}", case.case, case.of, case.value));
        }
    }
    assert!(wrong.is_empty(), "{} of {}:\n{}", wrong.len(), cases.len(), wrong.join("\n"));
}

#[test]
fn what_has_no_answer_gives_none() {
    assert_eq!(bootstrap(&[], 0.95, mean), None);
    assert_eq!(bootstrap(&[1.0, 2.0], 1.0, mean), None);
    assert_eq!(bootstrap(&[1.0, 2.0], f64::NAN, mean), None);
    assert_eq!(bootstrap(&[1.0, f64::NAN], 0.95, mean), None);
    assert_eq!(bootstrap(&[1e308, f64::INFINITY], 0.95, mean), None);
    assert_eq!(bootstrap(&[1.0, 2.0], 0.95, |x| if x[0] > 1.0 { f64::INFINITY } else { 1.0 }), None);
    assert_eq!(bootstrap_two(&[1.0], &[], 0.95, probability_of_improvement), None);
    assert_eq!(profile_band(&[], &[0.0], 0.95), None);
    assert_eq!(profile_band(&[1.0], &[0.0], 0.0), None);
    assert_eq!(tolerance(&[1.0, f64::NAN], 0.9, 0.95), None);
    assert_eq!(tolerance(&[1.0, 2.0], 1.0, 0.95), None);
    assert_eq!(tolerance(&[1.0, 2.0], 0.9, 0.0), None);
    assert_eq!(t_interval(&[1.0], 0.95), None);
    assert_eq!(t_interval(&[1.0, 2.0], 0.0), None);
    assert_eq!(t_test(&[1.0], 0.0), None);
    assert_eq!(welch_test(&[1.0, 2.0], &[1.0]), None);
    for (confidence, df) in [(0.95, 0.0), (0.95, -1.0), (0.95, f64::NAN), (0.0, 9.0), (f64::NAN, 9.0)] {
        assert!(critical_value(confidence, df).is_nan());
    }
    assert_eq!(quantile(&[], 0.5), None);
    assert!(mean(&[]).is_nan() && iqm(&[]).is_nan() && variance(&[1.0]).is_nan());
    assert!(holm(&[]).is_empty());
}

#[test]
fn samples_without_spread_are_decided() {
    let equal = [0.1; 10];
    assert_eq!(t_interval(&equal, 0.95), Some(Interval { lo: 0.1, hi: 0.1 }));
    assert_eq!(bootstrap(&equal, 0.95, iqm), Some(Interval { lo: 0.1, hi: 0.1 }));
    assert_eq!(welch_test(&equal, &[0.1, 0.1]), Some(TTest { statistic: 0.0, df: 10.0, p: 1.0 }));
    assert_eq!(
        welch_test(&equal, &[0.2, 0.2]),
        Some(TTest { statistic: f64::NEG_INFINITY, df: 10.0, p: 0.0 })
    );
}

/// Every summary stands on these bits; a change of them is a new `numerics_version`.
#[test]
fn bits_are_fixed() {
    let x = [-1.1, -1.2, -1.15, -1.3, -1.22, -1.18, -1.25, -1.17, -1.21, -0.9];
    let values = [critical_value(0.95, 9.0), two_sided_p(2.3, 14.7)];
    assert_eq!(values.map(f64::to_bits), [4612276343877733156, 4585427541848582291]);
    let intervals = [ends(bootstrap(&x, 0.95, iqm)), ends(t_interval(&x, 0.95))].concat();
    assert_eq!(
        intervals.iter().map(|end| end.to_bits()).collect::<Vec<_>>(),
        [13831567953220936051, 13831064863612561872, 13831661617195427109, 13830960503588955809]
    );
}
