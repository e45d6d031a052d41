//! What the standard library declares as `extern` against what the runtime provides: both directions.

use std::collections::{BTreeMap, BTreeSet};

use mpgx_lang::ast::{ExternDecl, ExternKind, FunctionDecl, Item};
use mpgx_lang::parse::parse;
use mpgx_lang::plan::{Distribution, Function, Quantity};
use mpgx_lang::problem::Problems;
use mpgx_lang::source::Sources;
use mpgx_lang::stdlib;

fn items() -> Vec<Item> {
    let (mut sources, mut problems) = (Sources::default(), Problems::default());
    let mut items = Vec::new();
    for (path, text) in stdlib::MODULES {
        let file = sources.add(path, (*text).to_owned());
        items.extend(parse(&sources, file, &mut problems).items.into_iter().map(|item| item.node));
    }
    assert!(problems.is_empty());
    items
}

/// The externs of a kind with the names of their settings, those of their base included.
fn externs(kind: ExternKind) -> BTreeMap<String, BTreeSet<String>> {
    let items = items();
    let all: Vec<&ExternDecl> = items
        .iter()
        .filter_map(|item| match item {
            Item::Extern(it) if it.kind == kind => Some(it),
            _ => None,
        })
        .collect();
    let settings = |decl: &ExternDecl| {
        let base = decl.base.as_ref().and_then(|base| all.iter().find(|it| it.name.node == base.name.node));
        let decls = [Some(decl), base.copied()].into_iter().flatten();
        decls.flat_map(|decl| &decl.params).map(|param| param.name.node.clone()).collect()
    };
    all.iter().map(|decl| (decl.name.node.clone(), settings(decl))).collect()
}

fn set(names: &[&str]) -> BTreeSet<String> {
    names.iter().map(|name| (*name).to_owned()).collect()
}

#[test]
fn bodies() {
    let provided = mpgx_sim::BODIES.iter().map(|name| {
        let settings = mpgx_sim::body_settings(name).expect("a body has a list of its settings");
        ((*name).to_owned(), set(settings))
    });
    assert_eq!(externs(ExternKind::Body), provided.collect());
}

#[test]
fn filters() {
    let provided = mpgx_sim::FILTERS.iter().map(|name| {
        let settings = mpgx_sim::filter_settings(name).expect("a filter has a list of its settings");
        ((*name).to_owned(), set(settings))
    });
    assert_eq!(externs(ExternKind::Filter), provided.collect());
}

#[test]
fn what_is_seen_and_what_looks() {
    use mpgx_vision::declared;
    for (kind, provided) in [
        (ExternKind::Room, declared::ROOMS),
        (ExternKind::Lighting, declared::LIGHTINGS),
        (ExternKind::Camera, declared::CAMERAS),
        (ExternKind::Odometry, declared::ODOMETRIES),
        (ExternKind::Landmark, declared::LANDMARKS),
        (ExternKind::Localiser, declared::LOCALISERS),
    ] {
        let provided = provided.iter().map(|(name, settings)| ((*name).to_owned(), set(settings)));
        assert_eq!(externs(kind), provided.collect());
    }
}

#[test]
fn controllers() {
    let provided = mpgx_sim::CONTROLLERS.iter().map(|name| {
        let settings = mpgx_sim::controller_settings(name).expect("a controller has a list of its settings");
        ((*name).to_owned(), set(settings))
    });
    assert_eq!(externs(ExternKind::Controller), provided.collect());
}

#[test]
fn algorithms() {
    let provided = mpgx_learn::ALGORITHMS.iter().map(|name| ((*name).to_owned(), set(mpgx_learn::SETTINGS)));
    assert_eq!(externs(ExternKind::Algorithm), provided.collect());
}

/// The extern of each function of the Plan. `None`: written with bars or as a member.
fn declared(function: Function) -> Option<&'static str> {
    match function {
        Function::Norm | Function::Abs | Function::X | Function::Y => None,
        Function::Dot => Some("dot"),
        Function::Cross => Some("cross"),
        Function::Rotate => Some("rotate"),
        Function::Unit => Some("unit_vector"),
        Function::Sqrt => Some("sqrt"),
        Function::Sin => Some("sin"),
        Function::Cos => Some("cos"),
        Function::Tan => Some("tan"),
        Function::Atan2 => Some("atan2"),
        Function::Exp => Some("exp"),
        Function::Ln => Some("ln"),
        Function::Tanh => Some("tanh"),
        Function::Floor => Some("floor"),
        Function::Mod => Some("mod"),
        Function::Sign => Some("sign"),
        Function::Min => Some("min"),
        Function::Max => Some("max"),
        Function::Clamp => Some("clamp"),
    }
}

const FUNCTIONS: [Function; 22] = [
    Function::Norm,
    Function::Abs,
    Function::X,
    Function::Y,
    Function::Dot,
    Function::Cross,
    Function::Rotate,
    Function::Unit,
    Function::Sqrt,
    Function::Sin,
    Function::Cos,
    Function::Tan,
    Function::Atan2,
    Function::Exp,
    Function::Ln,
    Function::Tanh,
    Function::Floor,
    Function::Mod,
    Function::Sign,
    Function::Min,
    Function::Max,
    Function::Clamp,
];

/// The extern of each distribution and of the quantity that is called.
fn drawn(distribution: &Distribution) -> &'static str {
    match distribution {
        Distribution::Uniform { .. } => "uniform",
        Distribution::Normal { .. } => "normal",
        Distribution::UnitDisc => "unit_disc",
    }
}

fn called(quantity: Quantity) -> Option<&'static str> {
    match quantity {
        Quantity::Position | Quantity::Velocity | Quantity::Heading => None,
        Quantity::Command | Quantity::CommandChange => None,
        Quantity::Outside => Some("outside"),
    }
}

#[test]
fn functions() {
    use mpgx_lang::plan::Expr;
    let zero = || Box::new(Expr::Number(0.0));
    let distributions = [
        Distribution::Uniform { low: zero(), high: zero() },
        Distribution::Normal { mean: zero(), deviation: zero() },
        Distribution::UnitDisc,
    ];
    let quantities = [Quantity::Position, Quantity::Velocity, Quantity::Heading, Quantity::Outside];
    let provided = FUNCTIONS.into_iter().filter_map(declared);
    // Expressions of their own, and schedules, which are settings.
    let special = ["clearance", "duration", "number", "linear", "cosine", "geometric"];
    let provided = provided.chain(distributions.iter().map(drawn)).chain(special);
    let provided = provided.chain(quantities.into_iter().filter_map(called));
    let declared = items().into_iter().filter_map(|item| match item {
        Item::Function(FunctionDecl { body: None, name, .. }) => Some(name.node),
        _ => None,
    });
    assert_eq!(declared.collect::<BTreeSet<_>>(), provided.map(str::to_owned).collect());
}
