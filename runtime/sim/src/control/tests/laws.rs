//! The control laws against cases worked out by hand.

use std::f64::consts::{PI, TAU};

use super::*;
use crate::maths::{norm, rotate, scale};
use crate::sample::{number, vector};

/// A leader that stands at the origin and followers that keep the distances of a graph.
fn distances(followers: usize, graph: Graph, lengths: &[f64]) -> Task {
    let mut world = sample::unison(sample::point());
    (world.observe, world.reward) = Default::default();
    world.groups[1].size = followers;
    world.groups[1].start = Some(vector(1.0, 1.0));
    let lengths = lengths.iter().map(|&length| number(length)).collect();
    world.formations[0] =
        Formation { constraint: Constraint::Distances(lengths), graph, ..world.formations[0].clone() };
    sample::task(world)
}

fn begun(task: &Task, followers: &[Vec2]) -> Episode {
    let mut episode = task.episode();
    task.reset(&mut episode, EpisodeKey::default()).unwrap();
    for (k, place) in followers.iter().enumerate() {
        episode.agents.position[1 + k] = *place;
    }
    episode
}

/// The velocities that a controller commands, m/s.
fn commanded(controller: &mut dyn Controller, task: &Task, episode: &Episode) -> Vec<Vec2> {
    let mut action = vec![f32::NAN; task.action_len()];
    controller.command(task, episode, &mut action);
    action.chunks(2).map(|pair| [0.7 * f64::from(pair[0]), 0.7 * f64::from(pair[1])]).collect()
}

fn near(found: &[Vec2], expected: &[Vec2]) {
    let close = found.len() == expected.len()
        && found.iter().zip(expected).all(|(found, expected)| distance(*found, *expected) < 1e-6);
    assert!(close, "{found:?}, not {expected:?}");
}

/// Leader (0, 0), follower 1 at (0.5, 0), follower 2 at (0, 0.3), all distances 0.4 m, gain 5 /(m² s):
/// edge leader–1: (0.25 − 0.16) (0.5, 0) = (0.045, 0); leader–2: (0.09 − 0.16) (0, 0.3) = (0, −0.021);
/// edge 1–2: (0.34 − 0.16) (0.5, −0.3) = (0.09, −0.054).
#[test]
fn the_gradient_of_distances_is_that_worked_out_by_hand() {
    let task = distances(2, Graph::Complete, &[0.4]);
    let episode = begun(&task, &[[0.5, 0.0], [0.0, 0.3]]);
    let found = commanded(&mut *made("distance_gradient", &task), &task, &episode);
    near(&found, &[[-5.0 * (0.045 + 0.09), 5.0 * 0.054], [5.0 * 0.09, 5.0 * (0.021 - 0.054)]]);
}

/// From starts that are astray by up to half a side; the law is only locally stable.
#[test]
fn a_triangle_and_a_braced_square_converge_to_their_distances() {
    let diagonal = 0.4 * 2f64.sqrt();
    let braces = Graph::Edges(vec![(0, 1), (1, 2), (2, 3), (3, 0), (0, 2), (1, 3)]);
    let square = [0.4, 0.4, 0.4, 0.4, diagonal, diagonal];
    for (followers, graph, lengths, places) in [
        (2, Graph::Complete, &[0.4][..], &[[0.4, 0.0], [0.2, 0.346]][..]),
        (3, braces, &square, &[[0.4, 0.0], [0.4, 0.4], [0.0, 0.4]]),
    ] {
        let task = distances(followers, graph, lengths);
        for turn in 0..12 {
            let stray = |k: usize| rotate([0.15, 0.0], TAU * turn as f64 / 12.0 + k as f64);
            let starts: Vec<Vec2> = places.iter().enumerate().map(|(k, p)| add(*p, stray(k))).collect();
            let mut episode = begun(&task, &starts);
            let mut controller = made("distance_gradient", &task);
            let mut action = vec![0.0; task.action_len()];
            let mut error = f64::INFINITY;
            for _ in 0..300 {
                controller.command(&task, &episode, &mut action);
                error = task.step(&mut episode, &action, Mode::Evaluate).error_m;
            }
            assert!(error < 1e-5, "{error} m left");
        }
    }
}

#[test]
fn the_gradient_takes_places_by_their_distances() {
    let (task, episode) = chase(sample::point(), 0);
    let found = commanded(&mut *made("distance_gradient", &task), &task, &episode);
    for (k, side) in [0.4, 0.4 * 2f64.sqrt(), 0.4].into_iter().enumerate() {
        let way = subtract(episode.position(1 + k), episode.position(0));
        let expected = scale(way, -5.0 * (norm(way) * norm(way) - side * side));
        near(&found[k..=k], &[clamp_axes(expected, (-0.7, 0.7))]);
    }
}

/// Followers in a path from the leader on. The Laplacian without the leader, [[2, −1, 0], [−1, 2, −1], [0, −1, 1]],
/// has the eigenvalues 2 − 2 cos(π (2 k − 1) / 7); the error along the vector (sin(k π / 7)) of the least,
/// 0.198, decays by 1 − 0.198 · gain · dt in each step, and with it at e^(−0.198 · gain · t) as dt goes to 0.
#[test]
fn the_error_of_consensus_decays_with_the_eigenvalue_of_the_laplacian() {
    let mut world = sample::unison(sample::point());
    world.formations[0].graph = Graph::Path;
    world.dt_s = 0.01;
    let task = sample::task(world);
    let least = 2.0 - 2.0 * (PI / 7.0).cos();
    let stray = |k: usize| 0.1 * (PI * (k + 1) as f64 / 7.0).sin();
    let mut episode = begun(&task, &[]);
    let slots = episode.slots().to_vec();
    for (k, slot) in slots.iter().enumerate() {
        episode.agents.position[1 + k] = add(*slot, [stray(k), -stray(k)]);
    }
    let mut controller = made("consensus", &task);
    let mut action = vec![0.0; task.action_len()];
    for step in 1..=150 {
        controller.command(&task, &episode, &mut action);
        task.step(&mut episode, &action, Mode::Evaluate);
        let exact = (1.0 - least * 2.0 * 0.01f64).powi(step);
        assert!((exact / (-least * 2.0 * 0.01 * f64::from(step)).exp() - 1.0).abs() < 0.02);
        for (k, slot) in slots.iter().enumerate() {
            let left = subtract(episode.position(1 + k), *slot)[0];
            assert!((left / stray(k) - exact).abs() < 1e-4, "step {step}: {left}");
        }
    }
}

#[test]
fn consensus_goes_with_its_leader_if_told() {
    let mut world = sample::unison(sample::point());
    world.groups[0].control = sample::velocity(vector(0.3, 0.1));
    let task = sample::task(world);
    let mut episode = begun(&task, &[]);
    let feedforward = [("feedforward", Setting::Truth(true))];
    let mut controller = set("consensus", &task, &feedforward);
    let mut action = vec![0.0; task.action_len()];
    let mut error = 0.0;
    for _ in 0..80 {
        controller.command(&task, &episode, &mut action);
        error = task.step(&mut episode, &action, Mode::Evaluate).error_m;
    }
    assert!(error < 1e-4, "{error} m");
    let mut lagging = made("consensus", &task);
    for _ in 0..80 {
        lagging.command(&task, &episode, &mut action);
        error = task.step(&mut episode, &action, Mode::Evaluate).error_m;
    }
    // Steady: gain · error = speed, less the step that the leader is ahead.
    let expected = 0.1f64.sqrt() * 0.5;
    assert!((error - expected).abs() < 1e-3, "{error} m, not {expected} m");
}

#[test]
fn laws_refuse_what_they_cannot_steer_by() {
    let refusal = |name: &str, task: &Task| {
        let settings = [("gain".to_string(), Setting::Number(1.0))].into_iter();
        let settings = match name {
            "consensus" => settings.chain([("feedforward".to_string(), Setting::Truth(false))]).collect(),
            _ => settings.collect(),
        };
        controller(&Extern { name: name.into(), settings }, task).err().unwrap().to_string()
    };
    assert_eq!(
        refusal("consensus", &distances(2, Graph::Complete, &[0.4])),
        "the controller `consensus` steers to slots, but follower[1] has no place in a formation (follower.scn:1:1)"
    );
    assert_eq!(
        refusal("distance_gradient", &distances(3, Graph::Edges(vec![(0, 1), (1, 3)]), &[0.4])),
        "the controller `distance_gradient` steers by neighbours, but follower[2] has none in a formation \
         (follower.scn:1:1)"
    );
}

/// One follower of a leader at the origin, with `obstacles`.
fn regulation(body: Extern, obstacles: &[(Solid, Vec2)]) -> World {
    let mut world = sample::unison(body);
    (world.observe, world.reward) = Default::default();
    world.groups[1].size = 1;
    world.formations[0].constraint = sample::places(vec![vector(0.0, 0.0)]);
    for (k, (solid, [x, y])) in obstacles.iter().enumerate() {
        let place = Some(vector(*x, *y));
        let mut group = sample::group(&format!("obstacle{k}"), 1, sample::point(), Control::Still, place);
        group.solid = Some(solid.clone());
        world.groups.push(group);
    }
    world
}

/// Follower at (0.3, 0.4), a disc of radius 0.1 m at (0.3, 0.2): clearance 0.1 m straight down; reach 0.3 m.
/// 1e-3 (1/0.1 − 1/0.3) / 0.01 = 2/3 m/s upwards; attraction 0.5 · (−0.3, −0.4).
#[test]
fn the_potential_field_is_that_worked_out_by_hand() {
    let disc = Solid::Disc { radius_m: 0.1 };
    let task = sample::task(regulation(sample::point(), &[(disc, [0.3, 0.2])]));
    let weak = [("attraction", Setting::Number(0.5))];
    let mut controller = set("potential_field", &task, &weak);
    let field = [-0.15, -0.2 + 2.0 / 3.0];
    near(&commanded(&mut *controller, &task, &begun(&task, &[[0.3, 0.4]])), &[field]);
    // Out of reach; the leader, whose place is its own, does not repel.
    near(&commanded(&mut *controller, &task, &begun(&task, &[[0.02, -0.4]])), &[[-0.01, 0.2]]);
    // Inside: straight out, at full speed.
    near(&commanded(&mut *controller, &task, &begun(&task, &[[0.3, 0.25]])), &[[0.0, 0.7]]);
}

/// Laws ask for velocities: one that is commanded in its own frame moves as the unicycle does.
#[test]
fn laws_steer_a_robot_in_its_own_frame() {
    for name in ["proportional", "consensus", "potential_field", "predictive"] {
        let ends = [sample::unicycle(), sample::steered()].map(|body| {
            let task = sample::task(sample::unison(body));
            let mut episode = begun(&task, &[]);
            let mut action = vec![0.0; task.action_len()];
            let mut controller = made(name, &task);
            let mut error = 0.0;
            for _ in 0..150 {
                controller.command(&task, &episode, &mut action);
                error = task.step(&mut episode, &action, Mode::Evaluate).error_m;
            }
            error
        });
        assert!((ends[0] - ends[1]).abs() < 0.02 && ends[1] < 0.05, "{name}: {ends:?} m");
    }
}

#[test]
fn a_formation_is_at_rest_in_its_own_field() {
    let (task, mut episode) = chase(sample::point(), 0);
    for k in 0..3 {
        episode.agents.position[1 + k] = episode.slots()[k];
    }
    let wide = [("reach", Setting::Number(2.0))];
    near(&commanded(&mut *set("potential_field", &task, &wide), &task, &episode), &[[0.0; 2]; 3]);
    // Nearer than they should be, they part.
    episode.agents.position[2] = add(episode.slots()[0], [0.0, -0.1]);
    let found = commanded(&mut *set("potential_field", &task, &wide), &task, &episode);
    assert!(found[0][1] > 0.6, "{found:?}");
}

/// What a controller does in an episode: least clearance from obstacles and mean error after step 60, m.
fn driven(name: &str, task: &Task, from: Vec2) -> (f64, f64) {
    let mut episode = begun(task, &[from]);
    let mut controller = made(name, task);
    let mut action = vec![0.0; task.action_len()];
    let (mut least, mut sum, mut count) = (f64::INFINITY, 0.0, 0);
    for step in 0..200 {
        controller.command(task, &episode, &mut action);
        let error = task.step(&mut episode, &action, Mode::Evaluate).error_m;
        for &obstacle in task.obstacles.iter() {
            let way = subtract(episode.position(1), episode.position(obstacle));
            least = least.min(task.model.outlines[obstacle].distance(way));
        }
        if step >= 60 {
            (sum, count) = (sum + error, count + 1);
        }
    }
    (least, sum / f64::from(count))
}

/// As in the paper's figure "regulation": the leader goes along the diagonal, through two discs.
#[test]
fn the_predictive_controller_goes_round_what_the_proportional_one_runs_into() {
    let disc = Solid::Disc { radius_m: 0.1 };
    for body in [sample::point(), sample::unicycle()] {
        let mut world = regulation(body, &[(disc.clone(), [-0.4, -0.4]), (disc.clone(), [0.4, 0.4])]);
        world.groups[0].control = sample::velocity(vector(0.1, 0.1));
        world.groups[0].start = Some(vector(-1.0, -1.0));
        let task = sample::task(world);
        for from in [[-1.0, -0.9], [0.5, 0.1]] {
            let (touched, _) = driven("proportional", &task, from);
            assert!(touched < -0.05, "{touched} m");
            let (clear, error) = driven("predictive", &task, from);
            assert!(clear > 0.02 && error < 0.1, "from {from:?}: clearance {clear} m, error {error} m");
        }
    }
}

#[test]
fn the_predictive_controller_with_one_step_ahead_is_the_oracle() {
    for body in [sample::point(), sample::unicycle()] {
        for k in 0..20 {
            let mut world = sample::unison(body.clone());
            world.safety_m = 0.0;
            let task = sample::task(world);
            let mut episode = task.episode();
            task.reset(&mut episode, EpisodeKey { episode: k, ..EpisodeKey::default() }).unwrap();
            let short = [("ahead", Setting::Number(1.0)), ("margin", Setting::Number(0.0))];
            let found = commanded(&mut *set("predictive", &task, &short), &task, &episode);
            near(&found, &commanded(&mut *made("oracle", &task), &task, &episode));
        }
    }
}

/// Two followers that must change sides, head on.
#[test]
fn predictive_robots_keep_their_safety_distance() {
    let mut world = sample::unison(sample::point());
    world.groups[1].size = 2;
    world.formations[0].constraint = sample::places(vec![vector(0.5, 0.5), vector(-0.5, 0.5)]);
    let task = sample::task(world);
    let run = |name: &str| {
        let mut episode = begun(&task, &[[-0.5, 0.5], [0.5, 0.5]]);
        let mut controller = made(name, &task);
        let mut action = vec![0.0; task.action_len()];
        let (mut collided, mut error) = (0, 0.0);
        for _ in 0..100 {
            controller.command(&task, &episode, &mut action);
            let step = task.step(&mut episode, &action, Mode::Evaluate);
            (collided, error) = (collided + u32::from(step.collisions), step.error_m);
        }
        (collided, error)
    };
    assert!(run("proportional").0 > 0);
    let (collided, error) = run("predictive");
    assert!(collided == 0 && error < 1e-3, "{collided} collisions, {error} m left");
}

/// For a triangle with the leader the nearest arrangement is known: among all turns of the triangle and of its mirror
/// image the one to which the followers move least, in the sum of squares.
#[test]
fn arrangements_are_the_nearest_that_keep_the_distances() {
    let task = distances(2, Graph::Complete, &[0.4]);
    for k in 0..40 {
        let start = |j: usize| {
            rotate(
                [0.25 + 0.02 * f64::from(k), 0.0],
                f64::from(k) * 0.7 + j as f64 * (0.5 + 0.06 * f64::from(k)),
            )
        };
        let episode = begun(&task, &[start(0), start(1)]);
        let mut found = episode.agents.position.clone();
        arrange::arrange(&task, &episode, 0, &mut found);
        for (a, b) in [(0, 1), (0, 2), (1, 2)] {
            assert!((distance(found[a], found[b]) - 0.4).abs() < 1e-8);
        }
        let moved = |places: [Vec2; 2]| {
            places.iter().enumerate().map(|(j, place)| distance(*place, start(j)).powi(2)).sum::<f64>()
        };
        let least = (0..2000).flat_map(|turn| {
            [1.0, -1.0].map(|side| {
                let angle = TAU * f64::from(turn) / 2000.0;
                moved([rotate([0.4, 0.0], angle), rotate([0.4, 0.0], angle + side * PI / 3.0)])
            })
        });
        let least = least.fold(f64::INFINITY, f64::min).sqrt();
        let way = moved([found[1], found[2]]).sqrt();
        assert!(way < 1.1 * least + 1e-3, "start {k}: {way} m, but {least} m is enough");
    }
}
