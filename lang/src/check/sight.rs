//! What robots with a camera see, and what tells them where they are.

use super::fits::Wanted;
use super::obstacles::LIST_LENGTH;
use super::settings::{GIVEN_TWICE, MISSING};
use super::{Checker, Scope};
use crate::ast::{
    self, AgentsDecl, Argument, Assignment, Expr as Ast, ExprAt, Item, Name, ObserveItem, Spanned,
};
use crate::case::Case;
use crate::dim::Dim;
use crate::hir::{Chosen, Control, Expr, Extern, Hir, Kind, Landmark, Localised, Localiser, Parameter, Type};
use crate::plan::{GroupId, Setting};
use crate::problem::{Code, Problem};
use crate::resolve::{Space, listed};

/// Landmarks of a scenario, at most.
const LANDMARKS: usize = 1000;

/// Localisers of a scenario, at most.
const LOCALISERS: usize = 100;

impl<'a> Checker<'a> {
    /// `indoor(width = 6 m)` or `indoor`: something that Rust provides.
    pub fn chosen(&mut self, space: Space, setting: &'a Assignment, example: &str) -> Chosen {
        self.undrawn(setting);
        let ExprAt { node, span } = &setting.value;
        let what = match node {
            Ast::Call(call) => self.provided(space, call),
            Ast::Name(name) => self.provided_bare(space, &Name { node: name.clone(), span: *span }),
            _ => {
                let people = space.people().trim_start_matches("a ");
                let problem = Problem::error(&super::expr::WRONG_KIND, format!("this is no {people}"));
                self.report(problem.at(*span, "").help(format!("write its name: `{example}`")));
                None
            }
        };
        Chosen { what, span: *span }
    }

    /// Something by its name alone, with the defaults of its settings.
    fn provided_bare(&mut self, space: Space, name: &Name) -> Option<Extern> {
        let id = self.item_named(space, name)?;
        let given = |param: &Parameter| Some((param.name.clone(), param.default.clone()?));
        let settings = self.signature(id)?.iter().map(given).collect::<Option<_>>()?;
        Some(Extern { name: name.node.clone(), settings })
    }

    pub fn landmarks(&mut self) {
        let mut number = 0;
        for (_, item) in self.main_items() {
            let Item::Landmarks(decl) = &item.node else { continue };
            let Some(landmark) = self.landmark(decl) else { continue };
            number += landmark.count();
            if !self.few("landmarks", number, LANDMARKS, decl.name.span) {
                return;
            }
            self.hir.world.landmarks.push(landmark);
        }
    }

    fn landmark(&mut self, decl: &'a AgentsDecl) -> Option<Landmark> {
        let mut scope = Scope::of(self.program.main);
        let size = match &decl.size {
            None => None,
            Some(size) => {
                let why = Wanted::by("the number of landmarks");
                let size = self.wanted(&mut scope, size, &Type::Count, &why);
                scope.add("i", Kind::SlotNumber, Type::Number(Dim::none()));
                Some(self.whole(&size, &"the number of landmarks", 1.0)?)
            }
        };
        let what = self.provided(Space::LandmarkKind, &decl.body);
        let settings = self.settings(&format!("`{}`", decl.name.node), &decl.settings, &["at", "heading"]);
        let Some(setting) = settings.get("at") else {
            let problem = Problem::error(&MISSING, format!("`{}` needs a place", decl.name.node));
            self.report(problem.at(decl.name.span, "has no `at`").help("for example `at = (2 m, 1 m)`"));
            return None;
        };
        self.constants.slot = Some((1.0, size.unwrap_or(1) as f64));
        let at = self.landmark_setting(&mut scope, setting, &Type::Vector(self.units.base("length")));
        let plain = Type::Number(Dim::none());
        let heading =
            settings.get("heading").map(|setting| self.landmark_setting(&mut scope, setting, &plain));
        self.constants.slot = None;
        Some(Landmark { name: decl.name.node.clone(), size, what, at, heading, span: decl.name.span })
    }

    /// The same for all, a rule for number i, or a list with an entry for each.
    fn landmark_setting(&mut self, scope: &mut Scope, setting: &'a Assignment, type_: &Type) -> Expr {
        self.undrawn(setting);
        let name = format!("`{}`", setting.path.last().map_or("", |name| name.node.as_str()));
        scope.draws = setting.random;
        let value = self.expr(scope, &setting.value);
        if setting.random {
            return Expr::poison(value.span);
        }
        let value = match &value.type_ {
            Type::List(of) if **of == *type_ => value,
            _ => self.fits(value, type_, &Wanted::by(name.clone()), &[], &mut Default::default()),
        };
        self.constant_setting(&value, &name);
        value
    }

    pub fn localisers(&mut self) {
        for (id, item) in self.main_items() {
            let Item::Localiser { name, what, .. } = &item.node else { continue };
            let what = self.provided(Space::LocaliserKind, what);
            if !self.few("localisers", self.hir.localisers.len() + 1, LOCALISERS, name.span) {
                return;
            }
            self.ids.localisers.insert(id, self.hir.localisers.len());
            self.hir.localisers.push(Localiser { name: name.node.clone(), what, span: name.span });
        }
    }

    /// What is there to be seen needs a room.
    pub fn rooms(&mut self) {
        if self.hir.world.room.is_some() {
            return;
        }
        let cameras = self.hir.world.groups.iter().filter_map(|group| Some(group.camera.as_ref()?.span));
        let cameras = cameras.map(|at| (at, "a camera needs a room to look at", "shows nothing"));
        let landmarks = self.hir.world.landmarks.iter();
        let landmarks = landmarks.map(|it| (it.span, "a landmark stands in a room", "stands nowhere"));
        for (at, message, label) in cameras.chain(landmarks).collect::<Vec<_>>() {
            let problem = Problem::error(&NO_ROOM, message).at(at, label);
            self.report(problem.help("`world { …, room = indoor() }`, with `use std.sight.indoor`"));
        }
    }

    /// `observe { camera(follower) via eyes }` of an evaluation.
    pub fn localised(&mut self, observe: &'a [Spanned<Item>]) {
        if let [first, others @ ..] = observe {
            for other in others {
                let problem = Problem::error(&GIVEN_TWICE, "`observe` is set twice");
                self.report(problem.at(other.span, "again here").with(first.span, "first set here"));
            }
            let Item::Observe { each, items } = &first.node else { return };
            if let Some(each) = each {
                self.other_observation(each.set.span);
            }
            for item in items {
                if let Some(localised) = self.localised_group(item) {
                    self.hir.world.localised.push(localised);
                }
            }
        }
    }

    fn other_observation(&mut self, at: ast::Span) {
        let problem = Problem::error(&BAD_SIGHT, "an evaluation does not change what is observed");
        self.report(problem.at(at, "a policy goes on with what it learned to observe").help(
            "it says how poses are told: `camera(follower) via eyes`; something else is observed in a `variant`",
        ));
    }

    fn localised_group(&mut self, item: &'a ObserveItem) -> Option<Localised> {
        let at = item.value.span;
        let Some(via) = &item.via else {
            self.other_observation(at);
            return None;
        };
        let (sees, name) = match &item.value.node {
            Ast::Call(call) => match (call.name.node.as_str(), call.args.as_slice()) {
                (
                    word @ ("camera" | "pose"),
                    [Argument { name: None, value: ExprAt { node: Ast::Name(name), span } }],
                ) => (word == "camera", Name { node: name.clone(), span: *span }),
                _ => return self.no_sight(at),
            },
            _ => return self.no_sight(at),
        };
        let localiser = self.localiser_named(via);
        let group = self.seeing_group(&name)?;
        if let Some(first) = self.hir.world.localised.iter().find(|it| it.group == group) {
            let first = first.span;
            let problem = Problem::error(&GIVEN_TWICE, format!("`{}` is localised twice", name.node));
            self.report(problem.at(name.span, "again here").with(first, "first here"));
            return None;
        }
        let localiser = localiser?;
        let (declared, looks) = self.hir.localisers.get(localiser).map(|it| (it.span, it.looks()))?;
        if sees != looks {
            let message = match looks {
                true => format!("`{}` looks at images", via.node),
                false => format!("`{}` does not look at images", via.node),
            };
            let right = if looks { "camera" } else { "pose" };
            let problem =
                Problem::error(&WRONG_LOCALISER, message).at(at, "").with(declared, "declared here");
            self.report(problem.help(format!("write `{right}({}) via {}`", name.node, via.node)));
            return None;
        }
        let own = self.hir.world.groups.get(group)?;
        let (span, camera, arena) = (own.span, own.camera.is_some(), own.arena.is_some());
        let counts = own.odometry.is_some();
        if looks && !camera {
            let problem = Problem::error(&NO_CAMERA, format!("`{}` has no camera", name.node));
            let problem = problem.at(name.span, "sees nothing").with(span, "has no `camera`");
            self.report(
                problem.help("give the group one: `camera = pinhole()`, with `use std.sight.pinhole`"),
            );
            return None;
        }
        if looks && !arena {
            let problem = Problem::error(&MISSING, format!("`{}` needs an arena", name.node));
            let problem = problem.at(name.span, "where could it be?").with(span, "has no `arena`");
            let help = "a network tells places of a bounded area: `arena = box(-2 m .. 2 m, -2 m .. 2 m)`";
            self.report(problem.help(help));
            return None;
        }
        if let (Some(joined), false) = (item.odometry, counts) {
            let problem = Problem::error(&NO_ODOMETRY, format!("`{}` has no odometry", name.node));
            let problem = problem.at(joined, "counts nothing").with(span, "has no `odometry`");
            self.report(
                problem.help("give the group one: `odometry = wheels()`, with `use std.sight.wheels`"),
            );
            return None;
        }
        let end = item.odometry.unwrap_or(via.span);
        Some(Localised { group, via: localiser, odometry: item.odometry.is_some(), span: at.to(end) })
    }

    fn no_sight(&mut self, at: ast::Span) -> Option<Localised> {
        let problem = Problem::error(&BAD_SIGHT, "a localiser tells the poses of a group");
        self.report(
            problem.at(at, "").help("write `camera(follower) via eyes` or `pose(follower) via blur`"),
        );
        None
    }

    fn localiser_named(&mut self, via: &Name) -> Option<usize> {
        let main = self.program.main;
        if let Some(entry) = self.find(main, Space::Localiser, &via.node) {
            self.program.item(entry.id)?;
            self.used.insert(entry.at);
            return self.ids.localisers.get(&entry.id).copied();
        }
        let known: Vec<&str> = self.program.names(main, Space::Localiser).collect();
        let help = if self.program.find(main, Space::LocaliserKind, &via.node).is_some() {
            format!("give it a name: `localiser eyes = {}`, then `via eyes`", via.node)
        } else if let Some(meant) = self.meant(&via.node, known.iter().copied()) {
            format!("did you mean `{meant}`?")
        } else if known.is_empty() {
            "declare one: `localiser eyes = resnet`, with `use std.sight.resnet`".to_owned()
        } else {
            format!("known here: {}", listed(known))
        };
        let message = format!("there is no localiser `{}`", via.node);
        self.report(Problem::error(&super::expr::UNKNOWN_NAME, message).at(via.span, "").help(help));
        None
    }

    /// A group that acts on what it is told.
    fn seeing_group(&mut self, name: &Name) -> Option<GroupId> {
        let agents = || self.hir.world.groups.iter().filter(|group| !group.obstacle);
        let Some(group) =
            self.hir.world.groups.iter().position(|group| !group.obstacle && group.name == name.node)
        else {
            if self.program.is_unknown(self.program.main, Space::Value, &name.node) {
                return None;
            }
            let message = format!("there is no group of agents `{}`", name.node);
            let problem = Problem::error(&super::expr::UNKNOWN_NAME, message).at(name.span, "");
            let help = match self.meant(&name.node, agents().map(|group| group.name.as_str())) {
                Some(meant) => format!("did you mean `{meant}`?"),
                None => format!("known here: {}", listed(agents().map(|group| group.name.as_str()))),
            };
            self.report(problem.help(help));
            return None;
        };
        let own = self.hir.world.groups.get(group)?;
        match &own.control {
            None => None,
            Some(Control::Learned) => Some(group),
            Some(_) => {
                let problem = Problem::error(&USELESS_LOCALISER, format!("`{}` is not steered", name.node))
                    .at(name.span, "acts on nothing that it is told")
                    .with(own.span, "follows a motion");
                self.report(problem.help("localise a group with `control = learned`"));
                None
            }
        }
    }

    /// Cameras belong into evaluations.
    pub fn no_training_by_sight(&mut self, item: &ObserveItem, via: &Name) {
        self.localiser_named(via);
        let span = item.value.span.to(item.odometry.unwrap_or(via.span));
        let problem = Problem::error(&SIGHT_IN_TRAINING, "a controller is trained on true poses");
        let text = self.sources.text(span).to_owned();
        self.report(problem.at(span, "not known while it learns").help(format!(
            "see how it does without them in an evaluation: `evaluate seen {{ observe {{ {text} }} }}`"
        )));
    }
}

impl Checker<'_> {
    /// Warnings about what nobody looks at and nobody asks.
    pub fn unseen(&mut self) {
        let mut warn = |at, message: String, label: &str, help: &str| {
            self.problems.push(Problem::warning(&super::UNUSED, message).at(at, label).help(help));
        };
        for localiser in self.hir.localisers.iter().filter(|it| !self.used.contains(&it.span)) {
            let name = &localiser.name;
            let word = if localiser.looks() { "camera" } else { "pose" };
            let help =
                format!("use it, `evaluate … {{ observe {{ {word}(…) via {name} }} }}`, or take it out");
            warn(
                localiser.span,
                format!("the localiser `{name}` is not used"),
                "tells nobody anything",
                &help,
            );
        }
        let changed = self.hir.protocols.iter().filter_map(|protocol| protocol.changed.as_deref());
        let changed = changed.chain(self.hir.variants.iter().map(|variant| &*variant.changed));
        let mut worlds = std::iter::once(&self.hir).chain(changed).map(|hir| &hir.world);
        let cameras = worlds.any(|world| world.groups.iter().any(|group| group.camera.is_some()));
        let world = &self.hir.world;
        if let (Some(room), false) = (&world.room, cameras) {
            let help = "give a group a camera: `camera = pinhole()`";
            warn(room.span, "the room has no effect".to_owned(), "nobody has a camera", help);
        }
        if let (Some(lighting), None) = (&world.lighting, &world.room) {
            let help = "`world { …, room = indoor() }`";
            warn(lighting.span, "the lighting has no effect".to_owned(), "there is no room", help);
        }
    }

    /// Warnings about robots that count their ways for nothing.
    pub fn uncounted(&mut self) {
        let joined = |hir: &Hir, group: GroupId| {
            hir.world.localised.iter().any(|localised| localised.group == group && localised.odometry)
        };
        let used = |group: GroupId| {
            self.hir.protocols.iter().filter_map(|it| it.changed.as_deref()).any(|hir| joined(hir, group))
        };
        let groups = self.hir.world.groups.iter().enumerate();
        for (_, own) in groups.filter(|(group, _)| !used(*group)) {
            let Some(odometry) = &own.odometry else { continue };
            let name = &own.name;
            let message = format!("the odometry of `{name}` is not used");
            self.problems.push(
                Problem::warning(&super::UNUSED, message).at(odometry.span, "tells nobody anything").help(
                    format!("use it, `observe {{ pose({name}) via … with odometry }}`, or take it out"),
                ),
            );
        }
    }

    /// What stands or drives outside of the room.
    pub fn outside_room(&self, case: &Case) -> Vec<Problem> {
        let mut problems = Vec::new();
        for landmark in &case.world.landmarks {
            for setting in std::iter::once(&landmark.at).chain(&landmark.heading) {
                problems.extend(self.list_length(case, landmark, setting));
            }
        }
        let Some(room) = &case.world.room else { return problems };
        let size = |name: &str| {
            let (_, value) = room.what.as_ref()?.settings.iter().find(|(known, _)| known == name)?;
            match case.setting(value)? {
                Setting::Number(metres) => Some(metres),
                _ => None,
            }
        };
        let (Some(width), Some(depth)) = (size("width"), size("depth")) else { return problems };
        let inside = |(x, y): (f64, f64)| x.abs() <= width / 2.0 && y.abs() <= depth / 2.0;
        let label = format!("the room is {width} m x {depth} m around the origin");
        for landmark in &case.world.landmarks {
            let places = case.landmarks(landmark).unwrap_or_default();
            let Some(number) = places.iter().position(|&(place, _)| !inside(place)) else { continue };
            let name = landmark.member(number);
            let (x, y) = places[number].0;
            let problem = Problem::error(&OUTSIDE_ROOM, format!("`{name}` stands outside of the room"));
            problems.push(
                problem.at(landmark.at.span, format!("at ({x} m, {y} m)")).with(room.span, label.clone()),
            );
        }
        for group in case.world.groups.iter().filter(|group| group.camera.is_some()) {
            let Some(arena) = &group.arena else { continue };
            let Some(area) = case.area(arena) else { continue };
            if inside((area.x_m.0, area.y_m.0)) && inside((area.x_m.1, area.y_m.1)) {
                continue;
            }
            let message = format!("the arena of `{}` reaches beyond the room", group.name);
            problems.push(
                Problem::error(&OUTSIDE_ROOM, message)
                    .at(arena.span, "a camera sees nothing out there")
                    .with(room.span, label.clone())
                    .help("make the arena smaller or the room larger: `room = indoor(width = …, depth = …)`"),
            );
        }
        problems
    }

    fn list_length(&self, case: &Case, landmark: &Landmark, setting: &Expr) -> Option<Problem> {
        let length = case.length(setting)?;
        let counted = super::feasible::counted;
        (length != landmark.count()).then(|| {
            let own = counted(landmark.count(), "landmark");
            Problem::error(&LIST_LENGTH, format!("{} for {own}", counted(length, "value")))
                .at(setting.span, "")
                .with(landmark.span, format!("declares {own}"))
        })
    }
}

pub const NO_ROOM: Code = Code {
    name: "no-room",
    explain: "\
Cameras look at a room, and landmarks stand in it. The room is a setting of the world.

    use std.sight.{indoor, pinhole}
    world { dt = 0.1 s, room = indoor(width = 8 m, depth = 7 m) }
    agents follower[3] : unicycle { …, camera = pinhole() }",
};

pub const NO_CAMERA: Code = Code {
    name: "no-camera",
    explain: "\
`camera(follower) via eyes` tells the poses of a group from what its cameras show, so each member has a camera:

    agents follower[3] : unicycle { …, camera = pinhole() }
    evaluate seen { observe { camera(follower) via eyes } }",
};

pub const NO_ODOMETRY: Code = Code {
    name: "no-odometry",
    explain: "\
`with odometry` joins what a localiser tells to what each robot counts of its own way, so each member counts:

    use std.sight.wheels
    agents follower[3] : unicycle { …, odometry = wheels(slip = 5%, bias = 1%) }
    evaluate seen { observe { camera(follower) via eyes with odometry } }",
};

pub const BAD_SIGHT: Code = Code {
    name: "bad-sight",
    explain: "\
An evaluation tries a policy that is learned already, so it cannot change what is observed. Its `observe` says of groups
that they do not know their poses, and which localiser tells them:

    evaluate seen { observe { camera(follower) via eyes } }         // from images
    evaluate blurred { observe { pose(follower) via blur } }        // the true pose with noise
    evaluate other { observe { p[leader] } }                        // wrong: write a `variant`",
};

pub const WRONG_LOCALISER: Code = Code {
    name: "wrong-localiser",
    explain: "\
A network looks at images, so it is given what cameras show; noise is added to true poses.

    localiser eyes = resnet
    localiser blur = noisy(position = 4 cm)
    observe { camera(follower) via eyes }       // right
    observe { pose(follower) via blur }         // right
    observe { pose(follower) via eyes }         // wrong",
};

pub const USELESS_LOCALISER: Code = Code {
    name: "useless-localiser",
    explain: "\
A localiser tells a robot where it is, and the robot's controller acts on it. A group that follows a motion acts on
nothing that it is told, so it has no localiser. What is asked about it, such as `p[leader]`, stays true.",
};

pub const SIGHT_IN_TRAINING: Code = Code {
    name: "sight-in-training",
    explain: "\
A controller is trained on true poses, and the network that tells poses from images is trained by itself. An evaluation
brings the two together; neither is trained again.

    observe { camera(follower) via eyes }                       // wrong
    evaluate seen { observe { camera(follower) via eyes } }     // right",
};

pub const OUTSIDE_ROOM: Code = Code {
    name: "outside-room",
    explain: "\
The room lies around the origin: a room with `width = 8 m, depth = 7 m` reaches from -4 m to 4 m along x and from
-3.5 m to 3.5 m along y. Landmarks stand inside of it, and the arena of a group with cameras lies inside of it.",
};
