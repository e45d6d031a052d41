//! From the typed scenario to what runs: `Hir → Plan`. Calls are inlined, settings become numbers.

mod cases;
mod sight;

use std::cell::Cell;
use std::collections::BTreeMap;

use crate::ast::Span;
use crate::case::Case;
use crate::check::obstacles::solid;
use crate::check::units::Units;
use crate::check::value::{not_constant, too_large};
use crate::dim::Dim;
use crate::hir::{self, Hir, Output, Type};
use crate::inline::{Inliner, Refusal, Value};
use crate::plan::{
    Binder, Claim, Constraint, Control, Each, End, Expr, Extern, Formation, Group, GroupId, Method, Motion,
    MotionOutput, MotionState, Observation, Param, Plan, Randomised, Shared, Slots, Term, Track, VarId,
    World,
};
use crate::problem::{Code, Problem, Problems};
use crate::source::Sources;

use cases::Cases;
pub use cases::OTHER_SIZES;
pub use sight::OTHER_CAMERAS;

/// The variable that stands for a member of a shared policy: the first of each expression.
const SHARED: VarId = 0;

/// Seeds of a study that says nothing else.
const SEEDS: usize = 10;

/// A checked scenario's Plan; `None` if something could not be lowered, which is reported.
pub fn lower(hir: &Hir, units: &Units, sources: &Sources, problems: &mut Problems) -> Option<Plan> {
    let spent = Cell::new(0);
    let case = Case::of(hir, &hir.params, &spent);
    let mut own = Lower { hir, units, sources, case: &case, problems };
    let world = own.world()?;
    let params = hir.params.iter().map(|param| own.param(param)).collect::<Option<_>>()?;
    let learners = hir.learners.iter().map(|method| own.method(method)).collect::<Option<_>>()?;
    let controllers = hir.controllers.iter().map(|method| own.method(method)).collect::<Option<_>>()?;
    let seeds = match &hir.seeds {
        Some(seeds) => own.number(seeds)? as usize,
        None => SEEDS,
    };
    let localisers =
        hir.localisers.iter().map(|localiser| own.localiser(localiser)).collect::<Option<_>>()?;
    let claims = hir.claims.iter().map(|claim| Claim {
        text: claim.text.clone(),
        kind: claim.kind.clone(),
        at: sources.place(claim.span),
    });
    let mut plan = Plan {
        name: hir.name.clone(),
        doc: hir.doc.clone(),
        params,
        learners,
        controllers,
        first_seed: 0,
        seeds,
        claims: claims.collect(),
        tests: hir.tests.iter().map(|test| own.test(test)).collect::<Option<_>>()?,
        world,
        localisers,
        tracks: hir.tracks.iter().map(|track| lowered(track, sources)).collect(),
        ..Plan::default()
    };
    let mut cases = Cases { hir, units, sources, spent: &spent, plan: &plan, problems };
    let protocols = hir.protocols.iter().map(|protocol| cases.protocol(protocol)).collect::<Option<_>>()?;
    let stages = hir.stages.iter().map(|stage| cases.stage(stage)).collect::<Option<_>>()?;
    let variants = hir.variants.iter().map(|variant| cases.variant(variant)).collect::<Option<_>>()?;
    (plan.protocols, plan.stages, plan.variants) = (protocols, stages, variants);
    sight::one_camera_each(&plan, hir, problems)?;
    Some(plan)
}

fn lowered(track: &hir::Track, sources: &Sources) -> Track {
    let (t_s, p_m) = track.points.iter().copied().unzip();
    Track { name: track.name.clone(), t_s, p_m, at: sources.place(track.span) }
}

struct Lower<'a> {
    hir: &'a Hir,
    units: &'a Units,
    sources: &'a Sources,
    case: &'a Case<'a>,
    problems: &'a mut Problems,
}

impl<'a> Lower<'a> {
    /// Reports why something has no value.
    fn told<T>(&mut self, result: Result<T, Refusal>, at: Span) -> Option<T> {
        let inside = |part: Span, problem: Problem| match part.file == at.file
            && (at.start..at.end).contains(&part.start)
        {
            true => problem,
            false => problem.with(at, "in what this stands for"),
        };
        let wrong = |part, message: &str, label, help: &str| {
            inside(part, Problem::error(&UNKNOWN_MEMBER, message).at(part, label)).help(help)
        };
        let problem = match result {
            Ok(value) => return Some(value),
            Err(Refusal::TooLarge) => too_large(at),
            Err(Refusal::ForeignSlot(slot)) => wrong(
                slot,
                "the agent is not in the formation",
                "this place is asked of an agent that may have none",
                "pass members of the formation's group only",
            ),
            Err(Refusal::NoNeighbours(pair)) => wrong(
                pair,
                "these two may be no neighbours in the formation",
                "the distance of neighbours is asked for",
                "run over the edges: `sum(i, j in edges(T)) … T[i, j] …`",
            ),
            Err(Refusal::NoPlaces(place)) => wrong(
                place,
                "this formation gives distances, not places",
                "a place is asked for",
                "the distance of neighbours is `T[i, j]`, for `i, j in edges(T)`",
            ),
            Err(Refusal::WrongSet(set)) => wrong(
                set,
                "this set has no fixed size",
                "",
                "`size` is taken of a group, `all`, `obstacles` or `pairs(…)`",
            ),
            Err(Refusal::Poison) => not_constant(at, &"this"),
        };
        self.problems.push(problem);
        None
    }

    fn constant<T>(&mut self, value: Option<T>, at: Span) -> Option<T> {
        if value.is_none() {
            self.problems.push(not_constant(at, &"this"));
        }
        value
    }

    fn number(&mut self, expr: &hir::Expr) -> Option<f64> {
        self.constant(self.case.number(expr), expr.span)
    }

    /// One expression by itself.
    fn expr(&mut self, expr: &hir::Expr) -> Option<Expr> {
        let lowered = self.case.inliner().expr(expr, &[]);
        self.told(lowered, expr.span)
    }

    fn param(&mut self, param: &hir::Param) -> Option<Param> {
        Some(Param {
            name: param.name.clone(),
            doc: param.doc.clone(),
            value: self.constant(param.value, param.span)?,
            dimension: self.units.name(&param.dim),
            text: self.written(&param.default, &param.dim),
            at: self.sources.place(param.span),
        })
    }

    /// A value as it stands in the source; as a number, if it is a point of a range.
    fn written(&self, value: &hir::Expr, dim: &Dim) -> String {
        let text = self.sources.text(value.span);
        match value.kind {
            hir::Kind::Number(number) if text.contains('(') => {
                format!("{number} {}", self.units.si(dim)).trim_end().to_owned()
            }
            _ => text.to_owned(),
        }
    }

    /// A draw around a parameter's own value means the declared one.
    fn randomised(&mut self, drawn: &hir::Randomised) -> Option<Randomised> {
        let mut folded = self.case.folded.clone();
        let declared = self.hir.params.get(drawn.param).and_then(|param| param.value);
        folded.extend(declared.map(|value| (drawn.param, value)));
        let value = self.case.inliner_with(&folded).expr(&drawn.value, &[]);
        Some(Randomised {
            param: drawn.param,
            value: self.told(value, drawn.value.span)?,
            at: self.sources.place(drawn.span),
        })
    }

    fn extern_(&mut self, what: &hir::Extern) -> Option<Extern> {
        let mut settings = BTreeMap::new();
        for (name, value) in &what.settings {
            let setting = self.constant(self.case.setting(value), value.span)?;
            settings.insert(name.clone(), setting);
        }
        Some(Extern { name: what.name.clone(), settings })
    }

    fn method(&mut self, method: &hir::Method) -> Option<Method> {
        let what = self.extern_(&method.what)?;
        Some(Method { label: method.label.clone(), what, at: self.sources.place(method.span) })
    }

    fn world(&mut self) -> Option<World> {
        let world = self.case.world;
        Some(World {
            dt_s: self.number(world.dt.as_ref()?)?,
            horizon: self.number(world.horizon.as_ref()?)? as usize,
            safety_m: self.number(world.safety.as_ref()?)?,
            groups: world
                .groups
                .iter()
                .enumerate()
                .map(|(id, group)| self.group(id, group))
                .collect::<Option<_>>()?,
            formations: world.formations.iter().map(|f| self.formation(f)).collect::<Option<_>>()?,
            randomise: world.randomise.iter().map(|drawn| self.randomised(drawn)).collect::<Option<_>>()?,
            shared: world.shared.as_ref().map(|shared| Shared {
                group: shared.group,
                var: Binder { id: SHARED, name: shared.var.1.clone() },
                rewarded: shared.rewarded.as_ref().map(|(_, name)| Binder { id: SHARED, name: name.clone() }),
            }),
            require: world.require.iter().map(|condition| self.expr(condition)).collect::<Option<_>>()?,
            observe: world.observe.iter().map(|o| self.observation(o)).collect::<Option<_>>()?,
            reward: world.reward.iter().map(|term| self.term(term)).collect::<Option<_>>()?,
            ends: world.ends.iter().map(|end| self.end(end)).collect::<Option<_>>()?,
            scenery: self.scenery()?,
            localised: world.localised.iter().map(|it| self.localised(it)).collect(),
        })
    }

    fn group(&mut self, id: GroupId, group: &hir::Group) -> Option<Group> {
        let arena = match &group.arena {
            Some(arena) => Some(self.constant(self.case.area(arena), arena.span)?),
            None => None,
        };
        let speed = group.speed.as_ref()?;
        let outline = group.body.as_ref()?;
        let (solid, body) = match group.obstacle {
            true => {
                let solid = solid(self.case, outline).and_then(Result::ok);
                let point = Extern { name: "point".to_owned(), settings: BTreeMap::new() };
                (Some(self.constant(solid, group.span)?), point)
            }
            false => (None, self.extern_(outline)?),
        };
        let control = match group.control.as_ref()? {
            hir::Control::Still => Control::Still,
            hir::Control::Learned => Control::Learned,
            hir::Control::Motion(motion) => Control::Motion(self.motion(id, motion)?),
        };
        let positions = matches!(&control, Control::Motion(Motion { output: MotionOutput::Position(_), .. }));
        let start = match group.start.as_ref().filter(|_| !positions) {
            Some(start) => Some(self.expr(start)?),
            None => None,
        };
        Some(Group {
            name: group.name.clone(),
            size: group.size,
            solid,
            stops: group.stops.clone(),
            radius_m: group.radius.as_ref().map_or(Some(0.0), |radius| self.number(radius))?,
            body,
            arena,
            speed_mps: self.constant(self.case.range(speed), speed.span)?,
            control,
            filter: group.filter.as_ref().map_or(Some(None), |filter| self.extern_(filter).map(Some))?,
            camera: group.camera.as_ref().map_or(Some(None), |it| self.chosen(it).map(Some))?,
            odometry: group.odometry.as_ref().map_or(Some(None), |it| self.chosen(it).map(Some))?,
            start,
            at: self.sources.place(group.span),
        })
    }

    fn motion(&mut self, group: GroupId, call: &hir::Called<hir::Motion>) -> Option<Motion> {
        let mut inliner = self.case.inliner().moving(group);
        let args = inliner.all(&call.args, &[]);
        let args = self.told(args, call.span)?;
        let mut each = |expr: &hir::Expr| -> Option<Expr> {
            let lowered = inliner.expr(expr, &args);
            self.told(lowered, call.span)
        };
        let mut states = Vec::new();
        for (number, state) in call.what.states.iter().enumerate() {
            let start = each(&state.start)?;
            let next = state.next.as_ref().map_or(Some(Expr::State(number)), &mut each)?;
            states.push(MotionState { name: state.name.clone(), start, next });
        }
        let output = match call.what.output.as_ref()? {
            Output::Velocity(value) => MotionOutput::Velocity(each(value)?),
            Output::Position(value) => MotionOutput::Position(each(value)?),
        };
        Some(Motion { name: call.what.name.clone(), states, output })
    }

    fn formation(&mut self, formation: &hir::Formation) -> Option<Formation> {
        let shape = formation.shape.as_ref()?;
        let mut inliner = self.case.inliner();
        let args: Result<Vec<Value>, _> = inliner.all(&shape.args, &[]);
        let args = self.told(args, shape.span)?;
        let mut slot = |expr: &hir::Expr| {
            let lowered = self.case.inliner().expr(expr, &args);
            self.told(lowered, shape.span)
        };
        let frame = formation.frame;
        let constraint = match &shape.what.slots {
            hir::Slots::List(all) => {
                let slots = Slots::List(all.iter().map(&mut slot).collect::<Option<_>>()?);
                Constraint::Displacements { slots, frame }
            }
            hir::Slots::Rule(rule) => Constraint::Displacements { slots: Slots::Rule(slot(rule)?), frame },
            hir::Slots::Edges(edges) => {
                Constraint::Distances(edges.iter().map(|edge| slot(&edge.distance)).collect::<Option<_>>()?)
            }
            hir::Slots::Graph(_, distance) => Constraint::Distances(vec![slot(distance)?]),
        };
        Some(Formation {
            name: formation.name.clone(),
            shape: shape.what.name.clone(),
            group: formation.group,
            about: formation.about.map(|about| self.case.world.first_of(about)),
            constraint,
            graph: self.case.world.graph(formation).into_owned(),
            at: self.sources.place(formation.span),
        })
    }

    fn observation(&mut self, observation: &hir::Observation) -> Option<Observation> {
        let mut inliner = self.case.inliner();
        if let Some(shared) = &self.case.world.shared {
            inliner.bind(&shared.var, shared.group);
        }
        let over = match &observation.over {
            Some(over) => {
                let each = Self::each(&mut inliner, over);
                self.told(each, observation.span)?
            }
            None => None,
        };
        let value = inliner.expr(&observation.value, &[]);
        let noise = match &observation.noise {
            Some(noise) => Some(self.expr(noise)?),
            None => None,
        };
        let delay = observation.delay.as_ref().map_or(Some(0.0), |delay| self.number(delay))? as usize;
        Some(Observation {
            text: observation.text.clone(),
            value: self.told(value, observation.value.span)?,
            vector: matches!(observation.value.type_, Type::Vector(_)),
            over,
            noise,
            delay,
            at: self.sources.place(observation.span),
        })
    }

    fn each(inliner: &mut Inliner<'_>, over: &hir::Over) -> Result<Option<Each>, Refusal> {
        let (vars, set, filter) = inliner.over(over, &[])?;
        Ok(vars.into_iter().next().map(|var| Each { var, set, filter }))
    }

    fn term(&mut self, term: &hir::Term) -> Option<Term> {
        let mut inliner = self.case.inliner();
        if let Some(shared) = &self.case.world.shared
            && let Some(var) = &shared.rewarded
        {
            inliner.bind(var, shared.group);
        }
        let value = inliner.expr(&term.value, &[]);
        Some(Term {
            name: term.name.clone(),
            doc: term.doc.clone(),
            value: self.told(value, term.value.span)?,
            dimension: self.units.name(&self.hir.reward_dim),
            at: self.sources.place(term.span),
        })
    }

    fn end(&mut self, end: &hir::End) -> Option<End> {
        let cost = match &end.cost {
            Some(cost) => Some(self.expr(cost)?),
            None => None,
        };
        Some(End {
            name: end.name.clone(),
            when: self.expr(&end.when)?,
            failure: end.failure,
            cost,
            at: self.sources.place(end.span),
        })
    }
}

pub const UNKNOWN_MEMBER: Code = Code {
    name: "unknown-member",
    explain: "\
A function asks for the place of an agent in a formation, and is called for an agent that has none.

    fn off(i: agent) -> length = |p[i] - F[i]|
    gap = -sum(i in all) off(i)             // wrong: the leader has no place in F
    gap = -sum(i in follower) off(i)        // right",
};
