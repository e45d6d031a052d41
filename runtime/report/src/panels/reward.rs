//! The reward as it runs: its terms in mathematical notation, their share, and the source they came from.

use minijinja::value::Serde;
use minijinja::{Value, context};
use mpgx_lang::analyse::bounds::bounds;
use mpgx_lang::analyse::interval::Interval;
use mpgx_lang::analyse::rigidity::Framework;
use mpgx_lang::analyse::scene::{Mode, Scene};
use mpgx_lang::plan::{Constraint, Expr, Plan};
use mpgx_lang::render::{latex, mathml};
use serde::Serialize;

use super::{Content, Panel};
use crate::picture::{self, Start};
use crate::symbols::{Symbol, quantity, symbols, unit};
use crate::text::{Format, plural};
use crate::view::View;

pub const PANEL: Panel = Panel {
    id: "reward",
    title: "Reward",
    template: include_str!("reward.html"),
    script: None,
    fills: false,
    content,
};

/// Formations of more nodes are only counted.
const MOST_NODES: usize = 24;
const MOST_FORMATIONS: usize = 3;
/// Of the landscape.
const NODES: usize = 4000;

#[derive(Serialize)]
struct Term<'a> {
    name: &'a str,
    doc: &'a str,
    math: Value,
    mathml: String,
    latex: String,
    symbols: Vec<Symbol>,
    link: Option<String>,
    place: String,
    /// What it can be in one step.
    bounds: Option<String>,
    share: Option<Share>,
}

/// A drawing with its words.
#[derive(Serialize)]
struct Drawing {
    title: String,
    words: String,
    svg: Value,
}

/// What a term gives of the whole, by the mean sums of the first learner's held-out episodes.
#[derive(Serialize)]
struct Share {
    sum: String,
    /// Of the sum of all terms' absolute values.
    percent: String,
    width: String,
}

#[derive(Serialize)]
struct End<'a> {
    name: &'a str,
    math: Value,
    cost: Option<Value>,
    link: Option<String>,
}

#[derive(Serialize)]
struct Param<'a> {
    name: &'a str,
    value: String,
    doc: &'a str,
    link: Option<String>,
}

#[derive(Serialize)]
struct File<'a> {
    name: &'a str,
    lines: Vec<Line<'a>>,
}

/// A line of source: code, then its comment.
#[derive(Serialize)]
struct Line<'a> {
    id: String,
    number: usize,
    code: &'a str,
    comment: &'a str,
}

fn content(view: &View) -> Option<Content> {
    let plan = view.input.plan;
    let world = &plan.world;
    let sums: Vec<Option<f64>> = world.reward.iter().map(|term| mean_sum(view, &term.name)).collect();
    let total: f64 = sums.iter().flatten().map(|sum| sum.abs()).sum();
    let share = |sum: Option<f64>| {
        let sum = sum.filter(|_| total > 0.0)?;
        let part = sum.abs() / total;
        Some(Share {
            sum: Format::number(sum).plain(sum),
            percent: Format::percent(part).full(part),
            width: format!("{:.1}", 100.0 * part),
        })
    };
    let bounds = bounds(&Scene::new(plan, world, Mode::Training));
    let dimension = world.reward.first().map_or("number", |term| term.dimension.as_str());
    let terms: Vec<_> = world
        .reward
        .iter()
        .zip(&sums)
        .enumerate()
        .map(|(k, (term, sum))| Term {
            name: &term.name,
            doc: term.doc.trim(),
            math: Value::from_safe_string(mathml::term(plan, world, term)),
            mathml: mathml::term(plan, world, term),
            latex: latex::term(plan, world, term),
            symbols: symbols(plan, world, &term.value),
            link: view.source_link(&term.at.file, term.at.line),
            place: format!("{}:{}", term.at.file, term.at.line),
            bounds: bounds.terms.get(k).map(|it| between(*it, &term.dimension)),
            share: share(*sum),
        })
        .collect();
    let math = |expr: &Expr| Value::from_safe_string(mathml::expr(plan, world, expr));
    let ends: Vec<_> = world
        .ends
        .iter()
        .map(|end| End {
            name: &end.name,
            math: math(&end.when),
            cost: end.cost.as_ref().map(math),
            link: view.source_link(&end.at.file, end.at.line),
        })
        .collect();
    let params: Vec<_> = plan
        .params
        .iter()
        .map(|param| Param {
            name: &param.name,
            value: quantity(param.value, &param.dimension),
            doc: param.doc.trim(),
            link: view.source_link(&param.at.file, param.at.line),
        })
        .collect();
    let files: Vec<_> = view.input.source.iter().enumerate().map(file).collect();
    let context = context! {
        reward => (!world.reward.is_empty()).then(|| between(bounds.reward, dimension)),
        total => (!world.reward.is_empty()).then(|| between(bounds.total, dimension)),
        drawings => Serde(drawings(view)),
        terms => Serde(&terms),
        ends => Serde(ends),
        params => Serde(params),
        files => Serde(files),
        method => view.first().map(|method| method.label),
        protocol => view.main_protocol().map(|protocol| protocol.name.as_str()),
    };
    Some(Content { context, data: None })
}

/// `from −2.83 m to 0 m`
fn between(bounds: Interval, dimension: &str) -> String {
    let unit = unit(dimension).unwrap_or("SI");
    let end = |value: f64, none: &str| match value.is_finite() {
        true => Format { unit, ..Format::number(value) }.full(value),
        false => none.into(),
    };
    format!("from {} to {}", end(bounds.low, "no bound"), end(bounds.high, "no bound"))
}

/// Each formation that is more than a point, and the reward over the position of the first agent that learns.
fn drawings(view: &View) -> Vec<Drawing> {
    let plan = view.input.plan;
    let Ok(start) = Start::new(plan, 0) else { return Vec::new() };
    let moment = &start.moment;
    let formation = |k: usize| {
        let it = plan.world.formations.get(k)?;
        let svg = Value::from_safe_string(picture::graph_svg(moment, k));
        Some(Drawing { title: format!("Formation {}: {}", it.name, it.shape), words: kept(plan, k)?, svg })
    };
    let mut drawings: Vec<_> =
        picture::drawable(moment).into_iter().take(MOST_FORMATIONS).filter_map(formation).collect();
    let learned = plan.world.learned().first().copied().filter(|_| !plan.world.reward.is_empty());
    drawings.extend(learned.map(|agent| Drawing {
        title: format!("Reward over the position of {}", plan.world.agent_name(agent)),
        words: "At the start of the first episode, with all others where they are; hatched where an end that is a \
                failure holds, a star at the greatest value."
            .into(),
        svg: Value::from_safe_string(picture::landscape_svg(moment, &start.landscape(agent, None, NODES))),
    }));
    drawings
}

/// What a formation's graph keeps, in words.
fn kept(plan: &Plan, formation: usize) -> Option<String> {
    let it = plan.world.formations.get(formation)?;
    let members = plan.world.groups.get(it.group)?.size;
    let nodes = members + usize::from(it.about.is_some());
    let framework = Framework { nodes, edges: it.graph.iter(nodes).collect() };
    let (edges, full) = (framework.edges.len(), framework.full_rank());
    let graph = format!("{} and {}", plural(nodes, "node"), plural(edges, "edge"));
    if let Constraint::Displacements { .. } = it.constraint {
        return Some(format!("{graph}. Every member has a place of its own, so nothing is left free."));
    }
    if nodes > MOST_NODES {
        return Some(format!("{graph}; a rigid formation needs at least {full}."));
    }
    let freedom = framework.freedom();
    Some(if freedom.rank >= full {
        format!(
            "{graph}. Rigid: its distances leave only the place, the turn and the mirror image of the whole."
        )
    } else {
        let open = full - freedom.rank;
        let free = if open == 1 { "one motion keeps".to_string() } else { format!("{open} motions keep") };
        format!("{graph}. Not rigid: {free} all distances (rank {} of {full}).", freedom.rank)
    })
}

fn mean_sum(view: &View, term: &str) -> Option<f64> {
    let protocol = view.main_protocol()?;
    let statistic = view.statistic(&protocol.name, view.first()?.label, &format!("reward/{term}"))?;
    Some(statistic.mean)
}

fn file<'v>((index, (name, text)): (usize, &'v (String, String))) -> File<'v> {
    let line = |(number, line): (usize, &'v str)| {
        let (code, comment) = line.split_at(line.find("//").unwrap_or(line.len()));
        Line { id: format!("src-{index}-{}", number + 1), number: number + 1, code, comment }
    };
    File { name, lines: text.lines().enumerate().map(line).collect() }
}
