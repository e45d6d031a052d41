mod commands;

use mpgx_lang::plan::*;
use proptest::prelude::*;

use super::*;
use crate::maths::{add, distance, norm, rotate};
use crate::sample::{self, binary, group, number, position, task, term, vector};

const KEY: EpisodeKey = EpisodeKey { master: 7, protocol: 0, seed: 3, episode: 11 };
const LEADER: AgentRef = AgentRef::Fixed(0);
const FOLLOWER: AgentRef = AgentRef::Fixed(1);

fn began(task: &Task, key: EpisodeKey) -> Episode {
    let mut episode = task.episode();
    task.reset(&mut episode, key).unwrap();
    episode
}

/// A leader moved by `control` and one learned point, both starting at the origin.
fn pair(control: Control) -> World {
    let mut world = sample::unison(sample::point());
    world.groups[0].control = control;
    world.groups[1].size = 1;
    world.groups[1].start = Some(vector(0.0, 0.0));
    world.formations[0].constraint = sample::places(vec![vector(0.0, 0.0)]);
    world.reward.truncate(1);
    world
}

fn still() -> Control {
    sample::velocity(vector(0.0, 0.0))
}

fn random_velocity() -> Control {
    sample::velocity(sample::noise())
}

fn square_metre() -> Option<Area> {
    Some(Area { x_m: (-0.5, 0.5), y_m: (-0.5, 0.5) })
}

/// Where the leader is at the start and after each of some steps, the follower doing `action`.
fn leader_path(task: &Task, key: EpisodeKey, action: [f32; 2], steps: usize) -> Vec<Vec2> {
    let mut episode = began(task, key);
    let mut path = vec![episode.position(0)];
    for _ in 0..steps {
        task.step(&mut episode, &action, Mode::Evaluate);
        path.push(episode.position(0));
    }
    path
}

#[test]
fn rewards_errors_and_collisions_are_those_worked_out_by_hand() {
    let task = task(sample::unison(sample::point()));
    let mut episode = began(&task, KEY);
    // Slots: (-0.4, 0), (-0.4, -0.4), (0, -0.4). Two followers in place, one 0.05 m from the leader.
    episode.agents.position = vec![[0.0, 0.0], [-0.4, 0.0], [-0.4, -0.4], [0.03, 0.04]];
    let step = task.step(&mut episode, &[0.0; 6], Mode::Train);
    let gap = (0.03f64.powi(2) + 0.44f64.powi(2)).sqrt();
    assert_eq!(episode.terms(), [-gap, -1.0]);
    assert_eq!(step.reward, -gap - 1.0);
    assert_eq!((step.collisions, step.ended, step.outside, step.last), (1, None, false, false));
    assert!((step.error_m - gap / 3.0).abs() < 1e-15);
    assert_eq!(episode.slots(), [[-0.4, 0.0], [-0.4, -0.4], [0.0, -0.4]]);
    // A quarter of the limit, 0.7 m/s, for 0.1 s, on x of follower 1 and y of follower 2.
    task.step(&mut episode, &[0.25, 0.0, 0.0, -0.25, 0.0, 0.0], Mode::Train);
    assert!(norm(subtract(episode.position(1), [-0.3825, 0.0])) < 1e-15);
    assert!(norm(subtract(episode.agents.velocity[2], [0.0, -0.175])) < 1e-15);
}

#[test]
fn touching_the_safety_distance_is_no_collision() {
    let mut world = pair(still());
    world.safety_m = 0.5;
    let task = task(world);
    let mut episode = began(&task, KEY);
    for (x, collisions) in [(0.5, 0), (0.499_999, 1)] {
        episode.agents.position[1] = [x, 0.0];
        assert_eq!(task.step(&mut episode, &[0.0; 2], Mode::Train).collisions, collisions, "at {x} m");
    }
}

#[test]
fn actions_are_mapped_onto_unequal_limits_and_clipped() {
    let mut world = pair(still());
    world.groups[1].speed_mps = (-0.2, 0.6);
    let task = task(world);
    for (action, velocity) in [(-1.0, -0.2), (0.0, 0.2), (1.0, 0.6), (9.0, 0.6), (-9.0, -0.2)] {
        let mut episode = began(&task, KEY);
        task.step(&mut episode, &[action, 0.0], Mode::Train);
        assert!(
            (episode.position(1)[0] - 0.1 * velocity).abs() < 1e-15,
            "{action}: {:?}",
            episode.position(1)
        );
    }
}

#[test]
fn a_failure_is_told_from_the_time_limit() {
    let mut world = pair(still());
    world.horizon = 3;
    let far = |x| binary(BinaryOp::Greater, Expr::Call(Function::X, vec![position(FOLLOWER)]), number(x));
    world.ends = vec![sample::end("further", far(0.1), Some(2.0)), sample::end("far", far(0.05), Some(0.5))];
    let task = task(world);
    let mut episode = began(&task, KEY);
    let quiet: Vec<Step> = (0..3).map(|_| task.step(&mut episode, &[0.0; 2], Mode::Train)).collect();
    assert_eq!(quiet.iter().map(|step| step.last).collect::<Vec<_>>(), [false, false, true]);
    assert!(quiet.iter().all(|step| step.ended.is_none() && step.reward == 0.0));
    assert_eq!(episode.time_steps(), 3);

    let mut episode = began(&task, KEY);
    let first = task.step(&mut episode, &[1.0, 0.0], Mode::Train);
    assert_eq!((first.ended, first.last), (Some(1), false));
    assert!((first.reward - (-0.07 - 0.5)).abs() < 1e-7);
    let second = task.step(&mut episode, &[1.0, 0.0], Mode::Train);
    assert_eq!((second.ended, second.last), (Some(0), false));
    assert!((second.reward - (-0.14 - 2.5)).abs() < 1e-7, "each end that holds costs: {}", second.reward);
}

#[test]
fn evaluation_puts_learned_agents_back_into_their_arena() {
    let mut world = pair(still());
    world.groups[1].arena = square_metre();
    world.groups[1].start = Some(vector(0.48, 0.0));
    let outside = Expr::Agent(Quantity::Outside, FOLLOWER);
    world.ends = vec![sample::end("lost", outside, Some(1.0))];
    let task = task(world);
    for (mode, x, velocity) in [(Mode::Train, 0.55, 0.7), (Mode::Evaluate, 0.5, 0.2)] {
        let mut episode = began(&task, KEY);
        let step = task.step(&mut episode, &[1.0, 0.0], mode);
        assert!(step.outside && step.ended == Some(0), "{mode:?}");
        assert!((episode.position(1)[0] - x).abs() < 1e-12, "{mode:?}: {:?}", episode.position(1));
        assert!((episode.agents.velocity[1][0] - velocity).abs() < 1e-12, "{mode:?}");
        assert!((step.reward - (-x - 1.0)).abs() < 1e-12, "{mode:?}: {}", step.reward);
        assert!(!task.step(&mut episode, &[-1.0, 0.0], mode).outside, "{mode:?}: it has come back");
    }
}

#[test]
fn scripted_agents_are_clipped_to_their_speed_and_arena() {
    let mut world = pair(sample::velocity(vector(5.0, -0.3)));
    world.groups[0].arena = square_metre();
    let path = leader_path(&task(world), KEY, [0.0; 2], 10);
    assert!(norm(subtract(path[1], [0.07, -0.03])) < 1e-15);
    assert!(norm(subtract(path[10], [0.5, -0.3])) < 1e-12);
}

/// A scripted unicycle turns towards its velocity as a learned one does.
#[test]
fn a_scripted_body_keeps_its_kinematics() {
    let mut world = pair(sample::velocity(vector(0.3, 0.0)));
    world.groups[0].body = sample::unicycle();
    let task = task(world);
    let mut episode = began(&task, KEY);
    assert_ne!(episode.heading(0), 0.0);
    for _ in 0..200 {
        task.step(&mut episode, &[0.0; 2], Mode::Train);
    }
    assert!(episode.heading(0).abs() < 1e-3, "{}", episode.heading(0));
}

#[test]
fn motion_states_change_all_at_once() {
    let state = |name: &str, start: Expr, next: Expr| MotionState { name: name.into(), start, next };
    let velocity = binary(BinaryOp::Mul, Expr::State(0), vector(0.1, 0.0));
    let motion = Motion {
        name: "swap".into(),
        states: vec![
            state("a", number(1.0), Expr::State(1)),
            state("b", binary(BinaryOp::Add, Expr::State(0), number(1.0)), Expr::State(0)),
        ],
        output: MotionOutput::Velocity(velocity),
    };
    let path = leader_path(&task(pair(Control::Motion(motion))), KEY, [0.0; 2], 3);
    // States (1, 2), then (2, 1), (1, 2), (2, 1).
    for (place, x) in path.iter().zip([0.0, 0.02, 0.03, 0.05]) {
        assert!((place[0] - x).abs() < 1e-15, "{path:?}");
    }
}

#[test]
fn a_motion_of_positions_is_where_its_formula_says_at_each_time() {
    let along = Expr::Vector(Box::new(Expr::Time), Box::new(number(0.25)));
    let path = leader_path(&task(pair(sample::at(along))), KEY, [0.0; 2], 3);
    for (k, place) in path.iter().enumerate() {
        assert_eq!(*place, [k as f64 * 0.1, 0.25]);
    }
}

#[test]
fn an_episode_is_a_function_of_its_key() {
    let mut world = pair(random_velocity());
    world.groups[0].start = Some(sample::draw(Distribution::UnitDisc));
    let task = task(world);
    let path = leader_path(&task, KEY, [0.0; 2], 5);
    assert_eq!(path, leader_path(&task, KEY, [1.0, -0.5], 5), "the leader does not mind what others do");
    for other in [
        EpisodeKey { master: 8, ..KEY },
        EpisodeKey { protocol: 1, ..KEY },
        EpisodeKey { seed: 4, ..KEY },
        EpisodeKey { episode: 12, ..KEY },
    ] {
        let other = leader_path(&task, other, [0.0; 2], 5);
        assert!(path[0] != other[0] && path[1] != other[1]);
    }
    let steps: Vec<Vec2> = path.windows(2).map(|pair| subtract(pair[1], pair[0])).collect();
    assert!(steps.windows(2).all(|pair| pair[0] != pair[1]), "each step draws afresh: {steps:?}");
}

#[test]
fn agents_draw_independently_of_each_other() {
    let mut world = sample::unison(sample::unicycle());
    world.groups.push(group("stray", 2, sample::point(), random_velocity(), Some(vector(0.0, 0.0))));
    let task = task(world);
    let mut episode = began(&task, KEY);
    let ways = [0, 1, 2].map(|k| subtract(episode.position(1 + k), episode.slots()[k]));
    assert!(distance(ways[0], ways[1]) > 1e-3 && distance(ways[1], ways[2]) > 1e-3);
    assert_ne!(episode.heading(1), episode.heading(2));
    task.step(&mut episode, &[0.0; 6], Mode::Train);
    assert_ne!(episode.position(4), episode.position(5));
}

#[test]
fn a_used_episode_is_as_good_as_a_new_one() {
    let mut world = sample::unison(sample::unicycle());
    world.groups[0].control = random_velocity();
    let task = task(world);
    let mut used = began(&task, EpisodeKey::default());
    for _ in 0..5 {
        task.step(&mut used, &[0.3; 6], Mode::Train);
    }
    task.reset(&mut used, KEY).unwrap();
    assert_eq!(used, began(&task, KEY));
}

#[test]
fn starts_are_drawn_until_all_requirements_hold() {
    let apart = |metres: f64| {
        binary(BinaryOp::Greater, sample::distance(position(LEADER), position(FOLLOWER)), number(metres))
    };
    let mut world = pair(still());
    world.groups[1].start = Some(sample::draw(Distribution::UnitDisc));
    world.require = vec![apart(0.0), apart(0.8)];
    let demanding = task(world.clone());
    world.require.pop();
    let free = task(world.clone());
    let keys = (0..50).map(|episode| EpisodeKey { episode, ..KEY });
    let away = |task, key| norm(began(task, key).position(1));
    let mut redrawn = 0;
    for key in keys {
        assert!(away(&demanding, key) > 0.8);
        if away(&free, key) > 0.8 {
            assert_eq!(away(&demanding, key), away(&free, key), "a good first draw is kept");
        } else {
            redrawn += 1;
        }
    }
    assert!(redrawn > 10, "{redrawn}");

    world.require = vec![apart(0.0), apart(1.1)];
    let refused = task(world).reset(&mut free.episode(), KEY).unwrap_err();
    let text = "no start of `follower` fulfilled requirement 2 in 10000 attempts; \
                give the starts more room or ask for less (follower.scn:1:1)";
    assert_eq!(refused.to_string(), text);
}

#[test]
fn agents_are_placed_after_those_they_refer_to() {
    let near = |agent| binary(BinaryOp::Add, position(AgentRef::Fixed(agent)), vector(0.1, 0.0));
    let mut world = pair(sample::at(vector(0.25, 0.5)));
    // The leader is listed last, and placed first nevertheless.
    world.groups = vec![
        group("first", 1, sample::point(), Control::Learned, Some(near(2))),
        group("second", 1, sample::point(), still(), Some(near(0))),
        world.groups.swap_remove(0),
    ];
    (world.formations, world.observe, world.reward) = Default::default();
    let episode = began(&task(world), KEY);
    assert_eq!(episode.agents.position, [[0.35, 0.5], [0.35 + 0.1, 0.5], [0.25, 0.5]]);
}

#[test]
fn headings_fill_the_circle() {
    let task = task(sample::unison(sample::unicycle()));
    let mut quarters = [0; 4];
    for episode in 0..100 {
        let episode = began(&task, EpisodeKey { episode, ..KEY });
        assert_eq!(episode.heading(0), 0.0, "a point has none");
        for agent in 1..4 {
            assert!(episode.heading(agent) > -PI && episode.heading(agent) <= PI);
            quarters[((episode.heading(agent) + PI) / PI * 2.0) as usize % 4] += 1;
        }
    }
    assert!(quarters.iter().all(|&count| count > 50), "{quarters:?}");
}

#[test]
fn the_state_is_what_the_plan_observes_in_its_order() {
    let mut world = sample::unison(sample::unicycle());
    let observe = |text: &str, value, vector| Observation {
        text: text.into(),
        value,
        vector,
        over: None,
        noise: None,
        delay: 0,
        at: Place::default(),
    };
    world.observe.push(observe("v[leader]", Expr::Agent(Quantity::Velocity, LEADER), true));
    world.observe.push(observe("t", Expr::Time, false));
    let task = task(world);
    let mut episode = began(&task, KEY);
    episode.agents.position[2] = [-1.0, 0.5];
    task.step(&mut episode, &[0.0; 6], Mode::Train);
    let mut state = [f32::NAN; 9];
    task.observe(&episode, &mut state);
    assert_eq!(state[2..4], [0.6, -0.9]);
    assert_eq!(state[6..], [0.0, 0.0, 0.1]);
    let names = task.observation_names();
    assert_eq!(names[2..4], ["F[i] - p[i] (follower[2]) x", "F[i] - p[i] (follower[2]) y"]);
    assert_eq!(names[6..], ["v[leader] x", "v[leader] y", "t"]);
    assert_eq!(names.len(), task.state_len());
    assert_eq!(task.action_names()[3], "follower[2] velocity y");
    assert_eq!((task.action_len(), task.agents(), task.slot_count(), task.term_count()), (6, 4, 3, 2));
}

#[test]
fn numbers_that_are_not_finite_are_reported_with_their_cause() {
    let ln = || Expr::Call(Function::Ln, vec![binary(BinaryOp::Sub, Expr::Time, number(1.0))]);
    let fault = |world| {
        let task = task(world);
        let mut episode = began(&task, KEY);
        let fault = task.step(&mut episode, &[0.0; 2], Mode::Train).fault.unwrap();
        (fault.cause, fault.at.file)
    };
    let mut world = pair(still());
    world.reward.push(term("steep", ln()));
    assert_eq!(fault(world), ("reward term `steep` is NaN".into(), "steep.scn".into()));

    let mut world = pair(still());
    let mut end = sample::end("costly", Expr::Truth(true), None);
    end.cost = Some(ln());
    world.ends.push(end);
    assert_eq!(fault(world).0, "the cost of end `costly` is NaN");

    let runaway = sample::velocity(Expr::Vector(Box::new(ln()), Box::new(number(0.0))));
    assert_eq!(fault(pair(runaway)), ("the position of leader is [NaN, 0.0]".into(), "leader.scn".into()));

    let mut world = pair(still());
    let nowhere = binary(BinaryOp::Mul, sample::draw(Distribution::UnitDisc), number(f64::INFINITY));
    world.groups[1].start = Some(nowhere);
    let refused = task(world.clone()).reset(&mut task(world).episode(), KEY).unwrap_err();
    assert!(matches!(&refused, SimError::StartNotFinite { agent, .. } if agent == "follower"), "{refused}");
}

/// A world turned by `angle` and shifted: the leader runs on a circle about `shift`. Its followers have places
/// along the axes of the world, or along the leader's heading, or keep distances.
fn turned(body: &Extern, angle: f64, shift: Vec2, kind: u8) -> Task {
    let turn = Expr::Call(
        Function::Rotate,
        vec![vector(0.6, 0.0), binary(BinaryOp::Add, Expr::Time, number(angle))],
    );
    let mut world = sample::unison(body.clone());
    world.groups[0].control = sample::at(binary(BinaryOp::Add, vector(shift[0], shift[1]), turn));
    let places = [[-0.4, 0.0], [-0.4, -0.4], [0.0, -0.4]];
    let [i, j] = [0, 1].map(AgentRef::Var);
    let formation = &mut world.formations[0];
    match kind {
        0 => {
            for (slot, displacement) in sample::places_of(formation).iter_mut().zip(places) {
                let [x, y] = rotate(displacement, angle);
                *slot = vector(x, y);
            }
        }
        1 => {
            formation.constraint = Constraint::Displacements {
                slots: Slots::List(places.map(|[x, y]| vector(x, y)).into()),
                frame: Frame::Heading,
            }
        }
        _ => {
            let near = binary(BinaryOp::Add, position(LEADER), sample::draw(Distribution::UnitDisc));
            world.groups[1].start = Some(near);
            formation.constraint = Constraint::Distances([0.4, 0.7, 0.4].map(number).into());
            world.observe.clear();
            let length = sample::distance(position(i), position(j));
            let miss = Expr::Call(Function::Abs, vec![binary(BinaryOp::Sub, length, Expr::Rest(0, i, j))]);
            world.reward[0].value = sample::reduce(Reduction::Sum, &[0, 1], IndexSet::Edges(0), miss);
        }
    }
    task(world)
}

proptest! {
    #![proptest_config(sample::cases(200))]

    /// Actions stay in a disc inside the limits, so that turned ones are not clipped. Single precision of
    /// the actions allows 1e-8 m a step.
    #[test]
    fn a_turned_and_shifted_world_gives_the_same_rewards(
        angle in -PI..PI, shift in [-5.0..5.0, -5.0..5.0], seed: u32, unicycles: bool, kind in 0u8..3,
    ) {
        let body = if unicycles { sample::unicycle() } else { sample::point() };
        let here = turned(&body, 0.0, [0.0, 0.0], kind);
        let there = turned(&body, angle, shift, kind);
        let mut episode = began(&here, EpisodeKey { seed, ..KEY });
        let mut image = began(&there, KEY);
        // Before it moves the leader looks along the axis x of its world.
        image.agents.course[0] = rotate([1.0, 0.0], angle);
        for agent in 1..4 {
            let pose = episode.pose(agent);
            let heading = if unicycles { wrap(pose.heading + angle) } else { 0.0 };
            image.set_pose(agent, crate::body::Pose { position: add(rotate(pose.position, angle), shift), heading });
        }
        let mut choice = KEY.address(Purpose::Exploration, 0, u64::from(seed)).stream();
        for _ in 0..50 {
            let commands = [0; 3].map(|_| rotate([choice.uniform(), 0.0], TAU * choice.uniform()));
            let turned = commands.map(|command| rotate(command, angle));
            let step = here.step(&mut episode, &commands.concat().iter().map(|u| *u as f32).collect::<Vec<_>>(), Mode::Train);
            let other = there.step(&mut image, &turned.concat().iter().map(|u| *u as f32).collect::<Vec<_>>(), Mode::Train);
            prop_assert!((step.error_m - other.error_m).abs() < 1e-5, "{step:?} is not {other:?}");
            prop_assert!((episode.terms()[0] - image.terms()[0]).abs() < 1e-5);
            if step.collisions == other.collisions {
                prop_assert!((step.reward - other.reward).abs() < 1e-5);
            } else {
                let all = &episode.agents.position;
                let pairs = all.iter().enumerate().flat_map(|(i, p)| all[i + 1..].iter().map(|q| distance(*p, *q)));
                prop_assert!(pairs.into_iter().any(|metres| (metres - 0.1).abs() < 1e-5), "a pair on the edge");
            }
        }
    }

    #[test]
    fn terms_less_costs_are_the_reward(seed: u32, evaluate: bool) {
        let mut world = sample::unison(sample::unicycle());
        world.groups[0].control = random_velocity();
        world.groups[1].arena = square_metre();
        let colliding = binary(BinaryOp::Greater, sample::collisions(), number(0.0));
        let outside = Expr::Agent(Quantity::Outside, AgentRef::Var(0));
        let any = sample::reduce(Reduction::Any, &[0], IndexSet::Group(1), outside);
        world.ends = vec![sample::end("crash", colliding, None), sample::end("lost", any, Some(1.5))];
        let task = task(world);
        let mut episode = began(&task, EpisodeKey { seed, ..KEY });
        let mode = if evaluate { Mode::Evaluate } else { Mode::Train };
        for step in 0..50 {
            let action = [0; 6].map(|k| (f64::from(seed + k + step)).sin() as f32);
            let step = task.step(&mut episode, &action, mode);
            let terms: f64 = episode.terms().iter().sum();
            prop_assert_eq!(step.reward, terms - if step.outside { 1.5 } else { 0.0 });
            prop_assert_eq!(episode.terms()[1], -f64::from(step.collisions));
            prop_assert_eq!(step.ended, if step.collisions > 0 { Some(0) } else { step.outside.then_some(1) });
            prop_assert!(step.fault.is_none());
            for agent in 1..4 {
                prop_assert!(!evaluate || !task.agents[agent].is_outside(episode.position(agent)));
            }
        }
    }
}
