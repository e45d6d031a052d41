//! Motions and formation shapes.

use std::sync::Arc;

use super::fits::{TYPE_MISMATCH, Wanted, What};
use super::{Checker, Scope};
use crate::ast::{self, Item, LetDecl, MotionDecl, ShapeDecl, ShapeSlots, Span, StateDecl};
use crate::dim::Dim;
use crate::hir::{Expr, Kind, Motion, Output, Parameter, Shape, Slots, State, Type};
use crate::plan::Graph;
use crate::problem::{Code, Problem};
use crate::resolve::{DUPLICATE_NAME, ItemId};

/// The parameters of a declaration and what it declares.
pub type Declared<T> = (Arc<[Parameter]>, Arc<T>);

impl<'a> Checker<'a> {
    pub fn motion(&mut self, id: ItemId) -> Option<Declared<Motion>> {
        let Item::Motion(decl) = &self.program.item(id)?.node else { return None };
        if let Some(seen) = self.seen.motions.get(&id) {
            return Some(seen.clone());
        }
        let mut scope = Scope::of(id.module);
        let params = self.parameters(&mut scope, &decl.params);
        scope.add("self", Kind::Own, Type::Agent(None));
        let motion = Arc::new(self.motion_body(&mut scope, decl));
        self.seen.motions.insert(id, (params.clone().into(), motion.clone()));
        Some((params.into(), motion))
    }

    fn motion_body(&mut self, scope: &mut Scope, decl: &'a MotionDecl) -> Motion {
        let mut states: Vec<State> = Vec::new();
        if !self.few("states", decl.states.len().max(decl.nexts.len()), super::declare::MOST, decl.name.span)
        {
            return Motion { name: decl.name.node.clone(), states, output: None };
        }
        let lets = decl.lets.iter().map(|decl| (decl.name.span, Err(decl)));
        let mut entries: Vec<(Span, Result<&'a StateDecl, &'a LetDecl>)> =
            decl.states.iter().map(|state| (state.name.span, Ok(state))).chain(lets).collect();
        entries.sort_by_key(|entry| entry.0);
        for (_, entry) in entries {
            match entry {
                Err(decl) => self.local_let(scope, decl),
                Ok(state) => {
                    if let Some(first) = states.iter().position(|first| first.name == state.name.node) {
                        self.twice(&state.name, decl.states.get(first).map(|first| first.name.span), "state");
                        continue;
                    }
                    let start = self.drawn_or_set(scope, state);
                    if !start.is_poison() && !matches!(start.type_, Type::Number(_) | Type::Vector(_)) {
                        let have = self.describe(&start.type_);
                        let problem = Problem::error(&TYPE_MISMATCH, "a state is a number or a vector");
                        self.report(problem.at(start.span, format!("this is {have}")));
                    }
                    scope.add(&state.name.node, Kind::State(states.len()), start.type_.clone());
                    states.push(State { name: state.name.node.clone(), start, next: None });
                }
            }
        }
        for next in &decl.nexts {
            let Some(number) = states.iter().position(|state| state.name == next.name.node) else {
                let problem = Problem::error(
                    &UNKNOWN_STATE,
                    format!("`{}` has no state `{}`", decl.name.node, next.name.node),
                )
                .at(next.name.span, "");
                let help = match self.meant(&next.name.node, states.iter().map(|state| state.name.as_str())) {
                    Some(meant) => format!("did you mean `{meant}`?"),
                    None => format!("declare how it begins: `state {} = …`", next.name.node),
                };
                self.report(problem.help(help));
                continue;
            };
            let value = self.drawn_or_set(scope, next);
            let why = Wanted::declared(
                format!("`next {}`", next.name.node),
                decl.states
                    .iter()
                    .find(|s| s.name.node == next.name.node)
                    .map_or(next.name.span, |s| s.name.span),
            );
            let Some(state) = states.get_mut(number) else { continue };
            if state.next.is_some() {
                let first = decl.nexts.iter().find(|first| first.name.node == next.name.node);
                self.twice(&next.name, first.map(|first| first.name.span), "next value");
                continue;
            }
            let type_ = state.start.type_.clone();
            let value = self.fits(value, &type_, &why, &[], &mut Default::default());
            state.next = Some(value);
        }
        Motion { name: decl.name.node.clone(), states, output: self.output(scope, decl) }
    }

    fn twice(&mut self, name: &ast::Name, first: Option<Span>, what: &str) {
        let problem = Problem::error(&DUPLICATE_NAME, format!("`{}` has this {what} already", name.node))
            .at(name.span, "again here");
        self.report(match first {
            Some(first) => problem.with(first, "first here"),
            None => problem,
        });
    }

    fn output(&mut self, scope: &mut Scope, decl: &'a MotionDecl) -> Option<Output> {
        let problem = match decl.outputs.as_slice() {
            [output] => {
                let (dim, make): (_, fn(Expr) -> Output) = match output.name.node.as_str() {
                    "velocity" => ("speed", Output::Velocity),
                    "position" => ("length", Output::Position),
                    other => {
                        let problem =
                            Problem::error(&MOTION_OUTPUT, format!("a motion does not give `{other}`"))
                                .at(output.name.span, "")
                                .help("it gives `velocity` or `position`");
                        self.report(problem);
                        return None;
                    }
                };
                let value = self.drawn_or_set(scope, output);
                let type_ = Type::Vector(self.units.base(dim));
                let why = Wanted::declared(What::Name(&output.name.node), output.name.span);
                let value = self.fits(value, &type_, &why, &[], &mut Default::default());
                return (!value.is_poison()).then(|| make(value));
            }
            [] => Problem::error(&MOTION_OUTPUT, format!("the motion `{}` moves nothing", decl.name.node))
                .at(decl.name.span, "gives neither `velocity` nor `position`")
                .help("end it with `velocity = (…, …)` or `position = (…, …)`"),
            [first, second, ..] => Problem::error(&MOTION_OUTPUT, "a motion gives one thing")
                .at(second.name.span, "a second one")
                .with(first.name.span, "the first"),
        };
        self.report(problem);
        None
    }

    /// `name = value` or `name ~ value`: whether it draws must show.
    fn drawn_or_set(&mut self, scope: &mut Scope, decl: &'a StateDecl) -> Expr {
        self.assigned(scope, &decl.name.node, decl.random, &decl.value)
    }

    pub fn shape(&mut self, id: ItemId) -> Option<Declared<Shape>> {
        let Item::Shape(decl) = &self.program.item(id)?.node else { return None };
        if let Some(seen) = self.seen.shapes.get(&id) {
            return Some(seen.clone());
        }
        let mut scope = Scope::of(id.module);
        let params = self.parameters(&mut scope, &decl.params);
        let shape = Arc::new(self.shape_body(&mut scope, decl));
        self.seen.shapes.insert(id, (params.clone().into(), shape.clone()));
        Some((params.into(), shape))
    }

    fn shape_body(&mut self, scope: &mut Scope, decl: &'a ShapeDecl) -> Shape {
        for decl in &decl.lets {
            self.local_let(scope, decl);
        }
        let point = Type::Vector(self.units.base("length"));
        let why = Wanted::by("a slot");
        let slots = match &decl.slots {
            ShapeSlots::List(all) => {
                Slots::List(all.iter().map(|slot| self.wanted(scope, slot, &point, &why)).collect())
            }
            ShapeSlots::Rule { number, count, value } => {
                scope.add(&number.node, Kind::SlotNumber, Type::Number(Dim::none()));
                scope.add(&count.node, Kind::SlotCount, Type::Number(Dim::none()));
                Slots::Rule(self.wanted(scope, value, &point, &why))
            }
            ShapeSlots::Edges(edges) => Slots::Edges(self.edges(edges, scope, None).unwrap_or_default()),
            ShapeSlots::Graph { graph, distance } => {
                let length = Type::Number(self.units.base("length"));
                let why = Wanted::by("the distance of neighbours");
                let distance = self.wanted(scope, distance, &length, &why);
                Slots::Graph(self.graph(graph).unwrap_or(Graph::Complete), distance)
            }
        };
        Shape { name: decl.name.node.clone(), slots }
    }
}

pub const UNKNOWN_STATE: Code = Code {
    name: "unknown-state",
    explain: "\
`next` names a state that the motion does not declare.

    state phase ~ uniform(0 deg, 360 deg)
    next fase = phase + 1 deg       // wrong
    next phase = phase + 1 deg      // right",
};

pub const MOTION_OUTPUT: Code = Code {
    name: "motion-output",
    explain: "\
A motion gives exactly one of `velocity` and `position`.

    motion drift(pace: speed) { velocity = (pace, 0 m/s) }      // right",
};
