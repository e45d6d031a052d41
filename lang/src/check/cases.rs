//! The cases of a scenario: evaluations, stages and variants, each checked as the whole that its changes make of it.

use std::collections::BTreeSet;

use super::agents::UNUSED_START;
use super::evaluate::is_episodes;
use super::fits::{Wanted, What};
use super::settings::MISSING;
use super::{Checker, Override, Scope};
use crate::ast::{Assignment, ExprAt, Item, Span, Spanned, StageDecl, UntilDecl};
use crate::change::{self, Kind};
use crate::dim::Dim;
use crate::hir::{Hir, Stage, Type, Variant};
use crate::plan::Until;
use crate::problem::{Code, Problem, Problems};
use crate::resolve::{DUPLICATE_NAME, listed};

/// Stages of a curriculum, at most.
const STAGES: usize = 100;

/// Variants of a scenario, the points of its sweeps included, at most.
pub const VARIANTS: usize = 1000;

/// Episodes that the measure of a stage is taken over, if it says nothing else.
const OVER: usize = 20;

/// A case by its name, and the item that makes it.
pub struct Origin<'n> {
    pub kind: Kind,
    pub name: &'n str,
    pub at: Span,
    pub item: Span,
}

/// A variant before it is checked.
pub struct Chosen {
    pub name: String,
    pub text: String,
    /// What is observed instead.
    pub observe: Vec<Spanned<Item>>,
    pub settings: Vec<Assignment>,
    pub at: Span,
    pub item: Span,
}

/// Problems that were told: their code, their place, and where they come from (of the scenario itself, their place).
type Known = BTreeSet<(&'static str, Option<Span>, Option<Span>)>;

impl<'a> Checker<'a> {
    /// All cases of the scenario as written.
    pub fn cases(&mut self, overrides: &[Override]) {
        let mut known = self.own_problems();
        self.worlds(overrides, &mut known);
        self.variants(overrides, &mut known);
    }

    fn own_problems(&self) -> Known {
        self.problems.iter().map(|problem| (problem.code.name, problem.span(), problem.span())).collect()
    }

    /// Evaluations and stages.
    fn worlds(&mut self, overrides: &[Override], known: &mut Known) {
        let mut evaluations = 0;
        for (_, item) in self.main_items() {
            match &item.node {
                Item::Evaluate { name, observe, settings, .. } => {
                    let origin =
                        Origin { kind: Kind::Evaluation, name: &name.node, at: name.span, item: item.span };
                    let same = observe.is_empty() && settings.iter().all(is_episodes);
                    if evaluations < self.hir.protocols.len() && !same {
                        let changed = self.case(&origin, (observe, settings), overrides, known);
                        if let Some(protocol) = self.hir.protocols.get_mut(evaluations) {
                            protocol.changed = Some(changed);
                        }
                    }
                    evaluations += 1;
                }
                Item::Stage(decl) => {
                    let stages = self.hir.stages.len();
                    if self.few("stages", stages + 1, STAGES, decl.name.span) {
                        let stage = self.stage(decl, item.span, overrides, known);
                        self.hir.stages.push(stage);
                    }
                }
                _ => {}
            }
        }
    }

    fn variants(&mut self, overrides: &[Override], known: &mut Known) {
        let mut chosen: Vec<Chosen> = Vec::new();
        for (_, item) in self.main_items() {
            match &item.node {
                Item::Variant { name, observe, settings, .. } => {
                    let span = |s: &Assignment| super::settings::path_span(&s.path).to(s.value.span);
                    let spans = observe.iter().map(|it| it.span).chain(settings.iter().map(span));
                    let text = spans.map(|span| self.one_line(span)).collect::<Vec<_>>().join(", ");
                    chosen.push(Chosen {
                        name: name.node.clone(),
                        text,
                        observe: observe.clone(),
                        settings: settings.clone(),
                        at: name.span,
                        item: item.span,
                    });
                }
                Item::Sweep { axes, .. } => {
                    let room = (VARIANTS + 1).saturating_sub(chosen.len());
                    let points = self.sweep(axes, item.span, room);
                    chosen.extend(points);
                }
                _ => {}
            }
            if chosen.len() > VARIANTS {
                self.few("variants", chosen.len(), VARIANTS, item.span);
                return;
            }
        }
        for (number, one) in chosen.iter().enumerate() {
            if let Some(first) = chosen.iter().take(number).find(|first| first.name == one.name) {
                let message = format!("two variants are called `{}`", one.name);
                if !known.contains(&(DUPLICATE_NAME.name, Some(one.at), Some(one.at))) {
                    let problem = Problem::error(&DUPLICATE_NAME, message).at(one.at, "again here");
                    self.report(problem.with(first.at, "first here"));
                }
                continue;
            }
            let origin = Origin { kind: Kind::Variant, name: &one.name, at: one.at, item: one.item };
            let changed = self.case(&origin, (&one.observe, &one.settings), overrides, known);
            let (name, text) = (one.name.clone(), one.text.clone());
            self.hir.variants.push(Variant { name, text, changed, span: one.at });
        }
    }

    /// The source under a span, on one line.
    pub fn one_line(&self, span: Span) -> String {
        self.sources.text(span).split_whitespace().collect::<Vec<_>>().join(" ")
    }

    /// Checks the scenario as it is with what is observed instead (in an evaluation: who is localised), and these
    /// settings. Tells what is wrong with it alone.
    fn case(
        &mut self,
        origin: &Origin,
        (observe, settings): (&[Spanned<Item>], &[Assignment]),
        overrides: &[Override],
        known: &mut Known,
    ) -> Box<Hir> {
        let (observe, localised) = match origin.kind {
            Kind::Variant => (observe, &[][..]),
            _ => (&[][..], observe),
        };
        let changed = change::apply(self.program, observe, settings, origin.kind);
        let overrides: Vec<Override> = overrides.iter().cloned().chain(changed.params).collect();
        let mut problems = Problems::default();
        changed.problems.into_iter().for_each(|problem| problems.push(problem));
        let seen = self.seen.of_others(self.program.main);
        let mut case = Checker::new(&changed.program, self.sources, self.units, seen, &mut problems);
        case.world_of_episodes(&overrides);
        case.localised(localised);
        if origin.kind == Kind::Variant {
            case.study();
        }
        case.feasible();
        if origin.kind == Kind::Variant {
            let mut known = case.own_problems();
            case.worlds(&overrides, &mut known);
        }
        let Checker { hir, used, .. } = case;
        self.used.extend(used);
        self.tell(&problems, origin, known);
        Box::new(hir)
    }

    fn tell(&mut self, problems: &Problems, origin: &Origin, known: &mut Known) {
        for problem in problems.iter().filter(|problem| problem.code != &UNUSED_START) {
            let (code, place) = (problem.code.name, problem.span());
            let told = |from: Span| known.contains(&(code, place, Some(from)));
            if told(origin.item) || problem.labels.iter().any(|label| told(label.span)) {
                continue;
            }
            let inside = place.is_some_and(|place| {
                place.file == origin.item.file && (origin.item.start..origin.item.end).contains(&place.start)
            });
            // Variants come upon the mistakes of evaluations again, with the same place or label.
            let again = if inside { place } else { Some(origin.at) };
            known.extend([(code, place, Some(origin.item)), (code, place, again)]);
            let problem = problem.clone();
            self.report(match (inside, origin.kind) {
                (true, _) => problem,
                // What would be right here may be wrong without the change.
                (false, kind) => Problem { fix: None, ..problem }
                    .with(origin.at, format!("in {} `{}`", the(kind), origin.name)),
            });
        }
    }

    fn stage(&mut self, decl: &'a StageDecl, item: Span, overrides: &[Override], known: &mut Known) -> Stage {
        let name = &decl.name;
        let origin = Origin { kind: Kind::Stage, name: &name.node, at: name.span, item };
        let changed = self.case(&origin, (&[], &decl.settings), overrides, known);
        if decl.until.is_none() && decl.within.is_none() {
            let problem = Problem::error(&MISSING, format!("the stage `{}` never ends", name.node));
            self.report(
                problem
                    .at(name.span, "has neither `until` nor `within`")
                    .help("write for example `until error < 0.1 m within 5000 steps` after its settings"),
            );
        }
        let until = decl.until.as_ref().and_then(|until| self.until(until));
        let most_steps = decl
            .within
            .as_ref()
            .and_then(|within| self.counted(&Type::Number(self.units.base("steps")), within, "`within`"));
        Stage { name: name.node.clone(), changed, until, most_steps, span: name.span }
    }

    fn until(&mut self, until: &'a UntilDecl) -> Option<Until> {
        let measure = &until.measure;
        let (name, dim) = match measure.node.as_str() {
            "return" => ("return", self.hir.reward_dim.clone()),
            "error" => ("error_m", self.units.base("length")),
            "steps" => ("steps", self.units.base("steps")),
            "failures" => ("failures", Dim::none()),
            other => {
                let measures = ["return", "error", "steps", "failures"];
                let problem =
                    Problem::error(&BAD_UNTIL, format!("nothing measures `{other}` while learning"));
                let help = match self.meant(other, measures) {
                    Some(meant) => format!("did you mean `{meant}`?"),
                    None => format!("measured are {}", listed(measures)),
                };
                self.report(problem.at(measure.span, "").help(help));
                return None;
            }
        };
        let why = Wanted::like(What::Of("a bound", &measure.node), measure.span);
        let mut scope = Scope::of(self.program.main);
        let bound = self.wanted(&mut scope, &until.bound, &Type::Number(dim), &why);
        let bound = self.constant(&bound, &"the bound of a stage");
        let episodes = match &until.over {
            Some(over) => self.counted(&Type::Count, over, "`over`"),
            None => Some(OVER),
        };
        Some(Until { measure: name.to_owned(), below: until.below, bound: bound?, episodes: episodes? })
    }

    /// `5000 steps`, `20 episodes`
    fn counted(&mut self, type_: &Type, at: &'a ExprAt, what: &str) -> Option<usize> {
        let value = self.wanted(&mut Scope::of(self.program.main), at, type_, &Wanted::by(what));
        self.whole(&value, &what, 1.0)
    }
}

fn the(kind: Kind) -> &'static str {
    match kind {
        Kind::Evaluation => "the evaluation",
        Kind::Stage => "the stage",
        Kind::Variant => "the variant",
    }
}

pub const BAD_UNTIL: Code = Code {
    name: "bad-until",
    explain: "\
A stage of a curriculum is over when the mean of something measured while learning, over the last episodes, lies on
one side of a bound, or after some steps at the latest.

    stage near { side = 0.2 m } until error < 0.1 m over 20 episodes within 5000 steps

Measured are return (in the reward's unit), error (a length), steps (of an episode) and failures (the share of
episodes that ended as one).",
};
