use mpgx_random::{Address, Purpose, Stream};

use super::*;

const WHEELS: Wheels = Wheels { slip: 0.05, bias: 0.01 };

fn stream(episode: u32) -> Stream {
    let purpose = Purpose::Odometry;
    Address { master: 7, purpose, protocol: 0, part: 0, seed: 0, episode, step: 0 }.stream()
}

/// Of a random walk with variance q a step, told with variance r: before an answer the variance is
/// (q + √(q² + 4 q r)) / 2, after it that times r / (that + r). Of what stands still, r / n after n answers.
#[test]
fn variances_are_those_of_closed_forms() {
    let (slip, counted, r) = (0.5, 0.2, 0.04);
    let mut filter = Filter::new([0.0; 3], [r; 3], Wheels { slip, bias: 0.0 }, false);
    for _ in 1..200 {
        filter.go([counted, 0.0, 0.0]);
        filter.correct([0.0; 3], [r; 3]);
    }
    let q = (slip * counted) * (slip * counted);
    let before = (q + (q * q + 4.0 * q * r).sqrt()) / 2.0;
    let after = before * r / (before + r);
    assert!((filter.covariance[0][0] - after).abs() < 1e-12, "{:?}", filter.covariance);
    assert!((filter.covariance[1][1] - r / 200.0).abs() < 1e-12, "{:?}", filter.covariance);
}

/// Through a gate of standard deviations √16.3, an answer of 100 of them counts as one on the gate.
#[test]
fn an_answer_beyond_the_gate_counts_as_one_on_it() {
    let exact = Wheels { slip: 0.0, bias: 0.0 };
    let mut filter = Filter::new([0.0; 3], [1.0; 3], exact, true);
    filter.correct([100.0, 0.0, 0.0], [1.0; 3]);
    let whole = 50.0;
    let weight = GATES[1] / (100.0 * 100.0 / 2.0);
    assert!((filter.pose()[0] - weight * whole).abs() < 1e-12);
    assert!((filter.covariance[0][0] - (1.0 - weight / 2.0)).abs() < 1e-12);
}

/// Who was carried away is believed again once it says so for long enough.
#[test]
fn no_answer_is_dropped_for_good() {
    let mut filter = Filter::new([0.0; 3], [1e-4; 3], WHEELS, true);
    let mut steps = 0;
    while filter.pose()[0] < 0.9 {
        filter.go([0.05, 0.0, 0.01]);
        filter.go([-0.05, 0.0, -0.01]);
        filter.correct([1.0, 0.0, 0.0], [1e-4; 3]);
        steps += 1;
        assert!(steps < 1000, "{:?}", filter.pose());
    }
    assert!(steps > 10, "{steps}");
}

#[test]
fn headings_meet_where_they_wrap() {
    let pi = std::f64::consts::PI;
    let mut filter = Filter::new([0.0, 0.0, pi - 0.1], [0.01; 3], WHEELS, true);
    filter.correct([0.0, 0.0, 0.1 - pi], [0.01; 3]);
    assert!((filter.pose()[2].abs() - pi).abs() < 1e-12, "{:?}", filter.pose());
    filter.go([0.0, 0.0, 0.3]);
    assert!((filter.pose()[2] - (0.3 - pi)).abs() < 1e-12, "{:?}", filter.pose());
}

/// A quarter of a circle of radius 1 m has a chord of √2 m in the middle of its turn.
#[test]
fn a_way_that_is_counted_rightly_leads_where_the_robot_is() {
    let quarter = std::f64::consts::FRAC_PI_2;
    let [ahead, left, turn] = way([1.0, 0.0, quarter], [0.0, 1.0, 2.0 * quarter]);
    assert!((ahead - 2.0_f64.sqrt()).abs() < 1e-12 && left.abs() < 1e-12 && turn == quarter);
    let exact = Wheels { slip: 0.0, bias: 0.0 };
    let mut truth = [0.3, -0.2, 3.0];
    let mut filter = Filter::new(truth, [0.0; 3], exact, true);
    let mut stream = stream(0);
    let odometer = Odometer::new(exact, &mut stream);
    for _ in 0..100 {
        let next = std::array::from_fn(|k| truth[k] + 0.3 * stream.normal());
        filter.go(odometer.count(way(truth, next), &mut stream));
        filter.correct([9.0; 3], [1.0; 3]);
        truth = next;
        let pose = filter.pose();
        assert!((0..2).all(|k| (pose[k] - truth[k]).abs() < 1e-9), "{pose:?} {truth:?}");
        assert!(wrapped(pose[2] - truth[2]).abs() < 1e-9, "{pose:?} {truth:?}");
    }
}

/// Errors of the filter's poses after each step of a drive of a robot with or without a heading, those of the answers, and
/// the filter then.
fn drive(
    wheels: Wheels,
    deviation: [f64; 3],
    has_heading: bool,
    episode: u32,
) -> Vec<([f64; 3], [f64; 3], Filter)> {
    let mut stream = stream(episode);
    let variance = deviation.map(|deviation| deviation * deviation);
    let tell = |truth: [f64; 3], stream: &mut Stream| {
        std::array::from_fn(|k| truth[k] + deviation[k] * stream.normal())
    };
    let error = |pose: [f64; 3], truth: [f64; 3]| {
        [pose[0] - truth[0], pose[1] - truth[1], wrapped(pose[2] - truth[2])]
    };
    let odometer = Odometer::new(wheels, &mut stream);
    let mut truth = [0.0; 3];
    let mut filter = Filter::new(tell(truth, &mut stream), variance, wheels, has_heading);
    let (mut speed, mut turn) = (0.0, 0.0);
    let step = |_| {
        speed = 0.9 * speed + 0.02 * stream.normal();
        turn = 0.9 * turn + if has_heading { 0.05 * stream.normal() } else { 0.0 };
        let aside = if has_heading { 0.0 } else { 0.02 * stream.normal() };
        let (sin, cos) = libm::sincos(truth[2] + turn / 2.0);
        let next = [
            truth[0] + speed * cos - aside * sin,
            truth[1] + speed * sin + aside * cos,
            wrapped(truth[2] + turn),
        ];
        filter.go(odometer.count(way(truth, next), &mut stream));
        truth = next;
        let answer = tell(truth, &mut stream);
        filter.correct(answer, variance);
        (error(filter.pose(), truth), error(answer, truth), filter.clone())
    };
    (0..100).map(step).collect()
}

/// Σ e C⁻¹ e over the first components of an error, by elimination.
fn squared_distance(filter: &Filter, error: [f64; 3], components: usize) -> f64 {
    let (mut c, mut e, mut sum) = (filter.covariance, error, 0.0);
    for k in 0..components {
        sum += e[k] * e[k] / c[k][k];
        for row in k + 1..components {
            let share = c[row][k] / c[k][k];
            e[row] -= share * e[k];
            let above = c[k];
            c[row].iter_mut().zip(above).for_each(|(value, above)| *value -= share * above);
        }
    }
    sum
}

/// The mean of the squared distance is the number of components if the covariance is that of the errors.
#[test]
fn the_filter_is_as_wrong_as_it_takes_itself_to_be() {
    for (wheels, deviation, has_heading) in [
        (WHEELS, [0.05, 0.05, 0.03], true),
        (Wheels { slip: 0.3, bias: 0.0 }, [0.02, 0.1, 0.1], true),
        (Wheels { slip: 0.02, bias: 0.1 }, [0.05, 0.05, 0.03], true),
        (WHEELS, [0.05, 0.1, 0.0], false),
    ] {
        let components = if has_heading { 3 } else { 2 };
        let drives = (0..400).flat_map(|episode| drive(wheels, deviation, has_heading, episode));
        let distances: Vec<f64> =
            drives.map(|(error, _, filter)| squared_distance(&filter, error, components)).collect();
        let mean = distances.iter().sum::<f64>() / distances.len() as f64;
        assert!((mean / components as f64 - 1.0).abs() < 0.1, "{wheels:?}: {mean}");
    }
}

#[test]
fn who_counts_its_way_is_less_wrong_than_who_does_not() {
    for slip in [0.0, 0.05, 0.2] {
        for deviation in [[0.05, 0.05, 0.03], [0.005, 0.005, 0.2]] {
            let wheels = Wheels { slip, bias: 0.02 };
            let drives: Vec<_> =
                (0..30).flat_map(|episode| drive(wheels, deviation, true, episode)).collect();
            for k in 0..3 {
                let joined: f64 = drives.iter().map(|(error, ..)| error[k] * error[k]).sum();
                let told: f64 = drives.iter().map(|(_, error, _)| error[k] * error[k]).sum();
                assert!(joined < told, "{wheels:?} {deviation:?} {k}: {joined} {told}");
            }
        }
    }
}
