use mpgx_lang::plan::*;

use crate::episode::{Episode, EpisodeKey};
use crate::maths::{Vec2, distance};
use crate::sample::{self, binary, number, vector};
use crate::step::{Mode, Step};
use crate::task::Task;

const I: AgentRef = AgentRef::Var(0);
const J: AgentRef = AgentRef::Var(1);

fn formation(about: Option<AgentId>, graph: Graph, lengths: Vec<Expr>) -> Formation {
    let constraint = Constraint::Distances(lengths);
    Formation {
        name: "D".into(),
        shape: "d".into(),
        group: 1,
        about,
        constraint,
        graph,
        at: Place::default(),
    }
}

/// A leader and three followers that keep distances.
fn world(formation: Formation) -> World {
    let mut world = sample::unison(sample::point());
    world.formations = vec![formation];
    world.groups[1].start = Some(vector(0.0, 0.0));
    world.observe.clear();
    let length = sample::distance(sample::position(I), sample::position(J));
    let miss = Expr::Call(Function::Abs, vec![binary(BinaryOp::Sub, length, Expr::Rest(0, I, J))]);
    world.reward =
        vec![sample::term("miss", sample::reduce(Reduction::Mean, &[0, 1], IndexSet::Edges(0), miss))];
    world
}

fn stepped(world: World, places: [Vec2; 4]) -> (Step, Episode) {
    let task = sample::task(world);
    let mut episode = task.episode();
    task.reset(&mut episode, EpisodeKey::default()).unwrap();
    episode.agents.position = places.to_vec();
    let step = task.step(&mut episode, &[0.0; 6], Mode::Train);
    (step, episode)
}

fn refusal(world: World) -> String {
    let plan = sample::plan(world);
    Task::new(&plan, &plan.world).unwrap_err().to_string()
}

/// A leader at the origin, followers at (3, 0), (0, 4) and (6, 8): distances 3, 4, 10, 5, √73 and √52.
const PLACES: [Vec2; 4] = [[0.0, 0.0], [3.0, 0.0], [0.0, 4.0], [6.0, 8.0]];

#[test]
fn the_error_is_what_distances_of_neighbours_differ() {
    let [a, b] = [73f64.sqrt(), 52f64.sqrt()];
    let cases = [
        (Some(0), Graph::Star, vec![number(4.0)], (1.0 + 0.0 + 6.0) / 3.0),
        (Some(0), Graph::Path, vec![number(4.0)], (1.0 + 1.0 + (b - 4.0)) / 3.0),
        (Some(0), Graph::Ring, vec![number(4.0)], (1.0 + 1.0 + (b - 4.0) + 6.0) / 4.0),
        (None, Graph::Complete, vec![number(5.0)], (0.0 + (a - 5.0) + (b - 5.0)) / 3.0),
        (Some(0), Graph::Edges(vec![(0, 3), (2, 1)]), vec![number(9.0), number(1.0)], (1.0 + 4.0) / 2.0),
        // In the order of pairs: 0-1, 0-2, 0-3, 1-2, 1-3, 2-3.
        (Some(0), Graph::Complete, [3.0, 4.0, 10.0, 5.0, a + 0.6, b].map(number).into(), 0.1),
    ];
    for (about, graph, lengths, expected) in cases {
        let (step, episode) = stepped(world(formation(about, graph.clone(), lengths)), PLACES);
        assert!((step.error_m - expected).abs() < 1e-14, "{graph:?}: {}, not {expected}", step.error_m);
        assert!((step.reward - step.error_m).abs() < 1e-14, "{graph:?}: reduced over the edges");
        assert!(episode.slots().is_empty());
    }
}

#[test]
fn the_errors_of_all_formations_are_put_together() {
    let mut world = world(formation(Some(0), Graph::Star, vec![number(4.0)]));
    world.formations.push(sample::unison(sample::point()).formations.remove(0));
    let (step, episode) = stepped(world, PLACES);
    assert_eq!(episode.slots().len(), 3);
    let places: f64 = episode.slots().iter().zip(&PLACES[1..]).map(|(f, p)| distance(*f, *p)).sum();
    assert!((step.error_m - (places + 7.0) / 6.0).abs() < 1e-14);
}

#[test]
fn places_have_distances_too() {
    let mut world = sample::unison(sample::point());
    let rest = |a, b| Expr::Rest(0, AgentRef::Fixed(a), AgentRef::Fixed(b));
    // Places (−0.4, 0), (−0.4, −0.4), (0, −0.4) about the leader.
    world.formations[0].graph = Graph::Complete;
    world.reward = vec![
        sample::term("leader", rest(2, 0)),
        sample::term("followers", rest(1, 3)),
        sample::term("all", sample::reduce(Reduction::Sum, &[0, 1], IndexSet::Edges(0), Expr::Rest(0, I, J))),
    ];
    let (_, episode) = stepped(world, PLACES);
    let diagonal = 0.32f64.sqrt();
    for (found, expected) in episode.terms().iter().zip([diagonal, diagonal, 4.0 * 0.4 + 2.0 * diagonal]) {
        assert!((found - expected).abs() < 1e-15, "{found}, not {expected}");
    }
}

/// The leader looks along y after its first step; its follower belongs 0.4 m behind it.
#[test]
fn places_turn_with_the_heading_of_the_leader() {
    let mut world = sample::unison(sample::point());
    world.groups[0].control = sample::velocity(vector(0.0, 0.5));
    if let Constraint::Displacements { frame, .. } = &mut world.formations[0].constraint {
        *frame = Frame::Heading;
    }
    let task = sample::task(world.clone());
    let mut episode = task.episode();
    task.reset(&mut episode, EpisodeKey::default()).unwrap();
    assert_eq!(episode.slots()[0], [-0.4, 0.0], "x at first");
    task.step(&mut episode, &[0.0; 6], Mode::Train);
    for (slot, expected) in episode.slots().iter().zip([[0.0, -0.35], [0.4, -0.35], [0.4, 0.05]]) {
        assert!(distance(*slot, expected) < 1e-15, "{slot:?}, not {expected:?}");
    }
    // A unicycle has a heading, wherever it goes.
    world.groups[0].body = sample::unicycle();
    let task = sample::task(world);
    task.reset(&mut episode, EpisodeKey::default()).unwrap();
    let (sin, cos) = libm::sincos(episode.heading(0));
    assert!(distance(episode.slots()[0], [-0.4 * cos, -0.4 * sin]) < 1e-15);
}

#[test]
fn what_a_formation_cannot_be_is_refused() {
    let distances = |about, graph, lengths: &[f64]| {
        refusal(world(formation(about, graph, lengths.iter().map(|x| number(*x)).collect())))
    };
    let counts = "formation `D` has 2 distances for 3 edges; it needs one, or one for each";
    assert_eq!(distances(Some(0), Graph::Star, &[1.0, 2.0]), counts);
    assert_eq!(
        distances(Some(0), Graph::Star, &[]),
        "formation `D` has 0 distances for 3 edges; it needs one, or one for each"
    );
    assert_eq!(
        distances(None, Graph::Edges(vec![(0, 3)]), &[1.0]),
        "formation `D`: the edge (0, 3) is not between two of 3 nodes, which are numbered from 0"
    );
    assert_eq!(
        distances(Some(4), Graph::Star, &[1.0]),
        "formation `D` refers to the agent 4, which does not exist"
    );
    let places = Constraint::Displacements { slots: Slots::Rule(vector(0.0, 0.0)), frame: Frame::Global };
    let nobody = Formation { constraint: places, ..formation(None, Graph::Star, vec![]) };
    assert_eq!(
        refusal(world(nobody)),
        "formation `D`: the places of a formation need an agent that they are about"
    );
    let mut large = world(formation(None, Graph::Complete, vec![number(1.0)]));
    large.groups[1].size = 10_000;
    assert!(refusal(large).contains("a graph of 49995000 edges is too large"));

    let with = |value: Expr| {
        let mut world = world(formation(Some(0), Graph::Star, vec![number(4.0)]));
        world.reward[0].value = value;
        refusal(world)
    };
    let fixed = AgentRef::Fixed;
    let neighbours = "reward term `miss`: they are no neighbours in this formation, or not the two variables of its \
                      edges (miss.scn:2:3)";
    assert_eq!(with(Expr::Rest(0, fixed(1), fixed(2))), neighbours);
    let pairs = IndexSet::Pairs(Box::new(IndexSet::All));
    assert_eq!(with(sample::reduce(Reduction::Sum, &[0, 1], pairs, Expr::Rest(0, I, J))), neighbours);
    let other = sample::reduce(Reduction::Sum, &[0, 1], IndexSet::Edges(0), Expr::Rest(0, I, I));
    assert_eq!(with(other), neighbours);
    let slot = Expr::Call(Function::X, vec![Expr::Slot(0, fixed(1))]);
    assert_eq!(with(slot), "reward term `miss`: formation `D` tells distances, not places (miss.scn:2:3)");
}
