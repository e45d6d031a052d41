//! A scenario with something changed: the same program with some settings replaced, to be checked again as a whole.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::ast::{
    AgentsDecl, Assignment, Call, EndItem, Expr, ExprAt, FormationDecl, Item, Name, RewardTerm, Span, Spanned,
};
use crate::check::Override;
use crate::check::call::MISPLACED_DRAW;
use crate::check::expr::WRONG_KIND;
use crate::check::settings::{GIVEN_TWICE, UNKNOWN_SETTING, path_span};
use crate::problem::{Code, Problem, did_you_mean};
use crate::resolve::{Program, Space, listed};

/// What changes the scenario; it decides what can be changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// The world only; what is learned goes on in it.
    Evaluation,
    Stage,
    /// A study of its own.
    Variant,
}

impl Kind {
    /// With its article.
    pub fn people(self) -> &'static str {
        match self {
            Kind::Evaluation => "an evaluation",
            Kind::Stage => "a stage",
            Kind::Variant => "a variant",
        }
    }
}

pub struct Changed {
    pub program: Program,
    /// New values of parameters.
    pub params: Vec<Override>,
    /// Settings that change nothing.
    pub problems: Vec<Problem>,
}

/// Replaces what is observed and applies the settings in their order. `episodes` of an evaluation is none of the scenario and passed over.
pub fn apply(program: &Program, observe: &[Spanned<Item>], settings: &[Assignment], kind: Kind) -> Changed {
    let items = program.main().map(|main| main.items.clone()).unwrap_or_default();
    let mut change = Change { program, kind, items, params: Vec::new() };
    let mut problems = Vec::new();
    if let [first, others @ ..] = observe {
        change.observe(first.clone());
        problems.extend(others.iter().map(|other| {
            let problem = Problem::error(&GIVEN_TWICE, "`observe` is set twice");
            problem.at(other.span, "again here").with(first.span, "first set here")
        }));
    }
    let mut seen: BTreeMap<Vec<&str>, Span> = BTreeMap::new();
    for setting in settings {
        let path: Vec<&str> = setting.path.iter().map(|name| name.node.as_str()).collect();
        let span = path_span(&setting.path);
        if let Some(first) = seen.get(&path) {
            let problem = Problem::error(&GIVEN_TWICE, format!("`{}` is set twice", path.join(".")));
            problems.push(problem.at(span, "again here").with(*first, "first set here"));
        } else if path != ["episodes"] || kind != Kind::Evaluation {
            problems.extend(change.set(setting, &path).err().map(|problem| *problem));
        }
        seen.entry(path).or_insert(span);
    }
    let Change { items, params, .. } = change;
    Changed { program: program.with_main(items), params, problems }
}

struct Change<'a> {
    program: &'a Program,
    kind: Kind,
    items: Vec<Arc<Spanned<Item>>>,
    params: Vec<Override>,
}

type Refused = Result<(), Box<Problem>>;

impl Change<'_> {
    fn set(&mut self, setting: &Assignment, path: &[&str]) -> Refused {
        match (path, setting.path.as_slice()) {
            ([name], [at]) => self.whole(setting, name, at),
            ([of, name], [_, at]) => self.part(setting, of, name, at),
            _ => self.unknown(setting, path),
        }
    }

    fn observe(&mut self, observe: Spanned<Item>) {
        let observe = Arc::new(observe);
        match self.items.iter_mut().find(|item| matches!(item.node, Item::Observe { .. })) {
            Some(known) => *known = observe,
            None => self.items.push(observe),
        }
    }

    /// `side = …`, `F = …`, `seeds = …`
    fn whole(&mut self, setting: &Assignment, name: &str, at: &Name) -> Refused {
        if self.find(|item| matches!(item, Item::Param(param) if param.name.node == name)).is_some() {
            self.param(setting, at);
            return Ok(());
        }
        if let Some(Item::Formation(decl)) =
            self.find(|item| matches!(item, Item::Formation(decl) if decl.name.node == name))
        {
            let FormationDecl { shape, edges, .. } = decl;
            (*shape, *edges) = (Some(called(setting, "formation shape", "`F = line(0.4 m)`")?), Vec::new());
            return Ok(());
        }
        if name == "seeds" {
            self.only_variants(setting, "how often something is learned")?;
            let value = fixed(setting)?;
            match self.find(|item| matches!(item, Item::Seeds(_))) {
                Some(Item::Seeds(seeds)) => *seeds = value,
                _ => self.append(Item::Seeds(value), setting),
            }
            return Ok(());
        }
        self.unknown(setting, &[name])
    }

    /// A value ends the randomisation of a parameter; a draw replaces or begins it.
    fn param(&mut self, setting: &Assignment, name: &Name) {
        let same = |other: &Assignment| other.path.len() == 1 && other.path[0].node == name.node;
        if !setting.random {
            self.params.push(Override { name: name.clone(), value: setting.value.clone() });
            while let Some(Item::Randomise(settings)) =
                self.find(|item| matches!(item, Item::Randomise(settings) if settings.iter().any(same)))
            {
                settings.retain(|other| !same(other));
            }
            return;
        }
        match self.find(|item| matches!(item, Item::Randomise(_))) {
            Some(Item::Randomise(settings)) => put(settings, setting, name),
            _ => self.append(Item::Randomise(vec![setting.clone()]), setting),
        }
    }

    /// `leader.motion = …`, `world.dt = …`, `reward.gap = …`
    fn part(&mut self, setting: &Assignment, of: &str, name: &str, at: &Name) -> Refused {
        let path = [of, name];
        match of {
            "world" => match self.find(|item| matches!(item, Item::World(_))) {
                Some(Item::World(settings)) => put(settings, setting, at),
                _ => self.append(
                    Item::World(vec![Assignment { path: vec![at.clone()], ..setting.clone() }]),
                    setting,
                ),
            },
            "observe" => {
                if let Some(Item::Observe { items, .. }) =
                    self.find(|item| matches!(item, Item::Observe { .. }))
                {
                    items.iter_mut().for_each(|item| put(&mut item.settings, setting, at));
                }
            }
            "learn" => {
                self.only_variants(setting, "how something is learned")?;
                if let Some(Item::Learn { algorithm, preset, settings }) =
                    self.find(|item| matches!(item, Item::Learn { .. }))
                {
                    match name {
                        "algorithm" => *algorithm = named(setting, "an algorithm")?,
                        "preset" => *preset = Some(named(setting, "a preset")?),
                        _ => put(settings, setting, at),
                    }
                }
            }
            "reward" => {
                let value = fixed(setting)?;
                let new = self.kind == Kind::Variant;
                match self.find(|item| matches!(item, Item::Reward { .. })) {
                    Some(Item::Reward { terms, .. }) => {
                        match terms.iter_mut().find(|term| term.name.node == name) {
                            Some(term) => term.value = value,
                            None if new => {
                                terms.push(RewardTerm { doc: String::new(), name: at.clone(), value });
                            }
                            None => return self.unknown(setting, &path),
                        }
                    }
                    _ => return self.unknown(setting, &path),
                }
            }
            "end" => {
                let when = fixed(setting)?;
                let new = self.kind == Kind::Variant;
                let end = EndItem { limit: false, name: at.clone(), when, cost: None };
                match self.find(|item| matches!(item, Item::End(_))) {
                    Some(Item::End(ends)) => match ends.iter_mut().find(|end| end.name.node == name) {
                        Some(known) => known.when = end.when,
                        None if new => ends.push(end),
                        None => return self.unknown(setting, &path),
                    },
                    _ if new => self.append(Item::End(vec![end]), setting),
                    _ => return self.unknown(setting, &path),
                }
            }
            _ => return self.group(setting, of, name, at),
        }
        Ok(())
    }

    fn group(&mut self, setting: &Assignment, of: &str, name: &str, at: &Name) -> Refused {
        let kind = self.kind;
        let found = self.find(|item| {
            matches!(item, Item::Agents(decl) | Item::Obstacles(decl) | Item::Landmarks(decl)
                if decl.name.node == of)
        });
        let Some(Item::Agents(decl) | Item::Obstacles(decl) | Item::Landmarks(decl)) = found else {
            return self.unknown(setting, &[of, name]);
        };
        match name {
            "size" => decl.size = Some(fixed(setting)?),
            "body" => decl.body = called(setting, "body", "`robot.body = unicycle(hand = 0.2 m)`")?,
            "motion" | "control" => {
                let other = if name == "motion" { "control" } else { "motion" };
                if name == "motion" && learns(decl) && kind != Kind::Variant {
                    let message = format!("`{of}` learns; {} cannot give it a motion", kind.people());
                    let problem = Problem::error(&NOT_CHANGEABLE, message).at(path_span(&setting.path), "");
                    return Err(Box::new(problem.help("change the motion of a group that has one")));
                }
                decl.settings.retain(|setting| setting.path.last().is_none_or(|name| name.node != other));
                put(&mut decl.settings, setting, at);
            }
            _ => put(&mut decl.settings, setting, at),
        }
        Ok(())
    }

    /// The first item of a kind.
    fn find(&mut self, which: impl Fn(&Item) -> bool) -> Option<&mut Item> {
        let found = self.items.iter_mut().find(|item| which(&item.node));
        found.map(|item| &mut Arc::make_mut(item).node)
    }

    fn append(&mut self, node: Item, setting: &Assignment) {
        let span = path_span(&setting.path).to(setting.value.span);
        self.items.push(Arc::new(Spanned { node, span }));
    }

    fn only_variants(&self, setting: &Assignment, what: &str) -> Refused {
        if self.kind == Kind::Variant {
            return Ok(());
        }
        let message = format!("{} does not change {what}", self.kind.people());
        let problem = Problem::error(&NOT_CHANGEABLE, message).at(path_span(&setting.path), "");
        let (path, value) = (dotted(&setting.path), "…");
        Err(Box::new(problem.help(format!("a variant does: `variant other {{ {path} = {value} }}`"))))
    }

    /// There is nothing of this name, unless it stands in an item with a syntax error.
    fn unknown(&self, setting: &Assignment, path: &[&str]) -> Refused {
        let Some(first) = path.first() else { return Ok(()) };
        let unknown = |name: &str| self.program.is_unknown(self.program.main, Space::Value, name);
        if path.iter().any(|name| unknown(name)) {
            return Ok(());
        }
        let text = path.join(".");
        let problem = Problem::error(&UNKNOWN_SETTING, format!("there is no `{text}` to change"))
            .at(path_span(&setting.path), "");
        let known = self.known();
        let parts: Vec<&str> =
            known.iter().filter(|known| known.split('.').next() == Some(first)).map(String::as_str).collect();
        let heads = || known.iter().filter_map(|known| known.split_once('.')).map(|(head, _)| head);
        let meant = match path {
            [first, rest @ ..] if !rest.is_empty() && parts.is_empty() => {
                did_you_mean(first, heads()).map(|head| {
                    std::iter::once(head.as_str()).chain(rest.iter().copied()).collect::<Vec<_>>().join(".")
                })
            }
            _ => did_you_mean(&text, known.iter().map(String::as_str)),
        };
        Err(Box::new(problem.help(match (meant, path, parts.as_slice()) {
            (_, ["episodes"], _) => {
                "`episodes` belongs to an evaluation; those of training are `learn.episodes`".to_owned()
            }
            (Some(meant), ..) => format!("did you mean `{meant}`?"),
            (None, [_, ..], [_, ..]) if path != parts => format!("of `{first}` there is {}", listed(parts)),
            _ => {
                let mut heads: Vec<String> = heads().map(|head| format!("{head}.…")).collect();
                heads.dedup();
                let alone = known.iter().filter(|known| !known.contains('.')).map(String::as_str);
                let all = listed(alone.chain(heads.iter().map(String::as_str)));
                format!("{} changes {all}", self.kind.people())
            }
        })))
    }

    /// Paths that can be changed, not all of them: the settings that a group does not make are left out.
    fn known(&self) -> Vec<String> {
        let mut known: Vec<String> = Vec::new();
        let mut add = |of: &str, names: &mut dyn Iterator<Item = &str>| {
            known.extend(names.map(|name| format!("{of}.{name}")));
        };
        let names = |settings: &[Assignment]| -> Vec<String> {
            settings.iter().filter_map(|setting| Some(setting.path.last()?.node.clone())).collect()
        };
        for item in &self.items {
            match &item.node {
                Item::World(settings) => {
                    add("world", &mut names(settings).iter().map(String::as_str));
                }
                Item::Agents(decl) | Item::Obstacles(decl) | Item::Landmarks(decl) => {
                    let own = names(&decl.settings);
                    add(&decl.name.node, &mut own.iter().map(String::as_str).chain(["size", "body"]));
                }
                Item::Reward { terms, .. } => {
                    add("reward", &mut terms.iter().map(|term| term.name.node.as_str()))
                }
                Item::End(ends) => add("end", &mut ends.iter().map(|end| end.name.node.as_str())),
                Item::Observe { .. } => add("observe", &mut ["noise", "delay"].into_iter()),
                Item::Learn { settings, .. } if self.kind == Kind::Variant => {
                    let own = names(settings);
                    add("learn", &mut own.iter().map(String::as_str).chain(["algorithm", "preset"]));
                }
                _ => {}
            }
        }
        for item in &self.items {
            match &item.node {
                Item::Param(param) => known.push(param.name.node.clone()),
                Item::Formation(decl) => known.push(decl.name.node.clone()),
                _ => {}
            }
        }
        match self.kind {
            Kind::Evaluation => known.push("episodes".to_owned()),
            Kind::Variant => known.push("seeds".to_owned()),
            Kind::Stage => {}
        }
        known
    }
}

/// `a.b`
pub fn dotted(path: &[Name]) -> String {
    path.iter().map(|name| name.node.as_str()).collect::<Vec<_>>().join(".")
}

/// Replaces the setting of a name, or adds it.
fn put(settings: &mut Vec<Assignment>, setting: &Assignment, name: &Name) {
    let changed = Assignment { path: vec![name.clone()], ..setting.clone() };
    let same = |other: &&mut Assignment| other.path.len() == 1 && other.path[0].node == name.node;
    match settings.iter_mut().find(same) {
        Some(known) => *known = changed,
        None => settings.push(changed),
    }
}

fn learns(decl: &AgentsDecl) -> bool {
    decl.settings.iter().any(|setting| setting.path.last().is_some_and(|name| name.node == "control"))
}

/// The value of a setting that is no draw.
fn fixed(setting: &Assignment) -> Result<ExprAt, Box<Problem>> {
    if !setting.random {
        return Ok(setting.value.clone());
    }
    let path = dotted(&setting.path);
    let problem = Problem::error(&MISPLACED_DRAW, format!("`{path}` is not drawn"))
        .at(path_span(&setting.path), "the same in all episodes");
    Err(Box::new(problem.help(format!("give it a fixed value: `{path} = …`"))))
}

/// `name` or `name(arguments)`.
fn called(setting: &Assignment, what: &str, example: &str) -> Result<Call, Box<Problem>> {
    let ExprAt { node, span } = fixed(setting)?;
    match node {
        Expr::Call(call) => Ok(call),
        Expr::Name(name) => Ok(Call { name: Name { node: name, span }, args: Vec::new() }),
        _ => {
            let problem = Problem::error(&WRONG_KIND, format!("this is no {what}")).at(span, "");
            Err(Box::new(problem.help(format!("write its name and arguments, for example {example}"))))
        }
    }
}

fn named(setting: &Assignment, what: &str) -> Result<Name, Box<Problem>> {
    let ExprAt { node, span } = fixed(setting)?;
    match node {
        Expr::Name(node) => Ok(Name { node, span }),
        _ => {
            let problem = Problem::error(&WRONG_KIND, format!("this is not {what}")).at(span, "");
            Err(Box::new(problem.help("write its name")))
        }
    }
}

pub const NOT_CHANGEABLE: Code = Code {
    name: "not-changeable",
    explain: "\
An evaluation or a stage changes the world that a policy acts in, not the policy: it is learned once, by the settings
of `learn`, for the groups with `control = learned`. A variant is a study of its own and changes anything.

    evaluate far { learn.gamma = 0.99 }     // wrong
    evaluate far { side = 1 m }             // right
    variant far_sighted { learn.gamma = 0.99 }      // right",
};
