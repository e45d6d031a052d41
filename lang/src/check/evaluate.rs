//! Held-out evaluations and the claims about them.

use std::collections::BTreeMap;

use super::fits::Wanted;
use super::settings::{MISSING, UNKNOWN_SETTING, path_span};
use super::{Checker, Scope};
use crate::ast::{Assignment, Expectation, ExpectationKind, ExprAt, Item, Name, Span, Spanned};
use crate::dim::Dim;
use crate::hir::{Change, Claim, Control, Kind, Output, Protocol, Type};
use crate::plan::{ClaimKind, GroupId};
use crate::problem::{Code, Problem};
use crate::resolve::{Space, listed};

const CONFIDENCE: f64 = 0.95;

/// Evaluations of a scenario, at most.
const PROTOCOLS: usize = 100;

/// A metric of the study: its name in a scenario, its name in the summary, and what it is.
const METRICS: [(&str, &str, Measures); 7] = [
    ("return", "return", Measures::Reward),
    ("error", "error_m", Measures::Length),
    ("error_over_oracle", "error_over_oracle", Measures::Number),
    ("collisions", "collision_episodes", Measures::Number),
    ("collision_episodes", "collision_episodes", Measures::Number),
    ("late_collisions", "late_collision_episodes", Measures::Number),
    ("outside", "outside_episodes", Measures::Number),
];

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
            self.hir.protocols.push(Protocol {
                name: "held_out".to_owned(),
                episodes,
                changes: Vec::new(),
                span,
            });
        }
    }

    fn protocol(&mut self, name: &Name, settings: &'a [Assignment]) -> Protocol {
        let mut episodes = self.make(Kind::Number(100.0), Type::Count, name.span);
        let mut changes = Vec::new();
        let mut seen: BTreeMap<&str, Span> = BTreeMap::new();
        for setting in settings {
            let span = path_span(&setting.path);
            let text = self.sources.text(span);
            if let Some(first) = seen.get(text)
                && let Some(last) = setting.path.last()
            {
                self.given_twice(&Name { node: text.to_owned(), span: last.span }, *first);
                continue;
            }
            seen.insert(text, span);
            let names: Vec<&str> = setting.path.iter().map(|name| name.node.as_str()).collect();
            if names == ["episodes"] {
                episodes = self.fixed(setting, &Type::Count);
                self.whole(&episodes, "`episodes`", 1.0);
            } else if let Some(change) = self.change(setting, &names, span) {
                changes.push(Spanned { node: change, span });
            }
        }
        Protocol { name: name.node.clone(), episodes, changes, span: name.span }
    }

    fn change(&mut self, setting: &'a Assignment, names: &[&str], span: Span) -> Option<Change> {
        let constant = |checker: &mut Self, dim: &str| {
            let type_ = Type::Number(checker.units.base(dim));
            let value = checker.fixed(setting, &type_);
            checker.constant(&value, &format!("`{}`", names.join("."))).map(|_| value)
        };
        match names {
            ["world", "dt"] => return constant(self, "time").map(Change::Dt),
            ["world", "horizon"] => return constant(self, "steps").map(Change::Horizon),
            ["world", "safety"] => return constant(self, "length").map(Change::Safety),
            [name] => {
                let entry = self.program.find(self.program.main, Space::Value, name);
                if let Some(&id) = entry.and_then(|entry| self.ids.params.get(&entry.id)) {
                    return self.changed_param(setting, id);
                }
            }
            [group, what] => {
                if let Some(id) = self.hir.world.groups.iter().position(|other| other.name == *group) {
                    return self.changed_group(setting, id, what);
                }
            }
            _ => {}
        }
        self.nothing_to_change(names, span);
        None
    }

    fn changed_param(&mut self, setting: &'a Assignment, id: usize) -> Option<Change> {
        let param = self.hir.params.get(id)?;
        let (dim, declared, name) = (param.dim.clone(), param.span, param.name.clone());
        self.undrawn(setting);
        self.used.insert(declared);
        let mut scope = Scope::of(self.program.main);
        let why = Wanted::declared(format!("`{name}`"), declared);
        let value = self.wanted(&mut scope, &setting.value, &Type::Number(dim), &why);
        self.constant(&value, &format!("`{name}`"))?;
        let bound = self.hir.bounds.iter().find(|bound| bound.declared == declared).cloned();
        if let Some(bound) = bound {
            self.hir.bounds.push(crate::hir::Bound { value: value.clone(), ..bound });
        }
        Some(Change::Param(id, value))
    }

    fn changed_group(&mut self, setting: &'a Assignment, group: GroupId, what: &str) -> Option<Change> {
        let known = ["motion", "start", "speed", "arena"];
        let own = self.hir.world.groups.get(group)?;
        let (name, learned) = (own.name.clone(), matches!(own.control, Some(Control::Learned)));
        let no_start = own.start.is_none();
        let change = match what {
            "arena" => Change::Arena(group, self.fixed(setting, &Type::Area)),
            "speed" => {
                let type_ = Type::Range(self.units.base("speed"));
                Change::Speed(group, self.fixed(setting, &type_))
            }
            "start" => Change::Start(group, self.start(group, setting)),
            "motion" if learned => {
                let at = path_span(&setting.path);
                let problem =
                    Problem::error(&UNKNOWN_SETTING, format!("`{name}` learns; it has no motion")).at(at, "");
                self.report(problem.help("change the motion of a group that has one"));
                return None;
            }
            "motion" => {
                self.undrawn(setting);
                let motion = self.motion_call(group, &setting.value)?;
                if no_start && matches!(motion.what.output, Some(Output::Velocity(_))) {
                    let problem =
                        Problem::error(&MISSING, format!("`{name}` has no `start` for this motion"))
                            .at(motion.span, "gives velocities from some start");
                    self.report(
                        problem.help(format!("give `{name}` a `start`; it counts only where it is needed")),
                    );
                }
                Change::Motion(group, motion)
            }
            _ => {
                if let Some(last) = setting.path.last() {
                    self.unknown_setting(&format!("`{name}` in an evaluation"), last, &known);
                }
                return None;
            }
        };
        if let Change::Arena(_, value) | Change::Speed(_, value) = &change {
            self.constant_setting(value, &format!("`{name}.{what}`"));
        }
        Some(change)
    }

    fn nothing_to_change(&mut self, names: &[&str], span: Span) {
        let main = self.program.main;
        if names.first().is_some_and(|name| self.program.is_unknown(main, Space::Value, name)) {
            return;
        }
        let params = self.hir.params.iter().map(|param| param.name.as_str());
        let groups = self.hir.world.groups.iter().map(|group| group.name.as_str());
        let known: Vec<&str> = match names {
            ["world", _] => vec!["world.dt", "world.horizon", "world.safety"],
            [_] => params.chain(["episodes"]).collect(),
            _ => groups.chain(["world"]).collect(),
        };
        let text = names.join(".");
        let wrong = if names.len() == 2 && names.first() != Some(&"world") { names.first() } else { None };
        let meant = self.meant(wrong.copied().unwrap_or(&text), known.iter().copied());
        let help = match meant {
            Some(meant) => format!("did you mean `{meant}`?"),
            None => format!(
                "an evaluation changes `episodes`, parameters, `world.dt`, and of a group `motion`, `start`, `speed` or `arena`; here {}",
                listed(known)
            ),
        };
        self.report(
            Problem::error(&UNKNOWN_SETTING, format!("there is no `{text}` to change"))
                .at(span, "")
                .help(help),
        );
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
                let why = Wanted::by(format!("a bound of `{}`", self.sources.text(path_span(path))));
                let main = self.program.main;
                let bound = self.wanted(&mut Scope::of(main), bound, &Type::Number(dim), &why);
                let bound = self.constant(&bound, "a bound")?;
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
        let number = self.constant(&value, "a confidence")?;
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

Measured are return, error, error_over_oracle, collisions, late_collisions, outside, and each reward term by its
name (its sum over an episode). Without a method, the one of `learn` is meant.",
};
