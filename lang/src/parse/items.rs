//! Items from what the grammar found.

use crate::ast::{
    AgentsDecl, Assignment, EdgeDecl, EndItem, Expectation, ExpectationKind, Expr, ExprAt, ExternDecl,
    ExternKind, FormationDecl, FunctionBody, FunctionDecl, Item, LetDecl, MotionDecl, Name, ObserveItem,
    Over, Parameter, RewardTerm, ShapeDecl, ShapeSlots, Span, Spanned, StateDecl,
};
use crate::problem::{Code, Problem};

use super::expr::{dimensions, expr, name, over, type_, use_of};
use super::syntax::SYNTAX;
use super::{Context, Node, Rule, end_of, study};

pub(crate) const MISSING_SEPARATOR: Code = Code {
    name: "missing-separator",
    explain: "\
The entries of a block are separated by commas or line ends.

    world { dt = 0.1 s horizon = 200 steps }      // wrong
    world { dt = 0.1 s, horizon = 200 steps }     // right",
};

pub(crate) const FUNCTION_BODY: Code = Code {
    name: "function-body",
    explain: "\
A `fn` or `dist` says how its value is computed. Only an `extern` one, which the runtime provides, does not.

    fn twice(x: length) -> length                // wrong
    fn twice(x: length) -> length = 2 * x        // right",
};

/// The parts of a node that are not punctuation, in order.
pub(super) struct Parts<'a>(std::iter::Peekable<pest::iterators::Pairs<'a, Rule>>);

impl<'a> Parts<'a> {
    pub fn of(node: Node<'a>) -> Self {
        Parts(node.into_inner().peekable())
    }

    /// The text of the `///` comment that comes next, if one does.
    pub fn doc(&mut self) -> String {
        let lines = self.of_rule(Rule::doc).map(|doc| doc.into_inner()).into_iter().flatten();
        let lines = lines.filter_map(|line| Some(line.as_str().strip_prefix("///")?.trim_end().to_owned()));
        let lines: Vec<String> =
            lines.map(|line| line.strip_prefix(' ').unwrap_or(&line).to_owned()).collect();
        lines.join("\n")
    }

    /// The next part, if it is of this rule.
    pub fn of_rule(&mut self, rule: Rule) -> Option<Node<'a>> {
        while self.0.next_if(|node| is_punctuation(node.as_rule())).is_some() {}
        self.0.next_if(|node| node.as_rule() == rule)
    }
}

impl<'a> Iterator for Parts<'a> {
    type Item = Node<'a>;

    fn next(&mut self) -> Option<Node<'a>> {
        self.0.find(|node| !is_punctuation(node.as_rule()))
    }
}

#[rustfmt::skip]
fn is_punctuation(rule: Rule) -> bool {
    matches!(
        rule,
        Rule::comma | Rule::colon | Rule::dot | Rule::dots | Rule::equals | Rule::tilde | Rule::arrow | Rule::bar
            | Rule::open_brace | Rule::close_brace | Rule::open_paren | Rule::close_paren | Rule::open_bracket
            | Rule::close_bracket | Rule::open_angle | Rule::close_angle | Rule::kw_about | Rule::kw_at
            | Rule::kw_beats | Rule::kw_costs | Rule::kw_else | Rule::kw_extern | Rule::kw_for | Rule::kw_if
            | Rule::kw_in | Rule::kw_let | Rule::kw_next | Rule::kw_odometry | Rule::kw_of | Rule::kw_on | Rule::kw_one | Rule::kw_range
            | Rule::kw_slot | Rule::kw_slots | Rule::kw_state | Rule::kw_then | Rule::kw_vec | Rule::kw_when
            | Rule::kw_with | Rule::kw_check | Rule::kw_each | Rule::kw_edge | Rule::kw_edges | Rule::kw_frame
            | Rule::kw_its | Rule::kw_over | Rule::kw_place | Rule::kw_steer | Rule::kw_step | Rule::kw_to
            | Rule::kw_turn | Rule::kw_until | Rule::kw_via | Rule::kw_within | Rule::minus | Rule::within_of | Rule::EOI
    )
}

pub(super) fn item(context: &Context, node: Node) -> Option<Item> {
    let mut outer = Parts::of(node);
    let doc = outer.doc();
    let whole = outer.next()?;
    let mut parts = Parts::of(whole.clone());
    Some(match whole.as_rule() {
        Rule::scenario => Item::Scenario(name(context, parts.next()?)),
        Rule::use_ => uses(context, parts)?,
        Rule::dimension => Item::Dimension {
            doc,
            name: name(context, parts.next()?),
            value: dimensions(context, parts.next()?)?,
        },
        Rule::unit_item => Item::Unit {
            doc,
            name: name(context, parts.next()?),
            dimension: optional(parts.of_rule(Rule::dimensions), |node| dimensions(context, node))?,
            value: optional(parts.of_rule(Rule::expr), |node| expr(context, node))?,
        },
        Rule::param => Item::Param(parameter(context, doc, parts.next()?)?),
        Rule::let_ => Item::Let(let_decl(context, doc, parts)?),
        Rule::function => Item::Function(function(context, doc, whole)?),
        Rule::motion => Item::Motion(motion(context, doc, whole)?),
        Rule::shape => Item::Shape(shape(context, doc, whole)?),
        Rule::formation => Item::Formation(formation(context, doc, parts)?),
        Rule::recording => {
            Item::Recording { doc, name: name(context, parts.next()?), file: text(context, parts.next()?) }
        }
        Rule::extern_ => Item::Extern(extern_decl(context, doc, parts)?),
        Rule::preset => Item::Preset {
            doc,
            name: name(context, parts.next()?),
            for_: names(context, parts.next()?),
            settings: settings(context, parts.next())?,
        },
        Rule::world => Item::World(settings(context, parts.next())?),
        Rule::randomise => Item::Randomise(settings(context, parts.next())?),
        Rule::agents => Item::Agents(agents(context, doc, parts)?),
        Rule::obstacles => Item::Obstacles(agents(context, doc, parts)?),
        Rule::landmarks => Item::Landmarks(agents(context, doc, parts)?),
        Rule::localiser => {
            Item::Localiser { doc, name: name(context, parts.next()?), what: use_of(context, parts.next()?)? }
        }
        Rule::require => Item::Require(expr(context, parts.next()?)?),
        Rule::observe => observe(context, whole)?,
        Rule::reward => {
            let (of, entries) = of_each(context, whole)?;
            let terms = entries.into_iter().map(|node| term(context, node)).collect::<Option<_>>()?;
            Item::Reward { each: of, terms }
        }
        Rule::end => Item::End(each(context, whole, |node| ending(context, node))?),
        Rule::learn => Item::Learn {
            algorithm: name(context, parts.next()?),
            preset: parts.of_rule(Rule::name).map(|node| name(context, node)),
            settings: settings(context, parts.next())?,
        },
        Rule::compare => Item::Compare(each(context, whole, |node| {
            let span = context.span(&node);
            Some(Spanned { node: use_of(context, node)?, span })
        })?),
        Rule::seeds => Item::Seeds(expr(context, parts.next()?)?),
        Rule::evaluate => {
            let (name, observe, settings) = changes(context, whole)?;
            Item::Evaluate { doc, name, observe, settings }
        }
        Rule::expect => Item::Expect(expectation(context, parts.next()?)?),
        Rule::variant => {
            let (name, observe, settings) = changes(context, whole)?;
            Item::Variant { doc, name, observe, settings }
        }
        Rule::stage => Item::Stage(study::stage(context, doc, parts)?),
        Rule::sweep => Item::Sweep { doc, axes: each(context, whole, |node| study::axis(context, node))? },
        Rule::test => {
            let mut entries = each(context, whole, Some)?.into_iter();
            let name = text(context, entries.next()?);
            let steps = entries.map(|node| study::test_step(context, node)).collect::<Option<_>>()?;
            Item::Test { doc, name, steps }
        }
        _ => return None,
    })
}

/// A text without its quotes.
fn text(context: &Context, node: Node) -> Spanned<String> {
    Spanned { node: node.as_str().trim_matches('"').to_owned(), span: context.span(&node) }
}

fn agents(context: &Context, doc: String, mut parts: Parts) -> Option<AgentsDecl> {
    Some(AgentsDecl {
        doc,
        name: name(context, parts.next()?),
        size: optional(parts.of_rule(Rule::size), |node| expr(context, Parts::of(node).next()?))?,
        body: use_of(context, parts.next()?)?,
        settings: settings(context, parts.next())?,
    })
}

fn formation(context: &Context, doc: String, mut parts: Parts) -> Option<FormationDecl> {
    let (name_, group) = (name(context, parts.next()?), name(context, parts.next()?));
    let shape = optional(parts.of_rule(Rule::use_of), |node| use_of(context, node))?;
    let (about, frame) = match parts.of_rule(Rule::about) {
        Some(node) => {
            let mut parts = Parts::of(node);
            let about = name(context, parts.next()?);
            (Some(about), parts.of_rule(Rule::frame).map(|node| context.span(&node)))
        }
        None => (None, None),
    };
    let graph = parts.of_rule(Rule::graph).and_then(|node| Parts::of(node).next());
    let graph = graph.map(|node| name(context, node));
    let edges = optional(parts.of_rule(Rule::edges), |node| edges(context, node))?.unwrap_or_default();
    Some(FormationDecl { doc, name: name_, group, shape, about, frame, graph, edges })
}

fn edges(context: &Context, node: Node) -> Option<Vec<EdgeDecl>> {
    each(context, node, |node| {
        let mut parts = Parts::of(node);
        parts.doc();
        let (from, to) = (endpoint(context, parts.next()?)?, endpoint(context, parts.next()?)?);
        Some(EdgeDecl { from, to, distance: expr(context, parts.next()?)? })
    })
}

/// A number, a name, or a name and an index.
fn endpoint(context: &Context, node: Node) -> Option<ExprAt> {
    let span = context.span(&node);
    let mut parts = Parts::of(node);
    let first = parts.next()?;
    if first.as_rule() == Rule::count {
        let value = first.as_str().trim().parse().ok()?;
        return Some(Spanned { node: Expr::Number { value, unit: None }, span });
    }
    let Spanned { node, span: of } = name(context, first);
    let named = Spanned { node: Expr::Name(node), span: of };
    Some(match parts.next() {
        None => named,
        Some(index) => {
            let index = expr(context, Parts::of(index).next()?)?;
            Spanned { node: Expr::Index(Box::new(named), Box::new(index)), span }
        }
    })
}

/// The entries of a block and what stands before them: `each i in follower`.
fn of_each<'a>(context: &Context, block: Node<'a>) -> Option<(Option<Over>, Vec<Node<'a>>)> {
    let mut entries = each(context, block, Some)?;
    if entries.first().is_none_or(|first| first.as_rule() != Rule::each) {
        return Some((None, entries));
    }
    let over = over(context, Parts::of(entries.remove(0)).next()?)?;
    Some((Some(over), entries))
}

pub(super) fn optional<'a, T>(
    node: Option<Node<'a>>,
    make: impl FnOnce(Node<'a>) -> Option<T>,
) -> Option<Option<T>> {
    match node {
        Some(node) => make(node).map(Some),
        None => Some(None),
    }
}

/// The entries of a block. Tells of two that nothing separates.
fn each<'a, T>(
    context: &Context,
    block: Node<'a>,
    make: impl FnMut(Node<'a>) -> Option<T>,
) -> Option<Vec<T>> {
    let (mut entries, mut inside, mut before) = (Vec::new(), false, None);
    for node in block.into_inner() {
        if is_punctuation(node.as_rule()) {
            inside |= node.as_rule() == Rule::open_brace;
            before = None;
            continue;
        }
        let start = context.offset + node.as_span().start();
        let gap = before.and_then(|end: usize| context.text.get(end..start));
        if inside && gap.is_some_and(|gap| !gap.contains('\n')) {
            context.problem(
                Problem::error(&MISSING_SEPARATOR, "two entries with nothing between them")
                    .at(Span { end: start + 1, ..context.span(&node) }, "a new entry begins here")
                    .help("write a comma before it, or begin a new line"),
            );
        }
        before = Some(context.offset + end_of(&node));
        entries.push(node);
    }
    entries.into_iter().map(make).collect()
}

pub(super) fn names(context: &Context, node: Node) -> Vec<Name> {
    Parts::of(node).map(|node| name(context, node)).collect()
}

fn uses(context: &Context, mut parts: Parts) -> Option<Item> {
    let mut path = names(context, parts.next()?);
    let names = match parts.next() {
        Some(list) => names(context, list),
        None => vec![path.pop()?],
    };
    if path.is_empty() {
        let name = names.first()?;
        context.problem(
            Problem::error(&SYNTAX, "a `use` names a module and what to take from it")
                .at(name.span, "only one name")
                .help(format!("write `use {}.…`, for example `use std.motion.circle`", name.node)),
        );
        return None;
    }
    Some(Item::Use { path, names })
}

fn parameter(context: &Context, doc: String, node: Node) -> Option<Parameter> {
    let mut parts = Parts::of(node);
    let name = name(context, parts.next()?);
    let type_ = optional(parts.of_rule(Rule::type_), |node| type_(context, node))?;
    let default = optional(parts.of_rule(Rule::default), |node| expr(context, Parts::of(node).next()?))?;
    let range = optional(parts.of_rule(Rule::limits), |node| {
        let range = expr(context, Parts::of(node).next()?)?;
        if let Expr::Range(low, high) = range.node {
            return Some((*low, *high));
        }
        context.problem(
            Problem::error(&SYNTAX, "expected a range after `in`")
                .at(range.span, "this is one value")
                .help("a range is written `low .. high`, for example `in 0.1 m .. 2 m`"),
        );
        None
    })?;
    Some(Parameter { doc, name, type_, default, range })
}

fn parameters(context: &Context, node: Node) -> Option<Vec<Parameter>> {
    let each = Parts::of(node).map(|documented| {
        let mut parts = Parts::of(documented);
        parameter(context, parts.doc(), parts.next()?)
    });
    each.collect()
}

fn let_decl(context: &Context, doc: String, mut parts: Parts) -> Option<LetDecl> {
    Some(LetDecl { doc, name: name(context, parts.next()?), value: expr(context, parts.next()?)? })
}

fn let_entry(context: &Context, node: Node) -> Option<LetDecl> {
    let mut parts = Parts::of(node);
    let_decl(context, parts.doc(), parts)
}

fn function(context: &Context, doc: String, node: Node) -> Option<FunctionDecl> {
    let is_extern = node.clone().into_inner().next().is_some_and(|node| node.as_rule() == Rule::kw_extern);
    let mut parts = Parts::of(node);
    let random = parts.next()?.as_str() == "dist";
    let name = name(context, parts.next()?);
    let generics = parts.of_rule(Rule::generics).map(|node| names(context, node)).unwrap_or_default();
    let params = parameters(context, parts.next()?)?;
    let result = type_(context, parts.next()?)?;
    let body = optional(parts.of_rule(Rule::body), |node| body(context, node))?;
    let problem = match (&body, is_extern) {
        (Some(body), true) => Problem::error(&FUNCTION_BODY, "an `extern` function has no body")
            .at(body.value.span, "this would never run")
            .help("delete `extern`, or delete the body"),
        (None, false) => Problem::error(&FUNCTION_BODY, format!("`{}` has no body", name.node))
            .at(name.span, "nothing says how its value is computed")
            .help("add `= …` after the type of its result"),
        _ => return Some(FunctionDecl { doc, random, name, generics, params, result, body }),
    };
    context.problem(problem);
    None
}

fn body(context: &Context, node: Node) -> Option<FunctionBody> {
    let mut parts = each(context, node, Some)?;
    let value = expr(context, parts.pop()?)?;
    let lets = parts.into_iter().map(|node| let_entry(context, node)).collect::<Option<_>>()?;
    Some(FunctionBody { lets, value })
}

fn motion(context: &Context, doc: String, node: Node) -> Option<MotionDecl> {
    let mut entries = each(context, node, Some)?.into_iter();
    let name = name(context, entries.next()?);
    let params = parameters(context, entries.next()?)?;
    let (mut lets, mut states, mut nexts, mut outputs) = (vec![], vec![], vec![], vec![]);
    for node in entries {
        match node.as_rule() {
            Rule::let_entry => lets.push(let_entry(context, node)?),
            Rule::state => states.push(state(context, node)?),
            Rule::next => nexts.push(state(context, node)?),
            _ => outputs.push(state(context, node)?),
        }
    }
    Some(MotionDecl { doc, name, params, lets, states, nexts, outputs })
}

/// `name = value` or `name ~ distribution`.
fn state(context: &Context, node: Node) -> Option<StateDecl> {
    let mut parts = Parts::of(node);
    parts.doc();
    let name = name(context, parts.next()?);
    let random = parts.next()?.as_str() == "~";
    Some(StateDecl { name, random, value: expr(context, parts.next()?)? })
}

fn shape(context: &Context, doc: String, node: Node) -> Option<ShapeDecl> {
    let mut entries = each(context, node, Some)?;
    let slots = entries.pop()?;
    let mut entries = entries.into_iter();
    let name_ = name(context, entries.next()?);
    let params = parameters(context, entries.next()?)?;
    let lets = entries.map(|node| let_entry(context, node)).collect::<Option<_>>()?;
    let slots = match slots.as_rule() {
        Rule::slot_list => ShapeSlots::List(each(context, slots, |node| expr(context, node))?),
        Rule::edges => ShapeSlots::Edges(edges(context, slots)?),
        Rule::graph_rule => {
            let mut parts = Parts::of(slots);
            let graph = name(context, parts.next()?);
            ShapeSlots::Graph { graph, distance: expr(context, parts.next()?)? }
        }
        _ => {
            let mut parts = Parts::of(slots);
            let (number, count) = (name(context, parts.next()?), name(context, parts.next()?));
            ShapeSlots::Rule { number, count, value: expr(context, parts.next()?)? }
        }
    };
    Some(ShapeDecl { doc, name: name_, params, lets, slots })
}

fn extern_decl(context: &Context, doc: String, mut parts: Parts) -> Option<ExternDecl> {
    let kind = match parts.next()?.as_str() {
        "algorithm" => ExternKind::Algorithm,
        "controller" => ExternKind::Controller,
        "solid" => ExternKind::Solid,
        "filter" => ExternKind::Filter,
        "room" => ExternKind::Room,
        "lighting" => ExternKind::Lighting,
        "camera" => ExternKind::Camera,
        "odometry" => ExternKind::Odometry,
        "landmark" => ExternKind::Landmark,
        "localiser" => ExternKind::Localiser,
        _ => ExternKind::Body,
    };
    let name = name(context, parts.next()?);
    let params =
        optional(parts.of_rule(Rule::parameters), |node| parameters(context, node))?.unwrap_or_default();
    let base = optional(parts.of_rule(Rule::use_of), |node| use_of(context, node))?;
    Some(ExternDecl { doc, kind, name, params, base })
}

pub(super) fn settings(context: &Context, node: Option<Node>) -> Option<Vec<Assignment>> {
    let Some(node) = node else { return Some(Vec::new()) };
    each(context, node, |node| setting(context, node))
}

fn setting(context: &Context, node: Node) -> Option<Assignment> {
    let mut parts = Parts::of(node);
    parts.doc();
    let path = names(context, parts.next()?);
    let random = parts.next()?.as_str() == "~";
    Some(Assignment { path, random, value: expr(context, parts.next()?)? })
}

/// The name of an evaluation or a variant, what it observes and what it sets.
fn changes(context: &Context, node: Node) -> Option<(Name, Vec<Spanned<Item>>, Vec<Assignment>)> {
    let mut entries = each(context, node, Some)?.into_iter();
    let name = name(context, entries.next()?);
    let (mut observes, mut settings) = (Vec::new(), Vec::new());
    for node in entries {
        let span = context.span(&node);
        match node.as_rule() {
            Rule::observe => observes.push(Spanned { node: observe(context, node)?, span }),
            _ => settings.push(setting(context, node)?),
        }
    }
    Some((name, observes, settings))
}

fn observe(context: &Context, node: Node) -> Option<Item> {
    let (each, entries) = of_each(context, node)?;
    let items = entries.into_iter().map(|node| observation(context, node)).collect::<Option<_>>()?;
    Some(Item::Observe { each, items })
}

fn observation(context: &Context, node: Node) -> Option<ObserveItem> {
    let mut parts = Parts::of(node);
    parts.doc();
    let value = expr(context, parts.next()?)?;
    let via = parts.of_rule(Rule::name).map(|node| name(context, node));
    let odometry = parts.of_rule(Rule::joined).map(|node| context.span(&node));
    let over = optional(parts.of_rule(Rule::over), |node| over(context, node))?;
    Some(ObserveItem { value, over, settings: settings(context, parts.next())?, via, odometry })
}

fn term(context: &Context, node: Node) -> Option<RewardTerm> {
    let mut parts = Parts::of(node);
    Some(RewardTerm {
        doc: parts.doc(),
        name: name(context, parts.next()?),
        value: expr(context, parts.next()?)?,
    })
}

fn ending(context: &Context, node: Node) -> Option<EndItem> {
    let mut parts = Parts::of(node);
    parts.doc();
    let limit = parts.of_rule(Rule::limit).is_some();
    let (name, when) = (name(context, parts.next()?), expr(context, parts.next()?)?);
    Some(EndItem { limit, name, when, cost: optional(parts.next(), |node| expr(context, node))? })
}

fn expectation(context: &Context, node: Node) -> Option<Expectation> {
    let text = context.text.get(context.offset + node.as_span().start()..context.offset + end_of(&node))?;
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    let rule = node.as_rule();
    let mut parts = Parts::of(node);
    let confidence = |node| expr(context, Parts::of(node).next()?);
    let kind = if rule == Rule::beats {
        ExpectationKind::Beats {
            better: name(context, parts.next()?),
            worse: name(context, parts.next()?),
            path: names(context, parts.next()?),
            confidence: optional(parts.next(), confidence)?,
        }
    } else {
        ExpectationKind::Bound {
            path: names(context, parts.next()?),
            below: parts.next()?.as_str() == "<",
            bound: expr(context, parts.next()?)?,
            confidence: optional(parts.next(), confidence)?,
        }
    };
    Some(Expectation { text, kind })
}
