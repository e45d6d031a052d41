//! One mistake at a time: each gives one problem, of the right kind, and a plan only if it is a warning.

use mpgx_lang::problem::{Severity, Style, render};
use mpgx_lang::source::NoFiles;
use mpgx_lang::{Compilation, compile};

const SQUARE: &str = include_str!("../../scenarios/square_unison.scn");

fn compiled(text: String) -> Compilation {
    compile("test.scn", text, &[], &NoFiles)
}

/// The square with parts of its text replaced.
fn square(edits: &[(&str, &str)]) -> String {
    edits.iter().fold(SQUARE.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "`{from}` is not in the scenario");
        text.replace(from, to)
    })
}

#[track_caller]
fn gives(edits: &[(&str, &str)], expected: &[&str]) {
    let result = compiled(square(edits));
    let text = render(&result.problems, &result.sources, Style::Plain);
    let codes: Vec<&str> = result.problems.iter().map(|problem| problem.code.name).collect();
    assert_eq!(codes, expected, "{text}");
    assert_eq!(result.plan.is_none(), result.problems.has_errors(), "{text}");
    for problem in result.problems.iter() {
        assert!(problem.span().is_some(), "no place: {text}");
        let warned =
            matches!(problem.code.name, "unused" | "unused-start" | "never-outside" | "place-outside");
        assert_eq!(problem.severity == Severity::Warning, warned, "{text}");
    }
}

/// Puts an item before the world.
fn with(item: &str, expected: &[&str]) {
    let item = format!("{item}\nworld {{ dt");
    gives(&[("world { dt", &item)], expected);
}

/// The longer episodes of `random` show nothing new; the leader of `regular` reaches other places.
#[test]
fn what_several_evaluations_share_is_told_once() {
    let arena = ("box(-2 m .. 2 m, -2 m .. 2 m)", "box(-1 m .. 1 m, -1 m .. 1 m)");
    let longer = ("random  { episodes", "random  { world.horizon = 300 steps, episodes");
    gives(&[arena, longer], &["place-outside", "place-outside"]);
}

const GAP: &str = "-sum(i in follower) |p[i] - F[i]|";
const CRASH: &str = "-k_c * collisions()";
const START: &str = "start   ~ near(F[i], 0.2 m)";
const CLAIM: &str = "expect random.error < 0.12 m at 95%";

#[test]
fn units() {
    gives(&[("param k_c = 1 m", "param k_c = 1")], &["reward-mismatch"]);
    gives(&[("costs 1 m", "costs 0")], &["reward-mismatch"]);
    gives(&[("dt = 0.1 s", "dt = 0.1")], &["unit-mismatch"]);
    gives(&[("random_velocity(1 m/s)", "random_velocity(1 m)")], &["unit-mismatch"]);
    gives(&[(GAP, "-sum(i in follower) |p[i] - F[i]| - 2 * collisions()")], &["unit-mismatch"]);
    gives(&[("collisions() > 0", "collisions() > 0 m")], &["unit-mismatch"]);
    gives(&[(CRASH, "if outside(leader) then -k_c else 0")], &["unit-mismatch"]);
    gives(&[("|p[i] - F[i]|", "|p[i] - F[i]|^2")], &["reward-mismatch"]);
    gives(&[("|p[i] - F[i]|", "|p[i] - F[i]|^k_c")], &["unit-mismatch"]);
    gives(&[("|p[i] - F[i]|", "|p[i] - F[i]|^(|p[i]| / k_c)")], &["bad-exponent"]);
    gives(&[("0.4 m in", "0.4 metre in")], &["unknown-unit"]);
    gives(&[("param side =", "param side : lenght =")], &["unknown-dimension"]);
    with("fn f(x: length, y: time) -> speed = x * y", &["unit-mismatch"]);
    with("fn g<D>(x: D) -> D = x * x", &["unit-mismatch"]);
    with("fn g<D>(x: D) -> D^2 = x * x\nfn root<D>(x: D^2) -> D = sqrt(x)", &[]);
    with("unit inch = 1 m + 2 cm", &["bad-unit"]);
    with("unit furlong = 201 m\ndimension area_speed = length^2 / time", &[]);
    with("fn f(x: area_sped) -> number = 1", &["unknown-dimension"]);
}

#[test]
fn the_reward_says_which_parameter_needs_which_unit() {
    let result = compiled(square(&[("param k_c = 1 m", "param k_c = 1.5")]));
    let problem = result.problems.iter().next().expect("a problem");
    assert_eq!(problem.help.as_deref(), Some("give `k_c` a length, for example `1.5 m`"));
    let labelled: Vec<&str> = problem.labels.iter().map(|label| result.sources.text(label.span)).collect();
    assert_eq!(labelled, ["-k_c * collisions()", GAP, "k_c"]);

    let help = |term: &str| {
        let result = compiled(square(&[(CRASH, term)]));
        result.problems.iter().next().and_then(|problem| problem.help.clone()).unwrap_or_default()
    };
    assert_eq!(help("-2 * collisions()"), "give the factor `2` a length: `2 m`");
    assert_eq!(
        help("-collisions() / 1e-1 s"),
        "give the factor `1e-1 s` a quantity of dimension 1/length: `1e-1 / 1 m`"
    );
    assert_eq!(help("-|v[leader]|"), "multiply `|v[leader]|` by a time, for example `1 s * |v[leader]|`");
    assert_eq!(
        help("-|p[leader]|^2"),
        "divide `|p[leader]|^2` by a length, for example `|p[leader]|^2 / 1 m`"
    );
    assert_eq!(help("-k_c * |p[leader]|"), "give `k_c` no unit, for example `1`");
}

#[test]
fn kinds() {
    gives(&[("|p[i] - F[i]|", "p[i] * F[i]")], &["bad-operands"]);
    gives(&[("|p[i] - F[i]|", "|p[i] - 1 m|")], &["bad-operands"]);
    gives(&[("|p[i] - F[i]|", "(p[i] - F[i])")], &["type-mismatch"]);
    gives(&[("collisions() > 0", "collisions()")], &["type-mismatch"]);
    gives(&[("sum(i in follower)", "sum(i in follower if 3)")], &["type-mismatch"]);
    gives(&[("-1 m .. 1 m, -1 m .. 1 m", "-1 m .. 1 m, 1 m")], &["type-mismatch"]);
    gives(&[("observe { F[i] - p[i]", "observe { outside(i)")], &["type-mismatch"]);
    gives(&[(CRASH, "-k_c * collisions")], &["wrong-kind"]);
    gives(&[(GAP, "-|F|")], &["wrong-kind"]);
    gives(&[(GAP, "-random_velocity(1 m)")], &["unknown-name"]);
    gives(&[("{ steps = 20000, gamma = 0.8 }", "{ noise_reading = variances }")], &["unknown-word"]);
    with("param here = (0 m, 0 m)", &["type-mismatch"]);
}

#[test]
fn names() {
    gives(&[("square(side)", "square(sied)")], &["unknown-name"]);
    gives(&[("use std.start.{near,", "use std.start.{naer,")], &["unknown-import"]);
    gives(&[("use std.motion.{", "use std.motions.{")], &["unknown-module"]);
    gives(&[("use std.reward.collisions", "")], &["unknown-name", "unknown-name"]);
    gives(&[("2 * world.safety", "2 * world.safty")], &["unknown-name"]);
    gives(&[("2 * world.safety", "p[i].z")], &["unknown-name"]);
    gives(&[(": unicycle(", ": unicyle(")], &["unknown-name"]);
    gives(&[("of follower =", "of folower =")], &["unknown-name"]);
    gives(&[("safety = 0.1 m", "saftey = 0.1 m")], &["unknown-setting"]);
    gives(&[("sum(i in follower)", "sum(i in followers)")], &["unknown-set"]);
    gives(&[("seeds 10", "seeds 10\nseeds 12")], &["given-twice"]);
    gives(&[("horizon = 200 steps", "dt = 0.2 s")], &["given-twice"]);
    gives(&[("use std.reward.collisions", "use std.reward.{collisions, distance}")], &["unused"]);
    with("param side = 3 m", &["duplicate-name"]);
    with("param p = 3 m", &["reserved-name"]);
    with("param z = 3 m", &["unused"]);
    with("fn f(x: number) -> number = f(x - 1)", &["circular"]);
    with("fn f(x: number) -> number = g(x)\nfn g(x: number) -> number = f(x)", &["circular"]);
    with("let a = b + 1\nlet b = 2 * a", &["circular"]);
    with("param a = 2 * b\nparam b = 1 m", &["circular"]);
    with("extern fn foo(x: number) -> number", &["misplaced-item"]);
}

/// What is said of the square with one part replaced.
#[track_caller]
fn says(from: &str, to: &str, words: &str) {
    let result = compiled(square(&[(from, to)]));
    let text = render(&result.problems, &result.sources, Style::Plain);
    assert!(text.contains(words), "{text}");
}

#[test]
fn remedies_fit_what_is_wrong() {
    says(CRASH, "-k_c * collisions(1)", "`collisions` takes none");
    let group = "fn many(of: group) -> number = size(of)\nlet all_of_them = many(F)\nworld { dt";
    says("world { dt", group, "its members are `members(F)`");
    says("at 95%", "at 100%", "a confidence lies between 0 and 1");
    says("follower[3]", "follower[3", "`[` is never closed");
    says("follower[3]", "follower[3 4]", "expected `]`");
    says("reward {", "reward {(", "`(` is never closed");
    says(
        "seeds 10",
        "seeds 10\nsweep { side in range(0.2 m, 0.4 m, 1000000000) }",
        "there are 1000000000 variants",
    );
}

#[test]
fn units_are_products_of_others() {
    let field = square(&[("param k_c = 1 m", "unit field = 3 m * 4 m / 2 m\nparam k_c = 1 field")]);
    let plan =
        compiled(field).plan.map(|plan| plan.params.iter().map(|param| param.value).collect::<Vec<_>>());
    assert_eq!(plan, Some(vec![0.4, 6.0]));
}

#[test]
fn what_the_library_has_is_told() {
    let has = "the standard library has one: `use std.";
    says(CRASH, "-k_c * hits()", has);
    says(CRASH, "-k_c * hits", has);
    says("random_velocity(1 m/s)", "wander(1 m/s)", has);
}

/// The library has motions and formations of the same names.
#[test]
fn what_the_library_has_is_told_of_the_kind_that_is_meant() {
    says("random_velocity(1 m/s)", "circle(1 m, 1 m/s)", "`use std.motion.circle`");
    says("= square(side)", "= circle(1 m)", "`use std.formation.circle`");
}

#[test]
fn a_reserved_name_is_told_with_its_meaning() {
    for (name, meaning) in [
        ("p", "`p[i]` is the position"),
        ("v", "`v[i]` is the velocity"),
        ("heading", "`heading[i]` is the direction"),
        ("u", "`u[i]` is the command"),
        ("du", "`du[i]` is by how much"),
        ("t", "time since the episode began"),
        ("all", "set of all agents"),
        ("pairs", "set of all pairs"),
        ("edges", "set of neighbours"),
        ("members", "set of agents in a formation"),
        ("nearest", "set of the agents nearest"),
        ("size", "number of agents in a group"),
        ("box", "is an area"),
    ] {
        says("world { dt", &format!("let {name} = 1\nworld {{ dt"), meaning);
    }
}

#[test]
fn arguments() {
    let motion = |call: &str, expected: &[&str]| gives(&[("random_velocity(1 m/s)", call)], expected);
    motion("random_velocity(sgma = 1 m/s)", &["bad-arguments"]);
    motion("random_velocity(1 m/s, 2)", &["bad-arguments"]);
    motion("random_velocity(1 m/s, sigma = 2 m/s)", &["bad-arguments"]);
    motion("random_velocity()", &[]);
    motion("random_velocity", &[]);
    motion("random_velocity(-1 m/s)", &["out-of-range"]);
    gives(&[("near(F[i], 0.2 m)", "near(F[i])")], &["bad-arguments"]);
    gives(&[("hand = 0.15 m", "hand = 0.15")], &["unit-mismatch"]);
    gives(&[("hand = 0.15 m", "hand = 50 m")], &["out-of-range"]);
}

#[test]
fn draws() {
    gives(&[(START, "start = near(F[i], 0.2 m)")], &["misplaced-draw"]);
    gives(&[(START, "start ~ F[i]")], &["nothing-drawn"]);
    gives(&[(START, "start = F[i]"), ("{near, ", "{")], &[]);
    gives(&[(START, "start ~ near(near(F[i], 1 m), 0.2 m)")], &["misplaced-draw"]);
    gives(&[(START, "start ~ F[i] + (uniform(0 m, 1 m), normal(0 m, 1 cm))"), ("{near, ", "{")], &[]);
    gives(&[(START, "start ~ F[i] + (uniform(0 m, 1), 0 m)")], &["unit-mismatch"]);
    gives(&[(CRASH, "-k_c * normal(0, 1)")], &["misplaced-draw"]);
    gives(&[("dt = 0.1 s", "dt ~ uniform(0.1 s, 0.2 s)")], &["misplaced-draw"]);
    with("dist fixed(x: point) -> point = x", &["nothing-drawn"]);
    with("fn moved(x: length) -> length = x + normal(0 m, 1 m)", &["misplaced-draw"]);
}

#[test]
fn agents_and_sets() {
    gives(&[(GAP, "-|p[follower] - p[leader]|")], &["group-as-agent"]);
    gives(
        &[("observe { F[i] - p[i] for i in follower }", "observe { F[4] - p[follower[2]] }")],
        &["index-out-of-range"],
    );
    gives(&[("observe { F[i] - p[i] for i in follower }", "observe { F[3] - p[follower[2]] }")], &[]);
    gives(&[(GAP, "-sum(i in all) |p[i] - F[i]|")], &["foreign-slot"]);
    gives(&[(GAP, "-sum(i in leader) |p[i] - F[i]|")], &["foreign-slot"]);
    gives(&[("sum(i in follower)", "sum(i in pairs(follower))")], &["wrong-variables"]);
    gives(&[("any(i in follower) outside(i)", "any(i, j in follower) outside(i)")], &["wrong-variables"]);
    gives(&[("for i in follower }", "for i, j in pairs(follower) }")], &["wrong-variables"]);
    gives(&[("|p[i] - F[i]|", "|p[2] - F[i]|")], &["bad-index"]);
    gives(&[("about leader", "about follower")], &["group-as-agent"]);
    gives(&[("follower[3]", "follower[2.5]")], &["out-of-range"]);
    gives(&[("follower[3]", "follower[0]")], &["out-of-range"]);
    gives(&[("follower[3]", "follower[1e12]")], &["out-of-range"]);
    gives(&[("follower[3]", "follower[4]")], &["slot-count"]);
    gives(&[("start  ~ uniform_in(arena)", "start  ~ near(p[follower[1]], 1 m)")], &["start-order"]);
    gives(&[("near(F[i], 0.2 m)", "near(p[follower[1]], 1 m)")], &["start-order"]);
    gives(&[("random_velocity(1 m/s)", "rounded_square()"), ("{random_velocity, ", "{")], &["unused-start"]);
    gives(&[("    start  ~ uniform_in(arena)\n", "")], &["missing"]);
    gives(&[("    motion = random_velocity(1 m/s)\n", "")], &["missing"]);
    gives(&[("control = learned", "control = learned, motion = random_velocity()")], &["given-twice"]);
    gives(&[("-2 m .. 2 m)", "-2 m .. p[leader].x)")], &["not-constant"]);
    gives(&[("    arena   = box(-2 m .. 2 m, -2 m .. 2 m)\n", "")], &["never-outside"]);
    let off = "fn off(i: agent) -> length = |p[i] - F[i]|\nworld { dt";
    gives(&[("world { dt", off), (GAP, "-sum(i in follower) off(i)")], &[]);
    gives(&[("world { dt", off), (GAP, "-sum(i in all) off(i)")], &["unknown-member"]);
}

#[test]
fn motions_and_shapes() {
    with(
        "motion m() {\n state a ~ uniform(0, 1)\n next b = a\n velocity = (a * 1 m/s, 0 m/s)\n}",
        &["unknown-state"],
    );
    with("motion m() {\n state a = uniform(0, 1)\n velocity = (a * 1 m/s, 0 m/s)\n}", &["misplaced-draw"]);
    with("motion m() {\n state a = 1 m\n next a = 2 s\n position = (a, a)\n}", &["unit-mismatch"]);
    with("motion m() {\n state a = 1 m\n state a = 2 m\n position = (a, a)\n}", &["duplicate-name"]);
    with("motion m() {\n speed = (0 m/s, 0 m/s)\n}", &["motion-output"]);
    with("motion m() {\n velocity = (0 m/s, 0 m/s)\n position = (0 m, 0 m)\n}", &["motion-output"]);
    with("motion m() { }", &["motion-output"]);
    with("motion m() {\n let a = b\n state b = 1 m\n position = (a, b)\n}", &["unknown-name"]);
    with("formation f(d: length) { slots { (d, 0) } }", &["unit-mismatch"]);
}

#[test]
fn ranges_and_feasibility() {
    gives(&[("0.4 m in 0.1 m", "3 m in 0.1 m")], &["out-of-range"]);
    gives(&[("0.4 m in 0.1 m .. 2 m", "0.05 m")], &["slots-too-close"]);
    gives(&[("0.4 m in 0.1 m .. 2 m", "0.1 m")], &[]);
    gives(&[("{ steps = 20000, gamma = 0.8 }", "{ gamma = 1.5 }")], &["out-of-range"]);
    gives(&[("{ steps = 20000, gamma = 0.8 }", "{ steps = 200.5 }")], &["out-of-range"]);
    gives(&[("{ steps = 20000, gamma = 0.8 }", "{ steps = 1 / 0 }")], &["not-constant"]);
    gives(&[("dt = 0.1 s", "dt = 0 s")], &["out-of-range"]);
    gives(&[("horizon = 200 steps", "horizon = 10.5 steps")], &["out-of-range"]);
    gives(&[("-1 m .. 1 m, -1 m .. 1 m", "1 m .. -1 m, -1 m .. 1 m")], &["out-of-range"]);
    gives(&[("costs 1 m", "costs -1 m")], &["out-of-range"]);
    gives(&[("evaluate random  {", "evaluate random  { side = 0.05 m,")], &["out-of-range"]);
    gives(&[("evaluate random  {", "evaluate random  { world.safety = 1 m,")], &["slots-too-close"]);
    gives(&[("seeds 10", "seeds 0")], &["out-of-range"]);
}

#[test]
fn methods_and_claims() {
    gives(&[("with tuned", "with tunde")], &["unknown-name"]);
    gives(
        &[("learn mpg with tuned", "preset quick for td3 { steps = 10 }\nlearn mpg with quick")],
        &["preset-mismatch"],
    );
    gives(&[("compare { td3", "compare { tdd3")], &["unknown-name"]);
    gives(&[("compare { td3", "compare { mpg")], &["duplicate-method"]);
    gives(&[("proportional }", "proportional(gain = 3) }")], &["unit-mismatch"]);
    gives(&[("leader.motion = rounded", "leeder.motion = rounded")], &["unknown-setting"]);
    gives(
        &[("evaluate random  {", "evaluate random  { follower.motion = random_velocity(),")],
        &["not-changeable"],
    );
    with("preset quick for mpg { stepss = 10 }", &["unknown-setting"]);
    let claim = |text: &str, expected: &[&str]| gives(&[(CLAIM, text)], expected);
    claim("expect random.errors < 0.12 m", &["bad-claim"]);
    claim("expect randm.error < 0.12 m", &["bad-claim"]);
    claim("expect random.error < 0.12", &["unit-mismatch"]);
    claim("expect random.error < 0.12 m at 110%", &["out-of-range"]);
    claim("expect mgp beats td3 on random.return", &["bad-claim"]);
    claim("expect mpg beats mpg on random.return", &["bad-claim"]);
    claim(
        "expect td3.random.collisions < 5%\nexpect random.gap > -30 m\nexpect mpg beats td3 on regular.reward.crash",
        &[],
    );
    gives(&[(", oracle", ""), (CLAIM, "expect random.error_over_oracle < 1.1")], &["bad-claim"]);
}

#[test]
fn what_a_scenario_needs() {
    let result = compiled(String::new());
    let messages: Vec<&str> = result.problems.iter().map(|problem| problem.message.as_str()).collect();
    let expected = [
        "the scenario has no `world`",
        "no agent learns",
        "the learner observes nothing",
        "the scenario has no reward",
        "nothing is learned",
        "the scenario has no name",
    ];
    assert_eq!(messages, expected);
    assert!(result.problems.iter().all(|problem| problem.code.name == "missing" && problem.help.is_some()));
}

#[test]
fn several_mistakes_are_found_in_one_run() {
    gives(
        &[
            ("dt = 0.1 s", "dt = 0.1"),
            ("square(side)", "square(sied)"),
            ("0.2 m)", "0.2)"),
            (CRASH, "-k_c * colisions()"),
        ],
        &["unit-mismatch", "unit-mismatch", "unknown-name", "unknown-name"],
    );
}

#[test]
fn a_syntax_error_does_not_make_its_names_unknown() {
    for (from, to) in [
        ("param side = 0.4 m", "param side = = 0.4 m"),
        ("agents follower[3] :", "agents follower[3] ;"),
        ("formation F of follower =", "formation F of follower = ="),
        ("world { dt = 0.1 s", "world { dt = 0.1 s s"),
        ("reward {", "reward { +"),
        ("learn mpg", "learn + mpg"),
        ("evaluate random  {", "evaluate random  { ="),
        (
            "use std.motion.{random_velocity, rounded_square}",
            "use std.motion.{random_velocity, rounded_square]",
        ),
        ("use std.start.{near, uniform_in}", "use std.start.{near, + uniform_in}"),
        ("require all", "require all all"),
    ] {
        let result = compiled(square(&[(from, to)]));
        let text = render(&result.problems, &result.sources, Style::Plain);
        assert_eq!(result.problems.errors(), 1, "{text}");
    }
}

#[test]
fn size_and_depth_are_bounded() {
    let lets = |edit: &str, all: String| {
        let result = compiled(square(&[("world { dt", &format!("{all}world {{ dt")), (CRASH, edit)]));
        assert!(result.plan.is_none() || !result.problems.has_errors());
        result.problems.iter().map(|problem| problem.code.name).collect::<Vec<_>>()
    };
    let each = |n: usize, entry: &dyn Fn(usize) -> String| (0..n).map(entry).collect::<String>();
    let doubling = |n| "let a0 = 1\n".to_owned() + &each(n, &|k| format!("let a{} = a{k} + a{k}\n", k + 1));
    assert_eq!(lets("-k_c * a12", doubling(12)), [""; 0]);
    assert_eq!(lets("-k_c * a60", doubling(60)), ["too-large"]);
    let terms = each(500, &|k| format!("-k_c * a15\n t{k} = "));
    assert_eq!(lets(&(terms + "-k_c"), doubling(15))[0], "too-large", "many terms share one limit");
    let twice = |n| format!("-k_c * {}collisions(){}", "twice(".repeat(n), ")".repeat(n));
    let function = "fn twice(x: number) -> number = x + x\n";
    assert_eq!(lets(&twice(6), function.into()), [""; 0]);
    assert_eq!(lets(&twice(60), function.into()), ["too-large"]);
    let chain = "let a0 = 1\n".to_owned() + &each(3000, &|k| format!("let a{} = 2 * a{k}\n", k + 1));
    assert_eq!(lets("-k_c * a3000", chain), ["too-large"]);
    let reversed = each(3000, &|k| format!("let a{k} = 2 * a{}\n", k + 1)) + "let a3000 = 1\n";
    assert!(lets("-k_c * a0", reversed).iter().all(|code| *code == "too-large"));
    assert_eq!(lets(&format!("-k_c{}", " - k_c".repeat(100)), String::new()), [""; 0]);
}

/// Whatever is cut out of a scenario, repeated or exchanged: no panic, and a plan exactly if there is no error.
#[test]
fn damaged_scenarios_are_survived() {
    let words: Vec<(usize, &str)> = SQUARE
        .split_inclusive(' ')
        .scan(0, |at, w| {
            let start = *at;
            *at += w.len();
            Some((start, w))
        })
        .collect();
    let mut state = 7_u64;
    let mut next = |below: usize| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) as usize % below
    };
    for _ in 0..300 {
        let mut text = SQUARE.to_owned();
        for _ in 0..1 + next(3) {
            let (from, word) = words[next(words.len())];
            let (_, other) = words[next(words.len())];
            let Some(after) = text.get(from + word.len()..).map(str::to_owned) else { continue };
            let Some(before) = text.get(..from).map(str::to_owned) else { continue };
            text = match next(3) {
                0 => before + &after,
                1 => before + other + &after,
                _ => before + word + other + &after,
            };
        }
        let result = compiled(text.clone());
        assert_eq!(result.plan.is_none(), result.problems.has_errors(), "{text}");
    }
}
