//! The standard library, embedded. A scenario uses little of it, so a module is looked at when it is first used, and
//! an item parsed when it is first looked at, once in the life of the program.

use std::ops::Range;
use std::sync::OnceLock;

use crate::ast::{Item, Name, Span, Spanned};
use crate::parse::sound_item;
use crate::resolve::Space;
use crate::source::SourceFile;

/// Modules by the path that `use` names, with their text.
pub const MODULES: &[(&str, &str)] = &[
    ("std.control", include_str!("../../stdlib/control.scn")),
    ("std.formation", include_str!("../../stdlib/formation.scn")),
    ("std.learn", include_str!("../../stdlib/learn.scn")),
    ("std.motion", include_str!("../../stdlib/motion.scn")),
    ("std.prelude", include_str!("../../stdlib/prelude.scn")),
    ("std.reward", include_str!("../../stdlib/reward.scn")),
    ("std.sight", include_str!("../../stdlib/sight.scn")),
    ("std.start", include_str!("../../stdlib/start.scn")),
];

/// Modules that every file sees without `use`.
pub const PRELUDE: &[&str] = &["std.prelude", "std.learn", "std.control"];

/// In every compilation the files of the modules have the indices from here on.
pub const FIRST_FILE: usize = usize::MAX / 2;

/// A module that was looked at.
#[derive(Debug)]
pub struct Module {
    pub source: SourceFile,
    pub declarations: Vec<Declaration>,
}

static LOADED: [OnceLock<Module>; MODULES.len()] = [const { OnceLock::new() }; MODULES.len()];

/// The module of that number among [`MODULES`].
pub fn module(number: usize) -> &'static Module {
    let (path, text) = MODULES[number];
    let load = || Module {
        source: SourceFile::new(path, text.to_owned()),
        declarations: declarations(text, FIRST_FILE + number),
    };
    LOADED[number].get_or_init(load)
}

/// The number of a module.
pub fn numbered(path: &str) -> Option<usize> {
    MODULES.iter().position(|(name, _)| *name == path)
}

/// The module that declares a name, in one space or in any, except those seen without `use`.
pub fn home(name: &str, space: Option<Space>) -> Option<&'static str> {
    let is_it = |it: &Declaration| it.name.node == name && space.is_none_or(|space| space == it.space);
    let declares = |number| module(number).declarations.iter().any(is_it);
    let mut homes =
        MODULES.iter().enumerate().filter(|(at, (path, _))| !PRELUDE.contains(path) && declares(*at));
    homes.next().map(|(_, (path, _))| *path)
}

/// What a standard module declares, known without parsing it.
#[derive(Debug)]
pub struct Declaration {
    pub space: Space,
    pub name: Name,
    text: &'static str,
    bytes: Range<usize>,
    span: Span,
    parsed: OnceLock<Option<Spanned<Item>>>,
}

impl Declaration {
    pub fn item(&self) -> Option<&Spanned<Item>> {
        let parse = || {
            let node = sound_item(self.text, self.span.file, self.bytes.clone())?;
            Some(Spanned { node, span: self.span })
        };
        self.parsed.get_or_init(parse).as_ref()
    }
}

/// What the text of a standard module declares, in order. `file` is the index of its source.
///
/// The library keeps to a form that tells without the grammar: what stands at the left edge is a comment, a closing
/// bracket, or the first line of an item.
fn declarations(text: &'static str, file: usize) -> Vec<Declaration> {
    let (mut declarations, mut doc, mut at): (Vec<Declaration>, Option<usize>, usize) = (Vec::new(), None, 0);
    for line in text.split_inclusive('\n') {
        let start = at;
        at += line.len();
        let end = start + line.trim_end().len();
        if line.starts_with("///") {
            doc.get_or_insert(start);
        } else if line.starts_with(|first: char| first.is_ascii_lowercase()) {
            let bytes = doc.take().unwrap_or(start)..end;
            declarations.extend(declaration(text, line, start, bytes, file));
        } else if let Some(last) = declarations.last_mut().filter(|_| end > start && !line.starts_with("//"))
        {
            (last.bytes.end, last.span.end) = (end, end);
        }
    }
    declarations
}

/// The declaration whose first line stands at `start`.
fn declaration(
    text: &'static str,
    line: &str,
    start: usize,
    bytes: Range<usize>,
    file: usize,
) -> Option<Declaration> {
    let mut words = line.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_'));
    let space = space(words.by_ref().find(|word| *word != "extern")?)?;
    let name = words.next()?;
    let at = start + line.find(&format!(" {name}"))? + 1;
    let span = Span { file, start: at, end: at + name.len() };
    let name = Spanned { node: name.to_owned(), span };
    let span = Span { file, start, end: bytes.end };
    Some(Declaration { space, name, text, bytes, span, parsed: OnceLock::new() })
}

/// What an item of the library declares that begins with a word.
fn space(word: &str) -> Option<Space> {
    Some(match word {
        "dimension" => Space::Dimension,
        "unit" => Space::Unit,
        "let" | "fn" | "dist" => Space::Value,
        "motion" => Space::Motion,
        "formation" => Space::Shape,
        "algorithm" => Space::Algorithm,
        "controller" => Space::Controller,
        "body" => Space::Body,
        "solid" => Space::Solid,
        "filter" => Space::Filter,
        "room" => Space::Room,
        "lighting" => Space::Lighting,
        "camera" => Space::Camera,
        "odometry" => Space::Odometry,
        "landmark" => Space::LandmarkKind,
        "localiser" => Space::LocaliserKind,
        "preset" => Space::Preset,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parse::parse;
    use crate::problem::Problems;
    use crate::resolve::declared;
    use crate::source::Sources;

    #[test]
    fn a_name_is_found_in_its_module_unless_it_is_seen_anyhow() {
        let homes = ["wander", "sqrt", "nobody"].map(|name| home(name, None));
        assert_eq!(homes, [Some("std.motion"), None, None]);
        let circles = [Space::Motion, Space::Shape, Space::Value].map(|space| home("circle", Some(space)));
        assert_eq!(circles, [Some("std.motion"), Some("std.formation"), None]);
    }

    #[test]
    fn what_modules_declare_is_what_their_parse_tells() {
        for (number, (path, _)) in MODULES.iter().enumerate() {
            let (sources, mut problems) = (Sources::default(), Problems::default());
            let parsed = parse(&sources, FIRST_FILE + number, &mut problems);
            let declarations = &module(number).declarations;
            assert_eq!((declarations.len(), problems.iter().count()), (parsed.items.len(), 0), "{path}");
            for (declaration, item) in declarations.iter().zip(&parsed.items) {
                assert_eq!(declaration.item(), Some(item));
                assert_eq!(declared(&item.node), Some((declaration.space, &declaration.name)));
            }
        }
    }
}
