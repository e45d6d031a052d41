//! The reward as it runs: its terms in mathematical notation, their share, and the source they came from.

use minijinja::value::Serde;
use minijinja::{Value, context};
use mpgx_lang::plan::Expr;
use mpgx_lang::render::{latex, mathml};
use serde::Serialize;

use super::{Content, Panel};
use crate::symbols::{Symbol, quantity, symbols};
use crate::text::Format;
use crate::view::View;

pub const PANEL: Panel =
    Panel { id: "reward", title: "Reward", template: include_str!("reward.html"), script: None, content };

#[derive(Serialize)]
struct Term<'a> {
    name: &'a str,
    doc: &'a str,
    math: Value,
    latex: String,
    symbols: Vec<Symbol>,
    link: Option<String>,
    place: String,
    share: Option<Share>,
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
    let terms: Vec<_> = world
        .reward
        .iter()
        .zip(&sums)
        .map(|(term, sum)| Term {
            name: &term.name,
            doc: term.doc.trim(),
            math: Value::from_safe_string(mathml::term(plan, world, term)),
            latex: latex::term(plan, world, term),
            symbols: symbols(plan, world, &term.value),
            link: view.source_link(&term.at.file, term.at.line),
            place: format!("{}:{}", term.at.file, term.at.line),
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
        terms => Serde(&terms),
        ends => Serde(ends),
        params => Serde(params),
        files => Serde(files),
        method => view.first().map(|method| method.label),
        protocol => view.main_protocol().map(|protocol| protocol.name.as_str()),
    };
    Some(Content { context, data: None })
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
