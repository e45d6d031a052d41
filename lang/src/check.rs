//! Finds out what everything means and whether it fits together: `Program → Hir`.
//!
//! Each problem is reported where it is; an expression with a problem becomes poison, which fits everywhere,
//! so that one mistake gives one message.

pub(crate) mod agents;
pub(crate) mod arithmetic;
pub(crate) mod call;
pub(crate) mod cases;
pub(crate) mod declare;
pub(crate) mod evaluate;
pub(crate) mod expr;
pub(crate) mod feasible;
pub(crate) mod fits;
pub(crate) mod formations;
pub(crate) mod index;
pub(crate) mod learn;
pub(crate) mod motion;
pub(crate) mod obstacles;
pub(crate) mod randomise;
pub(crate) mod reward;
pub(crate) mod scene;
pub(crate) mod schedule;
pub(crate) mod sets;
pub(crate) mod settings;
pub(crate) mod sight;
pub(crate) mod sweep;
pub(crate) mod test;
pub mod units;
pub(crate) mod value;

use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use crate::ast::{ExprAt, Item, Name, Span};
use crate::constant::Constants;
use crate::hir::{self, Expr, Hir, Kind, Type};
use crate::plan::{FormationId, GroupId, ParamId, TrackId, VarId};
use crate::problem::{Code, Problem, Problems, did_you_mean};
use crate::resolve::{ItemId, Program};
use crate::source::Sources;

use units::Units;

/// A parameter's value other than the declared one.
#[derive(Clone)]
pub struct Override {
    pub name: Name,
    pub value: ExprAt,
}

/// Checks the whole program. The Hir is complete as far as no problem was reported.
pub fn check(
    program: &Program,
    overrides: &[Override],
    sources: &Sources,
    problems: &mut Problems,
) -> (Hir, Units) {
    let units = Units::new(program, problems);
    let mut checker = Checker::new(program, sources, &units, Seen::default(), problems);
    checker.world_of_episodes(overrides);
    checker.study();
    checker.feasible();
    checker.cases(overrides);
    checker.unused();
    let hir = checker.hir;
    (hir, units)
}

/// Problems after which nothing is suggested any more.
const PATIENCE: usize = 50;

struct Checker<'a> {
    program: &'a Program,
    sources: &'a Sources,
    problems: &'a mut Problems,
    units: &'a Units,
    hir: Hir,
    constants: Constants,
    ids: Ids,
    /// Parameters that are drawn for each episode, and where that is said.
    randomised: BTreeMap<ParamId, Span>,
    seen: Seen,
    /// Names of `use`s and parameters that something refers to.
    used: BTreeSet<Span>,
    next_var: VarId,
    /// Nodes inlined so far.
    spent: Cell<usize>,
    /// Depth of the expression being checked.
    level: usize,
    /// Settings are checked for each method and evaluation they count for.
    told: BTreeSet<(&'static str, Option<Span>, String)>,
}

/// Items of the scenario by their place in the Hir.
#[derive(Default)]
struct Ids {
    params: BTreeMap<ItemId, ParamId>,
    groups: BTreeMap<ItemId, GroupId>,
    formations: BTreeMap<ItemId, FormationId>,
    tracks: BTreeMap<ItemId, TrackId>,
    localisers: BTreeMap<ItemId, usize>,
}

/// Declarations that were checked, or are being checked (`None`: to find those that refer to themselves).
#[derive(Default)]
struct Seen {
    lets: BTreeMap<ItemId, Option<Arc<Expr>>>,
    functions: BTreeMap<ItemId, Option<Arc<call::Callable>>>,
    motions: BTreeMap<ItemId, motion::Declared<hir::Motion>>,
    shapes: BTreeMap<ItemId, motion::Declared<hir::Shape>>,
    externs: BTreeMap<ItemId, Arc<[hir::Parameter]>>,
}

impl Seen {
    /// What the other modules declare, which no change of the scenario touches.
    fn of_others(&self, main: usize) -> Seen {
        fn others<T: Clone>(seen: &BTreeMap<ItemId, T>, main: usize) -> BTreeMap<ItemId, T> {
            let others = seen.iter().filter(|(id, _)| id.module != main);
            others.map(|(id, seen)| (*id, seen.clone())).collect()
        }
        Seen {
            lets: others(&self.lets, main),
            functions: others(&self.functions, main),
            motions: others(&self.motions, main),
            shapes: others(&self.shapes, main),
            externs: others(&self.externs, main),
        }
    }
}

/// What an expression can refer to besides items.
#[derive(Clone, Debug)]
struct Scope {
    module: usize,
    /// Dimension variables of the function around.
    generics: Vec<String>,
    locals: Locals,
    /// Whether values may be drawn here.
    draws: bool,
    /// Whether something was drawn, or a draw was refused.
    drawn: bool,
    /// What is being set, to say how it could be drawn (`start`).
    target: Option<String>,
}

impl Scope {
    fn of(module: usize) -> Scope {
        Scope {
            module,
            generics: Vec::new(),
            locals: Locals::default(),
            draws: false,
            drawn: false,
            target: None,
        }
    }

    fn local(&self, name: &str) -> Option<(Kind, Type)> {
        self.locals
            .0
            .iter()
            .rev()
            .find(|local| *local.name == *name)
            .map(|local| (local.kind.clone(), local.type_.clone()))
    }

    fn add(&mut self, name: &str, kind: Kind, type_: Type) {
        self.locals.0.push(Local { name: name.into(), kind, type_ });
    }
}

/// Names inside an expression or a body. Of equal names the last counts. They are few.
#[derive(Clone, Debug, Default)]
struct Locals(Vec<Local>);

#[derive(Clone, Debug)]
struct Local {
    name: Arc<str>,
    kind: Kind,
    type_: Type,
}

impl Locals {
    fn len(&self) -> usize {
        self.0.len()
    }

    /// Forgets all but the first names.
    fn truncate(&mut self, length: usize) {
        self.0.truncate(length);
    }

    fn names(&self) -> impl Iterator<Item = &str> {
        self.0.iter().map(|local| &*local.name)
    }
}

impl<'a> Checker<'a> {
    /// `seen`: what is known already.
    fn new(
        program: &'a Program,
        sources: &'a Sources,
        units: &'a Units,
        seen: Seen,
        problems: &'a mut Problems,
    ) -> Self {
        Checker {
            program,
            sources,
            problems,
            units,
            hir: Hir::default(),
            constants: Constants::default(),
            ids: Ids::default(),
            randomised: BTreeMap::new(),
            seen,
            used: BTreeSet::new(),
            next_var: 0,
            spent: Cell::new(0),
            level: 0,
            told: BTreeSet::new(),
        }
    }

    /// Everything that an episode depends on.
    fn world_of_episodes(&mut self, overrides: &'a [Override]) {
        self.number_items();
        self.mark_randomised();
        self.params(overrides);
        self.randomise();
        self.tracks();
        self.world();
        self.group_sizes();
        self.formations();
        self.declarations();
        self.agents();
        self.obstacles();
        self.landmarks();
        self.localisers();
        self.rooms();
        self.scene();
        self.reward();
    }

    /// What is done with it.
    fn study(&mut self) {
        self.learning();
        self.protocols();
        self.claims();
        self.tests();
        self.heading();
    }

    /// Reports a problem, once.
    fn report(&mut self, problem: Problem) {
        if self.told.insert((problem.code.name, problem.span(), problem.message.clone())) {
            self.problems.push(problem);
        }
    }

    /// Reports, and gives what stands for the expression.
    fn poison(&mut self, at: Span, problem: Problem) -> Expr {
        self.report(problem);
        Expr::poison(at)
    }

    /// What was likely meant by a name. A file full of mistakes is not searched again and again.
    fn meant<'n>(&self, name: &str, known: impl IntoIterator<Item = &'n str>) -> Option<String> {
        if self.told.len() > PATIENCE { None } else { did_you_mean(name, known) }
    }

    /// Whether there are no more of something than a scenario could need; reports if there are.
    fn few(&mut self, what: &str, number: usize, most: usize, at: Span) -> bool {
        if number > most {
            let message = format!("there are {number} {what}; at most {most} are possible");
            self.report(Problem::error(&value::TOO_LARGE, message).at(at, ""));
        }
        number <= most
    }

    fn number_items(&mut self) {
        for (id, item) in self.main_items() {
            match &item.node {
                Item::Param(_) => drop(self.ids.params.insert(id, self.ids.params.len())),
                Item::Agents(decl) | Item::Obstacles(decl) => {
                    self.ids.groups.insert(id, self.ids.groups.len());
                    self.hir.world.groups.push(hir::Group {
                        name: decl.name.node.clone(),
                        obstacle: matches!(item.node, Item::Obstacles(_)),
                        span: decl.name.span,
                        ..hir::Group::default()
                    });
                }
                Item::Recording { .. } => drop(self.ids.tracks.insert(id, self.ids.tracks.len())),
                Item::Formation(_) => drop(self.ids.formations.insert(id, self.ids.formations.len())),
                _ => {}
            }
        }
    }

    fn tracks(&mut self) {
        for (id, item) in self.main_items() {
            let Item::Recording { name, .. } = &item.node else { continue };
            let points = self.program.recordings.get(&id).cloned().unwrap_or_default();
            self.hir.tracks.push(hir::Track { name: name.node.clone(), points, span: name.span });
        }
    }

    fn main_items(&self) -> impl Iterator<Item = (ItemId, &'a crate::ast::Spanned<Item>)> + use<'a> {
        let main = self.program.main;
        self.program.written().filter(move |(id, _)| id.module == main)
    }
    /// The scenario's name and comment.
    fn heading(&mut self) {
        let found = self.only("scenario", |item| match item {
            Item::Scenario(name) => Some(name),
            _ => None,
        });
        self.hir.doc = self.program.main().map(|main| main.doc.clone()).unwrap_or_default();
        match found {
            Some((name, _)) => self.hir.name = name.node.clone(),
            None => {
                let at = self.anywhere();
                let problem = Problem::error(&settings::MISSING, "the scenario has no name");
                self.missing(
                    problem.at(at, "").help("begin with `scenario` and a name: `scenario square_unison`"),
                );
            }
        }
    }

    /// Warnings about what nothing refers to. What is wrong elsewhere may be why.
    fn unused(&mut self) {
        if self.problems.has_errors() {
            return;
        }
        for param in &self.hir.params {
            if !self.used.contains(&param.span) {
                self.problems.push(
                    Problem::warning(&UNUSED, format!("the parameter `{}` has no effect", param.name))
                        .at(param.span, "nothing refers to it")
                        .help("use it or take it out"),
                );
            }
        }
        self.unseen();
        self.uncounted();
        let imports = self.program.imports();
        for (_, item) in self.main_items().filter(|(_, item)| matches!(item.node, Item::Use { .. })) {
            let inside = |at: &Span| (item.span.start..item.span.end).contains(&at.start);
            let unused: Vec<_> =
                imports.iter().filter(|(at, _)| inside(at) && !self.used.contains(at)).collect();
            let Some(((first, _), others)) = unused.split_first() else { continue };
            let names = crate::resolve::listed(unused.iter().map(|(_, name)| **name));
            let (verb, pronoun) = if others.is_empty() { ("is", "it") } else { ("are", "them") };
            let problem = Problem::warning(&UNUSED, format!("{names} {verb} not used"))
                .at(**first, "nothing here refers to it");
            let problem = others.iter().fold(problem, |problem, (at, _)| problem.with(**at, ""));
            self.problems.push(problem.help(format!("take {pronoun} out of the `use`")));
        }
    }
}

pub const UNUSED: Code = Code {
    name: "unused",
    explain: "\
Something is declared or imported, and nothing refers to it: perhaps a name was mistyped, or it is a leftover.

    param side = 0.4 m
    formation F of follower = square(0.4 m) about leader        // was `square(side)` meant?",
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parse::parse;
    use crate::problem::render_short;
    use crate::resolve::resolve;
    use crate::source::NoFiles;

    /// A compilation looks only at what it uses of it.
    #[test]
    fn the_whole_standard_library_has_no_problems() {
        let text = include_str!("../../scenarios/localise_and_follow.scn").to_owned()
            + "\nuse std.reward.collisions";
        let (mut sources, mut problems) = (Sources::default(), Problems::default());
        let file = sources.add("a.scn", text);
        let main = parse(&sources, file, &mut problems);
        let program = resolve(main, &NoFiles, &mut sources, &mut problems);
        let units = Units::new(&program, &mut problems);
        let mut checker = Checker::new(&program, &sources, &units, Seen::default(), &mut problems);
        checker.world_of_episodes(&[]);
        let mut modules = BTreeSet::new();
        for (id, declared) in program.library() {
            let item = &declared.item().unwrap().node;
            checker.declaration(id, item);
            checker.check_preset(id.module, item);
            modules.insert(id.module);
        }
        assert_eq!(modules.len(), crate::stdlib::MODULES.len());
        assert_eq!(render_short(&problems, &sources), "");
    }
}
