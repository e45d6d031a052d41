use mpgx_lang::plan::*;
use proptest::prelude::*;

use crate::episode::{Episode, EpisodeKey};
use crate::maths::{Vec2, distance, norm, subtract};
use crate::outline::Outline;
use crate::sample::{self, binary, group, number, term, vector};
use crate::step::{Mode, Step};
use crate::task::Task;

/// An agent of 0.1 m that starts at the origin and goes where its motion says, at up to 5 m/s, 0.5 m in a step;
/// with obstacles that stop it.
fn world(velocity: Vec2, obstacles: &[(Vec2, Solid)]) -> World {
    let mover = group(
        "mover",
        1,
        sample::point(),
        sample::velocity(vector(velocity[0], velocity[1])),
        Some(vector(0.0, 0.0)),
    );
    let mut world = World {
        dt_s: 0.1,
        horizon: 10,
        groups: vec![Group { radius_m: 0.1, speed_mps: (-5.0, 5.0), ..mover }],
        reward: vec![term("none", number(0.0))],
        ..World::default()
    };
    for (k, (at, solid)) in obstacles.iter().enumerate() {
        let start = Some(vector(at[0], at[1]));
        let obstacle = group(&format!("obstacle{k}"), 1, Extern::default(), Control::Still, start);
        world.groups.push(Group { solid: Some(solid.clone()), stops: vec![0], ..obstacle });
    }
    world
}

fn stepped(world: World) -> (Step, Episode) {
    let task = sample::task(world);
    let mut episode = task.episode();
    task.reset(&mut episode, EpisodeKey::default()).unwrap();
    let step = task.step(&mut episode, &[], Mode::Train);
    (step, episode)
}

fn near(a: Vec2, b: Vec2) {
    assert!(distance(a, b) < 1e-8, "{a:?} is not {b:?}");
}

fn square(edge: f64) -> Solid {
    Solid::Polygon { corners_m: vec![(0.0, 0.0), (edge, 0.0), (edge, edge), (0.0, edge)] }
}

#[test]
fn an_agent_that_would_move_into_an_obstacle_rests_at_its_outline() {
    let disc = Solid::Disc { radius_m: 0.3 };
    let cases = [
        ([5.0, 0.0], [0.6, 0.0], disc.clone(), [0.2, 0.0]),
        // The disc's nearest point lies in the direction of the agent: (0.5, 0) − (0.5, 0.3), a distance of 0.3.
        ([5.0, 0.0], [0.5, 0.3], disc.clone(), [0.5, -0.1]),
        ([5.0, 0.0], [0.3, -0.5], square(1.0), [0.2, 0.0]),
        // Deep inside the nearest edge is the upper one.
        ([5.0, 0.0], [0.25, -0.625], square(0.75), [0.5, 0.225]),
    ];
    for (velocity, at, solid, end) in cases {
        let (step, episode) = stepped(world(velocity, &[(at, solid)]));
        near(episode.position(0), end);
        near(episode.agents.velocity[0].map(|v| v * 0.1), end);
        assert_eq!((step.hits, step.collisions), (1, 0), "an obstacle is no agent");
        assert_eq!(episode.position(1), at, "the obstacle stays");
    }
    // Without `stops` the agent goes on, and it is still a hit.
    let mut open = world([5.0, 0.0], &[([0.6, 0.0], disc)]);
    open.groups[1].stops.clear();
    let (step, episode) = stepped(open);
    near(episode.position(0), [0.5, 0.0]);
    assert_eq!(step.hits, 1);
}

#[test]
fn nothing_is_passed_within_one_step() {
    let wall = Solid::Segment { to_m: (0.0, 2.0) };
    for (at, solid, end, hits) in [
        ([0.25, -1.0], wall.clone(), [0.15, 0.0], 0),
        (
            [0.35, -0.02],
            Solid::Disc { radius_m: 0.03 },
            [0.35 - (0.03f64.powi(2) - 0.02f64.powi(2)).sqrt(), 0.0],
            0,
        ),
        ([0.25, -0.02], square(0.05), [0.15, 0.0], 0),
    ] {
        let mut world = world([5.0, 0.0], &[(at, solid.clone())]);
        if let Solid::Disc { .. } = solid {
            world.groups[0].radius_m = 0.0;
        }
        let (step, episode) = stepped(world);
        near(episode.position(0), end);
        assert_eq!(step.hits, hits, "{solid:?}");
    }
    // Of two walls the first stops it, whichever is listed first.
    for places in [[0.2, 0.3], [0.3, 0.2]] {
        let walls = places.map(|x| ([x, -1.0], wall.clone()));
        near(stepped(world([5.0, 0.0], &walls)).1.position(0), [0.1, 0.0]);
    }
}

/// A point at a wall stays at it, step after step, and may leave it.
#[test]
fn a_stopped_agent_neither_leaks_nor_sticks() {
    let mut world = world([0.0, 0.0], &[([0.25, -1.0], Solid::Segment { to_m: (0.0, 2.0) })]);
    world.groups[0].radius_m = 0.0;
    let early = binary(BinaryOp::Less, Expr::Time, number(0.95));
    let x = Expr::If { condition: early.into(), then: number(0.7).into(), otherwise: number(-0.7).into() };
    world.groups[0].control = sample::velocity(Expr::Vector(x.into(), number(0.3).into()));
    let task = sample::task(world);
    let mut episode = task.episode();
    task.reset(&mut episode, EpisodeKey::default()).unwrap();
    for step in 1..=9 {
        assert_eq!(task.step(&mut episode, &[], Mode::Train).hits, 0);
        let [x, _] = episode.position(0);
        assert!(x <= 0.25 && (step < 4 || x > 0.249_999), "step {step}: {x}");
    }
    task.step(&mut episode, &[], Mode::Train);
    assert!((episode.position(0)[0] - 0.18).abs() < 1e-8, "{:?}", episode.position(0));
}

#[test]
fn moving_obstacles_push() {
    for solid in [Solid::Segment { to_m: (0.0, 2.0) }, square(2.0)] {
        let mut world = world([0.0, 0.0], &[([0.3, -1.0], solid)]);
        world.groups[1].control = sample::velocity(vector(-5.0, 0.0));
        world.groups[1].speed_mps = (-5.0, 5.0);
        let (_, episode) = stepped(world);
        near(episode.position(1), [-0.2, -1.0]);
        let x = if matches!(episode.position(0), [x, _] if x < -0.25) { -0.3 } else { f64::NAN };
        near(episode.position(0), [x, 0.0]);
    }
}

#[test]
fn hits_count_pairs_of_the_new_state() {
    let disc = Solid::Disc { radius_m: 0.3 };
    let mut crowd =
        world([0.0, 0.0], &[([0.35, 0.0], disc.clone()), ([0.0, -0.35], disc.clone()), ([0.5, 0.0], disc)]);
    crowd.groups[0].size = 2;
    let clearance = Expr::Clearance(AgentRef::Var(0), AgentRef::Var(1));
    let hit = binary(BinaryOp::Less, clearance, number(0.0));
    let hits = sample::reduce(Reduction::Count, &[1], IndexSet::Obstacles, hit);
    let reward = sample::reduce(Reduction::Sum, &[0], IndexSet::All, hits);
    crowd.reward = vec![term("hits", reward)];
    crowd.groups[1..].iter_mut().for_each(|obstacle| obstacle.stops.clear());
    let (step, episode) = stepped(crowd.clone());
    assert_eq!((step.hits, step.reward), (4, 4.0));
    assert_eq!(episode.position(0), [0.0, 0.0]);
    // Agents on top of each other collide, at any distance up to their radii; obstacles never do.
    assert_eq!(step.collisions, 1);
    crowd.groups[1..].iter_mut().for_each(|obstacle| obstacle.stops = vec![0]);
    let (step, episode) = stepped(crowd.clone());
    assert_eq!((step.hits, step.reward), (4, 0.0));
    assert!(norm(episode.position(0)) > 0.05);
    // An obstacle that stops some lets others pass.
    crowd.groups.push(group("ghost", 1, sample::point(), Control::Still, Some(vector(0.35, 0.0))));
    assert_eq!(stepped(crowd.clone()).0.hits, 4);
    crowd.groups[1].stops.clear();
    assert_eq!(stepped(crowd).0.hits, 5);
}

#[test]
fn radii_count_in_collisions() {
    let mut two = world([0.0, 0.0], &[]);
    let other = group("other", 1, sample::point(), Control::Still, Some(vector(0.25, 0.0)));
    two.groups.push(Group { radius_m: 0.125, ..other });
    two.safety_m = 0.03;
    let close = binary(
        BinaryOp::Less,
        Expr::Clearance(AgentRef::Fixed(1), AgentRef::Fixed(0)),
        Expr::World(WorldConstant::Safety),
    );
    two.ends = vec![sample::end("close", close, None)];
    let (step, episode) = stepped(two.clone());
    assert_eq!((step.collisions, step.ended), (1, Some(0)));
    assert_eq!(episode.position(1), [0.25, 0.0], "it stays where it starts");
    two.safety_m = 0.025 - 1e-9;
    let (step, _) = stepped(two);
    assert_eq!((step.collisions, step.ended), (0, None));
}

#[test]
fn obstacles_and_those_they_stop_are_checked() {
    let refusal = |spoil: fn(&mut World)| {
        let mut world = world([0.0, 0.0], &[([1.0, 0.0], square(1.0))]);
        spoil(&mut world);
        let plan = sample::plan(world);
        Task::new(&plan, &plan.world).unwrap_err().to_string()
    };
    assert_eq!(
        refusal(|w| w.groups[0].radius_m = -1.0),
        "`mover` cannot have a radius that is negative or not finite (mover.scn:1:1)"
    );
    assert!(refusal(|w| w.groups[1].stops = vec![2]).contains("`obstacle0` cannot have group 2 to stop"));
    assert!(refusal(|w| w.groups[1].stops = vec![1]).contains("cannot have group 1 to stop"));
    assert!(refusal(|w| w.groups[0].stops = vec![0]).contains("`mover` cannot have group 0 to stop"));
    assert!(refusal(|w| w.groups[1].control = Control::Learned).contains("an outline and be learned"));
    assert!(
        refusal(|w| w.groups[1].solid = Some(Solid::Disc { radius_m: f64::NAN }))
            .contains("a disc whose radius")
    );
    assert!(
        refusal(|w| w.groups[1].solid = Some(Solid::Segment { to_m: (0.0, f64::INFINITY) }))
            .contains("a segment")
    );
    assert!(
        refusal(|w| w.groups[1].solid = Some(Solid::Polygon { corners_m: vec![(0.0, 0.0); 2] }))
            .contains("less than three corners")
    );
}

proptest! {
    #![proptest_config(sample::cases(300))]

    /// Walls anywhere, and two discs: whatever the agent does, it stays on its side of each wall and outside the
    /// discs, unless it finds no room.
    #[test]
    fn no_agent_gets_through(
        walls in prop::collection::vec(([-1.0..1.0f64, -1.0..1.0], [-1.0..1.0f64, -1.0..1.0]), 1..4),
        disc in [0.4..1.0f64, 0.4..1.0], velocities in prop::collection::vec([-5.0..5.0f64, -5.0..5.0], 20),
        radius in prop::sample::select(vec![0.0, 0.05]),
    ) {
        let mut obstacles: Vec<(Vec2, Solid)> =
            walls.iter().map(|&(at, to)| (at, Solid::Segment { to_m: to.into() })).collect();
        obstacles.push((disc, Solid::Disc { radius_m: 0.2 }));
        let mut world = world([0.0; 2], &obstacles);
        world.groups[0].radius_m = radius;
        world.groups[0].control = Control::Learned;
        let task = sample::task(world);
        let mut episode = task.episode();
        task.reset(&mut episode, EpisodeKey::default()).unwrap();
        prop_assume!(obstacles.iter().all(|(at, solid)| Outline::new(solid).distance(subtract([0.0; 2], *at)) > 0.1));
        for velocity in velocities {
            let before = episode.position(0);
            task.step(&mut episode, &velocity.map(|v| (v / 5.0) as f32), Mode::Train);
            let after = episode.position(0);
            for (at, solid) in &obstacles {
                let outline = Outline::new(solid);
                let (from, to) = (subtract(before, *at), subtract(after, *at));
                let wall = matches!(outline, Outline::Segment(_));
                prop_assert!(!wall || outline.crossing(from, to).is_none(), "{:?} to {:?}", before, after);
                prop_assert!(before == after || outline.distance(to) >= radius, "{:?}", after);
            }
        }
    }
}
