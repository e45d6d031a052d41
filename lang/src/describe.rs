//! What the checker found out, for people and golden files.

use crate::check::units::Units;
use crate::hir::{Chosen, Control, Expr, Extern, Hir, Kind, Localised, Set, TestStep, Type};
use crate::plan::ClaimKind;

/// Every parameter, setting, observation, term and end with its type.
pub fn describe(hir: &Hir, units: &Units) -> String {
    let mut text = Text { units, hir, lines: vec![format!("scenario {}", hir.name)] };
    for param in &hir.params {
        let value = param.value.map_or("?".to_owned(), |value| value.to_string());
        text.line(
            0,
            format!("param {} : {} = {value} {}", param.name, units.name(&param.dim), units.si(&param.dim)),
        );
    }
    let world = &hir.world;
    for (name, value) in [("dt", &world.dt), ("horizon", &world.horizon), ("safety", &world.safety)] {
        text.typed(0, &format!("world.{name}"), value.as_ref());
    }
    text.chosen(0, "world.room", &world.room);
    text.chosen(0, "world.lighting", &world.lighting);
    for landmark in &world.landmarks {
        let size = landmark.size.map_or(String::new(), |size| format!("[{size}]"));
        text.line(0, format!("landmark {}{size}", landmark.name));
        if let Some(what) = &landmark.what {
            text.provided(1, "what", what);
        }
        text.typed(1, "at", Some(&landmark.at));
        text.typed(1, "heading", landmark.heading.as_ref());
    }
    for group in &world.groups {
        text.line(0, format!("group {}[{}]", group.name, group.size));
        if let Some(body) = &group.body {
            text.provided(1, "body", body);
        }
        text.typed(1, "arena", group.arena.as_ref());
        text.typed(1, "speed", group.speed.as_ref());
        text.chosen(1, "camera", &group.camera);
        text.chosen(1, "odometry", &group.odometry);
        match &group.control {
            Some(Control::Still) => text.line(1, "still".to_owned()),
            Some(Control::Learned) => text.line(1, "control learned".to_owned()),
            Some(Control::Motion(motion)) => {
                text.line(1, format!("motion {}", motion.what.name));
                for state in &motion.what.states {
                    text.typed(2, &format!("state {}", state.name), Some(&state.start));
                }
            }
            None => {}
        }
        if let Some(filter) = &group.filter {
            text.provided(1, "filter", filter);
        }
        text.typed(1, "start", group.start.as_ref());
    }
    for formation in &world.formations {
        let name = |group: usize| world.groups.get(group).map_or("?", |group| group.name.as_str());
        let shape = formation.shape.as_ref().map_or("?", |shape| shape.what.name.as_str());
        let about = formation.about.map_or(String::new(), |about| format!(" about {}", name(about)));
        text.line(0, format!("formation {} of {} = {shape}{about}", formation.name, name(formation.group)));
    }
    for drawn in &world.randomise {
        let name = hir.params.get(drawn.param).map_or("?", |param| param.name.as_str());
        text.typed(0, &format!("randomise {name}"), Some(&drawn.value));
    }
    for condition in &world.require {
        text.typed(0, "require", Some(condition));
    }
    for observation in &world.observe {
        let over = observation
            .over
            .as_ref()
            .map_or(String::new(), |over| format!(" for each of {}", text.set(&over.set)));
        let type_ = text.type_(&observation.value.type_);
        text.line(0, format!("observe {type_}{over}"));
    }
    for term in &world.reward {
        text.typed(0, &format!("reward {}", term.name), Some(&term.value));
    }
    for end in &world.ends {
        text.typed(0, &format!("end {} when", end.name), Some(&end.when));
        text.typed(1, "costs", end.cost.as_ref());
    }
    for learner in &hir.learners {
        text.provided(0, "learner", &learner.what);
    }
    for controller in &hir.controllers {
        text.provided(0, "controller", &controller.what);
    }
    for localiser in &hir.localisers {
        text.line(0, format!("localiser {}", localiser.name));
        if let Some(what) = &localiser.what {
            text.provided(1, "what", what);
        }
    }
    for protocol in &hir.protocols {
        let changes = if protocol.changed.is_some() { " with changes" } else { "" };
        text.line(0, format!("evaluate {}{changes}", protocol.name));
        for Localised { group, via, odometry, .. } in
            protocol.changed.iter().flat_map(|hir| &hir.world.localised)
        {
            let group = world.groups.get(*group).map_or("?", |group| group.name.as_str());
            let via = hir.localisers.get(*via).map_or("?", |localiser| localiser.name.as_str());
            let joined = if *odometry { " with odometry" } else { "" };
            text.line(1, format!("poses of {group} via {via}{joined}"));
        }
    }
    for stage in &hir.stages {
        text.line(0, format!("stage {} until {:?} within {:?}", stage.name, stage.until, stage.most_steps));
    }
    for variant in &hir.variants {
        text.line(0, format!("variant {}: {}", variant.name, variant.text));
    }
    for test in &hir.tests {
        text.line(0, format!("test \"{}\"", test.name));
        for step in &test.steps {
            text.test_step(&step.node);
        }
    }
    for claim in &hir.claims {
        text.line(0, format!("expect {}", self::claim(&claim.kind)));
    }
    text.lines.push(String::new());
    text.lines.join("\n")
}

/// A claim with all that it leaves unsaid.
fn claim(kind: &ClaimKind) -> String {
    match kind {
        ClaimKind::Bound { protocol, metric, method, below, bound, confidence } => {
            let side = if *below { "<" } else { ">" };
            format!("{metric} of {method} in {protocol} {side} {bound} at {confidence}")
        }
        ClaimKind::Beats { better, worse, protocol, metric, confidence } => {
            format!("{better} beats {worse} by {metric} in {protocol} at {confidence}")
        }
    }
}

struct Text<'a> {
    units: &'a Units,
    hir: &'a Hir,
    lines: Vec<String>,
}

impl Text<'_> {
    fn line(&mut self, depth: usize, line: String) {
        self.lines.push("    ".repeat(depth) + line.trim_end());
    }

    fn typed(&mut self, depth: usize, name: &str, value: Option<&Expr>) {
        if let Some(value) = value {
            let type_ = self.type_(&value.type_);
            self.line(depth, format!("{name} : {type_}"));
        }
    }

    fn test_step(&mut self, step: &TestStep) {
        match step {
            TestStep::Place { position, .. } => self.typed(1, "place", Some(position)),
            TestStep::Turn { heading, .. } => self.typed(1, "turn", Some(heading)),
            TestStep::Steer { velocity, .. } => self.typed(1, "steer", Some(velocity)),
            TestStep::Step(steps) => self.line(1, format!("step {steps}")),
            TestStep::Check { text, actual, .. } => {
                let actual = actual.as_ref().map(|actual| format!(" of {}", self.type_(&actual.type_)));
                self.line(1, format!("check{} {text}", actual.unwrap_or_default()));
            }
        }
    }

    fn chosen(&mut self, depth: usize, kind: &str, chosen: &Option<Chosen>) {
        if let Some(what) = chosen.as_ref().and_then(|chosen| chosen.what.as_ref()) {
            self.provided(depth, kind, what);
        }
    }

    fn provided(&mut self, depth: usize, kind: &str, what: &Extern) {
        self.line(depth, format!("{kind} {}", what.name));
        for (name, value) in &what.settings {
            self.typed(depth + 1, name, Some(value));
        }
    }

    fn type_(&self, type_: &Type) -> String {
        match type_ {
            Type::Number(dim) => self.units.name(dim),
            Type::Vector(dim) => format!("vec({})", self.units.name(dim)),
            Type::Range(dim) => format!("range({})", self.units.name(dim)),
            Type::Truth => "bool".to_owned(),
            Type::Count => "count".to_owned(),
            Type::Agent(_) => "agent".to_owned(),
            Type::Area => "area".to_owned(),
            Type::List(of) if matches!(**of, Type::Vector(_)) => "points".to_owned(),
            Type::List(_) => "list".to_owned(),
            Type::Formation => "formation".to_owned(),
            Type::Group => "group".to_owned(),
            Type::Track => "track".to_owned(),
            Type::Schedule => "schedule".to_owned(),
            Type::Word(words) => format!("one of ({})", words.join(", ")),
            Type::Poison => "?".to_owned(),
        }
    }

    fn set(&self, set: &Set) -> String {
        let formation = |of: &Expr| match of.kind {
            Kind::Formation(id) => self.hir.world.formations.get(id).map_or("?", |formation| &formation.name),
            _ => "?",
        };
        match set {
            Set::All => "all".to_owned(),
            Set::Obstacles => "obstacles".to_owned(),
            Set::Group(group) => {
                self.hir.world.groups.get(*group).map_or("?", |group| &group.name).to_owned()
            }
            Set::Argument(_) => "group".to_owned(),
            Set::Members(of) => format!("members({})", formation(of)),
            Set::Pairs(of) => format!("pairs({})", self.set(of)),
            Set::Edges(of) => format!("edges({})", formation(of)),
            Set::Nearest { among, .. } => format!("the nearest of {}", self.set(among)),
        }
    }
}
