use mpgx_lang::plan::*;
use proptest::prelude::*;

use super::*;
use crate::episode::EpisodeKey;
use crate::maths::{Vec2, add, clamp_axes, distance, subtract};
use crate::sample::{self, vector};
use crate::step::Mode;
use mpgx_random::Purpose;

/// A controller as the standard library sets it.
fn made(name: &str, task: &Task) -> Box<dyn Controller> {
    set(name, task, &[])
}

/// The same with some settings changed.
fn set(name: &str, task: &Task, changes: &[(&str, Setting)]) -> Box<dyn Controller> {
    let settings: &[(&str, Setting)] = match name {
        "proportional" => &[("gain", Setting::Number(5.0))],
        "consensus" => &[("gain", Setting::Number(2.0)), ("feedforward", Setting::Truth(false))],
        "distance_gradient" => &[("gain", Setting::Number(5.0))],
        "potential_field" => &[
            ("attraction", Setting::Number(5.0)),
            ("repulsion", Setting::Number(1e-3)),
            ("reach", Setting::Number(0.3)),
        ],
        "predictive" => &[("ahead", Setting::Number(10.0)), ("margin", Setting::Number(0.03))],
        _ => &[],
    };
    let settings = settings.iter().chain(changes).map(|(name, value)| (name.to_string(), value.clone()));
    controller(&Extern { name: name.into(), settings: settings.collect() }, task).unwrap()
}

/// Three followers of a leader that moves at random, each begun within a metre of its slot.
fn chase(body: Extern, episode: u32) -> (Task, Episode) {
    let mut world = sample::unison(body);
    world.groups[0].control = sample::velocity(sample::noise());
    let task = sample::task(world);
    let mut begun = task.episode();
    task.reset(&mut begun, EpisodeKey { episode, ..EpisodeKey::default() }).unwrap();
    (task, begun)
}

/// Lets a controller take one step; gives the slots before it and after it.
fn stepped(name: &str, task: &Task, episode: &mut Episode) -> (Vec<Vec2>, Vec<Vec2>) {
    let before = episode.slots().to_vec();
    let mut action = vec![f32::NAN; task.action_len()];
    made(name, task).command(task, episode, &mut action);
    task.step(episode, &action, Mode::Evaluate);
    (before, episode.slots().to_vec())
}

#[test]
fn the_oracle_brings_each_point_to_its_old_slot_or_as_near_as_its_limits_allow() {
    let mut reached = 0;
    for k in 0..10 {
        let (task, mut episode) = chase(sample::point(), k);
        for _ in 0..20 {
            let from: Vec<Vec2> = (1..4).map(|agent| episode.position(agent)).collect();
            let (slots, _) = stepped("oracle", &task, &mut episode);
            for (agent, (from, slot)) in (1..4).zip(from.into_iter().zip(slots)) {
                let way = clamp_axes(subtract(slot, from), (-0.07, 0.07));
                assert!(distance(episode.position(agent), add(from, way)) < 1e-8);
                reached += usize::from(way == subtract(slot, from));
            }
        }
    }
    assert!((100..500).contains(&reached), "both cases are met: {reached} of 600");
}

#[test]
fn the_clairvoyant_leaves_no_error_within_its_reach() {
    for body in [sample::point(), sample::unicycle(), sample::steered()] {
        // A leader that a unicycle can follow sideways, too: 0.4 √2 m/s < 5 rad/s of 0.15 m.
        let (mut task, mut episode) = chase(body, 1);
        task.agents[0].speed_mps = (-0.4, 0.4);
        for _ in 0..60 {
            stepped("clairvoyant", &task, &mut episode);
        }
        let slots = stepped("clairvoyant", &task, &mut episode).1;
        for (agent, slot) in (1..4).zip(slots) {
            assert!(
                distance(episode.position(agent), slot) < 1e-4,
                "{:?}, {slot:?}",
                episode.position(agent)
            );
        }
    }
}

/// The slot lies behind to the right, and the wheels hardly turn. At the corner of the limits it runs backwards
/// fastest but turns left; the best command turns right and is slower. (Found on a grid of 401 by 401 commands.)
#[test]
fn the_oracle_finds_the_better_of_two_valleys() {
    let mut body = sample::unicycle();
    body.settings.insert("turn".into(), Setting::Range(-0.2, 0.2));
    body.settings.insert("rate".into(), Setting::Number(10.0));
    body.settings.insert("drive".into(), Setting::Range(-0.745_638, 0.745_638));
    let (task, mut episode) = chase(body, 0);
    episode.agents.position[0] = [0.0, 0.0];
    task.refresh_slots(&mut episode);
    let position = [-0.078_759_789_972, 0.533_389_718_873];
    episode.set_pose(2, crate::body::Pose { position, heading: 1.118_485_232_122 });
    let (slots, _) = stepped("oracle", &task, &mut episode);
    let miss = distance(episode.position(2), slots[1]);
    assert!(miss < 0.912_831 + 1e-4, "{miss} m; at the corner it is 0.913419 m");
}

#[test]
fn agents_steer_to_the_slot_of_their_own_formation() {
    let mut world = sample::unison(sample::point());
    world.groups.push(sample::group("pair", 2, sample::point(), Control::Learned, Some(vector(0.0, 0.0))));
    let constraint = sample::places(vec![vector(0.05, 0.0), vector(0.0, 0.05)]);
    world.formations.push(Formation { group: 2, constraint, ..world.formations[0].clone() });
    let task = sample::task(world);
    let mut episode = task.episode();
    task.reset(&mut episode, EpisodeKey::default()).unwrap();
    stepped("oracle", &task, &mut episode);
    assert!(distance(episode.position(4), [0.05, 0.0]) < 1e-8);
    assert!(distance(episode.position(5), [0.0, 0.05]) < 1e-8);
}

#[test]
fn the_proportional_controller_commands_gain_times_the_way() {
    let (task, mut episode) = chase(sample::point(), 2);
    // Ways to the slots: (0.1, −0.04), (1, −1), (0, 0) m; 5/s of them, clipped at 0.7 m/s.
    let ways = [[0.1, -0.04], [1.0, -1.0], [0.0, 0.0]];
    for (agent, way) in (1..4).zip(ways) {
        episode.agents.position[agent] = subtract(episode.slots()[agent - 1], way);
    }
    let mut action = [f32::NAN; 6];
    made("proportional", &task).command(&task, &episode, &mut action);
    for (found, velocity) in action.iter().zip([0.5, -0.2, 0.7, -0.7, 0.0, 0.0]) {
        assert!((found * 0.7 - velocity).abs() < 1e-6, "{action:?}");
    }
}

#[test]
fn unequal_and_fixed_limits_are_honoured() {
    let mut world = sample::unison(sample::point());
    world.groups[1].speed_mps = (0.1, 0.3);
    let task = sample::task(world.clone());
    let (low, high) = (task.agents[1].action(-9.0), task.agents[1].action(9.0));
    assert_eq!([low, task.agents[1].action(0.2), high], [-1.0, 0.0, 1.0]);
    world.groups[1].speed_mps = (0.3, 0.3);
    assert_eq!(sample::task(world).agents[1].action(0.3), 0.0);
}

#[test]
fn what_cannot_steer_is_refused() {
    let message = |name: &str, settings: &[(&str, Setting)], world: World| {
        let settings = settings.iter().map(|(name, value)| (name.to_string(), value.clone())).collect();
        match controller(&Extern { name: name.into(), settings }, &sample::task(world)) {
            Ok(_) => panic!("{name} was accepted"),
            Err(error) => error.to_string(),
        }
    };
    let unison = || sample::unison(sample::point());
    assert_eq!(
        message("orakel", &[], unison()),
        "there is no controller `orakel` in the simulator; it has oracle, clairvoyant, proportional, \
         consensus, distance_gradient, potential_field, predictive"
    );
    assert_eq!(
        message("oracle", &[("gain", Setting::Number(1.0))], unison()),
        "`oracle` has no setting `gain`; it reads nothing"
    );
    assert_eq!(
        message("proportional", &[], unison()),
        "`proportional` lacks the setting `gain`, a finite number, not negative"
    );
    assert_eq!(
        message("proportional", &[("gain", Setting::Number(-1.0))], unison()),
        "setting `gain` of `proportional` must be a finite number, not negative"
    );
    let mut free = unison();
    free.formations.clear();
    (free.observe, free.reward) = Default::default();
    free.groups[1].start = Some(vector(0.0, 0.0));
    assert_eq!(
        message("oracle", &[], free),
        "the controller `oracle` steers to slots, but follower[1] has no place in a formation (follower.scn:1:1)"
    );
}

#[test]
fn every_listed_name_is_implemented_and_reads_what_it_says() {
    for name in CONTROLLERS {
        let (task, _) = chase(sample::point(), 0);
        let read = controller_settings(name).unwrap();
        made(name, &task);
        assert_eq!(read.contains(&"margin"), *name == "predictive");
    }
    assert_eq!(controller_settings("nobody"), None);
}

mod laws;

proptest! {
    #![proptest_config(sample::cases(100))]

    /// The step of oracle A against 200 random commands, for unicycles that are well and badly able to obey.
    #[test]
    fn no_command_beats_the_oracle(episode: u32, drive in 0.1..1.0f64, turn in 0.2..6.0f64, rate in 10.0..200.0) {
        let mut body = sample::unicycle();
        body.settings.insert("drive".into(), Setting::Range(-drive, drive));
        body.settings.insert("turn".into(), Setting::Range(-turn, turn));
        body.settings.insert("rate".into(), Setting::Number(rate));
        let (task, mut episode) = chase(body, episode);
        let key = EpisodeKey::default();
        let mut choice = key.address(Purpose::Exploration, 0, 0).stream();
        for _ in 0..5 {
            let mut tried = episode.clone();
            let (slots, _) = stepped("oracle", &task, &mut episode);
            let poses = [1, 2, 3].map(|agent| tried.pose(agent));
            for _ in 0..200 {
                let action = [0; 6].map(|_| (2.0 * choice.uniform() - 1.0) as f32);
                for (agent, pose) in (1..4).zip(poses) {
                    tried.set_pose(agent, pose);
                }
                task.step(&mut tried, &action, Mode::Evaluate);
                for (agent, slot) in (1..4).zip(&slots) {
                    let (oracle, other) = (distance(episode.position(agent), *slot), distance(tried.position(agent), *slot));
                    prop_assert!(oracle <= other + 1e-4, "{oracle} m, but {other} m is possible");
                }
            }
        }
    }
}
