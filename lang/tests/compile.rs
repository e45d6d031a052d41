//! Whole scenarios through all passes.

use std::collections::BTreeMap;

use mpgx_lang::plan::{
    BinaryOp, Constraint, Control, Expr, Frame, Motion, MotionOutput, Plan, Setting, Slots, UnaryOp,
};
use mpgx_lang::problem::{Style, render};
use mpgx_lang::source::{Loader, NoFiles};
use mpgx_lang::{Compilation, Override, compile, meaning_hash};

const SQUARE: &str = include_str!("../../scenarios/square_unison.scn");
const TRACK: &str = include_str!("../../scenarios/track_random.scn");

fn compiled(text: &str) -> Compilation {
    compile("test.scn", text.to_owned(), &[], &NoFiles)
}

fn plan(text: &str) -> Plan {
    let result = compiled(text);
    let problems = render(&result.problems, &result.sources, Style::Plain);
    assert!(result.problems.is_empty(), "{problems}");
    result.plan.unwrap_or_else(|| panic!("no plan"))
}

/// The square with parts of its text replaced.
fn square(edits: &[(&str, &str)]) -> String {
    edits.iter().fold(SQUARE.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "`{from}` is not in the scenario");
        text.replace(from, to)
    })
}

fn codes(result: &Compilation) -> Vec<&str> {
    result.problems.iter().map(|problem| problem.code.name).collect()
}

#[test]
fn the_scenarios_compile_and_come_back_from_ron() {
    for text in [SQUARE, TRACK] {
        let plan = plan(text);
        assert_eq!(Plan::from_ron(&plan.to_ron()).as_ref(), Ok(&plan));
    }
}

#[test]
fn the_square_means_what_it_says() {
    let plan = plan(SQUARE);
    assert_eq!((plan.name.as_str(), plan.seeds, plan.world.horizon), ("square_unison", 10, 200));
    assert_eq!(plan.world.learned(), [1, 2, 3]);
    let side = || Expr::Unary(UnaryOp::Neg, Box::new(Expr::Param(0)));
    let vector = |x, y| Expr::Vector(Box::new(x), Box::new(y));
    let formation = &plan.world.formations[0];
    assert_eq!((formation.group, formation.about, formation.shape.as_str()), (1, Some(0), "square"));
    let zero = || Expr::Number(0.0);
    let slots = vec![vector(side(), zero()), vector(side(), side()), vector(zero(), side())];
    let displacements = Constraint::Displacements { slots: Slots::List(slots), frame: Frame::Global };
    assert_eq!(formation.constraint, displacements);
    assert_eq!(plan.world.observe[0].text, "F[i] - p[i] for i in follower");
    assert!(plan.world.observe[0].vector);
    assert_eq!(plan.world.reward[1].dimension, "length");
    assert_eq!(plan.world.groups[1].body.settings["turn"], Setting::Range(-5.0, 5.0));
    assert_eq!(plan.claims[0].text, "random.error < 0.12 m at 95%");
    assert_eq!((plan.world.reward[0].at.line, plan.world.reward[0].at.column), (39, 5));
}

#[test]
fn learners_share_the_settings_of_learn_and_keep_their_own() {
    let plan = plan(&square(&[("compare { td3,", "compare { td3(batch = 32),")]));
    let settings = |label: &str| -> &BTreeMap<String, Setting> {
        let mut methods = plan.learners.iter().chain(&plan.controllers);
        &methods.find(|method| method.label == label).expect("a method").what.settings
    };
    assert_eq!(settings("mpg")["rate_end"], Setting::Number(0.02), "of the preset");
    assert_eq!(settings("mpg")["steps"], Setting::Number(20000.0), "of the block, after the preset");
    assert_eq!(settings("mpg")["batch"], Setting::Number(16.0), "as declared");
    assert_eq!(settings("td3")["gamma"], Setting::Number(0.8));
    assert_eq!(settings("td3")["steps"], Setting::Number(20000.0));
    assert_eq!(settings("td3")["batch"], Setting::Number(32.0), "its own argument");
    assert_eq!(settings("mpg")["hidden"], Setting::List(vec![400.0, 300.0]));
    assert_eq!(settings("proportional")["gain"], Setting::Number(5.0));
    assert!(settings("oracle").is_empty());
}

#[test]
fn protocols_have_a_world_only_where_it_differs() {
    let base = plan(SQUARE);
    assert_eq!(base.protocols[0].world, None);
    let regular = base.protocols[1].world.as_ref().expect("another leader");
    let Control::Motion(Motion { name, states, output: MotionOutput::Position(_) }) =
        &regular.groups[0].control
    else {
        panic!("a motion that gives positions");
    };
    assert_eq!((name.as_str(), states.len()), ("rounded_square", 1));
    assert_eq!(regular.groups[0].start, None);
    assert_eq!(regular.reward, base.world.reward);

    let evaluate = |settings: &str| {
        let edited = format!("evaluate random  {{ {settings} }}");
        plan(&square(&[("evaluate random  { episodes = 100 }", &edited)])).protocols.swap_remove(0)
    };
    assert_eq!(evaluate("side = 0.4 m, world.dt = 100 ms").world, None, "as in training");
    let changed =
        evaluate("side = 50 cm, world.horizon = 50 steps, episodes = 7, leader.speed = -0.6 m/s .. 0.6 m/s");
    assert_eq!(changed.episodes, 7);
    let world = changed.world.expect("another world");
    assert_eq!((world.horizon, world.groups[0].speed_mps), (50, (-0.6, 0.6)));
    let Constraint::Displacements { slots: Slots::List(slots), .. } = &world.formations[0].constraint else {
        panic!("a list")
    };
    let expected = Expr::Vector(Box::new(Expr::Number(-0.5)), Box::new(Expr::Number(0.0)));
    assert_eq!(slots[0], expected, "a changed parameter is a number");
}

#[test]
fn a_parameter_that_depends_on_a_changed_one_changes_too() {
    let text = square(&[
        ("param k_c = 1 m", "param k_c = 2 * side"),
        ("evaluate random  {", "evaluate random  { side = 1 m,"),
    ]);
    let plan = plan(&text);
    assert_eq!(plan.params[1].value, 0.8);
    let world = plan.protocols[0].world.as_ref().expect("another world");
    let Expr::Binary(BinaryOp::Mul, weight, _) = &world.reward[1].value else { panic!("a product") };
    assert_eq!(**weight, Expr::Number(-2.0));
}

#[test]
fn calls_are_inlined_with_their_arguments() {
    let text = square(&[
        ("world {", "fn twice<D>(x: D, n: number = 2) -> D = n * x\nlet big = 3 m\nworld {"),
        ("-k_c * collisions()", "twice(n = 5, x = big) - twice(k_c)"),
        ("|p[i] - F[i]|", "off(i)"),
        ("param k_c", "fn off(i: agent) -> length { let d = p[i] - F[i], sqrt(dot(d, d)) }\nparam k_c"),
        ("collisions() > 0", "t > 1 min"),
        ("use std.reward.collisions", ""),
    ]);
    let plan = plan(&text);
    let times = |a, b| Expr::Binary(BinaryOp::Mul, Box::new(a), Box::new(b));
    let (five, two) = (times(Expr::Number(5.0), Expr::Number(3.0)), times(Expr::Number(2.0), Expr::Param(1)));
    assert_eq!(plan.world.reward[1].value, Expr::Binary(BinaryOp::Sub, Box::new(five), Box::new(two)));
    let minute = Expr::Binary(BinaryOp::Greater, Box::new(Expr::Time), Box::new(Expr::Number(60.0)));
    assert_eq!(plan.world.ends[0].when, minute);
}

#[test]
fn values_come_from_outside() {
    let set = |name: &str, value: &str| {
        let chosen = Override { name: name.to_owned(), value: value.to_owned() };
        compile("test.scn", SQUARE.to_owned(), &[chosen], &NoFiles)
    };
    let value = |result: &Compilation| result.plan.as_ref().map(|plan| plan.params[0].value);
    assert_eq!(value(&set("side", "50cm")), Some(0.5));
    assert_eq!(value(&set("side", "2 * 25 cm")), Some(0.5));
    for (name, wrong, code) in [
        ("sied", "0.5m", "unknown-override"),
        ("side", "0.5", "unit-mismatch"),
        ("side", "3 m", "out-of-range"),
        ("side", "1 m / 0", "not-constant"),
        ("side", "1 m\nlearn td3", "unknown-override"),
        ("side", "1 m in 0 m .. 9 m", "unknown-override"),
        ("side", "", "syntax-error"),
    ] {
        let result = set(name, wrong);
        assert_eq!(value(&result), None);
        let found = codes(&result);
        assert!(found == [code] || code.starts_with("syntax") && found.len() == 1, "{wrong}: {found:?}");
    }
    assert_ne!(
        set("side", "50cm").plan.as_ref().map(meaning_hash),
        set("side", "51cm").plan.as_ref().map(meaning_hash)
    );
}

#[test]
fn the_hash_sees_meaning_only() {
    let hash = meaning_hash(&plan(SQUARE));
    let spaced = SQUARE.replace(" = ", "   =  ").replace("\n\n", "\n\n\n");
    let commented: String = SQUARE.lines().map(|line| format!("{line} // and so on\n")).collect();
    let silent: String = SQUARE.lines().filter(|l| !l.starts_with("//")).map(|l| format!("{l}\n")).collect();
    let same = [
        spaced,
        silent,
        commented.replace("//! ", "//! so: ").replace("/// ", "/// so: "),
        SQUARE.replace('\n', "\r\n"),
        format!("\u{feff}{SQUARE}"),
        square(&[("0.1 s", "100 ms"), ("-1 m .. 1 m, -1 m .. 1 m", "-100 cm .. 1 m, -1 m .. 0.001 km")]),
        square(&[("random_velocity(1 m/s)", "random_velocity(sigma = 1 m/s)")]),
    ];
    for text in same {
        let result = compile("elsewhere/other.scn", text.clone(), &[], &NoFiles);
        assert_eq!(result.plan.as_ref().map(meaning_hash).as_ref(), Some(&hash), "{text}");
    }
    for edit in [
        ("0.4 m in", "0.41 m in"),
        ("horizon = 200", "horizon = 201"),
        ("steps = 20000", "steps = 20001"),
        ("costs 1 m", "costs 2 m"),
        ("at 95%", "at 90%"),
        ("pace = 0.3 m/s", "pace = 0.31 m/s"),
        ("lost  when", "gone  when"),
        ("seeds 10", "seeds 11"),
    ] {
        assert_ne!(meaning_hash(&plan(&square(&[edit]))), hash, "{edit:?}");
    }
}

struct Files(BTreeMap<&'static str, &'static str>);

impl Loader for Files {
    fn load(&self, path: &str) -> Result<String, String> {
        self.0.get(path).map(|text| (*text).to_owned()).ok_or_else(|| format!("no file `{path}`"))
    }
}

#[test]
fn files_beside_the_scenario_are_used() {
    let files = Files(BTreeMap::from([
        (
            "mine/shapes.scn",
            "use mine.sizes.{inch, wide}\nformation wedge() { slots { (-wide, 0 m), (0 m, wide), (wide, 0 m) } }",
        ),
        ("mine/sizes.scn", "unit inch = 0.0254 m\nlet wide = 10 inch"),
        ("a.scn", "use b.y\nlet x = y"),
        ("b.scn", "use a.x\nlet y = x"),
        ("broken.scn", "fn f(x: length) -> time = x\nworld { dt = 1 s }"),
    ]));
    let with = |line: &str, edits: &[(&str, &str)]| {
        let line = format!("{line}\nuse std.formation.square");
        let edits: Vec<_> =
            edits.iter().copied().chain([("use std.formation.square", line.as_str())]).collect();
        compile("test.scn", square(&edits), &[], &files)
    };
    let wedge = with("use mine.shapes.wedge", &[("= square(side)", "= wedge()")]);
    assert_eq!(codes(&wedge), ["unused", "unused"], "the square and its side");
    assert_eq!(codes(&with("use mine.shapes.wide", &[])), ["unknown-import"], "not declared there itself");
    assert_eq!(codes(&with("use none.here", &[])), ["unknown-module"]);
    let cycle = with("use a.x", &[]);
    assert!(codes(&cycle).contains(&"module-cycle"), "{:?}", codes(&cycle));
    assert_eq!(codes(&with("use broken.f", &[])), ["unit-mismatch", "misplaced-item"]);
    // A scenario may call the same file's unit by name.
    let inch = with("use mine.sizes.inch", &[("0.4 m in", "15 inch in")]);
    assert_eq!(inch.plan.map(|plan| plan.params[0].value), Some(0.381));
}

#[test]
fn everything_in_the_standard_library_is_sound() {
    for (path, _) in mpgx_lang::stdlib::MODULES {
        let names: Vec<&str> = match *path {
            "std.motion" => vec!["random_velocity", "circle", "square", "rounded_square"],
            "std.formation" => vec!["coincide", "square", "line"],
            "std.start" => vec!["near", "uniform_in"],
            "std.reward" => vec!["collisions", "distance"],
            _ => continue,
        };
        let result = compiled(&format!("scenario s\nuse {path}.{{{}}}", names.join(", ")));
        assert!(codes(&result).iter().all(|code| *code == "missing"), "{path}: {:?}", codes(&result));
    }
    for (shape, count) in [("line(0.3 m)", "7"), ("line(spacing = side)", "2")] {
        let size = format!("follower[{count}]");
        let edits =
            [("follower[3]", size.as_str()), ("square(side)", shape), ("formation.square", "formation.line")];
        let result = compiled(&square(&edits));
        assert!(result.plan.is_some(), "{}", render(&result.problems, &result.sources, Style::Plain));
    }
}

#[test]
fn what_is_left_out_has_a_default() {
    let plan = plan(
        "scenario least
         world { dt = 0.1 s }
         agent robot : point { control = learned, speed = -1 m/s .. 1 m/s, start = (0 m, 0 m) }
         observe { p[robot] }
         reward { near = -|p[robot]| }
         learn td3",
    );
    assert_eq!((plan.seeds, plan.world.horizon, plan.world.safety_m), (10, 200, 0.0));
    let protocols: Vec<_> = plan.protocols.iter().map(|p| (p.name.as_str(), p.episodes)).collect();
    assert_eq!(protocols, [("held_out", 100)]);
    assert_eq!(plan.world.groups[0].arena, None);
    assert_eq!(plan.learners[0].what.settings["gamma"], Setting::Number(0.99));
    assert!(plan.controllers.is_empty() && plan.world.ends.is_empty());
}
