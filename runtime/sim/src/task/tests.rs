use mpgx_lang::plan::*;

use super::*;
use crate::sample::{self, binary, number, position, vector};

/// The message for a world that `spoil` has changed.
fn refusal(spoil: impl FnOnce(&mut World)) -> String {
    let mut world = sample::unison(sample::unicycle());
    spoil(&mut world);
    let plan = sample::plan(world);
    match Task::new(&plan, &plan.world) {
        Ok(_) => panic!("the world was accepted"),
        Err(error) => error.to_string(),
    }
}

/// The flaw that is found in a reward term.
fn flaw(value: Expr) -> String {
    let message = refusal(|world| world.reward[0].value = value);
    let (head, tail) = ("reward term `gap`: ", " (gap.scn:2:3)");
    message
        .strip_prefix(head)
        .and_then(|rest| rest.strip_suffix(tail))
        .unwrap_or_else(|| panic!("{message}"))
        .into()
}

fn var(id: VarId) -> Expr {
    position(AgentRef::Var(id))
}

fn norm(v: Expr) -> Expr {
    Expr::Call(Function::Norm, vec![v])
}

fn pairs(set: IndexSet) -> IndexSet {
    IndexSet::Pairs(Box::new(set))
}

#[test]
fn numbers_out_of_range_are_refused() {
    for dt in [0.0, -0.1, f64::NAN, f64::INFINITY] {
        assert_eq!(
            refusal(|w| w.dt_s = dt),
            format!("the time step is {dt}; it must be a finite time above 0 s")
        );
    }
    assert_eq!(refusal(|w| w.horizon = 0), "the horizon is 0; it must be at least 1 step");
    assert!(refusal(|w| w.safety_m = -1.0).starts_with("the safety distance is -1; it must be"));
    assert!(
        refusal(|w| w.groups[1].size = 1 << 17).starts_with("the number of agents is 131073; it must be")
    );
    assert!(
        refusal(|w| w.groups[1].size = usize::MAX).starts_with("the number of agents is inf; it must be")
    );
    let end = sample::end("never", Expr::Truth(false), None);
    assert!(refusal(|w| w.ends = vec![end; 65_537]).starts_with("the number of ends is 65537"));
    for (low, high) in [(0.7, -0.7), (f64::NAN, 0.7), (-0.7, f64::INFINITY), (-1e308, 1e308)] {
        let message = refusal(|w| w.groups[1].speed_mps = (low, high));
        assert!(message.starts_with("speed of `follower`: the limits"), "{message}");
    }
    let arena = Area { x_m: (-1.0, 1.0), y_m: (1.0, -1.0) };
    let message = refusal(|w| w.groups[1].arena = Some(arena));
    assert_eq!(
        message,
        "arena y of `follower`: the limits 1 and -1 must be finite, the lower one first (follower.scn:1:1)"
    );
}

#[test]
fn bodies_and_their_settings_are_checked() {
    let set = |name: &'static str, value| {
        move |w: &mut World| {
            w.groups[1].body.settings.insert(name.into(), value);
        }
    };
    assert_eq!(
        refusal(|w| w.groups[1].body.name = "drone".into()),
        "there is no body `drone` in the simulator; it has point, unicycle, steered, holonomic (follower.scn:1:1)"
    );
    assert_eq!(
        refusal(set("wheels", Setting::Number(3.0))),
        "`unicycle` has no setting `wheels`; it reads hand, drive, turn, rate, acceleration (follower.scn:1:1)"
    );
    assert_eq!(
        refusal(|w| drop(w.groups[1].body.settings.remove("hand"))),
        "`unicycle` lacks the setting `hand`, a finite number above 0 (follower.scn:1:1)"
    );
    for value in [Setting::Number(0.0), Setting::Number(f64::NAN), Setting::Truth(true)] {
        let message = refusal(set("hand", value));
        assert_eq!(
            message,
            "setting `hand` of `unicycle` must be a finite number above 0 (follower.scn:1:1)"
        );
    }
    let message = refusal(set("turn", Setting::Range(1.0, -1.0)));
    assert!(message.starts_with("setting `turn` of `unicycle` must be a finite range"), "{message}");
    let message = refusal(|w| {
        w.groups[0].body = sample::unicycle();
        w.groups[0].control = sample::at(vector(0.0, 0.0));
    });
    assert!(
        message.starts_with("a motion that tells positions cannot move the body `unicycle`"),
        "{message}"
    );
}

#[test]
fn formations_are_checked() {
    assert_eq!(
        refusal(|w| w.formations[0].group = 2),
        "formation `F` refers to the group 2, which does not exist"
    );
    assert_eq!(
        refusal(|w| w.formations[0].about = Some(4)),
        "formation `F` refers to the agent 4, which does not exist"
    );
    assert_eq!(
        refusal(|w| w.formations[0].constraint = sample::places(vec![vector(0.0, 0.0)])),
        "formation `F` has 1 slots, but its group `follower` has 3 members"
    );
    assert_eq!(
        refusal(|w| w.formations[0].constraint = sample::rule(Expr::Slot(0, AgentRef::Fixed(1)))),
        "slot 1 of formation `F`: places and distances of formations cannot be used inside a formation"
    );
}

#[test]
fn starts_look_only_at_agents_that_are_placed() {
    assert_eq!(
        refusal(|w| w.groups[1].start = None),
        "`follower` has no start; give it `start ~ …` or a motion that tells positions (follower.scn:1:1)"
    );
    let later = "the start of `leader`: follower[1] is placed later than the start that refers to it (leader.scn:1:1)";
    assert_eq!(refusal(|w| w.groups[0].start = Some(position(AgentRef::Fixed(1)))), later);
    let crowd = sample::reduce(Reduction::Sum, &[0], IndexSet::Group(1), norm(var(0)));
    let far = Expr::Vector(Box::new(crowd), Box::new(number(0.0)));
    assert_eq!(refusal(|w| w.groups[0].start = Some(far)), later);
    assert_eq!(
        refusal(|w| w.formations[0].about = Some(3)),
        "the start of `follower`: follower[3] is placed later than the start that refers to it (follower.scn:1:1)"
    );
    assert!(
        refusal(|w| w.groups[1].start = Some(position(AgentRef::Member)))
            .contains("follower[1] is placed later")
    );
}

#[test]
fn a_random_argument_is_one_draw_wherever_it_stands() {
    let along = |site| {
        Box::new(Expr::Draw {
            distribution: Distribution::Uniform { low: Box::new(number(-1.0)), high: Box::new(number(1.0)) },
            site,
        })
    };
    let leader = |start: Expr| {
        let mut world = sample::unison(sample::point());
        world.groups[0].start = Some(start);
        let task = sample::task(world);
        let mut episode = task.episode();
        task.reset(&mut episode, EpisodeKey::default()).unwrap();
        episode.position(0)
    };
    let [x, y] = leader(Expr::Vector(along(4), along(4)));
    assert_eq!(x, y);
    let [x, y] = leader(Expr::Vector(along(4), along(5)));
    assert_ne!(x, y);
    let start = |expr| refusal(|w| w.groups[0].start = Some(expr));
    let many = (0..17).map(|site| *along(site)).reduce(|a, b| binary(BinaryOp::Add, a, b)).unwrap();
    let many = start(Expr::Vector(Box::new(many), Box::new(number(0.0))));
    assert!(many.contains("more than 16 random draws in one expression"), "{many}");
    let twice = binary(BinaryOp::Add, *along(0), *along(0));
    let set = || IndexSet::Group(0);
    let twice = sample::reduce(Reduction::Sum, &[0], set(), twice);
    let twice = start(Expr::Vector(Box::new(twice), Box::new(number(0.0))));
    assert!(twice.contains("a random argument cannot be used more than once in a reduction"), "{twice}");
}

#[test]
fn motions_are_checked() {
    let motion = |start: Expr, next: Expr| {
        move |w: &mut World| {
            let states = vec![MotionState { name: "s".into(), start, next }];
            let output = MotionOutput::Velocity(vector(0.0, 0.0));
            w.groups[0].control = Control::Motion(Motion { name: "odd".into(), states, output });
        }
    };
    let head = "motion `odd` of `leader`: ";
    let kinds = refusal(motion(number(0.0), vector(0.0, 0.0)));
    assert_eq!(kinds, format!("{head}expected a number, found a vector (leader.scn:1:1)"));
    let itself = refusal(motion(Expr::State(0), number(0.0)));
    assert_eq!(itself, format!("{head}state variable 0 does not exist here (leader.scn:1:1)"));
    let truth = refusal(motion(Expr::Truth(true), Expr::Truth(true)));
    assert_eq!(truth, format!("{head}expected a number or a vector, found a truth value (leader.scn:1:1)"));
}

#[test]
fn expressions_are_checked() {
    let each = |op, vars: &[VarId], over, body| sample::reduce(op, vars, over, body);
    let add = |a, b| binary(BinaryOp::Add, a, b);
    for (value, message) in [
        (vector(0.0, 0.0), "expected a number, found a vector"),
        (Expr::Param(2), "parameter 2 does not exist"),
        (Expr::State(0), "state variable 0 does not exist here"),
        (Expr::SlotNumber, "slot numbers are known only inside a formation"),
        (norm(position(AgentRef::Fixed(4))), "agent 4 does not exist"),
        (
            norm(position(AgentRef::Member)),
            "the member's own quantities are known only in starts and motions",
        ),
        (norm(var(0)), "index variable 0 is not bound here"),
        (norm(Expr::Slot(1, AgentRef::Fixed(1))), "formation 1 does not exist"),
        (norm(Expr::Slot(0, AgentRef::Fixed(0))), "leader is no member of the formation's group"),
        (
            each(Reduction::Sum, &[0], IndexSet::All, norm(Expr::Slot(0, AgentRef::Var(0)))),
            "leader is no member of the formation's group",
        ),
        (norm(sample::draw(Distribution::UnitDisc)), "random draws are possible only in starts and motions"),
        (each(Reduction::Sum, &[0], IndexSet::Group(2), number(1.0)), "group 2 does not exist"),
        (
            each(Reduction::Sum, &[0], pairs(IndexSet::All), number(1.0)),
            "a reduction binds 1 variables, but its index set has 2",
        ),
        (
            each(Reduction::Sum, &[0, 1], pairs(pairs(IndexSet::All)), number(1.0)),
            "pairs cannot be the members of another set",
        ),
        (each(Reduction::Count, &[0], IndexSet::All, number(1.0)), "expected a truth value, found a number"),
        (
            each(Reduction::Any, &[0], IndexSet::All, Expr::Truth(true)),
            "expected a number, found a truth value",
        ),
        (add(number(1.0), vector(1.0, 1.0)), "expected a number, found a vector"),
        (add(Expr::Truth(true), number(1.0)), "expected a number or a vector, found a truth value"),
        (binary(BinaryOp::Div, number(1.0), vector(1.0, 1.0)), "expected a number, found a vector"),
        (Expr::Call(Function::Clamp, vec![number(1.0)]), "clamp takes 3 arguments, found 1"),
        (Expr::Call(Function::Norm, vec![]), "norm takes 1 arguments, found 0"),
    ] {
        assert_eq!(flaw(value), message);
    }
    let nested = |n: usize| (0..n).fold(number(1.0), |inner, _| sample::negated(inner));
    assert_eq!(flaw(nested(400)), "more than 400 expressions inside each other");
    let mut folds = norm(var(8));
    for id in (0..9).rev() {
        folds = each(Reduction::Sum, &[id], IndexSet::All, folds);
    }
    assert_eq!(flaw(folds), "more than 8 index variables inside each other");
}

#[test]
fn observations_and_ends_are_checked() {
    let moving = binary(BinaryOp::Greater, Expr::Time, number(1.0));
    let filtered = |filter: Expr| {
        move |w: &mut World| {
            if let Some(each) = &mut w.observe[0].over {
                each.filter = Some(Box::new(filter));
            }
        }
    };
    assert_eq!(
        refusal(filtered(moving)),
        "observation `F[i] - p[i]`: a filter of an observation must not change during an episode"
    );
    let mut world = sample::unison(sample::point());
    filtered(Expr::Truth(false))(&mut world);
    assert_eq!(sample::task(world).state_len(), 0);
    assert_eq!(
        refusal(|w| w.observe[0].vector = false),
        "observation `F[i] - p[i]`: expected a number, found a vector"
    );
    assert_eq!(
        refusal(|w| w.ends.push(sample::end("gain", Expr::Truth(true), Some(-1.0)))),
        "end `gain`: it must be a finite number, not negative, but is -1"
    );
    assert_eq!(
        refusal(|w| w.require.push(number(1.0))),
        "requirement 1: expected a truth value, found a number (follower.scn:1:1)"
    );
}

#[test]
fn a_rule_gives_each_member_its_number() {
    let mut world = sample::unison(sample::point());
    let x = binary(BinaryOp::Mul, Expr::SlotNumber, number(-0.5));
    world.formations[0].constraint = sample::rule(Expr::Vector(Box::new(x), Box::new(Expr::SlotCount)));
    let task = sample::task(world);
    let mut episode = task.episode();
    task.reset(&mut episode, EpisodeKey::default()).unwrap();
    assert_eq!(episode.slots(), [[-0.5, 3.0], [-1.0, 3.0], [-1.5, 3.0]]);
}

/// Displacements may change, and use index variables of their own.
#[test]
fn a_formation_may_change_with_time() {
    let mut world = sample::unison(sample::point());
    let sum = sample::reduce(Reduction::Sum, &[7], IndexSet::All, Expr::Time);
    world.formations[0].constraint = sample::rule(Expr::Vector(Box::new(Expr::Time), Box::new(sum)));
    let miss = sample::distance(Expr::Slot(0, AgentRef::Var(0)), position(AgentRef::Var(0)));
    world.reward[0].value = sample::reduce(Reduction::Sum, &[0], IndexSet::Group(1), miss);
    let task = sample::task(world);
    let mut episode = task.episode();
    task.reset(&mut episode, EpisodeKey::default()).unwrap();
    episode.agents.position = vec![[0.0, 0.0], [0.1, 1.4], [0.1, 2.4], [0.1, 3.4]];
    task.step(&mut episode, &[0.0; 6], crate::Mode::Train);
    assert_eq!(episode.slots(), [[0.1, 0.4]; 3]);
    assert!((episode.terms()[0] - 6.0).abs() < 1e-12, "{:?}", episode.terms());
}
