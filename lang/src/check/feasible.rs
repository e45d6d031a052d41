//! Values out of range and arrangements that cannot work, in training and in each evaluation.

use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};

use super::Checker;
use super::value::OUT_OF_RANGE;
use crate::ast::{Item, ShapeSlots, Span};
use crate::case::Case;
use crate::hir::{Bound, Draw, Expr, Kind, Slots};
use crate::inline::{Refusal, Value};
use crate::plan::{GroupId, ParamId};
use crate::problem::{Code, Problem};
use crate::resolve::Space;

impl Checker<'_> {
    /// As declared, and with each uniformly drawn parameter at the ends of its draw.
    pub fn feasible(&mut self) {
        let spent = Cell::new(0);
        let declared: Vec<Option<f64>> = self.hir.params.iter().map(|param| param.value).collect();
        let case = Case::with(&self.hir, &[], declared.clone(), &spent);
        let mut found = self.misplaced(&case);
        let sound = found.is_empty();
        found.extend(self.infeasible(&case, sound, &|_| true));
        for (param, end, at) in self.ends_of_draws(&declared, &spent) {
            let mut params = declared.clone();
            params.iter_mut().skip(param).take(1).for_each(|value| *value = Some(end));
            let end = Case::with(&self.hir, &[], params, &spent);
            for problem in self.infeasible(&end, sound, &|value| value.mentions(param)) {
                if !found.iter().any(|told| (told.code, told.span()) == (problem.code, problem.span())) {
                    found.push(problem.with(at, "drawn here"));
                }
            }
        }
        found.into_iter().for_each(|problem| self.report(problem));
    }

    fn ends_of_draws(&self, declared: &[Option<f64>], spent: &Cell<usize>) -> Vec<(ParamId, f64, Span)> {
        let case = Case::with(&self.hir, &[], declared.to_vec(), spent);
        let mut ends = Vec::new();
        for drawn in &self.hir.world.randomise {
            let Kind::Draw(Draw::Uniform, of) = &drawn.value.kind else { continue };
            let of = of.iter().filter_map(|end| case.number(end));
            ends.extend(of.map(|end| (drawn.param, end, drawn.value.span)));
        }
        ends
    }

    /// What no value of a parameter could mend.
    fn misplaced(&self, case: &Case) -> Vec<Problem> {
        let mut problems = Vec::new();
        self.never_outside(case, &mut problems);
        (0..case.world.groups.len()).for_each(|group| self.start_order(case, group, &mut problems));
        problems
    }

    /// What is wrong with these values of the parameters, of what depends on them. `sound`: nothing is misplaced.
    fn infeasible(&self, case: &Case, sound: bool, depends: &dyn Fn(&Expr) -> bool) -> Vec<Problem> {
        let mut problems = Vec::new();
        let limits = |range: &Option<(Expr, Expr)>| {
            range.as_ref().is_some_and(|(low, high)| depends(low) || depends(high))
        };
        let bounds = self.hir.bounds.iter().filter(|bound| depends(&bound.value) || limits(&bound.range));
        problems.extend(bounds.filter_map(|bound| self.out_of_bounds(case, bound)));
        self.world_limits(case, &mut problems);
        problems.extend(self.outlines(case));
        for group in &case.world.groups {
            for setting in [&group.arena, &group.speed].into_iter().flatten().filter(|value| depends(value)) {
                self.rising(case, setting, &mut problems);
            }
            for (name, value) in group.body.iter().chain(&group.filter).flat_map(|it| &it.settings) {
                if depends(value)
                    && let Some((low, high)) = case.range(value)
                    && low > high
                {
                    problems.push(empty_range(value.span, &format!("`{name}`")));
                }
            }
        }
        // A size out of range may be why places are too close or outside.
        if sound && problems.is_empty() {
            problems.extend(self.outside_room(case));
            for (number, formation) in case.world.formations.iter().enumerate() {
                if formation
                    .shape
                    .as_ref()
                    .is_some_and(|shape| shape.args.iter().chain(shape.what.slots.places()).any(depends))
                {
                    self.formation(case, number, &mut problems);
                }
            }
        }
        problems
    }

    fn out_of_bounds(&self, case: &Case, bound: &Bound) -> Option<Problem> {
        let too_large = || case.value(&bound.value).err().filter(|why| *why == Refusal::TooLarge);
        let Some(value) = case.number(&bound.value) else {
            return too_large().map(|_| super::value::too_large(bound.value.span));
        };
        let at = bound.value.span;
        let text = self.sources.text(at);
        if bound.whole && (value.fract() != 0.0 || value < 0.0) {
            let problem = Problem::error(&OUT_OF_RANGE, format!("`{}` must be a whole number", bound.name))
                .at(at, if value < 0.0 { "negative" } else { "not whole" });
            return Some(problem.with(bound.declared, "declared here"));
        }
        let (low, high) = bound.range.as_ref()?;
        let (low_value, high_value) = (case.number(low)?, case.number(high)?);
        if (low_value..=high_value).contains(&value) {
            return None;
        }
        let (low, high) = (self.sources.text(low.span), self.sources.text(high.span));
        let message = format!("`{}` must lie between {low} and {high}", bound.name);
        let above = value > high_value;
        let label = if above { format!("above {high}") } else { format!("below {low}") };
        let mut problem = Problem::error(&OUT_OF_RANGE, message).at(at, label);
        if bound.declared != at {
            problem = problem.with(bound.declared, format!("declared in {low} .. {high}"));
        }
        let nearest = if above { high } else { low };
        Some(match matches!(bound.value.kind, Kind::Number(_) | Kind::Unary(..)) {
            true => problem.help(format!("the nearest value allowed is {nearest}")),
            false => problem.note(format!("`{text}` comes to {value} in SI units")),
        })
    }

    fn world_limits(&self, case: &Case, problems: &mut Vec<Problem>) {
        let world = &case.world;
        let mut limit = |setting: &Option<Expr>, message: &str, right: fn(f64) -> bool| {
            if let Some(setting) = setting
                && let Some(value) = case.number(setting)
                && !right(value)
            {
                let text = self.sources.text(setting.span);
                problems
                    .push(Problem::error(&OUT_OF_RANGE, message).at(setting.span, format!("this is {text}")));
            }
        };
        limit(&world.dt, "the time step must be above 0 s", |dt| dt > 0.0);
        limit(&world.safety, "the safety distance must not be negative", |safety| safety >= 0.0);
        limit(&world.horizon, "the horizon must be a whole number of steps, from 1", |steps| {
            steps >= 1.0 && steps.fract() == 0.0 && steps <= 1e9
        });
    }

    /// The ends of a range or of the sides of an area must not be the wrong way round.
    fn rising(&self, case: &Case, setting: &Expr, problems: &mut Vec<Problem>) {
        let wrong = |low: f64, high: f64| low.partial_cmp(&high) != Some(std::cmp::Ordering::Less);
        if let Some((low, high)) = case.range(setting)
            && wrong(low, high)
        {
            problems.push(empty_range(setting.span, "the speed limit"));
        }
        if let Some(area) = case.area(setting) {
            let sides = if let Kind::Area(x, y) = &setting.kind {
                (x.span, y.span)
            } else {
                (setting.span, setting.span)
            };
            for ((low, high), span, name) in [(area.x_m, sides.0, "width"), (area.y_m, sides.1, "height")] {
                if wrong(low, high) {
                    problems.push(empty_range(span, &format!("the {name} of the arena")));
                }
            }
        }
    }

    /// An end that asks whether agents are outside of arenas that they do not have.
    fn never_outside(&self, case: &Case, problems: &mut Vec<Problem>) {
        for end in &case.world.ends {
            let Ok(Value::Expr(when)) = case.value(&end.when) else { continue };
            let mut found = BTreeSet::new();
            case.asked_outside(&when, &mut BTreeMap::new(), &mut found);
            let groups: Vec<_> = found.iter().filter_map(|group| case.world.groups.get(*group)).collect();
            if let [first, ..] = groups.as_slice()
                && groups.iter().all(|group| group.arena.is_none())
            {
                let problem = Problem::warning(&NEVER_OUTSIDE, format!("`{}` is never outside", first.name))
                    .at(end.when.span, "asks whether it is")
                    .with(first.span, "has no `arena`");
                problems.push(problem.help(format!(
                    "give `{}` one, for example `arena = box(-2 m .. 2 m, -2 m .. 2 m)`",
                    first.name
                )));
            }
        }
    }

    /// A start may refer to agents that are placed before.
    fn start_order(&self, case: &Case, group: GroupId, problems: &mut Vec<Problem>) {
        let groups = &case.world.groups;
        let Some((own, start)) = groups.get(group).and_then(|own| Some((own, own.start.as_ref()?))) else {
            return;
        };
        let Ok(Value::Expr(lowered)) = case.value(start) else { return };
        if own.gives_positions() {
            return;
        }
        let later =
            |other: &GroupId| *other >= group && groups.get(*other).is_some_and(|g| !g.gives_positions());
        let mut found = BTreeSet::new();
        case.groups_in(&lowered, group, &mut found);
        let Some(other) = found.into_iter().find(later).and_then(|other| groups.get(other)) else { return };
        let alone = own.name == other.name;
        let message = match alone {
            true => format!("the start of `{}` depends on where `{}` is", own.name, own.name),
            false => format!("`{}` starts before `{}` has a place", own.name, other.name),
        };
        let problem =
            Problem::error(&START_ORDER, message).at(start.span, format!("depends on `{}`", other.name));
        problems.push(match alone {
            true => problem.help(
                "refer to other groups only, also by slots of formations about them; `require` keeps distances",
            ),
            false => problem
                .with(other.span, "declared later")
                .help(format!("declare `{}` before `{}`", other.name, own.name)),
        });
    }

    fn formation(&self, case: &Case, number: usize, problems: &mut Vec<Problem>) {
        let Some(formation) = case.world.formations.get(number) else { return };
        let Some(shape) = &formation.shape else { return };
        let Some(group) = case.world.groups.get(formation.group) else { return };
        if group.size == 0 {
            return;
        }
        let members = case.world.nodes(formation);
        // Edges by name join agents that are there, though perhaps not all.
        let by_name = shape.span == formation.span;
        if let Some(problem) = super::formations::other_nodes(shape, members, group.span).filter(|_| !by_name)
        {
            problems.push(problem);
            return;
        }
        if let Slots::List(slots) = &shape.what.slots
            && slots.len() != group.size
        {
            let name = &shape.what.name;
            let message = format!(
                "`{name}` has {} but `{}` has {}",
                counted(slots.len(), "place"),
                group.name,
                counted(group.size, "agent")
            );
            let problem = Problem::error(&SLOT_COUNT, message)
                .at(shape.span, format!("arranges {}", counted(slots.len(), "agent")))
                .with(group.span, counted(group.size, "agent"))
                .help(self.shapes_that_fit(&group.name, group.size, slots.len()));
            problems.push(problem);
            return;
        }
        let (Some(slots), Some(safety)) = (case.slots(number), case.constants.safety_m) else { return };
        let about = formation.about.and_then(|about| case.world.groups.get(about));
        let about = about.map_or("", |group| group.name.as_str());
        let points: Vec<(f64, f64)> = std::iter::once((0.0, 0.0)).chain(slots).collect();
        let nearest = nearest_two(&points);
        let Some((apart, i, j)) = nearest else { return };
        // Rounding must not make a square of just the safety distance too small.
        if apart < safety * (1.0 - 1e-9) {
            let name = |k: usize| match k {
                0 => format!("`{about}`"),
                k => format!("`{}[{k}]`", formation.name),
            };
            let message = format!(
                "{} and {} are {} m apart, below the safety distance of {} m",
                name(i),
                name(j),
                rounded(apart),
                rounded(safety)
            );
            let problem =
                Problem::error(&SLOTS_TOO_CLOSE, message).at(shape.span, "in their places these two collide");
            let safety_at = case.world.safety.as_ref().map(|safety| safety.span);
            let problem = match safety_at {
                Some(at) => problem.with(at, "the safety distance"),
                None => problem,
            };
            let problem = shape.args.iter().fold(problem, |problem, arg| match arg.kind {
                Kind::Param(id) => self.with_value(problem, case, id),
                _ => problem,
            });
            problems.push(problem.help("enlarge the formation or lower the safety distance"));
        }
    }

    /// Shows a parameter that the arrangement depends on.
    fn with_value(&self, problem: Problem, case: &Case, id: ParamId) -> Problem {
        match (self.hir.params.get(id), case.constants.params.get(id)) {
            (Some(param), Some(Some(value))) => {
                let value = format!("{} {}", rounded(*value), self.units.si(&param.dim));
                problem.with(param.span, format!("`{}` is {value}", param.name))
            }
            _ => problem,
        }
    }

    fn shapes_that_fit(&self, group: &str, size: usize, places: usize) -> String {
        let library = self.program.library().filter(|(_, declared)| declared.space == Space::Shape);
        let library = library.filter_map(|(_, declared)| declared.item());
        let fitting = library.chain(self.program.written().map(|(_, item)| item)).find_map(|item| {
            let Item::Shape(shape) = &item.node else { return None };
            let fits = match &shape.slots {
                ShapeSlots::Rule { .. } => true,
                ShapeSlots::Edges(_) | ShapeSlots::Graph { .. } => false,
                ShapeSlots::List(slots) => slots.len() == size,
            };
            fits.then_some(&shape.name.node)
        });
        let fitting =
            fitting.filter(|_| self.program.names(self.program.main, Space::Shape).next().is_some());
        let resize = format!("declare `{group}[{places}]`");
        match fitting {
            Some(shape) => format!("{resize}, or use a shape of {size}, for example `{shape}`"),
            None => format!("{resize}, or use a shape with {}", counted(size, "place")),
        }
    }
}

/// The two points that are closest to each other, and how far apart; of equals the first.
fn nearest_two(points: &[(f64, f64)]) -> Option<(f64, usize, usize)> {
    let extent = |of: fn(&(f64, f64)) -> f64| {
        let ends = points
            .iter()
            .map(of)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        ends.1 - ends.0
    };
    let along: fn(&(f64, f64)) -> f64 = if extent(|p| p.0) >= extent(|p| p.1) { |p| p.0 } else { |p| p.1 };
    // Sorted along the longer side, only neighbours can be closer than the closest so far.
    let mut order: Vec<(usize, &(f64, f64))> = points.iter().enumerate().collect();
    order.sort_by(|a, b| along(a.1).total_cmp(&along(b.1)));
    let mut nearest: Option<(f64, usize, usize)> = None;
    for (k, (j, b)) in order.iter().enumerate() {
        for (i, a) in order.iter().take(k).rev() {
            let best = nearest.map_or(f64::INFINITY, |nearest| nearest.0);
            if along(b) - along(a) > best {
                break;
            }
            let apart = ((a.0 - b.0) * (a.0 - b.0) + (a.1 - b.1) * (a.1 - b.1)).sqrt();
            let pair = (apart, *i.min(j), *i.max(j));
            if apart < best || nearest.is_some_and(|nearest| pair < nearest) {
                nearest = Some(pair);
            }
        }
    }
    nearest
}

fn empty_range(at: Span, what: &str) -> Problem {
    Problem::error(&OUT_OF_RANGE, format!("{what} is empty"))
        .at(at, "the low end is not below the high end")
        .help("write `low .. high`")
}

pub fn counted(number: usize, noun: &str) -> String {
    format!("{number} {noun}{}", if number == 1 { "" } else { "s" })
}

/// For people: to the micrometre.
fn rounded(metres: f64) -> f64 {
    (metres * 1e6).round() / 1e6
}

pub const SLOT_COUNT: Code = Code {
    name: "slot-count",
    explain: "\
A formation shape with a list of slots arranges just as many agents.

    agents follower[4] : point { … }
    formation F of follower = square(0.4 m) about leader        // wrong: `square` has three places
    formation F of follower = line(0.4 m) about leader          // right: `line` has a rule for any number",
};

pub const SLOTS_TOO_CLOSE: Code = Code {
    name: "slots-too-close",
    explain: "\
Two places of a formation, or a place and the agent it is about, are closer than the safety distance: agents that
do what they should would collide.

    world { dt = 0.1 s, safety = 0.1 m }
    formation F of follower = square(0.05 m) about leader       // wrong
    formation F of follower = square(0.4 m) about leader        // right",
};

pub const NEVER_OUTSIDE: Code = Code {
    name: "never-outside",
    explain: "\
`outside(i)` asks whether an agent has left its arena. Without an `arena` there is nothing to leave, so an end that
asks for it never comes.

    agent follower : point { speed = …, control = learned, start = … }      // add an `arena`
    end { lost when outside(follower) }",
};

pub const START_ORDER: Code = Code {
    name: "start-order",
    explain: "\
Agents are placed in the order of their declarations, so a start can refer to agents declared above only.

    agent follower : point { start ~ near(p[leader], 0.5 m) … }     // wrong if the leader comes later

Agents whose motion gives positions are placed first.",
};
