//! The compiler's bounds against sampling: whatever agents do, no term, reward, return or place is outside of them.
//! `MPGX_STATES=10000000` looks at more states.
#![allow(clippy::unwrap_used)]

mod worlds;

use mpgx_lang::analyse::bounds::{Bounds, bounds};
use mpgx_lang::analyse::interval::Interval;
use mpgx_lang::analyse::scene::{Mode, Scene};
use mpgx_lang::plan::{Plan, World};
use mpgx_random::{Address, Purpose, Stream};
use mpgx_sim::{EpisodeKey, Task};
use mpgx_tests::{compiled, golden, root, scenarios_in};

fn stream(part: u16, step: u64) -> Stream {
    let purpose = Purpose::Bootstrap;
    Address { master: 3, purpose, protocol: 0, part, seed: 0, episode: 0, step }.stream()
}

fn states() -> usize {
    std::env::var("MPGX_STATES").ok().and_then(|text| text.parse().ok()).unwrap_or(1_000_000)
}

/// Runs episodes with random commands, and gives the number of states that were seen.
fn sampled(plan: &Plan, world: &World, states: usize, random: &mut Stream) -> usize {
    let mut seen = 0;
    for (mode, kind) in
        [(Mode::Training, mpgx_sim::Mode::Train), (Mode::Evaluation, mpgx_sim::Mode::Evaluate)]
    {
        let scene = Scene::new(plan, world, mode);
        let bounds = bounds(&scene);
        let task = Task::new(plan, world).unwrap_or_else(|error| panic!("{error}\n{}", plan.to_ron()));
        let mut episode = task.episode();
        let mut number = 0;
        // Of a hundred agents or more one state is as much as many.
        let enough = seen + states / 2 * 100 / task.agents().max(100);
        while seen < enough {
            let key = EpisodeKey { episode: number, ..EpisodeKey::default() };
            number += 1;
            if task.reset(&mut episode, key).is_err() {
                break;
            }
            // Some run straight, some shake, some rest.
            let (shake, bias) = (random.uniform(), random.uniform() * 6.0 - 3.0);
            let mut total = 0.0;
            loop {
                let command = |random: &mut Stream| (bias + shake * random.normal()) as f32;
                let action: Vec<f32> = (0..task.action_len()).map(|_| command(random)).collect();
                let step = task.step(&mut episode, &action, kind);
                seen += 1;
                total += step.reward;
                held(plan, &scene, &bounds, &episode, step.reward);
                if step.fault.is_some() || total.is_nan() {
                    break;
                }
                if step.last || (mode == Mode::Training && step.ended.is_some()) {
                    assert!(bounds.total.contains(total), "return {total} not in {:?}", bounds.total);
                    break;
                }
            }
        }
    }
    seen
}

fn held(plan: &Plan, scene: &Scene, bounds: &Bounds, episode: &mpgx_sim::Episode, reward: f64) {
    let inside = |what: &str, value: f64, bounds: Interval| {
        assert!(
            value.is_nan() || bounds.contains(value),
            "{what} is {value}, not in {bounds:?}\n{}",
            plan.to_ron()
        );
    };
    for ((term, value), bounds) in scene.world.reward.iter().zip(episode.terms()).zip(&bounds.terms) {
        inside(&term.name, *value, *bounds);
    }
    inside("the reward", reward, bounds.reward);
    for agent in 0..scene.world.agents() {
        let [x, y] = episode.position(agent);
        let known = scene.groups[scene.group_of(agent).unwrap()].position;
        inside("x", x, known.x);
        inside("y", y, known.y);
    }
}

#[test]
fn no_state_of_a_scenario_is_outside_its_bounds() {
    let mut files = scenarios_in(&root().join("scenarios"));
    files.extend(scenarios_in(&golden::folder("plan")));
    let plans: Vec<Plan> = files.iter().map(|path| compiled(path).plan.unwrap()).collect();
    let mut random = stream(0, 0);
    for plan in &plans {
        let worlds: Vec<&World> = std::iter::once(&plan.world)
            .chain(plan.protocols.iter().filter_map(|protocol| protocol.world.as_deref()))
            .collect();
        let share = states() / 4 / plans.len() / worlds.len();
        for world in worlds {
            sampled(plan, world, share, &mut random);
        }
    }
}

#[test]
fn no_state_of_a_random_world_is_outside_its_bounds() {
    let (wanted, each) = (states() * 3 / 4, 600);
    let (mut seen, mut finite, mut terms) = (0, 0, 0);
    for k in 0.. {
        if seen >= wanted {
            break;
        }
        let mut random = stream(1, k);
        let plan = worlds::random(&mut random);
        let scene = Scene::new(&plan, &plan.world, Mode::Training);
        let known = bounds(&scene).terms;
        terms += known.len();
        finite += known.iter().filter(|bounds| bounds.is_finite()).count();
        seen += sampled(&plan, &plan.world, each, &mut random).max(1);
    }
    assert!(2 * finite > terms, "bounds that are infinite prove nothing: {finite} of {terms}");
}
