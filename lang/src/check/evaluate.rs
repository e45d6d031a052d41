//! Held-out evaluations and the claims about them.

use super::fits::{Wanted, What};
use super::settings::path_span;
use super::{Checker, Scope};
use crate::ast::{Assignment, Expectation, ExpectationKind, ExprAt, Item, Name};
use crate::dim::Dim;
use crate::hir::{Claim, Kind, Protocol, Type};
use crate::plan::ClaimKind;
use crate::problem::{Code, Problem};
use crate::resolve::listed;

const CONFIDENCE: f64 = 0.95;

/// Evaluations of a scenario, at most.
const PROTOCOLS: usize = 100;

/// A metric of the study: its name in a scenario, its name in the summary, and what it is.
const METRICS: [(&str, &str, Measures); 9] = [
    ("return", "return", Measures::Reward),
    ("error", "error_m", Measures::Length),
    ("error_over_oracle", "error_over_oracle", Measures::Number),
    ("collisions", "collision_episodes", Measures::Number),
    ("collision_episodes", "collision_episodes", Measures::Number),
    ("late_collisions", "late_collision_episodes", Measures::Number),
    ("outside", "outside_episodes", Measures::Number),
    ("hits", "hit_episodes", Measures::Number),
    ("late_hits", "late_hit_episodes", Measures::Number),
];

/// Whether this is the number of episodes of an evaluation, not a change.
pub fn is_episodes(setting: &Assignment) -> bool {
    matches!(setting.path.as_slice(), [name] if name.node == "episodes")
}

#[derive(Clone, Copy)]
enum Measures {
    Reward,
    Length,
    Number,
}

impl<'a> Checker<'a> {
    pub fn protocols(&mut self) {
        for (_, item) in self.main_items() {
            if let Item::Evaluate { name, settings, .. } = &item.node {
                let protocol = self.protocol(name, settings);
                self.hir.protocols.push(protocol);
            }
        }
        let number = self.hir.protocols.len();
        if let Some(last) = self.hir.protocols.last().map(|last| last.span)
            && !self.few("evaluations", number, PROTOCOLS, last)
        {
            self.hir.protocols.truncate(PROTOCOLS);
        }
        if self.hir.protocols.is_empty() {
            let span = self.anywhere();
            let episodes = self.make(Kind::Number(100.0), Type::Count, span);
            self.hir.protocols.push(Protocol { name: "held_out".to_owned(), episodes, changed: None, span });
        }
    }

    /// Its name and its episodes; the changes are seen to with all other cases.
    fn protocol(&mut self, name: &Name, settings: &'a [Assignment]) -> Protocol {
        let chosen = settings.iter().find(|setting| is_episodes(setting));
        let episodes = match chosen {
            Some(setting) => {
                let episodes = self.fixed(setting, &Type::Count);
                self.whole(&episodes, &"`episodes`", 1.0);
                episodes
            }
            None => self.make(Kind::Number(100.0), Type::Count, name.span),
        };
        Protocol { name: name.node.clone(), episodes, changed: None, span: name.span }
    }

    pub fn claims(&mut self) {
        for (_, item) in self.main_items() {
            if let Item::Expect(expectation) = &item.node
                && let Some(kind) = self.claim(expectation)
            {
                let text = expectation.text.clone();
                self.hir.claims.push(Claim { text, kind, span: item.span });
            }
        }
    }

    fn claim(&mut self, expectation: &'a Expectation) -> Option<ClaimKind> {
        match &expectation.kind {
            ExpectationKind::Bound { path, below, bound, confidence } => {
                let confidence = self.confidence(confidence.as_ref());
                let (method, path) = self.claimed_method(path)?;
                let (protocol, metric, dim) = self.measured(path)?;
                let why = Wanted::by(What::Of("a bound", self.sources.text(path_span(path))));
                let main = self.program.main;
                let bound = self.wanted(&mut Scope::of(main), bound, &Type::Number(dim), &why);
                let bound = self.constant(&bound, &"a bound")?;
                Some(ClaimKind::Bound {
                    protocol,
                    metric,
                    method,
                    below: *below,
                    bound,
                    confidence: confidence?,
                })
            }
            ExpectationKind::Beats { better, worse, path, confidence } => {
                let confidence = self.confidence(confidence.as_ref());
                let (first, second) = (self.known_method(better), self.known_method(worse));
                let (protocol, metric, _) = self.measured(path)?;
                if better.node == worse.node {
                    let problem = Problem::error(&BAD_CLAIM, "nothing beats itself");
                    self.report(problem.at(worse.span, "the same method"));
                    return None;
                }
                let (better, worse) = (first?, second?);
                Some(ClaimKind::Beats { better, worse, protocol, metric, confidence: confidence? })
            }
        }
    }

    fn confidence(&mut self, at: Option<&'a ExprAt>) -> Option<f64> {
        let Some(at) = at else { return Some(CONFIDENCE) };
        let why = Wanted::by("a confidence");
        let value = self.wanted(&mut Scope::of(self.program.main), at, &Type::Number(Dim::none()), &why);
        let number = self.constant(&value, &"a confidence")?;
        if number > 0.0 && number < 1.0 {
            return Some(number);
        }
        let problem = Problem::error(&super::value::OUT_OF_RANGE, "a confidence lies between 0 and 1");
        self.report(problem.at(at.span, format!("this is {number}")).help("write for example `at 95%`"));
        None
    }

    fn methods(&self) -> impl Iterator<Item = &str> {
        self.hir.learners.iter().chain(&self.hir.controllers).map(|method| method.label.as_str())
    }

    fn known_method(&mut self, name: &Name) -> Option<String> {
        if self.methods().any(|method| method == name.node) {
            return Some(name.node.clone());
        }
        let problem =
            Problem::error(&BAD_CLAIM, format!("no method is called `{}`", name.node)).at(name.span, "");
        let help = match self.meant(&name.node, self.methods()) {
            Some(meant) => format!("did you mean `{meant}`?"),
            None => format!("`learn` and `compare` name {}", listed(self.methods())),
        };
        self.missing(problem.help(help));
        None
    }

    /// The method of `[method.]protocol.metric`, and the rest of the path.
    fn claimed_method(&mut self, path: &'a [Name]) -> Option<(String, &'a [Name])> {
        let (first, rest) = path.split_first()?;
        let protocol = |name: &Name| self.hir.protocols.iter().any(|protocol| protocol.name == name.node);
        if protocol(first) || !rest.first().is_some_and(protocol) {
            return Some((self.hir.learners.first()?.label.clone(), path));
        }
        Some((self.known_method(first)?, rest))
    }

    /// Protocol, metric and its dimension, from `protocol.metric`.
    fn measured(&mut self, path: &[Name]) -> Option<(String, String, Dim)> {
        let (protocol, metric) = path.split_first()?;
        let protocols = || self.hir.protocols.iter().map(|protocol| protocol.name.as_str());
        if !protocols().any(|name| name == protocol.node) {
            let message = format!("no evaluation is called `{}`", protocol.node);
            let problem = Problem::error(&BAD_CLAIM, message).at(protocol.span, "");
            let help = match self.meant(&protocol.node, protocols()) {
                Some(meant) => format!("did you mean `{meant}`?"),
                None => format!("a claim begins with an evaluation; there is {}", listed(protocols())),
            };
            self.missing(problem.help(help));
            return None;
        }
        let names: Vec<&str> = metric.iter().map(|name| name.node.as_str()).collect();
        let term = match names.as_slice() {
            ["reward", term] | [term] => self.hir.world.reward.iter().find(|other| other.name == **term),
            _ => None,
        };
        let metric_of = match names.as_slice() {
            [name] => METRICS.iter().find(|metric| metric.0 == *name),
            _ => None,
        };
        let (name, dim) = match (metric_of, term) {
            (Some((_, name, measures)), _) => {
                let dim = match measures {
                    Measures::Reward => self.hir.reward_dim.clone(),
                    Measures::Length => self.units.base("length"),
                    Measures::Number => Dim::none(),
                };
                ((*name).to_owned(), dim)
            }
            (None, Some(term)) => (format!("reward/{}", term.name), self.hir.reward_dim.clone()),
            (None, None) => {
                let text = names.join(".");
                let terms = self.hir.world.reward.iter().map(|term| term.name.as_str());
                let known: Vec<&str> = METRICS.iter().map(|metric| metric.0).chain(terms).collect();
                let at = if metric.is_empty() { protocol.span } else { path_span(metric) };
                let problem = Problem::error(
                    &BAD_CLAIM,
                    match names.is_empty() {
                        true => "a claim needs something that is measured".to_owned(),
                        false => format!("nothing measures `{text}`"),
                    },
                );
                let help = match self.meant(&text, known.iter().copied()) {
                    Some(meant) => format!("did you mean `{meant}`?"),
                    None => format!("measured are {}", listed(known)),
                };
                self.report(problem.at(at, "").help(help));
                return None;
            }
        };
        if name == "error_over_oracle" && !self.methods().any(|method| method == "oracle") {
            let at = path_span(metric);
            let problem =
                Problem::error(&BAD_CLAIM, "the error of the oracle is not measured").at(at, "needs it");
            self.report(problem.help("add `oracle` to `compare`"));
            return None;
        }
        Some((protocol.node.clone(), name, dim))
    }
}

pub const BAD_CLAIM: Code = Code {
    name: "bad-claim",
    explain: "\
`expect` compares something measured in an evaluation with a bound, or two methods.

    expect random.error < 0.12 m at 95%
    expect td3.random.collisions < 5%
    expect random.gap > -30 m
    expect mpg beats td3 on random.return

Measured are return, error, error_over_oracle, collisions, late_collisions, outside, where there are obstacles hits
and late_hits, and each reward term by its name (its sum over an episode). Without a method, the one of `learn` is meant.",
};
