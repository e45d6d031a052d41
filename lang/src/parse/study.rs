//! Stages, sweeps and tests from what the grammar found.

use crate::ast::{Axis, Spanned, StageDecl, TestStep, UntilDecl};

use super::expr::{expr, name};
use super::items::{Parts, names, optional, settings};
use super::{Context, Node, Rule, end_of};

pub(super) fn stage(context: &Context, doc: String, mut parts: Parts) -> Option<StageDecl> {
    Some(StageDecl {
        doc,
        name: name(context, parts.next()?),
        settings: settings(context, parts.next())?,
        until: optional(parts.of_rule(Rule::until), |node| until(context, node))?,
        within: optional(parts.of_rule(Rule::within), |node| expr(context, Parts::of(node).next()?))?,
    })
}

fn until(context: &Context, node: Node) -> Option<UntilDecl> {
    let mut parts = Parts::of(node);
    Some(UntilDecl {
        measure: name(context, parts.next()?),
        below: parts.next()?.as_str() == "<",
        bound: expr(context, parts.next()?)?,
        over: optional(parts.next(), |node| expr(context, node))?,
    })
}

pub(super) fn axis(context: &Context, node: Node) -> Option<Axis> {
    let mut parts = Parts::of(node);
    parts.doc();
    let mut paths = Vec::new();
    while let Some(path) = parts.of_rule(Rule::path) {
        paths.push(names(context, path));
    }
    Some(Axis { paths, values: expr(context, parts.next()?)? })
}

pub(super) fn test_step(context: &Context, node: Node) -> Option<Spanned<TestStep>> {
    let (rule, span) = (node.as_rule(), context.span(&node));
    let text = context.text.get(context.offset + node.as_span().start()..context.offset + end_of(&node))?;
    let mut parts = Parts::of(node);
    let mut next = || expr(context, parts.next()?);
    let step = match rule {
        Rule::place => TestStep::Place { agent: next()?, at: next()? },
        Rule::turn => TestStep::Turn { agent: next()?, to: next()? },
        Rule::steer => TestStep::Steer { agent: next()?, at: next()? },
        Rule::step => TestStep::Step(next()?),
        _ => {
            let text = text.strip_prefix("check").unwrap_or(text);
            let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
            TestStep::Check {
                text,
                condition: next()?,
                tolerance: optional(parts.next(), |n| expr(context, n))?,
            }
        }
    };
    Some(Spanned { node: step, span })
}
