use mpgx_lang::plan::*;

use super::*;
use crate::sample::{self, binary, group, negated, number, position, vector};

fn at(line: usize) -> Place {
    Place { file: "it.scn".into(), line, column: 1 }
}

fn place(agent: AgentId, x: f64, y: f64) -> TestStep {
    TestStep::Place { agent, position: vector(x, y), at: at(1) }
}

fn steer(agent: AgentId, x: f64, y: f64) -> TestStep {
    TestStep::Steer { agent, velocity: vector(x, y), at: at(2) }
}

fn step(steps: usize) -> TestStep {
    TestStep::Step { steps, at: at(3) }
}

/// That a number is what it should be, to 1e-12.
fn check(actual: Expr, expected: f64) -> TestStep {
    let miss = Expr::Call(Function::Abs, vec![binary(BinaryOp::Sub, actual.clone(), number(expected))]);
    let holds = binary(BinaryOp::Less, miss, number(1e-12));
    TestStep::Check { text: "it".into(), actual: Some(actual), holds, at: at(4) }
}

fn holds(holds: Expr) -> TestStep {
    TestStep::Check { text: "so".into(), actual: None, holds, at: at(5) }
}

fn fixed(agent: AgentId) -> AgentRef {
    AgentRef::Fixed(agent)
}

fn x(agent: AgentId) -> Expr {
    Expr::Call(Function::X, vec![position(fixed(agent))])
}

fn plan() -> Plan {
    let mut world = sample::unison(sample::point());
    world.groups[0].control = sample::velocity(vector(0.2, 0.0));
    let far = binary(BinaryOp::Greater, x(1), number(1.0));
    world.ends = vec![sample::end("far", far, Some(2.0))];
    world.groups[1].arena = Some(Area { x_m: (-2.0, 2.0), y_m: (-2.0, 2.0) });
    sample::plan(world)
}

fn run(plan: &Plan, steps: Vec<TestStep>) -> Result<(), TestFailure> {
    run_test(plan, &Test { name: "it".into(), steps, at: Place::default() })
}

fn measured(measure: Measure) -> Expr {
    Expr::Measured(measure)
}

/// The followers in their places, then a first one that leaves its own at 0.5 m/s.
#[test]
fn a_test_prescribes_an_episode() {
    let steps = vec![
        place(0, 0.0, 0.0),
        place(1, -0.4, 0.0),
        place(2, -0.4, -0.4),
        place(3, 0.0, -0.4),
        check(measured(Measure::Error), 0.0),
        check(measured(Measure::Reward), 0.0),
        steer(1, 0.0, 0.5),
        check(x(0), 0.0),
        step(2),
        // The leader goes on at 0.2 m/s, the others stand.
        check(x(0), 0.04),
        check(x(2), -0.4),
        check(Expr::Call(Function::Y, vec![position(fixed(1))]), 0.1),
        check(Expr::Time, 0.2),
        check(Expr::Call(Function::Norm, vec![Expr::Agent(Quantity::Command, fixed(1))]), 0.5),
        check(measured(Measure::Term(0)), -(0.0016f64 + 0.01).sqrt() - 0.08),
        check(measured(Measure::Error), ((0.0016f64 + 0.01).sqrt() + 0.08) / 3.0),
        check(measured(Measure::Term(1)), 0.0),
        place(1, 0.04, 0.05),
        check(measured(Measure::Term(1)), -1.0),
        check(Expr::Call(Function::Norm, vec![Expr::Agent(Quantity::Velocity, fixed(1))]), 0.0),
        holds(Expr::Unary(UnaryOp::Not, Box::new(measured(Measure::Ended(0))))),
    ];
    assert_eq!(run(&plan(), steps), Ok(()));
}

#[test]
fn ends_cost_and_nobody_is_put_back() {
    let steps = vec![
        place(1, 2.0, 0.0),
        steer(1, 9.0, 0.0),
        step(1),
        check(x(1), 2.07),
        holds(Expr::Agent(Quantity::Outside, fixed(1))),
        holds(measured(Measure::Ended(0))),
        place(0, 2.47, 0.0),
        place(2, 2.07, -0.4),
        place(3, 2.47, -0.4),
        check(measured(Measure::Term(0)), 0.0),
        check(measured(Measure::Reward), -2.0),
        place(1, 0.0, 0.0),
        holds(Expr::Unary(UnaryOp::Not, Box::new(Expr::Agent(Quantity::Outside, fixed(1))))),
    ];
    assert_eq!(run(&plan(), steps), Ok(()));
}

#[test]
fn agents_are_turned() {
    let mut plan = plan();
    plan.world.groups.push(group("car", 1, sample::unicycle(), Control::Still, Some(vector(0.0, 0.0))));
    let turn = |agent, radians| TestStep::Turn { agent, heading: number(radians), at: at(6) };
    let heading = |agent| Expr::Agent(Quantity::Heading, fixed(agent));
    let steps = vec![
        turn(4, 0.75),
        turn(1, -2.0),
        check(heading(4), 0.75),
        check(heading(1), -2.0),
        step(1),
        check(heading(4), 0.75),
        turn(4, 4.0),
        check(heading(4), 4.0 - std::f64::consts::TAU),
        check(heading(0), 0.0),
    ];
    assert_eq!(run(&plan, steps), Ok(()));
}

/// A motion of positions takes its agent back at the next step; one of velocities goes on from there.
#[test]
fn a_motion_goes_on_after_its_agent_was_placed() {
    let mut plan = plan();
    let steps = || vec![place(0, 5.0, 0.0), check(x(0), 5.0), step(1)];
    let with = |end: f64| steps().into_iter().chain([check(x(0), end)]).collect();
    assert_eq!(run(&plan, with(5.02)), Ok(()));
    plan.world.groups[0].control = sample::at(Expr::Vector(Box::new(Expr::Time), Box::new(number(0.0))));
    assert_eq!(run(&plan, with(0.1)), Ok(()));
}

/// `require` holds at the start, which is that of an episode of master 0, and not after placing.
#[test]
fn a_test_begins_as_an_episode_does() {
    let mut plan = plan();
    plan.world.require = vec![binary(
        BinaryOp::Greater,
        sample::distance(position(fixed(1)), position(fixed(2))),
        number(0.5),
    )];
    let task = Task::new(&plan, &plan.world).unwrap();
    let mut episode = task.episode();
    task.reset(&mut episode, EpisodeKey::default()).unwrap();
    let begun = episode.position(1)[0];
    let steps = vec![check(x(1), begun), place(1, 0.0, 0.0), place(2, 0.0, 0.0), check(x(2), 0.0)];
    assert_eq!(run(&plan, steps), Ok(()));
}

#[test]
fn a_failure_tells_what_it_found_and_where() {
    let found = run(&plan(), vec![place(0, 0.5, 0.0), step(3), check(x(0), 0.5)]).unwrap_err();
    assert_eq!(found.to_string(), "after 3 steps `it` does not hold: it is 0.56");
    let TestFailure::Check { at: place, step: 3, actual: Some(_), .. } = found else { panic!("{found:?}") };
    assert_eq!(place, at(4));
    let found = run(&plan(), vec![holds(Expr::Truth(false))]).unwrap_err();
    assert_eq!(found.to_string(), "after 0 steps `so` does not hold");
    let mut runaway = plan();
    let ln = Expr::Call(Function::Ln, vec![negated(Expr::Time)]);
    runaway.world.reward[0].value = ln;
    let found = run(&runaway, vec![step(5)]).unwrap_err();
    assert_eq!(found.to_string(), "after 1 steps reward term `gap` is NaN");
}

#[test]
fn what_a_test_cannot_do_is_refused() {
    let refusal = |step| run(&plan(), vec![step]).unwrap_err().to_string();
    let head = "test `it`: ";
    assert_eq!(refusal(place(4, 0.0, 0.0)), format!("{head}agent 4 does not exist (it.scn:1:1)"));
    assert_eq!(
        refusal(steer(0, 0.0, 0.0)),
        format!("{head}leader is not commanded by the policy (it.scn:2:1)")
    );
    let unknown = measured(Measure::Term(2));
    assert_eq!(refusal(check(unknown, 0.0)), format!("{head}there is no such term or end (it.scn:4:1)"));
    assert_eq!(
        refusal(holds(number(0.0))),
        format!("{head}expected a truth value, found a number (it.scn:5:1)")
    );
    let mut plan = plan();
    plan.world.reward[0].value = measured(Measure::Reward);
    let refused = Task::new(&plan, &plan.world).unwrap_err().to_string();
    assert!(refused.contains("terms and measures are known only in tests"), "{refused}");
}
