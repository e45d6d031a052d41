//! Loads the modules a scenario uses and finds out which names are seen where: `Ast → Program`.

mod space;

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::ast::{File, Item, Name, Span, Spanned};
use crate::parse::parse;
use crate::problem::{Code, Problem, Problems, did_you_mean};
use crate::recording::{BAD_RECORDING, Points};
use crate::source::{Loader, Sources};
use crate::stdlib::{self, Declaration};
pub use space::{BUILT_IN, Space, declared};

/// Modules nested deeper than this are refused.
const DEEPEST: usize = 32;

/// The scenario and all modules it uses.
#[derive(Debug, Default)]
pub struct Program {
    /// The standard modules seen without `use`, then the others; each after those it uses.
    pub modules: Vec<Arc<Module>>,
    /// The scenario itself.
    pub main: usize,
    /// How many of the modules are seen without `use`.
    prelude: usize,
    /// The recordings that could be read: seconds and metres.
    pub recordings: BTreeMap<ItemId, Arc<Points>>,
}

#[derive(Debug)]
pub struct Module {
    /// As `use` names it.
    pub path: String,
    /// The `//!` comment, without the marks.
    pub doc: String,
    /// What was written; of the standard library nothing. Shared with the changed scenarios of cases.
    pub items: Vec<Arc<Spanned<Item>>>,
    /// Whether items with syntax errors were left out.
    pub broken: bool,
    /// What a module of the standard library declares; of others nothing.
    library: &'static [Declaration],
    names: Arc<Names>,
}

impl Module {
    pub fn is_standard(&self) -> bool {
        !self.library.is_empty()
    }
}

/// What the names of a module stand for; more than one thing only if that was reported.
type Names = BTreeMap<Space, BTreeMap<String, Vec<Entry>>>;

/// What a name stands for, and where it was declared or used.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    pub id: ItemId,
    pub at: Span,
    /// By `use`.
    pub imported: bool,
}

impl Entry {
    /// Whether it stands for what could not be imported.
    fn is_unknown(&self) -> bool {
        self.id.module == usize::MAX
    }
}

/// An item of a module.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ItemId {
    pub module: usize,
    pub item: usize,
}

impl Program {
    /// What a name stands for in a module.
    pub fn find(&self, module: usize, space: Space, name: &str) -> Option<Entry> {
        let seen = std::iter::once(module).chain(0..self.prelude);
        let mut found =
            seen.filter_map(|m| self.modules.get(m)?.names.get(&space)?.get(name)).flatten().copied();
        let first = found.next()?;
        Some(if first.is_unknown() {
            found.find(|entry| !entry.is_unknown()).unwrap_or(first)
        } else {
            first
        })
    }

    /// All names of a space that a module sees.
    pub fn names(&self, module: usize, space: Space) -> impl Iterator<Item = &str> {
        let seen = std::iter::once(module).chain(0..self.prelude);
        let modules = seen.filter_map(|m| self.modules.get(m));
        modules.flat_map(move |m| m.names.get(&space)).flat_map(|names| names.keys().map(String::as_str))
    }

    /// Whether a name stands for something that could not be read or imported, which was reported.
    pub fn is_unknown(&self, module: usize, space: Space, name: &str) -> bool {
        self.find(module, space, name).is_some_and(|entry| entry.is_unknown())
    }

    pub fn item(&self, id: ItemId) -> Option<&Spanned<Item>> {
        let module = self.modules.get(id.module)?;
        match module.library.get(id.item) {
            Some(declaration) => declaration.item(),
            None => module.items.get(id.item).map(|item| &**item),
        }
    }

    pub fn main(&self) -> Option<&Module> {
        self.modules.get(self.main).map(|main| &**main)
    }

    /// The same program with other items of the scenario, which have the same numbers and names; those that are more
    /// are not seen by name.
    pub fn with_main(&self, items: Vec<Arc<Spanned<Item>>>) -> Program {
        let mut modules = self.modules.clone();
        if let Some(main) = modules.get_mut(self.main) {
            let Module { path, doc, broken, names, .. } = &**main;
            let (path, doc, broken, names) = (path.clone(), doc.clone(), *broken, names.clone());
            *main = Arc::new(Module { path, doc, items, broken, library: &[], names });
        }
        Program { modules, main: self.main, prelude: self.prelude, recordings: self.recordings.clone() }
    }

    /// The items of the scenario and the files it uses, those of a file together.
    pub fn written(&self) -> impl Iterator<Item = (ItemId, &Spanned<Item>)> {
        self.modules.iter().enumerate().flat_map(|(module, m)| {
            m.items.iter().enumerate().map(move |(item, it)| (ItemId { module, item }, &**it))
        })
    }

    /// What the standard modules declare, those that are seen without `use` first.
    pub fn library(&self) -> impl Iterator<Item = (ItemId, &Declaration)> {
        self.modules.iter().enumerate().flat_map(|(module, m)| {
            m.library.iter().enumerate().map(move |(item, it)| (ItemId { module, item }, it))
        })
    }

    /// Where the scenario imported a name of an existing item, and in which spaces; units work without a mention.
    pub fn imports(&self) -> BTreeMap<Span, &str> {
        let mut found = BTreeMap::new();
        let spaces = self.main().into_iter().flat_map(|main| &*main.names);
        let spaces = spaces.filter(|(space, _)| !matches!(space, Space::Unit | Space::Dimension));
        for (name, entries) in spaces.flat_map(|(_, names)| names) {
            for entry in entries.iter().filter(|entry| entry.imported && self.item(entry.id).is_some()) {
                found.insert(entry.at, name.as_str());
            }
        }
        found
    }
}

/// Loads and resolves everything that the scenario uses.
pub fn resolve(main: File, loader: &dyn Loader, sources: &mut Sources, problems: &mut Problems) -> Program {
    let mut resolver =
        Resolver { loader, sources, problems, program: Program::default(), loading: Vec::new() };
    for number in stdlib::PRELUDE.iter().filter_map(|path| stdlib::numbered(path)) {
        resolver.load_standard(number);
    }
    resolver.program.prelude = resolver.program.modules.len();
    resolver.program.main = resolver.add("", main);
    resolver.program
}

/// The entries of a name.
fn entries<'n>(names: &'n mut Names, space: Space, name: &str) -> &'n mut Vec<Entry> {
    names.entry(space).or_default().entry(name.to_owned()).or_default()
}

/// Lets a name stand for something unknown, so that nobody is told again.
fn unknown(name: &str, at: Span, names: &mut Names) {
    let id = ItemId { module: usize::MAX, item: 0 };
    for space in Space::ALL {
        entries(names, space, name).push(Entry { id, at, imported: true });
    }
}

struct Resolver<'a> {
    loader: &'a dyn Loader,
    sources: &'a mut Sources,
    problems: &'a mut Problems,
    program: Program,
    /// Modules whose `use`s are being followed.
    loading: Vec<String>,
}

impl Resolver<'_> {
    fn load(&mut self, path: &str, text: String) -> usize {
        let file = self.sources.add(&file_name(path), text);
        let file = parse(self.sources, file, self.problems);
        self.add(path, file)
    }

    /// Adds a module of the standard library, which uses no others.
    fn load_standard(&mut self, number: usize) -> usize {
        let stdlib::Module { source, declarations: library } = stdlib::module(number);
        let module = self.program.modules.len();
        let mut names: Names = BTreeMap::new();
        for (item, Declaration { space, name, .. }) in library.iter().enumerate() {
            let entry = Entry { id: ItemId { module, item }, at: name.span, imported: false };
            entries(&mut names, *space, &name.node).push(entry);
        }
        self.program.modules.push(Arc::new(Module {
            path: source.name.clone(),
            doc: String::new(),
            items: Vec::new(),
            broken: false,
            library,
            names: Arc::new(names),
        }));
        module
    }

    /// Adds a module after the modules it uses.
    fn add(&mut self, path: &str, file: File) -> usize {
        self.loading.push(path.to_owned());
        let mut names: Names = BTreeMap::new();
        for item in &file.items {
            if let Item::Use { path, names: wanted } = &item.node {
                let Some(module) = self.module(path, item.span) else {
                    wanted.iter().for_each(|name| unknown(&name.node, name.span, &mut names));
                    continue;
                };
                for name in wanted {
                    self.import(module, name, &mut names);
                }
            }
        }
        for broken in &file.broken {
            // Its names are not known for sure, but nobody shall be told that they are unknown.
            let text = self.sources.text(*broken);
            let words =
                text.split(|c: char| !c.is_alphanumeric() && c != '_').filter(|word| !word.is_empty());
            let all = if text.starts_with("use") { usize::MAX } else { 3 };
            words.take(all).for_each(|word| unknown(word, *broken, &mut names));
        }
        let index = self.program.modules.len();
        for (number, item) in file.items.iter().enumerate() {
            self.placed_well(path.is_empty(), item);
            if let Item::Recording { file, .. } = &item.node
                && path.is_empty()
                && let Some(points) = self.recording(file)
            {
                let id = ItemId { module: index, item: number };
                self.program.recordings.insert(id, Arc::new(points));
            }
            if let Some((space, name)) = declared(&item.node) {
                let id = ItemId { module: index, item: number };
                self.declare(space, name, Entry { id, at: name.span, imported: false }, &mut names);
            }
        }
        self.loading.pop();
        self.program.modules.push(Arc::new(Module {
            path: path.to_owned(),
            doc: file.doc,
            items: file.items.into_iter().map(Arc::new).collect(),
            broken: !file.broken.is_empty(),
            library: &[],
            names: Arc::new(names),
        }));
        index
    }

    fn module(&mut self, path: &[Name], at: Span) -> Option<usize> {
        let wanted = path.iter().map(|name| name.node.as_str()).collect::<Vec<_>>().join(".");
        if let Some(known) = self.program.modules.iter().position(|module| module.path == wanted) {
            return Some(known);
        }
        let at = match (path.first(), path.last()) {
            (Some(first), Some(last)) => first.span.to(last.span),
            _ => at,
        };
        if let Some(start) = self.loading.iter().position(|loading| *loading == wanted) {
            let chain = self.loading[start..].iter().chain([&wanted]).map(|m| format!("`{m}`"));
            let chain = chain.collect::<Vec<_>>().join(" uses ");
            self.problems.push(
                Problem::error(&MODULE_CYCLE, format!("`{wanted}` uses itself"))
                    .at(at, "this closes the circle")
                    .note(chain)
                    .help("move what both need into a third file that uses neither"),
            );
            return None;
        }
        if self.loading.len() > DEEPEST {
            self.problems.push(
                Problem::error(&UNKNOWN_MODULE, "modules use each other too deeply")
                    .at(at, format!("more than {DEEPEST} files deep")),
            );
            return None;
        }
        if let Some(number) = stdlib::numbered(&wanted) {
            return Some(self.load_standard(number));
        }
        let mut problem = Problem::error(&UNKNOWN_MODULE, format!("there is no module `{wanted}`"));
        if path.first().is_some_and(|first| first.node == "std") {
            let all = stdlib::MODULES.iter().map(|(path, _)| *path);
            problem = problem.at(at, "not in the standard library").help(match did_you_mean(&wanted, all) {
                Some(meant) => format!("did you mean `{meant}`?"),
                None => format!("the standard library has {}", listed(stdlib::MODULES.iter().map(|m| m.0))),
            });
        } else {
            match self.loader.load(&file_name(&wanted)) {
                Ok(text) => return Some(self.load(&wanted, text)),
                Err(why) => {
                    problem = problem.at(at, why).help(format!(
                        "`use {wanted}.…` reads `{}` beside the scenario; the standard library begins with `std.`",
                        file_name(&wanted)
                    ));
                }
            }
        }
        self.problems.push(problem);
        None
    }

    fn import(&mut self, module: usize, name: &Name, names: &mut Names) {
        let Some(from) = self.program.modules.get(module) else { return };
        let known =
            from.names.iter().flat_map(|(space, names)| names.iter().map(move |known| (*space, known)));
        let own = known.filter_map(|(space, (known, entries))| {
            Some((known, space, *entries.iter().find(|entry| entry.id.module == module)?))
        });
        let found: Vec<_> = own.clone().filter(|(known, ..)| **known == name.node).collect();
        if found.is_empty() {
            let mut own: Vec<&str> = own.map(|(known, ..)| known.as_str()).collect();
            own.sort_unstable();
            own.dedup();
            let meant = did_you_mean(&name.node, own.iter().copied());
            let help = match (&meant, stdlib::home(&name.node, None)) {
                (Some(meant), _) => format!("did you mean `{meant}`?"),
                (None, Some(path)) => format!("it is in another module: `use {path}.{}`", name.node),
                (None, None) => format!("`{}` has {}", from.path, listed(own)),
            };
            self.problems.push(
                Problem::error(&UNKNOWN_IMPORT, format!("`{}` has no `{}`", from.path, name.node))
                    .at(name.span, "not declared there")
                    .help(help),
            );
            // What was likely meant shall not be reported where it is used.
            [Some(name.node.clone()), meant]
                .iter()
                .flatten()
                .for_each(|known| unknown(known, name.span, names));
            return;
        }
        let found: Vec<_> = found.into_iter().map(|(_, space, entry)| (space, entry)).collect();
        for (space, entry) in found {
            self.declare(space, name, Entry { at: name.span, imported: true, ..entry }, names);
        }
    }

    fn declare(&mut self, space: Space, name: &Name, entry: Entry, names: &mut Names) {
        if space == Space::Value && BUILT_IN.contains(&name.node.as_str()) {
            self.problems.push(
                Problem::error(&RESERVED_NAME, format!("`{}` has a meaning of its own", name.node))
                    .at(name.span, "cannot be declared")
                    .help(format!("choose another name; {}", reserved_meaning(&name.node))),
            );
        }
        let entries = entries(names, space, &name.node);
        if let Some(first) = entries.iter().find(|first| !first.is_unknown()) {
            let how = if first.imported { "used" } else { "declared" };
            self.problems.push(
                Problem::error(&DUPLICATE_NAME, format!("`{}` is declared twice", name.node))
                    .at(name.span, "again here")
                    .with(first.at, format!("first {how} here"))
                    .help("give one of the two another name"),
            );
        }
        entries.push(entry);
    }

    /// Modules declare things to be used; only a scenario says what happens.
    fn recording(&mut self, file: &Spanned<String>) -> Option<Points> {
        let path = &file.node;
        let inside = |part: &str| !matches!(part, "" | "." | "..") && !part.contains(['\\', ':']);
        let problem = if !path.split('/').all(inside) {
            Problem::error(&BAD_RECORDING, format!("`{path}` does not lie beside the scenario"))
                .at(file.span, "leads elsewhere")
                .help("write a path below the scenario's folder, with `/` between folders")
        } else {
            match self.loader.load(path) {
                Err(why) => {
                    Problem::error(&BAD_RECORDING, "this recording cannot be read").at(file.span, why)
                }
                Ok(text) => {
                    let added = self.sources.add(path, text);
                    let text = &self.sources.file(added).text;
                    match crate::recording::read(text, added) {
                        Ok(points) => return Some(points),
                        Err(problem) => problem.with(file.span, "recorded here"),
                    }
                }
            }
        };
        self.problems.push(problem);
        None
    }

    fn placed_well(&mut self, main: bool, item: &Spanned<Item>) {
        let library = matches!(
            item.node,
            Item::Use { .. }
                | Item::Dimension { .. }
                | Item::Unit { .. }
                | Item::Let(_)
                | Item::Function(_)
                | Item::Motion(_)
                | Item::Shape(_)
                | Item::Preset { .. }
        );
        let provided = match &item.node {
            Item::Extern(_) => true,
            Item::Function(function) => function.body.is_none(),
            _ => false,
        };
        if provided {
            self.problems.push(
                Problem::error(&MISPLACED_ITEM, "only the standard library declares what is built in")
                    .at(item.span, "`extern` has no implementation here")
                    .help(match item.node {
                        Item::Function(_) => "give it a body: `fn name(…) -> type = …`",
                        _ => "algorithms, controllers, bodies and all else that is `extern` are those of the standard library",
                    }),
            );
        } else if !main && !library {
            self.problems.push(
                Problem::error(&MISPLACED_ITEM, "this belongs in the scenario, not in a file that it uses")
                    .at(item.span, "")
                    .help("a used file may declare functions, motions, formation shapes, presets, units and lets"),
            );
        }
    }
}

fn file_name(path: &str) -> String {
    path.replace('.', "/") + ".scn"
}

fn reserved_meaning(name: &str) -> &'static str {
    match name {
        "p" => "`p[i]` is the position of agent i",
        "v" => "`v[i]` is the velocity of agent i",
        "heading" => "`heading[i]` is the direction that agent i faces",
        "u" => "`u[i]` is the command of agent i",
        "du" => "`du[i]` is by how much the command of agent i changed",
        "t" => "`t` is the time since the episode began",
        "all" => "`all` is the set of all agents",
        "pairs" => "`pairs(all)` is the set of all pairs of agents",
        "edges" => "`edges(F)` is the set of neighbours in a formation",
        "members" => "`members(F)` is the set of agents in a formation",
        "nearest" => "`nearest(2, i, all)` is the set of the agents nearest to agent i",
        "size" => "`size(follower)` is the number of agents in a group",
        _ => "`box(low .. high, low .. high)` is an area",
    }
}

/// `a`, `b` and `c`, in quotes.
pub fn listed<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    let quoted: Vec<String> = names.into_iter().map(|name| format!("`{name}`")).collect();
    match quoted.split_last() {
        None => "nothing".to_owned(),
        Some((only, [])) => only.clone(),
        Some((last, others)) => format!("{} and {last}", others.join(", ")),
    }
}

pub const UNKNOWN_MODULE: Code = Code {
    name: "unknown-module",
    explain: "\
`use` names a module that is neither in the standard library nor beside the scenario.

    use std.motions.circle      // wrong: the module is called std.motion
    use std.motion.circle       // right
    use shapes.mine.wedge       // reads shapes/mine.scn beside the scenario

Only files below the scenario's folder can be used.",
};

pub const MODULE_CYCLE: Code = Code {
    name: "module-cycle",
    explain: "\
A file uses, over one or more others, itself, so neither could be read first.

    // a.scn                    // b.scn
    use b.far                   use a.near       // wrong

Move what both need into a third file.",
};

pub const UNKNOWN_IMPORT: Code = Code {
    name: "unknown-import",
    explain: "\
`use` names something that the module does not declare.

    use std.motion.cirlce       // wrong
    use std.motion.circle       // right

Only what a module declares itself can be used from it, not what it uses.",
};

pub const DUPLICATE_NAME: Code = Code {
    name: "duplicate-name",
    explain: "\
Two things of a kind have one name, so that nobody could tell which is meant.

    param side = 0.4 m
    param side = 0.5 m          // wrong: the second of that name

Things of different kinds may share a name: a motion `square` and a formation shape `square` do.",
};

pub const RESERVED_NAME: Code = Code {
    name: "reserved-name",
    explain: "\
The language gives some names a meaning of their own in expressions: p, v, heading, u, du, t, all, pairs,
edges, members, nearest, size and box.

    param p = 2 m               // wrong: p[i] is the position of agent i
    param pitch = 2 m           // right",
};

pub const MISPLACED_ITEM: Code = Code {
    name: "misplaced-item",
    explain: "\
A file that others use declares functions, motions, formation shapes, presets, units and lets. Agents, rewards
and everything else that says what happens stand in the scenario. `extern` stands in the standard library only.",
};
