//! Obstacles: what they look like, where they are, whom they stop.

use super::Checker;
use crate::ast::{self, AgentsDecl, Assignment, ExprAt, Item};
use crate::case::Case;
use crate::hir::{Control, Expr, Extern, Kind, Output, Type};
use crate::plan::{GroupId, Setting, Solid};
use crate::problem::{Code, Problem};
use crate::resolve::{Space, listed};

const SETTINGS: [&str; 5] = ["position", "motion", "stops", "speed", "arena"];

/// Faster than anything: obstacles that move have no limit unless one is set, m/s.
const UNLIMITED_MPS: f64 = 1e9;

impl<'a> Checker<'a> {
    pub fn obstacles(&mut self) {
        for (id, item) in self.main_items() {
            let Item::Obstacles(decl) = &item.node else { continue };
            if let Some(&group) = self.ids.groups.get(&id) {
                self.obstacle(group, decl);
            }
        }
    }

    fn obstacle(&mut self, group: GroupId, decl: &'a AgentsDecl) {
        let outline = self.provided(Space::Solid, &decl.body);
        let of = format!("`{}`", decl.name.node);
        let settings = self.settings(&of, &decl.settings, &SETTINGS);
        let arena = settings.get("arena").map(|setting| self.fixed(setting, &Type::Area));
        let speed_type = Type::Range(self.units.base("speed"));
        let speed = settings.get("speed").map(|setting| self.fixed(setting, &speed_type));
        let stops = settings.get("stops").map(|setting| self.stops(setting)).unwrap_or_default();
        let span = decl.name.span;
        let number = |value, type_| Expr { kind: Kind::Number(value), type_, span, depth: 1 };
        let limit = Type::Number(self.units.base("speed"));
        let unlimited = || {
            let ends = [-UNLIMITED_MPS, UNLIMITED_MPS].map(|end| Box::new(number(end, limit.clone())));
            let [low, high] = ends;
            Expr { kind: Kind::Range(low, high), type_: speed_type.clone(), span, depth: 2 }
        };
        if let Some(place) = self.hir.world.groups.get_mut(group) {
            place.obstacle = true;
            (place.body, place.arena, place.stops) = (outline, arena, stops);
            place.speed = Some(speed.unwrap_or_else(unlimited));
        }
        let control = match settings.get("motion") {
            None => Some(Control::Still),
            Some(motion) => {
                self.undrawn(motion);
                self.motion_call(group, &motion.value).map(Control::Motion)
            }
        };
        let length = Type::Number(self.units.base("length"));
        let origin = || {
            let [x, y] = [0.0, 0.0].map(|x| Box::new(number(x, length.clone())));
            let type_ = Type::Vector(self.units.base("length"));
            Expr { kind: Kind::Vector(x, y), type_, span, depth: 2 }
        };
        let origin = origin();
        let start = settings.get("position").map(|setting| self.start(group, setting));
        let positions = matches!(&control, Some(Control::Motion(motion))
            if matches!(motion.what.output, Some(Output::Position(_))));
        if let (true, Some(setting)) = (positions, settings.get("position")) {
            self.report(
                Problem::warning(
                    &super::agents::UNUSED_START,
                    format!("the position of `{}` has no effect", decl.name.node),
                )
                .at(setting.value.span, "its motion tells where it is"),
            );
        }
        if let Some(place) = self.hir.world.groups.get_mut(group) {
            (place.control, place.start) = (control, Some(start.unwrap_or(origin)));
        }
    }

    /// The groups that are stopped: `all`, a group, or a list of groups.
    fn stops(&mut self, setting: &'a Assignment) -> Vec<GroupId> {
        self.undrawn(setting);
        let names: Vec<&ExprAt> = match &setting.value.node {
            ast::Expr::List(all) => all.iter().collect(),
            _ => vec![&setting.value],
        };
        let agents: Vec<(GroupId, String)> = self
            .hir
            .world
            .groups
            .iter()
            .enumerate()
            .filter(|(_, group)| !group.obstacle)
            .map(|(id, group)| (id, group.name.clone()))
            .collect();
        let mut found = Vec::new();
        for name in names {
            match &name.node {
                ast::Expr::Name(all) if all == "all" => found.extend(agents.iter().map(|(id, _)| *id)),
                ast::Expr::Name(group) if agents.iter().any(|(_, known)| known == group) => {
                    found.extend(agents.iter().filter(|(_, known)| known == group).map(|(id, _)| *id));
                }
                _ => {
                    let text = self.sources.text(name.span).to_owned();
                    let known = agents.iter().map(|(_, name)| name.as_str());
                    let problem = Problem::error(
                        &super::expr::UNKNOWN_NAME,
                        format!("`{text}` is no group of agents that could be stopped"),
                    );
                    self.report(problem.at(name.span, "").help(match self.meant(&text, known.clone()) {
                        Some(meant) => format!("did you mean `{meant}`?"),
                        None => format!("write `all`, or one or several of {}", listed(known)),
                    }));
                }
            }
        }
        found.sort_unstable();
        found.dedup();
        found
    }

    /// The list of places that the members of a group start at, one for each.
    pub fn places(&mut self, group: GroupId, list: Expr, setting: &Assignment) -> Expr {
        let own = self.hir.world.groups.get(group).map(|own| (own.size, own.span, own.name.clone()));
        let Some((size, span, name)) = own else { return Expr::poison(list.span) };
        if let Kind::List(all) = &list.kind
            && all.len() != size
            && size > 0
        {
            let problem = Problem::error(
                &LIST_LENGTH,
                format!(
                    "{} for {}",
                    super::feasible::counted(all.len(), "place"),
                    super::feasible::counted(size, "member")
                ),
            );
            let problem = problem
                .at(list.span, super::feasible::counted(all.len(), "place"))
                .with(span, format!("`{name}` has {}", super::feasible::counted(size, "member")))
                .help("give each member a place, or draw them: `~ …`");
            return self.poison(setting.value.span, problem);
        }
        let at = list.span;
        let type_ = Type::Vector(self.units.base("length"));
        let member = Expr { kind: Kind::Member(group), type_: Type::Agent(Some(group)), span: at, depth: 1 };
        let number = Type::Number(crate::dim::Dim::none());
        let number = self.make(Kind::MemberNumber(Box::new(member)), number, at);
        self.make(Kind::Element(Box::new(list), Box::new(number)), type_, at)
    }
}

impl Checker<'_> {
    /// What is wrong with the outlines of obstacles and the radii of agents.
    pub fn outlines(&self, case: &Case) -> Vec<Problem> {
        let mut problems = Vec::new();
        for group in &case.world.groups {
            if let Some(outline) = group.body.as_ref().filter(|_| group.obstacle)
                && let Some(Err(problem)) = solid(case, outline)
            {
                problems.push(*problem);
            }
            if let Some(radius) = &group.radius
                && case.number(radius).is_some_and(|radius| radius < 0.0)
            {
                let problem = Problem::error(&super::value::OUT_OF_RANGE, "a radius must not be negative");
                problems.push(problem.at(radius.span, "below 0 m"));
            }
        }
        problems
    }
}

/// The outline that the settings of an `extern solid` describe; the problem if they describe none.
pub fn solid(case: &Case, what: &Extern) -> Option<Result<Solid, Box<Problem>>> {
    let setting = |name: &str| {
        let value = &what.settings.iter().find(|(known, _)| known == name)?.1;
        Some((value, case.setting(value)?))
    };
    let number = |name: &str| match setting(name)?.1 {
        Setting::Number(value) => Some(value),
        _ => None,
    };
    Some(Ok(match what.name.as_str() {
        "disc" => Solid::Disc { radius_m: number("radius")? },
        "rectangle" => {
            let (x, y) = (number("width")? / 2.0, number("height")? / 2.0);
            Solid::Polygon { corners_m: vec![(-x, -y), (x, -y), (x, y), (-x, y)] }
        }
        "segment" => {
            let to = &what.settings.iter().find(|(known, _)| known == "to")?.1;
            Solid::Segment { to_m: case.point(to)? }
        }
        _ => {
            let corners = &what.settings.iter().find(|(known, _)| known == "corners")?.1;
            let corners_m = case.points(corners)?;
            if let Some(why) = crossing(&corners_m) {
                let problem = Problem::error(&BAD_OUTLINE, why).at(corners.span, "");
                return Some(Err(Box::new(problem.help(
                    "list the corners in order around the outline; the last is joined with the first",
                ))));
            }
            Solid::Polygon { corners_m }
        }
    }))
}

/// What is wrong with the corners of a polygon.
fn crossing(corners: &[(f64, f64)]) -> Option<String> {
    if corners.len() < 3 {
        return Some(format!("a polygon has at least three corners, not {}", corners.len()));
    }
    let edge = |k: usize| Some((*corners.get(k)?, *corners.get((k + 1) % corners.len())?));
    let side = |(a, b): ((f64, f64), (f64, f64)), p: (f64, f64)| {
        (b.0 - a.0) * (p.1 - a.1) - (b.1 - a.1) * (p.0 - a.0)
    };
    for i in 0..corners.len() {
        for j in i + 1..corners.len() {
            let (Some(a), Some(b)) = (edge(i), edge(j)) else { continue };
            let neighbours = j == i + 1 || (i == 0 && j + 1 == corners.len());
            let crosses = side(a, b.0) * side(a, b.1) < 0.0 && side(b, a.0) * side(b, a.1) < 0.0;
            if crosses && !neighbours {
                return Some(format!("side {} and side {} of this polygon cross", i + 1, j + 1));
            }
        }
    }
    let area: f64 = (0..corners.len()).filter_map(edge).map(|(a, b)| a.0 * b.1 - b.0 * a.1).sum();
    (area == 0.0).then(|| "this polygon has no area".to_owned())
}

pub const LIST_LENGTH: Code = Code {
    name: "list-length",
    explain: "\
A list of places has one for each member of the group.

    agents follower[3] : point {
        start = [(0 m, 0 m), (1 m, 0 m)]                    // wrong: two for three
        start = [(0 m, 0 m), (1 m, 0 m), (2 m, 0 m)]        // right
    }",
};

pub const BAD_OUTLINE: Code = Code {
    name: "bad-outline",
    explain: "\
The corners of a polygon go once around its outline, without crossing it. The last is joined with the first.

    obstacle yard : polygon([(0 m, 0 m), (1 m, 1 m), (1 m, 0 m), (0 m, 1 m)])       // wrong: crosses itself
    obstacle yard : polygon([(0 m, 0 m), (1 m, 0 m), (1 m, 1 m), (0 m, 1 m)])       // right",
};
