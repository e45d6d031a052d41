//! The world, formations, `require` and `observe`.

use super::fits::{TYPE_MISMATCH, Wanted};
use super::settings::MISSING;
use super::{Checker, Scope};
use crate::ast::{self, Item, Span};
use crate::dim::Substitution;
use crate::hir::{Called, Expr, Formation, Kind, Observation, Type};
use crate::plan::{GroupId, IndexSet};
use crate::problem::Problem;
use crate::resolve::{Space, listed};

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
        let settings = self.settings("`world`", settings, &["dt", "horizon", "safety"]);
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
        self.constants.dt_s = world.dt.and_then(|dt| self.constant(&dt, "`dt`"));
        self.constants.horizon = world.horizon.and_then(|horizon| self.constant(&horizon, "`horizon`"));
        self.constants.safety_m = world.safety.and_then(|safety| self.constant(&safety, "`safety`"));
    }

    pub fn formations(&mut self) {
        let mut shapes = Vec::new();
        for (_, item) in self.main_items() {
            let Item::Formation(decl) = &item.node else { continue };
            let (Some(shape), Some(about)) = (&decl.shape, &decl.about) else { continue };
            let (name, group) = (&decl.name, &decl.group);
            let (group, about) = (self.group_of_name(group), self.leader_of_formation(about));
            if let (Some(group), Some(about)) = (group, about)
                && group == about
            {
                let problem = Problem::error(
                    &super::expr::CIRCULAR,
                    format!("`{}` is about its own member", name.node),
                );
                self.report(problem.at(item.span, "").help("a formation is about an agent of another group"));
            }
            let unknown = usize::MAX;
            self.hir.world.formations.push(Formation {
                name: name.node.clone(),
                group: group.unwrap_or(unknown),
                about: about.unwrap_or(unknown),
                shape: None,
                span: name.span,
            });
            shapes.push((shape, group));
        }
        for (number, (call, group)) in shapes.into_iter().enumerate() {
            let Some(id) = self.item_named(Space::Shape, &call.name) else { continue };
            let Some((params, what)) = self.shape(id) else { continue };
            let mut scope = Scope::of(self.program.main);
            let args =
                self.bind(&mut scope, call, call.name.span, &params, (&[], &mut Substitution::default()));
            let span = call.args.last().map_or(call.name.span, |last| call.name.span.to(last.value.span));
            if let Some(formation) = self.hir.world.formations.get_mut(number)
                && group.is_some()
                && !args.iter().any(Expr::is_poison)
            {
                formation.shape = Some(Called { what, args, span });
            }
        }
    }

    fn group_of_name(&mut self, name: &ast::Name) -> Option<GroupId> {
        let groups = || self.hir.world.groups.iter().map(|group| group.name.as_str());
        if let Some(group) = groups().position(|group| group == name.node) {
            return Some(group);
        }
        if self.program.is_unknown(self.program.main, Space::Value, &name.node) {
            return None;
        }
        let problem =
            Problem::error(&super::expr::UNKNOWN_NAME, format!("there is no group `{}`", name.node));
        let help = match self.meant(&name.node, groups()) {
            Some(meant) => format!("did you mean `{meant}`?"),
            None => format!("`agent` and `agents` declare {}", listed(groups())),
        };
        self.report(problem.at(name.span, "").help(help));
        None
    }

    fn leader_of_formation(&mut self, name: &ast::Name) -> Option<GroupId> {
        let group = self.group_of_name(name)?;
        let (size, span) = self.hir.world.groups.get(group).map(|group| (group.size, group.span))?;
        if size > 1 {
            let problem =
                Problem::error(&super::sets::GROUP_AS_AGENT, format!("`{}` is {size} agents", name.node))
                    .at(name.span, "a formation is about one agent")
                    .with(span, format!("a group of {size}"));
            self.report(problem.help("name a group of one, such as `agent leader : …` declares"));
            return None;
        }
        Some(group)
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
            Item::Observe { items, .. } => Some(items),
            _ => None,
        });
        match found {
            Some((items, span)) if items.is_empty() => self.no_observation(span),
            None => self.no_observation(self.anywhere()),
            Some((items, _)) => items.iter().for_each(|item| self.observation(item)),
        }
    }

    fn no_observation(&mut self, at: Span) {
        let problem = Problem::error(&MISSING, "the learner observes nothing").at(at, "");
        self.missing(problem.help("write for example `observe { p[leader] - p[follower] }`"));
    }

    fn observation(&mut self, item: &'a ast::ObserveItem) {
        let mut scope = Scope::of(self.program.main);
        let over = item.over.as_ref().map(|over| {
            let checked = self.over(&mut scope, over);
            if let Some(crate::hir::Over { set: IndexSet::Pairs(_), .. }) = checked {
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
        self.hir.world.observe.push(Observation { text, value, over: over.flatten(), span });
    }
}
