//! Scenarios in the documents: blocks marked `scn` compile; blocks marked `scn-part` compile in the place of what
//! they declare anew in the first whole scenario of their document.

use std::path::PathBuf;

use mpgx_lang::compile;
use mpgx_lang::problem::{Style, render};
use mpgx_lang::source::NoFiles;
use mpgx_sim::run_test;
use mpgx_tests::{completed, root};

/// All Markdown files of the repository's root and of docs/.
fn documents() -> Vec<PathBuf> {
    let mut folders = vec![root().join("docs")];
    let mut files: Vec<PathBuf> = entries(&root()).filter(|path| path.is_file()).collect();
    while let Some(folder) = folders.pop() {
        let (inner, found): (Vec<_>, Vec<_>) = entries(&folder).partition(|path| path.is_dir());
        folders.extend(inner);
        files.extend(found);
    }
    files.retain(|path| path.extension().is_some_and(|it| it == "md"));
    files.sort();
    files
}

fn entries(folder: &std::path::Path) -> impl Iterator<Item = PathBuf> {
    std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path())
}

/// The blocks of a document with a mark, each with the line it begins on.
fn blocks(text: &str, mark: &str) -> Vec<(usize, String)> {
    let fence = format!("```{mark}");
    let (mut blocks, mut open): (Vec<(usize, String)>, bool) = (Vec::new(), false);
    for (number, line) in text.lines().enumerate() {
        if open && line.trim() == "```" {
            open = false;
        } else if let (true, Some((_, block))) = (open, blocks.last_mut()) {
            *block += line;
            block.push('\n');
        } else if line.trim() == fence {
            open = true;
            blocks.push((number + 2, String::new()));
        }
    }
    blocks
}

#[test]
fn scenarios_in_documents_compile() {
    let mut compiled = 0;
    for path in documents() {
        let text = std::fs::read_to_string(&path).unwrap();
        let whole = blocks(&text, "scn");
        for (line, block) in &whole {
            let it = compile(&format!("{} from line {line}", path.display()), block.clone(), &[], &NoFiles);
            assert!(it.problems.is_empty(), "{}", render(&it.problems, &it.sources, Style::Plain));
            compiled += 1;
        }
        for (line, block) in blocks(&text, "scn-part") {
            let (_, base) = whole.first().expect("a whole scenario comes before its parts");
            let name = format!("{} from line {line}", path.display());
            let it = compile(&name, completed(base, &block), &[], &NoFiles);
            let plan =
                it.plan.unwrap_or_else(|| panic!("{}", render(&it.problems, &it.sources, Style::Plain)));
            for test in &plan.tests {
                run_test(&plan, test).unwrap_or_else(|why| panic!("{name}: {why}"));
            }
        }
    }
    assert!(compiled > 0, "no document has a block marked `scn`");
}
