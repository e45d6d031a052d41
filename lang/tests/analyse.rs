//! What the compiler knows of Plans made by hand.
#![allow(clippy::unwrap_used)]

use mpgx_lang::analyse::bounds::bounds;
use mpgx_lang::analyse::formations::formations;
use mpgx_lang::analyse::interval::Interval;
use mpgx_lang::analyse::optimum::optimum;
use mpgx_lang::analyse::scene::{Mode, Scene};
use mpgx_lang::analyse::{Ground, influence, space};
use mpgx_lang::hir::Hir;
use mpgx_lang::plan::{
    AgentRef, Area, BinaryOp, Binder, Constraint, Control, Distribution, End, Expr, Formation, Graph, Group,
    IndexSet, Observation, Param, Place, Plan, Quantity, Reduction, Solid, Term, UnaryOp, World,
};
use mpgx_lang::problem::{Problem, Problems, Severity};

fn boxed(expr: Expr) -> Box<Expr> {
    Box::new(expr)
}

fn number(value: f64) -> Expr {
    Expr::Number(value)
}

fn vector(x: f64, y: f64) -> Expr {
    Expr::Vector(boxed(number(x)), boxed(number(y)))
}

fn binary(op: BinaryOp, a: Expr, b: Expr) -> Expr {
    Expr::Binary(op, boxed(a), boxed(b))
}

fn negated(expr: Expr) -> Expr {
    Expr::Unary(UnaryOp::Neg, boxed(expr))
}

fn position(agent: AgentRef) -> Expr {
    Expr::Agent(Quantity::Position, agent)
}

fn apart(a: AgentRef, b: AgentRef) -> Expr {
    Expr::Call(mpgx_lang::plan::Function::Norm, vec![binary(BinaryOp::Sub, position(a), position(b))])
}

fn sum(var: usize, over: IndexSet, body: Expr) -> Expr {
    let vars = vec![Binder { id: var, name: "i".into() }];
    Expr::Reduce { op: Reduction::Sum, vars, over, filter: None, body: boxed(body) }
}

fn group(name: &str, size: usize, control: Control, start: Expr) -> Group {
    Group { name: name.into(), size, control, speed_mps: (-1.0, 1.0), start: Some(start), ..Group::default() }
}

fn term(value: Expr) -> Term {
    Term { name: "term".into(), doc: String::new(), value, dimension: "length".into(), at: Place::default() }
}

/// A leader that stands still, followers that learn, and obstacles.
fn plan(followers: usize, obstacles: usize, reward: Vec<Expr>) -> Plan {
    let mut obstacle = group("obstacle", obstacles, Control::Still, vector(3.0, 0.0));
    obstacle.solid = Some(Solid::Disc { radius_m: 0.2 });
    let world = World {
        dt_s: 0.1,
        horizon: 200,
        safety_m: 0.1,
        groups: vec![
            group("leader", 1, Control::Still, vector(0.0, 0.0)),
            group("follower", followers, Control::Learned, vector(1.0, 0.0)),
            obstacle,
        ],
        reward: reward.into_iter().map(term).collect(),
        ..World::default()
    };
    Plan {
        params: vec![Param { name: "k".into(), value: 0.3, ..Param::default() }],
        world,
        ..Plan::default()
    }
}

/// Problems that a part of the analysis finds.
fn found(plan: &Plan, part: impl Fn(&Scene, &mut Ground)) -> Vec<Problem> {
    let (hir, mut problems) = (Hir::default(), Problems::default());
    part(&Scene::new(plan, &plan.world, Mode::Training), &mut Ground::new(plan, &hir, &mut problems));
    problems.iter().cloned().collect()
}

fn codes(problems: &[Problem]) -> Vec<&str> {
    problems.iter().map(|problem| problem.code.name).collect()
}

/// What surely happens in every step is paid in every step of an evaluation; what may happen, perhaps.
#[test]
fn costs_of_ends_are_bounded_by_what_can_hold() {
    let near = binary(BinaryOp::Less, apart(AgentRef::Fixed(0), FOLLOWER), number(0.1));
    for (when, costs) in
        [(Expr::Truth(true), (2.0, 2.0)), (Expr::Truth(false), (0.0, 0.0)), (near, (0.0, 2.0))]
    {
        let mut plan = plan(1, 0, vec![number(0.0)]);
        let cost = Some(number(2.0));
        plan.world.ends = vec![End { name: "end".into(), when, failure: true, cost, at: Place::default() }];
        let found = bounds(&Scene::new(&plan, &plan.world, Mode::Training));
        let about = |bounds: Interval| [bounds.low, bounds.high].map(|end| (1e9 * end).round() / 1e9);
        assert_eq!(about(found.costs), [costs.0, costs.1]);
        assert_eq!(about(-found.reward), [costs.0, costs.1]);
    }
}

// Where the optimum lies.

const FOLLOWER: AgentRef = AgentRef::Fixed(1);

fn gap() -> Expr {
    negated(apart(AgentRef::Fixed(0), FOLLOWER))
}

fn best_of(plan: &Plan) -> Vec<Problem> {
    found(plan, |scene, ground| {
        let endless = Scene::new(scene.plan, scene.world, Mode::Endless);
        optimum(scene, &endless, &influence::movers(scene), ground);
    })
}

fn where_is_the_best(reward: Vec<Expr>, obstacles: usize) -> Vec<&'static str> {
    best_of(&plan(1, obstacles, reward)).iter().map(|problem| problem.code.name).collect()
}

#[test]
fn the_papers_obstacle_reward_is_too_weak_or_too_strong() {
    let avoid =
        |k: f64, distance: Expr| binary(BinaryOp::Mul, number(k), sum(5, IndexSet::Obstacles, distance));
    let distance = || apart(FOLLOWER, AgentRef::Var(5));
    for (k, obstacles, code) in [
        (0.3, 3, "avoidance-without-effect"),
        (1.0 / 3.0, 3, "avoidance-without-effect"),
        (0.34, 3, "fleeing-pays"),
        (0.34, 2, "avoidance-without-effect"),
        (1.5, 1, "fleeing-pays"),
    ] {
        let two_terms = vec![gap(), avoid(k, distance())];
        let one_term = vec![binary(BinaryOp::Add, gap(), avoid(k, distance()))];
        let clearance = vec![gap(), avoid(k, Expr::Clearance(FOLLOWER, AgentRef::Var(5)))];
        for reward in [two_terms, one_term, clearance] {
            assert_eq!(where_is_the_best(reward, obstacles), [code], "{k} of {obstacles}");
        }
    }
    // A range, a square, or nothing to avoid: nothing is said.
    let near = |distance| Expr::Call(mpgx_lang::plan::Function::Min, vec![distance, number(0.25)]);
    let silent: Vec<&str> = Vec::new();
    assert_eq!(where_is_the_best(vec![gap(), avoid(5.0, near(distance()))], 2), silent);
    let squared = binary(BinaryOp::Pow, distance(), number(2.0));
    assert_eq!(where_is_the_best(vec![gap(), avoid(0.1, squared)], 2), silent);
    assert_eq!(where_is_the_best(vec![gap()], 2), silent);
    assert_eq!(where_is_the_best(vec![gap(), avoid(-0.3, distance())], 3), silent, "drawn to obstacles");
    // Twice the distance weighs twice.
    let twice = binary(
        BinaryOp::Mul,
        number(2.0),
        binary(BinaryOp::Sub, position(AgentRef::Fixed(0)), position(FOLLOWER)),
    );
    let twice = negated(Expr::Call(mpgx_lang::plan::Function::Norm, vec![twice]));
    for (k, code) in [(0.6, "avoidance-without-effect"), (0.7, "fleeing-pays")] {
        assert_eq!(where_is_the_best(vec![twice.clone(), avoid(k, distance())], 3), [code], "{k}");
    }
    // A penalty that is bounded does not keep anybody from running away, but may make him avoid something.
    let crash = negated(Expr::Reduce {
        op: Reduction::Count,
        vars: vec![Binder { id: 6, name: "o".into() }],
        over: IndexSet::Obstacles,
        filter: None,
        body: boxed(binary(BinaryOp::Less, apart(FOLLOWER, AgentRef::Var(6)), number(0.3))),
    });
    assert_eq!(where_is_the_best(vec![gap(), avoid(0.6, distance()), crash.clone()], 2), ["fleeing-pays"]);
    assert_eq!(where_is_the_best(vec![gap(), avoid(0.4, distance()), crash], 2), silent);
}

#[test]
fn each_member_of_a_group_counts_for_itself() {
    let var = AgentRef::Var;
    let gaps = negated(sum(1, IndexSet::Group(1), apart(AgentRef::Fixed(0), var(1))));
    let avoid = |k: f64| {
        let one = sum(3, IndexSet::Obstacles, apart(var(2), var(3)));
        binary(BinaryOp::Mul, number(k), sum(2, IndexSet::Group(1), one))
    };
    let best =
        |reward| best_of(&plan(3, 2, reward)).iter().map(|problem| problem.code.name).collect::<Vec<_>>();
    assert_eq!(best(vec![gaps.clone(), avoid(0.4)]), ["avoidance-without-effect"]);
    assert_eq!(best(vec![gaps.clone(), avoid(0.6)]), ["fleeing-pays"]);
    // Learned agents keep away from each other: where all of them are best is another question.
    let pairs = Expr::Reduce {
        op: Reduction::Sum,
        vars: vec![Binder { id: 4, name: "i".into() }, Binder { id: 5, name: "j".into() }],
        over: IndexSet::Pairs(Box::new(IndexSet::Group(1))),
        filter: None,
        body: boxed(apart(var(4), var(5))),
    };
    assert!(best(vec![gaps, pairs]).is_empty());
}

/// All pairs of agents: the follower and the leader once, the follower and each of two beacons.
#[test]
fn pairs_of_two_groups_count_as_often_as_there_are() {
    let best = |k: f64| {
        let pairs = Expr::Reduce {
            op: Reduction::Sum,
            vars: vec![Binder { id: 4, name: "i".into() }, Binder { id: 5, name: "j".into() }],
            over: IndexSet::Pairs(Box::new(IndexSet::All)),
            filter: None,
            body: boxed(apart(AgentRef::Var(4), AgentRef::Var(5))),
        };
        let mut plan = plan(1, 0, vec![gap(), binary(BinaryOp::Mul, number(k), pairs)]);
        plan.world.groups.push(group("beacon", 2, Control::Still, vector(-3.0, 0.0)));
        best_of(&plan).iter().map(|problem| problem.code.name).collect::<Vec<_>>()
    };
    assert_eq!(best(0.32), ["avoidance-without-effect"]);
    assert_eq!(best(0.35), ["fleeing-pays"]);
}

/// In the middle of a square of three metres, the nearest outline is a metre and a half away.
#[test]
fn clearance_is_as_low_as_a_polygon_is_deep() {
    let mut plan = plan(1, 1, vec![Expr::Clearance(FOLLOWER, AgentRef::Fixed(2))]);
    let corners_m = vec![(-1.5, -1.5), (1.5, -1.5), (1.5, 1.5), (-1.5, 1.5)];
    let [.., follower, obstacle] = plan.world.groups.as_mut_slice() else { panic!("no groups") };
    follower.control = Control::Still;
    follower.start = obstacle.start.clone();
    obstacle.solid = Some(Solid::Polygon { corners_m });
    let reward = bounds(&Scene::new(&plan, &plan.world, Mode::Training)).reward;
    assert!(reward.low <= -1.5 && reward.low > -1.51, "{reward:?}");
}

// Distances.

fn distances(followers: usize, about: bool, graph: Graph, lengths: &[f64]) -> Plan {
    let mut plan = plan(followers, 0, vec![gap()]);
    plan.world.formations.push(Formation {
        name: "F".into(),
        shape: "distances".into(),
        group: 1,
        about: about.then_some(0),
        constraint: Constraint::Distances(lengths.iter().copied().map(number).collect()),
        graph,
        at: Place::default(),
    });
    plan
}

fn said_of(plan: &Plan) -> (Vec<&'static str>, String) {
    let problems = found(plan, formations);
    let text = problems.iter().map(|problem| {
        let help = problem.help.iter().cloned();
        [problem.message.clone()]
            .into_iter()
            .chain(problem.notes.clone())
            .chain(help)
            .collect::<Vec<_>>()
            .join("; ")
    });
    (problems.iter().map(|problem| problem.code.name).collect(), text.collect())
}

#[test]
fn distances_that_cannot_be_are_errors() {
    let edges = |all: &[(usize, usize)]| Graph::Edges(all.to_vec());
    let (codes, text) = said_of(&distances(2, true, Graph::Complete, &[1.0, 2.5, 1.0]));
    assert_eq!(codes, ["unrealisable"]);
    assert!(text.contains("`leader` and `follower[2]` should be 2.5 m apart, but by way of `follower[1]` they are at most 2 m"), "{text}");
    assert_eq!(said_of(&distances(3, true, Graph::Complete, &[1.0])).0, ["unrealisable"]);
    assert_eq!(said_of(&distances(999, true, Graph::Complete, &[1.0])).0, ["unrealisable"]);
    assert_eq!(said_of(&distances(2, true, Graph::Complete, &[1.0])).0, [] as [&str; 0]);
    let errors =
        |plan: &Plan| found(plan, formations).iter().filter(|it| it.severity == Severity::Error).count();
    assert_eq!(errors(&distances(3, true, Graph::Complete, &[1.0])), 1);
    // All triangles close, and still no plane has room for it: nearly equal distances of four.
    let tight = distances(3, true, Graph::Complete, &[1.0, 1.1, 1.0, 1.0, 1.0, 1.0]);
    assert_eq!((said_of(&tight).0, errors(&tight)), (vec!["unrealisable"], 0));
    // A square with both diagonals.
    let diagonal = 2f64.sqrt();
    let square = [1.0, diagonal, 1.0, 1.0, diagonal, 1.0];
    assert_eq!(said_of(&distances(3, true, Graph::Complete, &square)).0, [] as [&str; 0]);
    let (codes, text) = said_of(&distances(2, true, Graph::Complete, &[1.0, -1.0, 1.0]));
    assert_eq!(codes, ["unrealisable"]);
    assert!(text.contains("a distance of -1 m cannot be"), "{text}");
    assert_eq!(said_of(&distances(1, true, Graph::Complete, &[-1.0])).0, ["unrealisable"]);
    // A Plan that nobody compiled can name nodes that are not there.
    let (codes, text) =
        said_of(&distances(2, true, edges(&[(0, 1), (1, 7), (7, 1), (2, 2), (0, 2)]), &[1.0]));
    assert_eq!((codes, text.contains("can swing about `leader`")), (vec!["not-rigid"], true), "{text}");
    let apart = edges(&[(0, 1), (2, 3)]);
    let (codes, text) = said_of(&distances(3, true, apart, &[1.0]));
    assert_eq!(codes, ["unconnected"]);
    assert!(text.contains("between `leader` and `follower[2]`"), "{text}");
}

#[test]
fn free_motions_are_counted_and_named() {
    let (codes, text) = said_of(&distances(3, true, Graph::Ring, &[1.0]));
    assert_eq!(codes, ["not-rigid"]);
    assert!(text.contains("one motion keeps all its distances"), "{text}");
    assert!(
        text.contains("one more distance is needed, for example between `leader` and `follower[2]`"),
        "{text}"
    );
    let (codes, text) = said_of(&distances(2, true, Graph::Star, &[1.0]));
    assert_eq!(codes, ["not-rigid"]);
    assert!(text.contains("`follower[2]` can swing about `leader`"), "{text}");
    let (codes, text) = said_of(&distances(999, true, Graph::Ring, &[1.0]));
    assert_eq!(codes, ["not-rigid"]);
    assert!(text.contains("997 more distances"), "{text}");
    assert_eq!(said_of(&distances(2, false, Graph::Path, &[1.0])).0, [] as [&str; 0], "two nodes, one edge");
}

#[test]
fn other_shapes_with_the_same_distances_are_named() {
    let braced = Graph::Edges(vec![(0, 1), (1, 2), (2, 3), (3, 0), (0, 2)]);
    let lengths = [1.0, 1.0, 1.0, 1.0, 1.2];
    let (codes, text) = said_of(&distances(3, true, braced, &lengths));
    assert_eq!(codes, ["ambiguous-shape"]);
    assert!(text.contains("between `follower[3]` and `follower[1]`"), "{text}");
    // A triangle without symmetry, and one where the followers may swap.
    assert_eq!(said_of(&distances(2, true, Graph::Complete, &[1.0, 1.5, 0.8])).0, ["mirror-image"]);
    assert_eq!(said_of(&distances(2, true, Graph::Complete, &[1.0, 1.0, 0.8])).0, [] as [&str; 0]);
}

// Room.

#[test]
fn starts_keep_out_of_obstacles() {
    let at = |start: Expr| {
        let mut plan = plan(1, 1, vec![gap()]);
        plan.world.groups[1].start = Some(start);
        let problems = found(&plan, |scene, ground| space::space(scene, None, ground));
        problems.iter().map(|problem| (problem.code.name, problem.severity)).collect::<Vec<_>>()
    };
    assert_eq!(at(vector(3.1, 0.0)), [("start-in-obstacle", Severity::Error)]);
    assert_eq!(at(vector(3.3, 0.0)), []);
    let side = |low, high, site| Expr::Draw {
        distribution: Distribution::Uniform { low: boxed(number(low)), high: boxed(number(high)) },
        site,
    };
    let region = Expr::Vector(boxed(side(2.0, 4.0, 0)), boxed(side(-1.0, 1.0, 1)));
    assert_eq!(at(region), [("start-in-obstacle", Severity::Warning)]);
}

#[test]
fn obstacles_that_never_move_are_nothing_to_learn_from() {
    let mut plan = plan(1, 1, vec![gap()]);
    plan.world.groups[1].arena = Some(Area { x_m: (-2.0, 2.0), y_m: (-2.0, 2.0) });
    let observed = |value| Observation {
        text: "seen".into(),
        value,
        vector: true,
        over: None,
        noise: None,
        delay: 0,
        at: Place::default(),
    };
    plan.world.observe = vec![observed(position(AgentRef::Fixed(2))), observed(position(FOLLOWER))];
    assert_eq!(codes(&found(&plan, influence::influence)), ["constant-observation"]);
    plan.world.observe[0].noise = Some(number(0.1));
    assert!(found(&plan, influence::influence).is_empty());
}
