use mpgx_lang::plan::*;
use proptest::prelude::*;

use crate::episode::EpisodeKey;
use crate::maths::distance;
use crate::sample::{self, cases, group, position, task, vector};
use crate::step::Mode;
use crate::task::Task;

fn barrier(margin: f64, share: f64) -> Extern {
    let settings = [("margin", margin), ("share", share)];
    let settings = settings.map(|(name, value)| (name.to_string(), Setting::Number(value)));
    Extern { name: "barrier".into(), settings: settings.into() }
}

/// A resting leader at the origin, points that may not come nearer than 0.1 m to it and to each other.
fn world(followers: usize, margin: f64, share: f64) -> World {
    let mut world = sample::unison(sample::point());
    world.groups[0].control = sample::velocity(vector(0.0, 0.0));
    world.groups[0].speed_mps = (0.0, 0.0);
    world.groups[1].size = followers;
    world.groups[1].speed_mps = (-1.0, 1.0);
    world.groups[1].arena = None;
    world.groups[1].filter = Some(barrier(margin, share));
    world.groups[1].start = Some(vector(5.0, 5.0));
    world.observe[0].value = position(AgentRef::Var(0));
    world.formations.clear();
    world.reward.truncate(0);
    world.ends.clear();
    world.safety_m = 0.1;
    world.dt_s = 0.1;
    world
}

/// Where the first follower is after a step of `actions` from `places`.
fn stepped(task: &Task, places: &[[f64; 2]], actions: &[f32]) -> [f64; 2] {
    let mut episode = task.episode();
    task.reset(&mut episode, EpisodeKey::default()).unwrap();
    episode.agents.position[..places.len()].copy_from_slice(places);
    task.step(&mut episode, actions, Mode::Train);
    episode.position(1)
}

/// 0.15 m from the leader 0.05 m are left: at 1 m/s it would go 0.1 m. With half a share it gets 0.025 m, with a
/// margin of 2 cm 0.03 m.
#[test]
fn a_step_uses_up_a_share_of_the_clearance() {
    for (margin, share, left) in [(0.0, 1.0, 0.1), (0.0, 0.5, 0.125), (0.02, 1.0, 0.12)] {
        let task = task(world(1, margin, share));
        let end = stepped(&task, &[[0.0, 0.0], [0.15, 0.0]], &[-1.0, 0.25]);
        assert!(distance(end, [left, 0.025]) < 1e-9, "margin {margin}, share {share}: {end:?}");
        let free = stepped(&task, &[[0.0, 0.0], [0.5, 0.0]], &[-1.0, 0.25]);
        assert!(distance(free, [0.4, 0.025]) < 1e-12, "{free:?}");
    }
}

/// Two that meet share 0.08 m.
#[test]
fn two_with_the_filter_do_half_each() {
    let task = task(world(2, 0.0, 1.0));
    let end = stepped(&task, &[[9.0, 0.0], [0.0, 0.0], [0.18, 0.0]], &[1.0, 0.0, -1.0, 0.0]);
    assert!(distance(end, [0.04, 0.0]) < 1e-9, "{end:?}");
}

/// A leader that may come 0.04 m nearer in a step: so much is kept in hand.
#[test]
fn the_worst_is_assumed_of_others() {
    let mut world = world(1, 0.0, 1.0);
    world.groups[0].speed_mps = (-0.4, 0.4);
    let end = stepped(&task(world), &[[0.0, 0.0], [0.2, 0.0]], &[-1.0, 0.0]);
    assert!(distance(end, [0.14, 0.0]) < 1e-9, "{end:?}");
}

/// A disc of 0.2 m that comes at 0.3 m/s; the second step knows its velocity.
#[test]
fn obstacles_are_expected_to_go_on() {
    let mut world = world(1, 0.0, 1.0);
    let disc = group("disc", 1, sample::point(), sample::velocity(vector(0.3, 0.0)), Some(vector(2.0, 0.0)));
    world.groups.push(Group { solid: Some(Solid::Disc { radius_m: 0.2 }), speed_mps: (-1.0, 1.0), ..disc });
    let task = task(world);
    let mut episode = task.episode();
    task.reset(&mut episode, EpisodeKey::default()).unwrap();
    task.step(&mut episode, &[0.0; 2], Mode::Train);
    episode.agents.position = vec![[9.0, 9.0], [0.25, 0.0], [0.0, 0.0]];
    task.step(&mut episode, &[-1.0, 0.0], Mode::Train);
    assert!((episode.position(1)[0] - episode.position(2)[0] - 0.2).abs() < 1e-9, "{episode:?}");
}

#[test]
fn settings_out_of_range_are_refused() {
    let refused = |filter: Extern| {
        let mut world = world(1, 0.0, 1.0);
        world.groups[1].filter = Some(filter);
        Task::new(&sample::plan(world.clone()), &world).unwrap_err().to_string()
    };
    assert!(refused(barrier(0.0, 1.5)).contains("share"));
    assert!(refused(barrier(-1.0, 1.0)).contains("margin"));
    assert!(refused(Extern { name: "shield".into(), ..barrier(0.0, 1.0) }).contains("barrier"));
}

proptest! {
    #![proptest_config(cases(50))]

    /// Whatever five points are asked for 100 steps, no two that began apart come nearer than they may. That their
    /// barriers have a velocity in common is clear: none moves.
    #[test]
    fn points_never_collide(seed in 0u32..1000, actions in proptest::collection::vec(-1f32..1.0, 1000)) {
        let task = task(world(5, 0.0, 1.0));
        let mut episode = task.episode();
        task.reset(&mut episode, EpisodeKey { seed, ..EpisodeKey::default() }).unwrap();
        episode.agents.position =
            vec![[0.0, 0.0], [0.3, 0.0], [0.0, 0.3], [-0.3, 0.0], [0.0, -0.3], [0.3, 0.3]];
        for action in actions.chunks_exact(10) {
            let step = task.step(&mut episode, action, Mode::Train);
            for i in 0..6 {
                for j in 0..i {
                    let apart = distance(episode.position(i), episode.position(j));
                    prop_assert!(apart > 0.1 - 1e-7, "{i} and {j}: {apart} m");
                }
            }
            prop_assert!(step.fault.is_none());
        }
    }
}
