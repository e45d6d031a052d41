//! Groups of agents: what they are, what moves them, where they start.

use std::fmt::Display;

use super::call::BAD_ARGUMENTS;
use super::fits::{Wanted, What};
use super::settings::{GIVEN_TWICE, MISSING};
use super::value::OUT_OF_RANGE;
use super::{Checker, Scope};
use crate::ast::{self, AgentsDecl, Assignment, Call, ExprAt, Item};
use crate::dim::Substitution;
use crate::hir::{Called, Control, Expr, Extern, Kind, Motion, Output, OwnSetting, Type};
use crate::plan::GroupId;
use crate::problem::{Code, Problem};
use crate::resolve::Space;

/// Agents of a group, at most.
const LARGEST_GROUP: usize = 10_000;

const SETTINGS: [&str; 9] =
    ["arena", "speed", "radius", "camera", "odometry", "control", "filter", "motion", "start"];

impl<'a> Checker<'a> {
    /// How many each group has, which everything else refers to.
    pub fn group_sizes(&mut self) {
        let (groups, formations) = (self.ids.groups.len(), self.ids.formations.len());
        if let Some(last) = self.hir.world.groups.last().map(|group| group.span) {
            self.few("groups", groups, super::declare::MOST, last);
            self.few("formations", formations, super::declare::MOST, last);
        }
        for (id, item) in self.main_items() {
            let (Item::Agents(decl) | Item::Obstacles(decl)) = &item.node else { continue };
            let size = match &decl.size {
                None => Some(1),
                Some(size) => {
                    let why = Wanted::by("the number of agents");
                    let size = self.wanted(&mut Scope::of(id.module), size, &Type::Count, &why);
                    let whole = self.whole(&size, &"the number of agents", 1.0);
                    if whole.is_some_and(|whole| whole > LARGEST_GROUP) {
                        self.report(
                            Problem::error(
                                &OUT_OF_RANGE,
                                format!("a group has at most {LARGEST_GROUP} agents"),
                            )
                            .at(size.span, ""),
                        );
                    }
                    whole.filter(|&whole| whole <= LARGEST_GROUP)
                }
            };
            let Some(&group) = self.ids.groups.get(&id) else { continue };
            if let Some(group) = self.hir.world.groups.get_mut(group) {
                group.size = size.unwrap_or(0);
            }
        }
    }

    pub fn agents(&mut self) {
        let mut learned = false;
        for (id, item) in self.main_items() {
            let Item::Agents(decl) = &item.node else { continue };
            if let Some(&group) = self.ids.groups.get(&id) {
                learned |= self.group(group, decl);
            }
        }
        if !learned {
            let problem = Problem::error(&MISSING, "no agent learns").at(self.anywhere(), "in this scenario");
            self.missing(problem.help("give a group `control = learned`"));
        }
    }

    /// Whether it learns, or would if it had no mistakes.
    fn group(&mut self, group: GroupId, decl: &'a AgentsDecl) -> bool {
        let body = self.provided(Space::Body, &decl.body);
        let of = format!("`{}`", decl.name.node);
        let settings = self.settings(&of, &decl.settings, &SETTINGS);
        let arena = settings.get("arena").map(|setting| self.fixed(setting, &Type::Area));
        let speed_type = Type::Range(self.units.base("speed"));
        let speed = settings.get("speed").map(|setting| self.fixed(setting, &speed_type));
        if speed.is_none() {
            self.missing_in_group(decl, "speed", "speed = -0.7 m/s .. 0.7 m/s");
        }
        let length = Type::Number(self.units.base("length"));
        let radius = settings.get("radius").map(|setting| self.fixed(setting, &length));
        let camera = settings.get("camera");
        let camera = camera.map(|setting| self.chosen(Space::Camera, setting, "camera = pinhole"));
        let odometry = settings.get("odometry");
        let odometry = odometry.map(|setting| self.chosen(Space::Odometry, setting, "odometry = wheels"));
        for (value, what) in [(&arena, "an arena"), (&speed, "a speed limit"), (&radius, "a radius")] {
            if let Some(value) = value {
                self.constant_setting(value, &what);
            }
        }
        if let Some(place) = self.hir.world.groups.get_mut(group) {
            (place.body, place.arena, place.speed, place.radius) = (body, arena, speed, radius);
            (place.camera, place.odometry) = (camera, odometry);
        }
        let control =
            self.control(group, decl, settings.get("control").copied(), settings.get("motion").copied());
        let learned = matches!(control, None | Some(Control::Learned));
        let filter = settings.get("filter").and_then(|setting| self.filter(decl, setting, learned));
        let start = settings.get("start").map(|setting| self.start(group, setting));
        let positions = matches!(&control, Some(Control::Motion(motion))
            if matches!(motion.what.output, Some(Output::Position(_)) | None));
        if start.is_none() && !positions && control.is_some() {
            self.missing_in_group(decl, "start", "start ~ near((0 m, 0 m), 0.5 m)");
        }
        if let (Some(setting), Some(Control::Motion(motion))) = (settings.get("start"), &control)
            && matches!(motion.what.output, Some(Output::Position(_)))
        {
            self.report(
                Problem::warning(&UNUSED_START, format!("the start of `{}` has no effect", decl.name.node))
                    .at(setting.value.span, "not used")
                    .with(
                        motion.span,
                        format!("`{}` tells the position from the beginning", motion.what.name),
                    ),
            );
        }
        if let Some(place) = self.hir.world.groups.get_mut(group) {
            (place.control, place.filter, place.start) = (control, filter, start);
        }
        learned
    }

    fn missing_in_group(&mut self, decl: &AgentsDecl, what: &str, example: &str) {
        self.report(
            Problem::error(&MISSING, format!("`{}` needs a `{what}`", decl.name.node))
                .at(decl.name.span, format!("has no `{what}`"))
                .help(format!("for example `{example}`")),
        );
    }

    /// A body or an outline, with its settings.
    pub fn provided(&mut self, space: Space, call: &'a Call) -> Option<Extern> {
        let id = self.item_named(space, &call.name)?;
        let params = self.signature(id)?;
        let mut scope = Scope::of(self.program.main);
        let args = self.bind(&mut scope, call, call.name.span, &params, (&[], &mut Substitution::default()));
        for (param, value) in params.iter().zip(&args) {
            self.constant_setting(value, &What::Name(&param.name));
        }
        let settings = params.iter().map(|param| param.name.clone()).zip(args).collect();
        Some(Extern { name: call.name.node.clone(), settings })
    }

    /// Reports a setting that is not known before the episodes begin.
    pub fn constant_setting(&mut self, value: &Expr, what: &dyn Display) {
        match &value.kind {
            Kind::Range(low, high) => {
                self.constant(low, what);
                self.constant(high, what);
            }
            Kind::Area(x, y) => {
                self.constant_setting(x, what);
                self.constant_setting(y, what);
            }
            Kind::List(all) | Kind::Schedule(_, all) => {
                for entry in all {
                    self.constant_setting(entry, what);
                }
            }
            Kind::Let(value) if matches!(value.type_, Type::List(_)) => self.constant_setting(value, what),
            _ if matches!(value.type_, Type::Vector(_)) => self.constant_vector(value, what),
            _ if matches!(value.type_, Type::Number(_)) => {
                self.constant(value, what);
            }
            _ => {}
        }
    }

    fn control(
        &mut self,
        group: GroupId,
        decl: &'a AgentsDecl,
        control: Option<&'a Assignment>,
        motion: Option<&'a Assignment>,
    ) -> Option<Control> {
        match (control, motion) {
            (Some(control), Some(motion)) => {
                self.report(
                    Problem::error(
                        &GIVEN_TWICE,
                        format!("`{}` cannot both learn and follow a motion", decl.name.node),
                    )
                    .at(motion.value.span, "a motion")
                    .with(control.value.span, "controlled")
                    .help("keep one of the two"),
                );
                None
            }
            (Some(control), None) => {
                self.undrawn(control);
                let why = Wanted::by("`control`");
                let type_ = Type::Word(vec!["learned".to_owned()]);
                let value = self.wanted(&mut Scope::of(self.program.main), &control.value, &type_, &why);
                (!value.is_poison()).then_some(Control::Learned)
            }
            (None, Some(motion)) => {
                self.undrawn(motion);
                self.motion_call(group, &motion.value).map(Control::Motion)
            }
            (None, None) => {
                self.report(
                    Problem::error(&MISSING, format!("nothing moves `{}`", decl.name.node))
                        .at(decl.name.span, "has neither `control` nor `motion`")
                        .help("write `control = learned`, or for example `motion = random_velocity(1 m/s)`"),
                );
                None
            }
        }
    }

    /// `barrier(margin = 3 cm)` or `barrier` as the filter of a learned group.
    fn filter(&mut self, decl: &AgentsDecl, setting: &'a Assignment, learned: bool) -> Option<Extern> {
        if !learned {
            let problem = Problem::error(&USELESS_FILTER, "a filter changes what a controller asks")
                .at(setting.value.span, "filters nothing")
                .with(decl.name.span, format!("`{}` follows a motion", decl.name.node));
            self.report(problem.help("remove it, or give the filter to a group with `control = learned`"));
            return None;
        }
        self.chosen(Space::Filter, setting, "filter = barrier").what
    }

    /// `circle(0.6 m)` as the motion of a group.
    pub fn motion_call(&mut self, group: GroupId, at: &'a ExprAt) -> Option<Called<Motion>> {
        let bare;
        let (call, span) = match &at.node {
            ast::Expr::Call(call) => (call, at.span),
            ast::Expr::Name(name) => {
                bare = ast::Name { node: name.clone(), span: at.span };
                let id = self.item_named(Space::Motion, &bare)?;
                let (params, what) = self.motion(id)?;
                return match params.iter().map(|param| param.default.clone()).collect::<Option<Vec<_>>>() {
                    Some(args) => Some(Called { what, args, span: at.span }),
                    None => {
                        let names = crate::resolve::listed(
                            params.iter().filter(|p| p.default.is_none()).map(|p| p.name.as_str()),
                        );
                        let problem = Problem::error(&BAD_ARGUMENTS, format!("`{name}` needs {names}"));
                        self.report(problem.at(at.span, "").help(format!("write `{name}(…)`")));
                        None
                    }
                };
            }
            _ => {
                let problem = Problem::error(&super::expr::WRONG_KIND, "this is no motion").at(at.span, "");
                self.report(problem.help("write a motion's name and its arguments: `circle(0.6 m)`"));
                return None;
            }
        };
        let id = self.item_named(Space::Motion, &call.name)?;
        let (params, what) = self.motion(id)?;
        let mut scope = self.member_scope(group);
        let args = self.bind(&mut scope, call, span, &params, (&[], &mut Substitution::default()));
        (!args.iter().any(Expr::is_poison)).then_some(Called { what, args, span })
    }

    /// Inside a group's settings, `i` is the member, and `arena` and `speed` are the group's.
    fn member_scope(&self, group: GroupId) -> Scope {
        let mut scope = Scope::of(self.program.main);
        let Some(own) = self.hir.world.groups.get(group) else { return scope };
        if let Some(arena) = &own.arena {
            scope.add("arena", Kind::Setting(group, OwnSetting::Arena), arena.type_.clone());
        }
        if let Some(speed) = &own.speed {
            scope.add("speed", Kind::Setting(group, OwnSetting::Speed), speed.type_.clone());
        }
        scope.add("i", Kind::Member(group), Type::Agent(Some(group)));
        scope
    }

    pub fn start(&mut self, group: GroupId, setting: &'a Assignment) -> Expr {
        let mut scope = self.member_scope(group);
        let name = setting.path.last().map_or("start", |name| name.node.as_str());
        let value = self.assigned(&mut scope, name, setting.random, &setting.value);
        let point = Type::Vector(self.units.base("length"));
        if matches!(&value.type_, Type::List(of) if **of == point) {
            return self.places(group, value, setting);
        }
        self.fits(value, &point, &Wanted::by(What::Name(name)), &[], &mut Default::default())
    }
}

pub const USELESS_FILTER: Code = Code {
    name: "useless-filter",
    explain: "\
A safety filter (`filter = barrier`) stands between whoever steers a robot and its wheels: it changes commands. A group
that follows a motion is not commanded, so it cannot have one. Others that have a filter keep clear of it.",
};

pub const UNUSED_START: Code = Code {
    name: "unused-start",
    explain: "\
A motion that gives positions tells where its agent is from the beginning, so the group's `start` has no effect in
training. (An evaluation may replace the motion by one that gives velocities; then the start counts.)",
};
