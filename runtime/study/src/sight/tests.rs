use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use mpgx_lang::plan::*;
use mpgx_vision::Image;

use super::*;
use crate::evaluation::{Driver, evaluate};
use crate::record::Evaluation;
use crate::tests::sample;

const KEY: EpisodeKey = EpisodeKey { master: 0, protocol: 1, seed: 0, episode: 0 };

/// The sample's follower is told its pose.
fn plan() -> Plan {
    let mut plan = sample::plan();
    plan.world.localised = vec![Localised { group: 1, via: 0, odometry: false, at: Place::default() }];
    plan
}

/// A follower with a camera in an empty room.
pub fn seeing() -> Plan {
    let named = |name: &str, settings: &[(&str, f64)]| Extern {
        name: name.into(),
        settings: settings.iter().map(|(name, value)| ((*name).into(), Setting::Number(*value))).collect(),
    };
    let mut plan = plan();
    let room =
        [("width", 6.0), ("depth", 5.0), ("height", 3.0), ("people", 0.0), ("furniture", 0.0), ("look", 1.0)];
    plan.world.scenery =
        Some(Scenery { room: named("indoor", &room), lighting: None, landmarks: Vec::new() });
    let camera = [
        ("height", 0.4),
        ("tilt", 0.0),
        ("field", 1.2),
        ("pixels", 8.0),
        ("exposure", 0.0),
        ("samples", 1.0),
        ("auto_exposure", 0.0),
        ("shot_noise", 0.0),
        ("read_noise", 0.0),
    ];
    plan.world.groups[1].camera = Some(named("pinhole", &camera));
    plan
}

fn by(plan: &Plan, controller: &str, tellers: &[Teller], episodes: usize) -> Evaluation {
    let task = Task::new(plan, &plan.world).unwrap();
    let sight = Sight::new(plan, &plan.world, tellers).unwrap();
    let settings = [("gain".to_owned(), Setting::Number(5.0))];
    let settings = if controller == "oracle" { Default::default() } else { settings.into() };
    let what = Extern { name: controller.into(), settings };
    match evaluate(&task, sight.as_ref(), &mut Driver::Controller(&what), KEY, episodes, || false) {
        Ok(evaluation) => evaluation,
        Err(_) => panic!("it did not end"),
    }
}

fn noise(position_m: f64, heading_rad: f64) -> [Teller; 1] {
    [Teller::Noise(PoseNoise { position_m, heading_rad })]
}

#[test]
fn who_is_told_the_truth_does_what_who_knows_it_does() {
    let knowing = by(&sample::plan(), "proportional", &[], 5);
    let told = by(&plan(), "proportional", &noise(0.0, 0.0), 5);
    assert_eq!((&told.returns, &told.trajectories), (&knowing.returns, &knowing.trajectories));
    let Told { agents, position_error_m, heading_error_rad, poses } = told.told.unwrap();
    assert_eq!((agents, knowing.told), (vec![1], None));
    assert_eq!((position_error_m, heading_error_rad), (vec![0.0; 5], vec![0.0; 5]));
    // Of each recorded episode all frames but the last.
    for (poses, trajectory) in poses.iter().zip(&knowing.trajectories) {
        let truth: Vec<[f32; 3]> = trajectory.agents.iter().skip(1).step_by(2).take(7).copied().collect();
        assert_eq!(poses, &truth);
    }
}

#[test]
fn evaluations_that_differ_by_who_is_told_alone_have_the_same_episodes() {
    let mut all = sample::plan();
    let told = World { localised: plan().world.localised, ..all.world.clone() };
    let longer = World { horizon: all.world.horizon + 1, ..all.world.clone() };
    let protocol = all.protocols[0].clone();
    let worlds = [None, Some(told), Some(longer)];
    all.protocols = worlds.map(|world| Protocol { world: world.map(Box::new), ..protocol.clone() }).into();
    assert_eq!([0, 1, 2].map(|number| crate::worlds::episodes_of(&all, number)), [1, 1, 3]);
}

/// A distance with a normal deviation of s on each axis has a mean of s √(π/2).
#[test]
fn noise_is_as_large_as_it_is_said_to_be_and_costs() {
    let knowing = by(&sample::plan(), "proportional", &[], 200);
    let blurred = by(&plan(), "proportional", &noise(0.05, 0.0), 200);
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let told = blurred.told.as_ref().unwrap();
    let wanted = 0.05 * (std::f64::consts::PI / 2.0).sqrt();
    assert!((mean(&told.position_error_m) / wanted - 1.0).abs() < 0.05, "{}", mean(&told.position_error_m));
    assert!(mean(&blurred.error_m) > mean(&knowing.error_m));
    assert_eq!(by(&plan(), "proportional", &noise(0.05, 0.0), 3).returns, blurred.returns[..3]);
}

/// With a follower that counts its way, and may join it to what it is told.
fn counting(mut plan: Plan, joined: bool) -> Plan {
    let settings = [("slip", 0.05), ("bias", 0.01)];
    let settings = settings.map(|(name, value)| (name.to_owned(), Setting::Number(value)));
    plan.world.groups[1].odometry = Some(Extern { name: "wheels".into(), settings: settings.into() });
    plan.world.localised[0].odometry = joined;
    plan
}

/// Who counts its way and is not asked is told as without.
#[test]
fn what_is_told_is_joined_to_what_wheels_count_where_it_is_said() {
    let counting = |joined: bool| counting(plan(), joined);
    let noise = noise(0.05, 0.0);
    let (raw, joined) =
        (by(&plan(), "proportional", &noise, 100), by(&counting(true), "proportional", &noise, 100));
    assert_eq!(by(&counting(false), "proportional", &noise, 100), raw);
    let mean = |told: &Evaluation| told.told.as_ref().unwrap().position_error_m.iter().sum::<f64>() / 100.0;
    assert!(mean(&joined) < 0.7 * mean(&raw), "{} {}", mean(&joined), mean(&raw));
    let mut few = by(&counting(true), "proportional", &noise, 3);
    assert_eq!(few.returns, joined.returns[..3]);
    assert_eq!(few.told.take().unwrap().poses, joined.told.unwrap().poses);
}

/// Tells one place for sure and, every second time, another in doubt.
struct Doubtful {
    elsewhere_m: f64,
    times: AtomicUsize,
}

impl Eyes for Doubtful {
    fn fixes(&self, images: &[Image]) -> Result<Vec<Fix>, String> {
        let sure = self.times.fetch_add(1, Ordering::Relaxed).is_multiple_of(2);
        let (x, spread) = if sure { (0.3, 1.0) } else { (self.elsewhere_m, 1000.0) };
        Ok(vec![Fix { pose: [x, -0.2, 0.0], spread: [spread; 3] }; images.len()])
    }
}

/// Seen to fail when all answers have the same variance.
#[test]
fn what_is_told_in_doubt_counts_less() {
    let believed = |elsewhere_m: f64| {
        let eyes = Box::new(Doubtful { elsewhere_m, times: AtomicUsize::new(0) });
        let reliability = Reliability { mean_square: [0.01; 3], correlation: [0.5; 3] };
        let plan = counting(seeing(), true);
        by(&plan, "proportional", &[Teller::Eyes(eyes, reliability)], 1).told.unwrap().poses
    };
    let [left, right] = [-1.0, 1.0].map(|elsewhere_m| believed(elsewhere_m)[0].clone());
    for ([x, ..], [other_x, ..]) in left.iter().zip(&right) {
        assert!((x - other_x).abs() < 0.001, "{x} {other_x}");
    }
}

#[test]
fn the_oracle_is_not_misled() {
    let knowing = by(&sample::plan(), "oracle", &[], 5);
    assert_eq!(by(&plan(), "oracle", &noise(1.0, 0.0), 5), knowing);
}

/// Takes every picture to be from one place.
struct Stuck(&'static Mutex<Vec<Image>>);

impl Eyes for Stuck {
    fn fixes(&self, images: &[Image]) -> Result<Vec<Fix>, String> {
        self.0.lock().unwrap().extend_from_slice(images);
        Ok(vec![Fix { pose: [0.3, -0.2, 0.0], spread: [1.0; 3] }; images.len()])
    }
}

#[test]
fn each_picture_is_of_its_own_episode_and_step() {
    static SEEN: Mutex<Vec<Image>> = Mutex::new(Vec::new());
    let episodes = ROOMS_SIDE_BY_SIDE + 2;
    let evaluation = by(
        &seeing(),
        "proportional",
        &[Teller::Eyes(Box::new(Stuck(&SEEN)), Reliability::default())],
        episodes,
    );
    let seen = SEEN.lock().unwrap();
    assert_eq!(seen.len(), 7 * episodes);
    assert!(seen.iter().all(|image| (image.width, image.height) == (8, 8)));
    assert!((1..seen.len()).all(|k| seen[..k].iter().all(|other| other.rgb != seen[k].rgb)));
    let told = evaluation.told.unwrap();
    for (poses, trajectory) in told.poses.iter().zip(&evaluation.trajectories) {
        assert!(poses.iter().all(|pose| *pose == [0.3, -0.2, 0.0]));
        let away = trajectory.agents.iter().skip(1).step_by(2).take(7);
        let mean = away.map(|[x, y, _]| f64::from(x - 0.3).hypot(f64::from(y + 0.2))).sum::<f64>() / 7.0;
        assert!(told.position_error_m.iter().any(|error| (error - mean).abs() < 1e-6), "{mean}");
    }
}

struct Blind;

impl Eyes for Blind {
    fn fixes(&self, _: &[Image]) -> Result<Vec<Fix>, String> {
        Err("an estimate is not a number".into())
    }
}

#[test]
fn a_network_that_tells_nonsense_is_a_fault_of_the_cell() {
    let plan = seeing();
    let task = Task::new(&plan, &plan.world).unwrap();
    let tellers = [Teller::Eyes(Box::new(Blind), Reliability::default())];
    let sight = Sight::new(&plan, &plan.world, &tellers).unwrap();
    let what =
        Extern { name: "proportional".into(), settings: [("gain".to_owned(), Setting::Number(5.0))].into() };
    match evaluate(&task, sight.as_ref(), &mut Driver::Controller(&what), KEY, 1, || false) {
        Err(Halt::Fault(fault)) => assert_eq!(fault.cause, "no pose was told: an estimate is not a number"),
        _ => panic!("it went on"),
    }
}
