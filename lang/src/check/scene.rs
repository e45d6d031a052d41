//! The world, `require` and `observe`.

use super::fits::{TYPE_MISMATCH, Wanted};
use super::settings::MISSING;
use super::{Checker, Scope};
use crate::ast::{self, Assignment, Item, Span};
use crate::hir::{Control, Expr, Kind, Observation, Set, Shared, Type};
use crate::plan::{GroupId, VarId};
use crate::problem::{Code, Problem};
use crate::resolve::Space;

/// A group and the variable that stands for one of its members.
pub type Member = (GroupId, (VarId, String));

impl<'a> Checker<'a> {
    pub fn world(&mut self) {
        let found = self.only("world", |item| match item {
            Item::World(settings) => Some(settings),
            _ => None,
        });
        let Some((settings, span)) = found else {
            let problem = Problem::error(&MISSING, "the scenario has no `world`").at(self.anywhere(), "");
            self.missing(
                problem.help("write for example `world { dt = 0.1 s, horizon = 200 steps, safety = 0.1 m }`"),
            );
            return;
        };
        let settings = self.settings("`world`", settings, &["dt", "horizon", "safety", "room", "lighting"]);
        let dims = ["time", "steps", "length"].map(|name| Type::Number(self.units.base(name)));
        let [dt, horizon, safety] = dims;
        self.hir.world.dt = settings.get("dt").map(|setting| self.fixed(setting, &dt));
        self.hir.world.horizon = settings.get("horizon").map(|setting| self.fixed(setting, &horizon));
        self.hir.world.safety = settings.get("safety").map(|setting| self.fixed(setting, &safety));
        if self.hir.world.dt.is_none() {
            self.report(
                Problem::error(&MISSING, "the world has no time step")
                    .at(span, "`dt` is missing")
                    .help("write for example `dt = 0.1 s`"),
            );
        }
        let fixed = |value: f64, type_: Type| Expr { kind: Kind::Number(value), type_, span, depth: 1 };
        self.hir.world.horizon.get_or_insert(fixed(200.0, horizon));
        self.hir.world.safety.get_or_insert(fixed(0.0, safety));
        let world = self.hir.world.clone();
        self.constants.dt_s = world.dt.and_then(|dt| self.constant(&dt, &"`dt`"));
        self.constants.horizon = world.horizon.and_then(|horizon| self.constant(&horizon, &"`horizon`"));
        self.constants.safety_m = world.safety.and_then(|safety| self.constant(&safety, &"`safety`"));
        let room = settings.get("room").map(|room| self.chosen(Space::Room, room, "room = indoor"));
        let lighting = settings.get("lighting");
        let lighting = lighting.map(|it| self.chosen(Space::Lighting, it, "lighting = evening"));
        (self.hir.world.room, self.hir.world.lighting) = (room, lighting);
    }

    pub fn scene(&mut self) {
        let main = self.program.main;
        for (_, item) in self.main_items() {
            if let Item::Require(condition) = &item.node {
                let why = Wanted::by("what is required");
                let condition = self.wanted(&mut Scope::of(main), condition, &Type::Truth, &why);
                self.hir.world.require.push(condition);
            }
        }
        let found = self.only("observe", |item| match item {
            Item::Observe { each, items } => Some((each.as_ref(), items)),
            _ => None,
        });
        match found {
            Some(((_, items), span)) if items.is_empty() => self.no_observation(span),
            None => self.no_observation(self.anywhere()),
            Some(((each, items), _)) => {
                let (shared, scope) = match each {
                    Some(each) => self.shared(each),
                    None => (None, Scope::of(self.program.main)),
                };
                self.hir.world.shared = shared;
                items.iter().for_each(|item| self.observation(item, scope.clone()));
            }
        }
    }

    /// `observe each i in follower`, and the scope of what each observes.
    fn shared(&mut self, each: &'a ast::Over) -> (Option<Shared>, Scope) {
        let (member, scope) = self.each_member(each, "observe");
        let Some((group, var)) = member else { return (None, scope) };
        let learned: Vec<GroupId> = self.learned_groups();
        let name = |group: GroupId| self.hir.world.groups.get(group).map_or("", |group| group.name.as_str());
        let span = |group: GroupId| self.hir.world.groups.get(group).map(|g| g.span).unwrap_or_default();
        let problem = if !learned.contains(&group) && !learned.is_empty() {
            Problem::error(&BAD_EACH, format!("`{}` does not learn", name(group)))
                .at(each.set.span, "one policy for each of these")
                .with(span(group), "moved by a motion")
        } else if let Some(other) = learned.iter().find(|&&other| other != group) {
            Problem::error(&BAD_EACH, format!("`{}` learns, too", name(*other)))
                .at(each.set.span, format!("one policy for each of `{}`", name(group)))
                .with(span(*other), "would have none")
        } else {
            return (Some(Shared { group, var, rewarded: None }), scope);
        };
        self.report(problem.help("all agents that learn are in the one group after `each`"));
        (None, scope)
    }

    /// The group of `each i in group` and its variable, and a scope in which it is known.
    pub fn each_member(&mut self, each: &'a ast::Over, what: &str) -> (Option<Member>, Scope) {
        let mut scope = Scope::of(self.program.main);
        let Some(over) = self.over(&mut scope, each) else { return (None, scope) };
        let Some(var) = over.vars.into_iter().next() else { return (None, scope) };
        if let (Set::Group(group), None) = (over.set, &over.filter) {
            return (Some((group, var)), scope);
        }
        let span = each.filter.as_ref().map_or(each.set.span, |filter| filter.span);
        let problem = Problem::error(&BAD_EACH, format!("`{what} each` is for the members of one group"));
        self.report(problem.at(span, "").help(format!("write `{what} each i in` and the group's name")));
        (None, scope)
    }

    pub fn learned_groups(&self) -> Vec<GroupId> {
        let groups = self.hir.world.groups.iter().enumerate();
        groups
            .filter(|(_, group)| matches!(group.control, Some(Control::Learned)))
            .map(|(id, _)| id)
            .collect()
    }

    fn no_observation(&mut self, at: Span) {
        let problem = Problem::error(&MISSING, "the learner observes nothing").at(at, "");
        self.missing(problem.help("write for example `observe { p[leader] - p[follower] }`"));
    }

    fn observation(&mut self, item: &'a ast::ObserveItem, mut scope: Scope) {
        if let Some(via) = &item.via {
            return self.no_training_by_sight(item, via);
        }
        let over = item.over.as_ref().map(|over| {
            let checked = self.over(&mut scope, over);
            if let Some(crate::hir::Over { set: Set::Pairs(_) | Set::Edges(_), .. }) = checked {
                let problem =
                    Problem::error(&super::sets::WRONG_VARIABLES, "`observe` runs over single agents");
                self.report(problem.at(over.set.span, "pairs").help("write `for i in` a group or `all`"));
                return None;
            }
            checked
        });
        let value = self.expr(&mut scope, &item.value);
        if !matches!(value.type_, Type::Number(_) | Type::Vector(_) | Type::Poison) {
            let have = self.describe(&value.type_);
            self.report(
                Problem::error(&TYPE_MISMATCH, "only numbers and vectors can be observed")
                    .at(value.span, format!("this is {have}")),
            );
            return;
        }
        let end = item
            .over
            .as_ref()
            .map_or(item.value.span, |over| over.filter.as_ref().map_or(over.set.span, |filter| filter.span));
        let span = item.value.span.to(end);
        let text = self.sources.text(span).split_whitespace().collect::<Vec<_>>().join(" ");
        if over.as_ref().is_some_and(Option::is_none) {
            return;
        }
        let (noise, delay) = self.sensor(&item.settings, &value);
        let over = over.flatten();
        self.hir.world.observe.push(Observation { text, value, over, noise, delay, span });
    }

    /// The noise or the delay of an observation.
    pub fn sensor(&mut self, settings: &'a [Assignment], value: &Expr) -> (Option<Expr>, Option<Expr>) {
        let found = self.settings("an observation", settings, &["noise", "delay"]);
        let dim = match &value.type_ {
            Type::Number(dim) | Type::Vector(dim) => Type::Number(dim.clone()),
            _ => Type::Poison,
        };
        let noise = found.get("noise").map(|setting| {
            self.undrawn(setting);
            let mut scope = Scope::of(self.program.main);
            let why = Wanted::like("the noise of an observation", value.span);
            self.wanted(&mut scope, &setting.value, &dim, &why)
        });
        let steps = Type::Number(self.units.base("steps"));
        let delay = found.get("delay").map(|setting| {
            let delay = self.fixed(setting, &steps);
            self.whole(&delay, &"`delay`", 0.0);
            delay
        });
        (noise, delay)
    }
}

pub const BAD_EACH: Code = Code {
    name: "bad-each",
    explain: "\
`observe each i in follower` gives every follower a state of its own, and all share one policy. So the group is the one
that learns, and `reward each` names the same group.

    observe each i in follower { F[i] - p[i] }
    reward each i in follower { gap = -|p[i] - F[i]| }      // or without `each`: a reward of the team",
};
