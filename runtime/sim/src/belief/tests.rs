use mpgx_lang::plan::*;

use crate::episode::{Episode, EpisodeKey};
use crate::sample;
use crate::step::Mode;
use crate::task::Task;

const KEY: EpisodeKey = EpisodeKey { master: 3, protocol: 1, seed: 0, episode: 4 };
const ACTION: [f32; 6] = [0.4, -0.3, 1.0, 0.2, -0.6, 0.5];

fn began(world: World) -> (Task, Episode) {
    let task = sample::task(world);
    let mut episode = task.episode();
    task.reset(&mut episode, KEY).unwrap();
    (task, episode)
}

fn state(task: &Task, episode: &Episode) -> Vec<f32> {
    let mut state = vec![f32::NAN; task.state_len()];
    task.observe(episode, &mut state);
    state
}

fn late(delay: usize) -> World {
    let mut world = sample::unison(sample::unicycle());
    world.observe[0].delay = delay;
    world
}

/// To the last bits: the hand is taken off and put on again.
#[test]
fn who_is_told_the_truth_sees_and_does_what_it_did() {
    for (body, delay) in [(sample::unicycle(), 0), (sample::unicycle(), 3), (sample::steered(), 0)] {
        let mut world = sample::unison(body);
        world.observe[0].delay = delay;
        let (task, mut believing) = began(world);
        let (mut knowing, mut belief) = (believing.clone(), task.episode());
        for _ in 0..12 {
            let told = [1, 2, 3].map(|agent| (agent, task.stand(&believing, agent)));
            task.believe(&mut belief, &believing, &told);
            let pairs = state(&task, &belief).into_iter().zip(state(&task, &knowing));
            pairs.into_iter().for_each(|(a, b)| assert!((a - b).abs() < 1e-6, "{a} {b}"));
            let told = task.step_believing(&mut believing, &belief, &ACTION, Mode::Evaluate);
            assert_eq!(told, task.step(&mut knowing, &ACTION, Mode::Evaluate));
        }
        assert_eq!(believing, knowing);
    }
}

/// The axle stands `hand` behind the position, so a robot that is told another place is told it of its hand as well.
#[test]
fn who_is_told_another_place_sees_from_there_now_and_later() {
    let (task, mut episode) = began(late(2));
    let mut belief = task.episode();
    let mut wrong = Vec::new();
    for step in 0..6 {
        let told = [1, 2, 3].map(|agent| {
            let [x, y, heading] = task.stand(&episode, agent);
            (agent, [x + 0.1 * f64::from(step), y - 0.5, heading])
        });
        task.believe(&mut belief, &episode, &told);
        let pairs = state(&task, &belief).into_iter().zip(state(&task, &episode));
        wrong.push(pairs.map(|(believed, true_)| believed - true_).collect::<Vec<f32>>());
        task.step_believing(&mut episode, &belief, &ACTION, Mode::Evaluate);
    }
    for (step, wrong) in wrong.iter().enumerate() {
        let then = step.saturating_sub(2) as f32;
        for way in wrong.chunks(2) {
            assert!((way[0] + 0.1 * then).abs() < 1e-5 && (way[1] - 0.5).abs() < 1e-5, "{step}: {way:?}");
        }
    }
}

/// A quarter turn too far to the left: what is meant for the left is driven ahead.
#[test]
fn who_is_wrong_about_its_heading_drives_off_by_as_much() {
    let (task, start) = began(late(0));
    let turned = [1, 2, 3].map(|agent| {
        let [x, y, heading] = task.stand(&start, agent);
        (agent, [x, y, heading + std::f64::consts::FRAC_PI_2])
    });
    let mut belief = task.episode();
    task.believe(&mut belief, &start, &turned);
    let (mut wrong, mut right) = (start.clone(), start);
    let meant = [0.0, 0.5, 0.0, 0.5, 0.0, 0.5];
    task.step_believing(&mut wrong, &belief, &meant, Mode::Evaluate);
    task.step(&mut right, &[0.5, 0.0, 0.5, 0.0, 0.5, 0.0], Mode::Evaluate);
    for agent in 1..4 {
        let (a, b) = (wrong.position(agent), right.position(agent));
        assert!((a[0] - b[0]).abs() < 1e-12 && (a[1] - b[1]).abs() < 1e-12, "{a:?} {b:?}");
    }
}
