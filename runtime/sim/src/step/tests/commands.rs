//! Commands, headings, drawn parameters, and motions that look at others.

use super::*;

fn quantity(quantity: Quantity, agent: AgentRef, axis: Function) -> Expr {
    Expr::Call(axis, vec![Expr::Agent(quantity, agent)])
}

/// Terms of the leader and the follower after some steps, whose actions are given.
fn terms(mut world: World, terms: Vec<Expr>, actions: &[[f32; 2]]) -> Vec<Vec<f64>> {
    world.reward = terms.into_iter().map(|value| term("it", value)).collect();
    let task = task(world);
    let mut episode = began(&task, KEY);
    let step = |action: &[f32; 2]| {
        task.step(&mut episode, action, Mode::Evaluate);
        episode.terms().to_vec()
    };
    actions.iter().map(step).collect()
}

#[test]
fn a_command_is_what_the_policy_asks_within_the_limits_of_speed() {
    use Quantity::{Command, CommandChange};
    let mut world = pair(sample::velocity(Expr::Vector(Box::new(Expr::Time), Box::new(number(-9.0)))));
    world.groups[1].arena = square_metre();
    world.groups[1].start = Some(vector(0.5, 0.0));
    let of = |agent| {
        [
            quantity(Command, agent, Function::X),
            quantity(Command, agent, Function::Y),
            quantity(CommandChange, agent, Function::X),
            quantity(CommandChange, agent, Function::Y),
        ]
    };
    let all = [of(FOLLOWER), of(LEADER)].concat();
    let found = terms(world, all, &[[1.0, 0.5], [9.0, -0.5], [0.0, -0.5]]);
    let expected = [
        // The follower's arena does not matter, nor does the first step count as a change.
        [0.7, 0.35, 0.0, 0.0, 0.1, -0.7, 0.0, 0.0],
        [0.7, -0.35, 0.0, -0.7, 0.2, -0.7, 0.1, 0.0],
        [0.0, -0.35, -0.7, 0.0, 0.3, -0.7, 0.1, 0.0],
    ];
    for (found, expected) in found.iter().zip(expected) {
        assert!(
            found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-15),
            "{found:?}, not {expected:?}"
        );
    }
}

/// Of a motion of positions the command is the velocity.
#[test]
fn who_has_no_command_has_its_velocity() {
    let square = binary(BinaryOp::Mul, Expr::Time, Expr::Time);
    let along = sample::at(Expr::Vector(Box::new(square), Box::new(number(0.0))));
    let x = |it| quantity(it, LEADER, Function::X);
    let found = terms(pair(along), vec![x(Quantity::Command), x(Quantity::CommandChange)], &[[0.0; 2]; 3]);
    for (found, expected) in found.iter().zip([[0.1, 0.0], [0.3, 0.2], [0.5, 0.2]]) {
        assert!(
            found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12),
            "{found:?}, not {expected:?}"
        );
    }
}

/// 2 m/s² for 0.1 s are 0.2 m/s.
#[test]
fn acceleration_limits_learned_and_scripted_agents() {
    let mut world = pair(sample::velocity(vector(0.0, 0.5)));
    for group in &mut world.groups {
        group.body.settings.insert("acceleration".into(), Setting::Number(2.0));
    }
    let y = |agent| quantity(Quantity::Velocity, agent, Function::Y);
    let x = quantity(Quantity::Velocity, FOLLOWER, Function::X);
    let found =
        terms(world, vec![x, y(FOLLOWER), y(LEADER)], &[[0.6, 0.8], [0.6, 0.8], [0.6, 0.8], [-0.6, -0.8]]);
    let expected = [[0.12, 0.16, 0.2], [0.24, 0.32, 0.4], [0.36, 0.48, 0.5], [0.24, 0.32, 0.5]];
    for (found, expected) in found.iter().zip(expected) {
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-7), "{found:?}, not {expected:?}");
    }
}

#[test]
fn the_heading_of_a_point_is_the_way_it_went_last() {
    let heading = Expr::Agent(Quantity::Heading, FOLLOWER);
    let found = terms(pair(still()), vec![heading], &[[0.0, 0.0], [0.0, 1.0], [0.0, 0.0], [-1.0, -1.0]]);
    let expected = [0.0, PI / 2.0, PI / 2.0, -0.75 * PI];
    for (found, expected) in found.iter().zip(expected) {
        assert!((found[0] - expected).abs() < 1e-12, "{found:?}, not {expected}");
    }
}

/// A pursuer goes to where its prey is after this step, and to where another pursuer was before it.
#[test]
fn motions_see_learned_agents_after_their_move_and_scripted_ones_before() {
    let goes_to = |agent| {
        let way = binary(BinaryOp::Sub, position(AgentRef::Fixed(agent)), position(AgentRef::Member));
        sample::velocity(binary(BinaryOp::Div, way, Expr::World(WorldConstant::Dt)))
    };
    let mut world = pair(still());
    for (name, prey) in [("hound", 1), ("hare", 2), ("fox", 2)] {
        world.groups.push(group(name, 1, sample::point(), goes_to(prey), Some(vector(0.0, 0.0))));
    }
    let task = task(world);
    let mut episode = began(&task, KEY);
    for action in [[1.0, 0.0], [0.5, 0.0], [0.0, 0.0]] {
        let hound = episode.position(2);
        task.step(&mut episode, &action, Mode::Train);
        for (found, expected) in [(2, episode.position(1)), (3, hound), (4, hound)] {
            assert!(
                distance(episode.position(found), expected) < 1e-15,
                "{found}: {:?}",
                episode.position(found)
            );
        }
    }
}

/// A gain and, from it, a radius, drawn for each episode.
fn randomised() -> World {
    let mut world = pair(still());
    let uniform =
        |low: Expr, high| Distribution::Uniform { low: Box::new(low), high: Box::new(number(high)) };
    let drawn =
        |param, low| Randomised { param, value: sample::draw(uniform(low, 2.0)), at: Place::default() };
    world.randomise = vec![drawn(1, number(1.0)), drawn(0, Expr::Param(1))];
    world.groups[1].start = Some(Expr::Vector(Box::new(Expr::Param(1)), Box::new(Expr::Param(0))));
    world.reward = vec![term("gain", Expr::Param(1)), term("radius", Expr::Param(0))];
    world
}

#[test]
fn parameters_are_drawn_for_each_episode() {
    let task = task(randomised());
    let drawn = |key| {
        let mut episode = began(&task, key);
        task.step(&mut episode, &[0.0; 2], Mode::Train);
        assert_eq!(episode.terms(), episode.position(1), "the same everywhere");
        task.step(&mut episode, &[0.0; 2], Mode::Train);
        assert_eq!(episode.terms(), episode.position(1), "throughout the episode");
        (episode.terms()[0], episode.terms()[1])
    };
    let all: Vec<(f64, f64)> = (0..50).map(|episode| drawn(EpisodeKey { episode, ..KEY })).collect();
    assert_eq!(all[7], drawn(EpisodeKey { episode: 7, ..KEY }));
    assert!(all.iter().all(|(gain, radius)| (1.0..=2.0).contains(gain) && gain <= radius && *radius <= 2.0));
    assert!(all.windows(2).all(|pair| pair[0].0 != pair[1].0 && pair[0].1 != pair[1].1));
    let mean = all.iter().map(|(gain, _)| gain).sum::<f64>() / 50.0;
    assert!((mean - 1.5).abs() < 0.15, "{mean}");
}

#[test]
fn drawn_parameters_leave_all_other_draws_alone() {
    let mut world = sample::unison(sample::unicycle());
    world.groups[0].control = random_velocity();
    let run = |world: &World| {
        let task = task(world.clone());
        let mut episode = began(&task, KEY);
        task.step(&mut episode, &[0.3; 6], Mode::Train);
        episode.agents
    };
    let plain = run(&world);
    world.randomise = randomised().randomise;
    assert_eq!(run(&world), plain);
}

#[test]
fn draws_of_parameters_are_checked() {
    let refusal = |spoil: fn(&mut World)| {
        let mut world = randomised();
        spoil(&mut world);
        let plan = sample::plan(world);
        Task::new(&plan, &plan.world).unwrap_err().to_string()
    };
    assert_eq!(refusal(|w| w.randomise.swap(0, 1)), "parameter `k`: parameter `k` is not drawn yet");
    assert_eq!(refusal(|w| w.randomise[0].param = 2), "parameter ``: parameter 2 does not exist");
    assert_eq!(
        refusal(|w| w.randomise[0].value = vector(0.0, 0.0)),
        "parameter `k`: expected a number, found a vector"
    );
    let looks = refusal(|w| w.randomise[0].value = Expr::Call(Function::X, vec![position(LEADER)]));
    assert!(looks.contains("leader is placed later"), "{looks}");
    let mut world = randomised();
    world.randomise[0].value = number(f64::NAN);
    let task = task(world);
    let refused = task.reset(&mut task.episode(), KEY).unwrap_err().to_string();
    assert_eq!(refused, "parameter `k` was drawn as NaN; it must be a finite number");
}
