//! The reward's terms and the ends of an episode: all that is added up has one dimension.

use std::collections::BTreeMap;

use super::fits::Wanted;
use super::scene::BAD_EACH;
use super::settings::MISSING;
use super::value::OUT_OF_RANGE;
use super::{Checker, Scope};
use crate::ast::{self, Item, Name, Span};
use crate::dim::Dim;
use crate::hir::{End, Expr, Kind, Term, Type};
use crate::problem::{Code, Problem};
use crate::resolve::DUPLICATE_NAME;

/// A term or a cost, with its dimension.
struct Summand {
    name: String,
    /// `the cost of `crash`` or just the name.
    what: String,
    value: Expr,
    dim: Dim,
}

impl<'a> Checker<'a> {
    pub fn reward(&mut self) {
        let found = self.only("reward", |item| match item {
            Item::Reward { each, terms } => Some((each.as_ref(), terms)),
            _ => None,
        });
        let each = found.and_then(|((each, _), _)| each);
        let member = each.and_then(|each| self.rewarded(each));
        let found = found.map(|((_, terms), span)| (terms, span));
        let mut summands = Vec::new();
        match found {
            Some((terms, _)) if !terms.is_empty() => {
                self.distinct(terms.iter().map(|term| &term.name), "reward term");
                terms.iter().for_each(|term| summands.extend(self.term(term, &member)));
            }
            other => {
                let at = other.map_or_else(|| self.anywhere(), |(_, span)| span);
                let problem = Problem::error(&MISSING, "the scenario has no reward").at(at, "");
                self.missing(problem.help("write for example `reward { gap = -|p[leader] - p[follower]| }`"));
            }
        }
        let found = self.only("end", |item| match item {
            Item::End(ends) => Some(ends),
            _ => None,
        });
        if let Some((ends, _)) = found {
            self.distinct(ends.iter().map(|end| &end.name), "end");
            ends.iter().for_each(|end| summands.extend(self.end(end)));
        }
        self.one_dimension(&summands);
    }

    fn distinct(&mut self, names: impl Iterator<Item = &'a Name>, what: &str) {
        let mut first: BTreeMap<&str, Span> = BTreeMap::new();
        for name in names {
            if let Some(first) = first.get(name.node.as_str()) {
                let message = format!("two of the {what}s are called `{}`", name.node);
                let problem = Problem::error(&DUPLICATE_NAME, message);
                self.report(problem.at(name.span, "again here").with(*first, "first here"));
            } else {
                first.insert(&name.node, name.span);
            }
        }
    }

    /// `reward each i in follower`: the scope of its terms.
    fn rewarded(&mut self, each: &'a ast::Over) -> Option<Scope> {
        let (member, scope) = self.each_member(each, "reward");
        let Some((group, var)) = member else { return Some(scope) };
        let Some(shared) = &mut self.hir.world.shared else {
            let observed = self.only("observe", |item| match item {
                Item::Observe { each, items } => Some((each, items.first()?)),
                _ => None,
            });
            let problem = Problem::error(&BAD_EACH, "rewards of members need policies of members")
                .at(each.set.span, "each of these is rewarded for itself");
            let problem = match observed {
                Some(((None, first), _)) => problem.with(first.value.span, "one state for all"),
                _ => problem,
            };
            self.report(problem.help("write `observe each …` as well, or sum over the members"));
            return Some(scope);
        };
        if shared.group == group {
            shared.rewarded = Some(var);
            return Some(scope);
        }
        let problem = Problem::error(&BAD_EACH, "the states and the rewards are of different groups");
        self.report(problem.at(each.set.span, "rewarded").help("name the same group after both `each`"));
        Some(scope)
    }

    fn term(&mut self, term: &'a ast::RewardTerm, member: &Option<Scope>) -> Option<Summand> {
        let mut scope = member.clone().unwrap_or_else(|| Scope::of(self.program.main));
        let value = self.expr(&mut scope, &term.value);
        let value = self.any_number(value, &format_args!("the term `{}`", term.name.node));
        let name = term.name.node.clone();
        self.hir.world.reward.push(Term {
            name: name.clone(),
            doc: term.doc.clone(),
            value: value.clone(),
            span: term.name.span,
        });
        let Type::Number(dim) = value.type_.clone() else { return None };
        Some(Summand { what: format!("`{name}`"), name, value, dim })
    }

    fn end(&mut self, end: &'a ast::EndItem) -> Option<Summand> {
        let mut scope = Scope::of(self.program.main);
        let name = end.name.node.clone();
        let when = self.wanted(&mut scope, &end.when, &Type::Truth, &Wanted::by("the condition of an end"));
        let cost = end.cost.as_ref().map(|cost| {
            let cost = self.expr(&mut scope, cost);
            self.any_number(cost, &format_args!("the cost of `{name}`"))
        });
        if let Some(cost) = &cost {
            self.not_negative(cost, &name);
        }
        let failure = !end.limit;
        self.hir.world.ends.push(End {
            name: name.clone(),
            when,
            failure,
            cost: cost.clone(),
            span: end.name.span,
        });
        let value = cost?;
        let Type::Number(dim) = value.type_.clone() else { return None };
        Some(Summand { what: format!("the cost of `{name}`"), name, value, dim })
    }

    fn not_negative(&mut self, cost: &Expr, name: &str) {
        let value = match self.inlined(cost) {
            Some(crate::inline::Value::Expr(value)) => self.constants.number(&value),
            _ => None,
        };
        if value.is_some_and(|value| value < 0.0) {
            let text = self.sources.text(cost.span).trim_start_matches('-').trim_start().to_owned();
            self.report(
                Problem::error(&OUT_OF_RANGE, format!("the cost of `{name}` is negative"))
                    .at(cost.span, "costs are taken from the reward")
                    .help(format!("write `costs {text}`")),
            );
        }
    }

    fn one_dimension(&mut self, summands: &[Summand]) {
        // What most have is meant; the first of equals.
        let mut counts: BTreeMap<&Dim, usize> = BTreeMap::new();
        summands.iter().for_each(|summand| *counts.entry(&summand.dim).or_default() += 1);
        let Some(&most) = counts.values().max() else { return };
        let Some(reference) = summands.iter().find(|summand| counts.get(&summand.dim) == Some(&most)) else {
            return;
        };
        self.hir.reward_dim = reference.dim.clone();
        let problems: Vec<Problem> = summands
            .iter()
            .filter(|summand| summand.dim != reference.dim)
            .map(|summand| self.unlike_summands(reference, summand))
            .collect();
        problems.into_iter().for_each(|problem| self.report(problem));
    }

    fn unlike_summands(&self, reference: &Summand, odd: &Summand) -> Problem {
        let (right, wrong) = (self.units.people(&reference.dim), self.units.people(&odd.dim));
        let message =
            format!("{} is {wrong} and {} is {right}: they cannot be added", odd.what, reference.what);
        let mut problem = Problem::error(&REWARD_MISMATCH, message)
            .at(odd.value.span, format!("this is {wrong}"))
            .with(reference.value.span, format!("this is {right}"))
            .note(self.aligned(reference, odd));
        for (span, text) in self.factors_declared(&odd.value) {
            problem = problem.with(span, text);
        }
        self.with_unit_remedy(problem, &odd.value, &odd.dim, &reference.dim)
    }

    /// Both dimensions, one below the other.
    fn aligned(&self, a: &Summand, b: &Summand) -> String {
        let width = a.name.chars().count().max(b.name.chars().count());
        let line = |summand: &Summand| {
            let unit = self.units.si(&summand.dim);
            let unit = if unit.is_empty() { String::new() } else { format!(" ({unit})") };
            format!("{:width$} : {}{unit}", summand.name, self.units.name(&summand.dim))
        };
        format!("all terms and costs of a reward share one dimension:\n{}\n{}", line(a), line(b))
    }

    /// The parameters that a value is multiplied from, where they are declared.
    fn factors_declared(&self, value: &Expr) -> Vec<(Span, String)> {
        let mut found = Vec::new();
        let mut rest = vec![value];
        while let Some(expr) = rest.pop() {
            match &expr.kind {
                Kind::Param(id) => {
                    let Some(param) = self.hir.params.get(*id) else { continue };
                    let label =
                        (param.span, format!("`{}` is {}", param.name, self.units.people(&param.dim)));
                    if !found.contains(&label) {
                        found.push(label);
                    }
                }
                Kind::Unary(_, operand) => rest.push(operand),
                Kind::Binary(crate::plan::BinaryOp::Mul | crate::plan::BinaryOp::Div, left, right) => {
                    rest.extend([&**left, &**right]);
                }
                _ => {}
            }
        }
        found
    }
}

pub const REWARD_MISMATCH: Code = Code {
    name: "reward-mismatch",
    explain: "\
The terms of a reward and the costs of ends are added up, so they all have one dimension. A weight carries the unit
that turns what it weighs into it.

    param k_c = 1
    reward {
        gap   = -|p[leader] - p[follower]|
        crash = -k_c * collisions()         // wrong: a plain number beside a length
    }

    param k_c = 1 m                         // right: what one collision costs, in metres of distance",
};
