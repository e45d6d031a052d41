//! Tests across the rooms of mpgx. What several of them need stands here.

pub mod crashes;
pub mod fuzz;
pub mod golden;
pub mod kills;

use std::mem::discriminant;
use std::path::{Path, PathBuf};

use mpgx_lang::ast::Item;
use mpgx_lang::parse::parse;
use mpgx_lang::problem::Problems;
use mpgx_lang::resolve::declared;
use mpgx_lang::source::{Loader, Sources};
use mpgx_lang::{Compilation, Override, compile};

/// The root of the repository.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().map(Path::to_owned).unwrap_or_default()
}

/// The `.scn` files of a folder, by name.
pub fn scenarios_in(folder: &Path) -> Vec<PathBuf> {
    let files = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut files: Vec<PathBuf> =
        files.filter(|path| path.extension().is_some_and(|it| it == "scn")).collect();
    files.sort();
    files
}

/// Finds what a scenario uses beside it.
pub struct Beside<'a>(pub &'a Path);

impl Loader for Beside<'_> {
    fn load(&self, path: &str) -> Result<String, String> {
        std::fs::read_to_string(self.0.join(path))
            .map_err(|_| format!("there is no file `{path}` beside this one"))
    }
}

/// Compiles a file. Lines `// --set NAME=VALUE` at its head are what the command line would say.
pub fn compiled(path: &Path) -> Compilation {
    let text = String::from_utf8_lossy(&std::fs::read(path).unwrap_or_default()).into_owned();
    let set =
        text.lines().map_while(|line| line.strip_prefix("// --set ")).filter_map(|set| set.split_once('='));
    let set: Vec<Override> =
        set.map(|(name, value)| Override { name: name.to_owned(), value: value.to_owned() }).collect();
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    compile(&name, text, &set, &Beside(path.parent().unwrap_or(Path::new(""))))
}

/// A scenario in which the items of `part` take the place of those that they declare anew.
pub fn completed(base: &str, part: &str) -> String {
    let items = |text: &str| {
        let (mut sources, mut problems) = (Sources::default(), Problems::default());
        let file = sources.add("part", text.to_owned());
        let parsed = parse(&sources, file, &mut problems);
        let texts: Vec<_> = parsed.items.iter().map(|item| sources.text(item.span).to_owned()).collect();
        parsed.items.into_iter().map(|item| item.node).zip(texts).collect::<Vec<_>>()
    };
    let anew = items(part);
    let replaced = |old: &Item| {
        anew.iter().any(|(new, _)| match (declared(old), declared(new)) {
            (Some(old), Some(new)) => old.0 == new.0 && old.1.node == new.1.node,
            (None, None) => discriminant(old) == discriminant(new) && !matches!(old, Item::Use { .. }),
            _ => false,
        })
    };
    let kept = items(base).into_iter().filter(|(item, _)| !replaced(item)).map(|(_, text)| text);
    kept.collect::<Vec<_>>().join("\n\n") + "\n\n" + part
}
