//! Prints a syntax tree as source, with parentheses around everything that was grouped:
//! what is printed parses to the same tree.

use std::fmt::Write;

use crate::ast::{
    AgentsDecl, Assignment, Axis, BinaryOp, Call, DimExpr, EdgeDecl, EndItem, Expectation, ExpectationKind,
    Expr, ExprAt, File, FormationDecl, FunctionDecl, Item, LetDecl, MotionDecl, Name, ObserveItem, Over,
    Parameter, Reduction, ShapeDecl, ShapeSlots, Spanned, StageDecl, StateDecl, TestStep, TypeExpr, UnaryOp,
    UnitExpr,
};

pub fn file(file: &File) -> String {
    let mut text = String::new();
    for line in file.doc.lines() {
        text += format!("//! {line}").trim_end();
        text.push('\n');
    }
    for item in &file.items {
        text += &self::item(&item.node);
        text.push('\n');
    }
    text
}

pub fn item(item: &Item) -> String {
    match item {
        Item::Scenario(name) => format!("scenario {}", name.node),
        Item::Use { path, names } => format!("use {}.{{{}}}", joined(path, "."), joined(names, ", ")),
        Item::Dimension { doc, name, value } => {
            format!("{}dimension {} = {}", self::doc(doc), name.node, dimensions(&value.node))
        }
        Item::Unit { doc, name, dimension, value } => {
            let dimension = dimension.as_ref().map(|it| format!(" : {}", dimensions(&it.node)));
            format!("{}unit {}{}{}", self::doc(doc), name.node, dimension.unwrap_or_default(), default(value))
        }
        Item::Param(it) => format!("{}param {}", doc(&it.doc), parameter(it)),
        Item::Let(it) => let_(it),
        Item::Function(it) => function(it),
        Item::Motion(it) => motion(it),
        Item::Shape(it) => shape(it),
        Item::Extern(it) => {
            let kind = it.kind.word();
            let rest = match &it.base {
                Some(base) => format!(" = {}", call(base, true)),
                None => parameters(&it.params),
            };
            format!("{}extern {kind} {}{rest}", doc(&it.doc), it.name.node)
        }
        Item::Preset { doc, name, for_, settings } => {
            let head = format!("{}preset {} for {}", self::doc(doc), name.node, joined(for_, ", "));
            block(&head, settings.iter().map(assignment))
        }
        Item::World(settings) => block("world", settings.iter().map(assignment)),
        Item::Randomise(settings) => block("randomise", settings.iter().map(assignment)),
        Item::Agents(it) => agents("agent", it),
        Item::Obstacles(it) => agents("obstacle", it),
        Item::Landmarks(it) => agents("landmark", it),
        Item::Localiser { doc, name, what } => {
            format!("{}localiser {} = {}", self::doc(doc), name.node, call(what, false))
        }
        Item::Formation(it) => formation(it),
        Item::Recording { doc, name, file } => {
            format!("{}recording {} = \"{}\"", self::doc(doc), name.node, file.node)
        }
        Item::Require(it) => format!("require {}", expr(it)),
        Item::Observe { each: of, items } => {
            block(&format!("observe{}", each(of)), items.iter().map(observation))
        }
        Item::Reward { each: of, terms } => block(
            &format!("reward{}", each(of)),
            terms.iter().map(|it| format!("{}{} = {}", doc(&it.doc), it.name.node, expr(&it.value))),
        ),
        Item::End(items) => block("end", items.iter().map(ending)),
        Item::Learn { algorithm, preset, settings } => {
            let preset = preset.as_ref().map(|it| format!(" with {}", it.node)).unwrap_or_default();
            block(&format!("learn {}{preset}", algorithm.node), settings.iter().map(assignment))
        }
        Item::Compare(methods) => block("compare", methods.iter().map(|it| call(&it.node, false))),
        Item::Seeds(it) => format!("seeds {}", expr(it)),
        Item::Evaluate { doc, name, observe, settings } => {
            changes("evaluate", (doc, name), observe, settings)
        }
        Item::Stage(it) => stage(it),
        Item::Variant { doc, name, observe, settings } => changes("variant", (doc, name), observe, settings),
        Item::Sweep { doc, axes } => block(&format!("{}sweep", self::doc(doc)), axes.iter().map(axis)),
        Item::Expect(it) => expectation(it),
        Item::Test { doc, name, steps } => {
            let head = format!("{}test \"{}\"", self::doc(doc), name.node);
            block(&head, steps.iter().map(|step| test_step(&step.node)))
        }
    }
}

fn changes(
    word: &str,
    (doc, name): (&str, &Name),
    observe: &[Spanned<Item>],
    settings: &[Assignment],
) -> String {
    let observe = observe.iter().map(|observe| item(&observe.node).replace('\n', "\n    "));
    let entries = observe.chain(settings.iter().map(assignment));
    block(&format!("{}{word} {}", self::doc(doc), name.node), entries)
}

fn agents(word: &str, it: &AgentsDecl) -> String {
    let head = match &it.size {
        Some(size) => format!("{word}s {}[{}]", it.name.node, expr(size)),
        None => format!("{word} {}", it.name.node),
    };
    let head = format!("{}{head} : {}", doc(&it.doc), call(&it.body, false));
    block(&head, it.settings.iter().map(assignment))
}

fn formation(it: &FormationDecl) -> String {
    let shape = it.shape.as_ref().map(|shape| format!(" = {}", call(shape, false))).unwrap_or_default();
    let frame = if it.frame.is_some() { " in its frame" } else { "" };
    let about = it.about.as_ref().map(|about| format!(" about {}{frame}", about.node)).unwrap_or_default();
    let graph = it.graph.as_ref().map(|graph| format!(" over {}", graph.node)).unwrap_or_default();
    let head =
        format!("{}formation {} of {}{shape}{about}{graph}", doc(&it.doc), it.name.node, it.group.node);
    if it.edges.is_empty() { head } else { block(&head, it.edges.iter().map(edge)) }
}

fn edge(it: &EdgeDecl) -> String {
    format!("edge {} - {} = {}", expr(&it.from), expr(&it.to), expr(&it.distance))
}

fn each(each: &Option<Over>) -> String {
    each.as_ref().map(|each| format!(" each {}", over(each))).unwrap_or_default()
}

fn ending(it: &EndItem) -> String {
    let limit = if it.limit { "limit " } else { "" };
    let cost = it.cost.as_ref().map(|cost| format!(" costs {}", expr(cost)));
    format!("{limit}{} when {}{}", it.name.node, expr(&it.when), cost.unwrap_or_default())
}

fn stage(it: &StageDecl) -> String {
    let head = format!("{}stage {}", doc(&it.doc), it.name.node);
    let mut text = block(&head, it.settings.iter().map(assignment));
    if let Some(until) = &it.until {
        let side = if until.below { "<" } else { ">" };
        text += &format!(" until {} {side} {}", until.measure.node, before_word(&until.bound));
        text += &until.over.as_ref().map(|over| format!(" over {}", before_word(over))).unwrap_or_default();
    }
    text + &it.within.as_ref().map(|within| format!(" within {}", expr(within))).unwrap_or_default()
}

fn axis(it: &Axis) -> String {
    let paths: Vec<String> = it.paths.iter().map(|path| joined(path, ".")).collect();
    match paths.as_slice() {
        [path] => format!("{path} in {}", expr(&it.values)),
        paths => format!("({}) in {}", paths.join(", "), expr(&it.values)),
    }
}

fn test_step(step: &TestStep) -> String {
    match step {
        TestStep::Place { agent, at } => format!("place {} at {}", expr(agent), expr(at)),
        TestStep::Turn { agent, to } => format!("turn {} to {}", before_word(agent), expr(to)),
        TestStep::Steer { agent, at } => format!("steer {} at {}", expr(agent), expr(at)),
        TestStep::Step(steps) => format!("step {}", expr(steps)),
        TestStep::Check { condition, tolerance, .. } => {
            let tolerance = tolerance.as_ref().map(|it| format!(" ± {}", expr(it))).unwrap_or_default();
            format!("check {}{tolerance}", expr(condition))
        }
    }
}

/// A formula that begins a line, where `[` would look something up in the line before.
fn entry(text: String) -> String {
    if text.starts_with('[') { format!("({text})") } else { text }
}

/// A formula before a word that would be the unit of the number that it ends with.
fn before_word(of: &ExprAt) -> String {
    let text = expr(of);
    if text.ends_with(|last: char| last.is_ascii_digit()) { format!("({text})") } else { text }
}

/// What stands before `[` or `.`, where a unit would not be one.
fn looked_into(of: &ExprAt) -> String {
    let text = expr(of);
    if matches!(of.node, Expr::Number { unit: Some(_), .. }) { format!("({text})") } else { text }
}

/// An expression; all but names, numbers and what brings its own brackets stands in parentheses.
pub fn expr(expr: &ExprAt) -> String {
    let this = self::expr;
    match &expr.node {
        Expr::Number { value, unit: None } => format!("{value}"),
        Expr::Number { value, unit: Some(unit) } => format!("{value}{}", self::unit(&unit.node)),
        Expr::Truth(value) => value.to_string(),
        Expr::Name(name) => name.clone(),
        Expr::Member(of, name) => format!("{}.{}", looked_into(of), name.node),
        Expr::Index(of, index) => format!("{}[{}]", looked_into(of), this(index)),
        Expr::Call(it) => call(it, true),
        Expr::Vector(x, y) => format!("({}, {})", this(x), this(y)),
        Expr::Tuple(values) => format!("({})", values.iter().map(this).collect::<Vec<_>>().join(", ")),
        Expr::List(values) => format!("[{}]", values.iter().map(this).collect::<Vec<_>>().join(", ")),
        Expr::Range(low, high) => format!("({} .. {})", this(low), this(high)),
        Expr::Bars(of) => format!("|{}|", this(of)),
        Expr::Unary(UnaryOp::Neg, of) => format!("(-{})", this(of)),
        Expr::Unary(UnaryOp::Not, of) => format!("(not {})", this(of)),
        Expr::Binary { op, left, right, .. } => format!("({} {} {})", this(left), operator(*op), this(right)),
        Expr::If { condition, then, otherwise } => {
            format!("(if {} then {} else {})", this(condition), this(then), this(otherwise))
        }
        Expr::Reduce { op, over, body } => {
            format!("({}({}) {})", reduction(op.node), self::over(over), this(body))
        }
    }
}

/// An operator as it is written.
pub fn operator(op: BinaryOp) -> &'static str {
    match op {
        BinaryOp::Add => "+",
        BinaryOp::Sub => "-",
        BinaryOp::Mul => "*",
        BinaryOp::Div => "/",
        BinaryOp::Pow => "^",
        BinaryOp::Less => "<",
        BinaryOp::LessEq => "<=",
        BinaryOp::Greater => ">",
        BinaryOp::GreaterEq => ">=",
        BinaryOp::Equal => "==",
        BinaryOp::NotEqual => "!=",
        BinaryOp::And => "and",
        BinaryOp::Or => "or",
    }
}

/// The word of a reduction.
pub fn reduction(op: Reduction) -> &'static str {
    match op {
        Reduction::Sum => "sum",
        Reduction::Mean => "mean",
        Reduction::Min => "min",
        Reduction::Max => "max",
        Reduction::Count => "count",
        Reduction::Any => "any",
        Reduction::All => "all",
    }
}

fn doc(text: &str) -> String {
    text.lines().map(|line| format!("{}\n", format!("/// {line}").trim_end())).collect()
}

fn block(head: &str, entries: impl Iterator<Item = String>) -> String {
    let mut text = format!("{head} {{");
    let mut empty = true;
    for entry in entries {
        for line in entry.lines() {
            let _ = write!(text, "\n    {line}");
        }
        empty = false;
    }
    text + if empty { "}" } else { "\n}" }
}

fn joined(names: &[Name], with: &str) -> String {
    names.iter().map(|name| name.node.as_str()).collect::<Vec<_>>().join(with)
}

fn over(over: &Over) -> String {
    let filter = over.filter.as_ref().map(|filter| format!(" if {}", expr(filter)));
    format!("{} in {}{}", joined(&over.vars, ", "), expr(&over.set), filter.unwrap_or_default())
}

fn call(call: &Call, parentheses: bool) -> String {
    let arguments = call.args.iter().map(|argument| match &argument.name {
        Some(name) => format!("{} = {}", name.node, expr(&argument.value)),
        None => expr(&argument.value),
    });
    let arguments = arguments.collect::<Vec<_>>().join(", ");
    match parentheses || !arguments.is_empty() {
        true => format!("{}({arguments})", call.name.node),
        false => call.name.node.clone(),
    }
}

fn unit(unit: &UnitExpr) -> String {
    if matches!(unit.factors.as_slice(), [(name, (1, 1))] if name.node == "percent") {
        return "%".to_owned();
    }
    format!(" {}", factors(&unit.factors, "*"))
}

fn dimensions(dimensions: &DimExpr) -> String {
    match dimensions.factors.is_empty() {
        true => "1".to_owned(),
        false => factors(&dimensions.factors, " * "),
    }
}

/// What is below a fraction line comes after a `/`.
fn factors(factors: &[(Name, (i32, i32))], times: &str) -> String {
    let mut text = String::new();
    for (name, (top, bottom)) in factors {
        let (sign, top) = if *top < 0 && !text.is_empty() {
            (times.replace('*', "/"), -top)
        } else {
            (times.to_owned(), *top)
        };
        text += if text.is_empty() { "" } else { &sign };
        text += &match (top, bottom) {
            (1, 1) => name.node.clone(),
            (top, 1) => format!("{}^{top}", name.node),
            (top, bottom) => format!("{}^({top}/{bottom})", name.node),
        };
    }
    text
}

fn type_(type_: &TypeExpr) -> String {
    match type_ {
        TypeExpr::Dim(it) => dimensions(it),
        TypeExpr::Vector(it) => format!("vec({})", dimensions(it)),
        TypeExpr::Range(it) => format!("range({})", dimensions(it)),
        TypeExpr::OneOf(words) => format!("one of ({})", joined(words, ", ")),
    }
}

fn default(value: &Option<ExprAt>) -> String {
    value.as_ref().map(|value| format!(" = {}", expr(value))).unwrap_or_default()
}

fn parameter(it: &Parameter) -> String {
    let type_ = it.type_.as_ref().map(|it| format!(" : {}", type_(&it.node))).unwrap_or_default();
    let range = it.range.as_ref().map(|(low, high)| format!(" in {} .. {}", expr(low), expr(high)));
    format!("{}{type_}{}{}", it.name.node, default(&it.default), range.unwrap_or_default())
}

fn parameters(parameters: &[Parameter]) -> String {
    if parameters.is_empty() {
        return "()".to_owned();
    }
    let lines = parameters.iter().flat_map(|it| {
        let text = format!("{}{},", doc(&it.doc), parameter(it));
        text.lines().map(|line| format!("    {line}\n")).collect::<Vec<_>>()
    });
    format!("(\n{})", lines.collect::<String>())
}

fn let_(it: &LetDecl) -> String {
    format!("{}let {} = {}", doc(&it.doc), it.name.node, expr(&it.value))
}

fn function(it: &FunctionDecl) -> String {
    let mut text = doc(&it.doc);
    text += if it.body.is_none() { "extern " } else { "" };
    text += if it.random { "dist " } else { "fn " };
    text += &it.name.node;
    if !it.generics.is_empty() {
        let _ = write!(text, "<{}>", joined(&it.generics, ", "));
    }
    let _ = write!(text, "{} -> {}", parameters(&it.params), type_(&it.result.node));
    match &it.body {
        None => text,
        Some(body) if body.lets.is_empty() => text + " = " + &expr(&body.value),
        Some(body) => block(&text, body.lets.iter().map(let_).chain([entry(expr(&body.value))])),
    }
}

fn motion(it: &MotionDecl) -> String {
    let head = format!("{}motion {}{}", doc(&it.doc), it.name.node, parameters(&it.params));
    let states = it.states.iter().map(|it| format!("state {}", state(it)));
    let nexts = it.nexts.iter().map(|it| format!("next {}", state(it)));
    block(&head, it.lets.iter().map(let_).chain(states).chain(nexts).chain(it.outputs.iter().map(state)))
}

fn state(it: &StateDecl) -> String {
    format!("{} {} {}", it.name.node, becomes(it.random), expr(&it.value))
}

fn shape(it: &ShapeDecl) -> String {
    let head = format!("{}formation {}{}", doc(&it.doc), it.name.node, parameters(&it.params));
    let slots = match &it.slots {
        ShapeSlots::List(slots) => block("slots", slots.iter().map(|it| entry(expr(it)))),
        ShapeSlots::Rule { number, count, value } => {
            format!("slot {} of {} = {}", number.node, count.node, expr(value))
        }
        ShapeSlots::Edges(edges) => edges.iter().map(edge).collect::<Vec<_>>().join("\n"),
        ShapeSlots::Graph { graph, distance } => format!("edges {} = {}", graph.node, expr(distance)),
    };
    block(&head, it.lets.iter().map(let_).chain([slots]))
}

fn becomes(random: bool) -> &'static str {
    if random { "~" } else { "=" }
}

fn assignment(it: &Assignment) -> String {
    format!("{} {} {}", joined(&it.path, "."), becomes(it.random), expr(&it.value))
}

fn observation(it: &ObserveItem) -> String {
    let over = it.over.as_ref().map(|over| format!(" for {}", self::over(over)));
    let joined = if it.odometry.is_some() { " with odometry" } else { "" };
    let via = it.via.as_ref().map(|via| format!(" via {}{joined}", via.node));
    let value = if via.is_some() { before_word(&it.value) } else { expr(&it.value) };
    let head = entry(value) + &over.or(via).unwrap_or_default();
    if it.settings.is_empty() { head } else { block(&head, it.settings.iter().map(assignment)) }
}

fn expectation(it: &Expectation) -> String {
    let at = |confidence: &Option<Spanned<Expr>>| {
        confidence.as_ref().map(|it| format!(" at {}", expr(it))).unwrap_or_default()
    };
    match &it.kind {
        ExpectationKind::Bound { path, below, bound, confidence } => {
            let side = if *below { "<" } else { ">" };
            format!("expect {} {side} {}{}", joined(path, "."), expr(bound), at(confidence))
        }
        ExpectationKind::Beats { better, worse, path, confidence } => {
            let (better, worse) = (&better.node, &worse.node);
            format!("expect {better} beats {worse} on {}{}", joined(path, "."), at(confidence))
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::parse::parse;
    use crate::problem::{Problems, render_short};
    use crate::source::Sources;
    use crate::stdlib::MODULES;

    fn printed(text: &str) -> String {
        let (mut sources, mut problems) = (Sources::default(), Problems::default());
        let file = sources.add("a.scn", text.to_owned());
        let tree = parse(&sources, file, &mut problems);
        assert_eq!(render_short(&problems, &sources), "", "{text}");
        super::file(&tree)
    }

    #[test]
    fn what_is_printed_parses_to_the_same() {
        let scenarios = [
            include_str!("../../scenarios/square_unison.scn"),
            include_str!("../../scenarios/track_random.scn"),
            "fn f<A>(x: A^(1/2) = 2%) -> A { let a = b\n(a, -a) }\nuse b.c\nexpect a beats b on c.d at 95%",
            "sweep { a in [1, 2], (b.c, d) in [(1 m, 2)] }",
        ];
        for text in MODULES.iter().map(|(_, text)| *text).chain(scenarios) {
            let once = printed(text);
            assert_eq!(printed(&once), once);
        }
    }

    #[test]
    fn no_word_becomes_the_unit_of_the_number_before_it() {
        for text in [
            "observe { (1) via a, (2 * 3) via b with odometry }",
            "test \"a\" { turn (1) to 2 }",
            "stage a { b = 1 } until error < (1) over (2) within 3",
        ] {
            let once = printed(text);
            assert_eq!(printed(&once), once);
        }
    }

    #[test]
    fn random_expressions_come_back() {
        let mut state = 7_u64;
        let mut random = move |below: u64| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) % below
        };
        for _ in 0..500 {
            let mut text = String::from("let a = ");
            for operand in 0..=random(8) {
                if operand > 0 {
                    let infix = [" + ", " - ", "*", " / ", "^", " and ", " or ", " < ", " and not "];
                    text += infix[random(infix.len() as u64) as usize];
                }
                let prefix = [
                    "",
                    "",
                    "",
                    "-",
                    "not ",
                    "sum(i in a) ",
                    "any(i, j in pairs(b) if c) ",
                    "if a then b else ",
                ];
                text += prefix[random(prefix.len() as u64) as usize];
                let atom = [
                    "x",
                    "1.5 m/s^2",
                    "|y - 1|",
                    "f(x, y = 2)",
                    "(x, y)",
                    "p[i].x",
                    "(a < b)",
                    "[1, 2]",
                    "true",
                ];
                text += atom[random(atom.len() as u64) as usize];
            }
            if text.matches(" < ").count() < 2 {
                let once = printed(&text);
                assert_eq!(printed(&once), once, "{text}");
            }
        }
    }
}
