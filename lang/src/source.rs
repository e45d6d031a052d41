//! Source files of one compilation, and where things stand in them.

use crate::ast::Span;
use crate::plan::Place;
use crate::stdlib;

/// One file: what it is called, its text, and where its lines begin.
#[derive(Clone, Debug)]
pub struct SourceFile {
    pub name: String,
    pub text: String,
    line_starts: Vec<usize>,
}

impl SourceFile {
    pub fn new(name: &str, text: String) -> SourceFile {
        let line_starts = std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect();
        SourceFile { name: name.to_owned(), text, line_starts }
    }

    /// 1-based line and column (in characters) of a byte; the end of the file for anything beyond it.
    pub fn line_column(&self, byte: usize) -> (usize, usize) {
        let byte = byte.min(self.text.len());
        let line = self.line_starts.partition_point(|&start| start <= byte);
        let start = line.checked_sub(1).and_then(|before| self.line_starts.get(before)).copied().unwrap_or(0);
        // Bytes that begin a character.
        let before = self.text.as_bytes().get(start..byte).unwrap_or_default();
        let column = before.iter().filter(|&&byte| byte & 0xc0 != 0x80);
        (line, column.count() + 1)
    }
}

/// The files of a compilation; [`Span::file`] is an index into them, or tells a file of the standard library.
#[derive(Clone, Debug, Default)]
pub struct Sources {
    files: Vec<SourceFile>,
}

impl Sources {
    /// Adds a file and tells its index. A byte order mark is dropped.
    pub fn add(&mut self, name: &str, text: String) -> usize {
        let text = match text.strip_prefix('\u{feff}') {
            Some(rest) => rest.to_owned(),
            None => text,
        };
        self.files.push(SourceFile::new(name, text));
        self.files.len() - 1
    }

    /// The file of an index that [`Sources::add`] gave, or of the standard library.
    pub fn file(&self, index: usize) -> &SourceFile {
        match index.checked_sub(stdlib::FIRST_FILE) {
            Some(module) => &stdlib::module(module).source,
            None => &self.files[index],
        }
    }

    /// Without those of the standard library.
    pub fn iter(&self) -> impl Iterator<Item = &SourceFile> {
        self.files.iter()
    }

    /// Where a span begins.
    pub fn place(&self, span: Span) -> Place {
        let file = self.file(span.file);
        let (line, column) = file.line_column(span.start);
        Place { file: file.name.clone(), line, column }
    }

    /// Where a sign of one byte stands, if it is the last before a span.
    pub fn sign_before(&self, sign: char, span: Span) -> Option<Span> {
        let before = self.file(span.file).text.get(..span.start)?.trim_end();
        let start = before.strip_suffix(sign)?.len();
        Some(Span { file: span.file, start, end: before.len() })
    }

    /// The text under a span.
    pub fn text(&self, span: Span) -> &str {
        self.file(span.file).text.get(span.start..span.end).unwrap_or("")
    }
}

/// Finds the files that a scenario `use`s. `lang` itself reads none.
pub trait Loader {
    /// `use shapes.mine` asks for `shapes/mine.scn`, relative to the scenario's folder.
    /// The error says in words why there is no such file.
    fn load(&self, path: &str) -> Result<String, String>;
}

/// A [`Loader`] that has nothing.
pub struct NoFiles;

impl Loader for NoFiles {
    fn load(&self, path: &str) -> Result<String, String> {
        Err(format!("there is no file `{path}`"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_found_where_there_are_no_files() {
        assert_eq!(NoFiles.load("a.scn"), Err("there is no file `a.scn`".to_owned()));
    }

    #[test]
    fn places_count_characters_and_lines_from_one() {
        let mut sources = Sources::default();
        let file = sources.add("a.scn", "\u{feff}é = 1\r\nb\n".to_owned());
        let place = |start, end| {
            let at = sources.place(Span { file, start, end });
            (at.line, at.column, sources.text(Span { file, start, end }))
        };
        assert_eq!(place(0, 2), (1, 1, "é"));
        assert_eq!(place(3, 4), (1, 3, "="));
        assert_eq!(place(8, 9), (2, 1, "b"));
        assert_eq!(place(10, 10), (3, 1, ""));
        assert_eq!(sources.file(file).line_column(99), (3, 1));
    }
}
