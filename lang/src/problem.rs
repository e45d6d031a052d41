//! Problems as data, and how they look.

mod github;
mod json;
mod sarif;

pub use github::render_github;
pub use json::render_json;
pub use sarif::render_sarif;

use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet, normalize_untrusted_str};

use crate::ast::Span;
use crate::source::Sources;

/// A kind of problem: a readable name, and the story that `mpgx explain` tells.
/// Each stands as a constant beside the check that raises it and is listed in [`crate::codes::ALL`].
#[derive(Debug, PartialEq, Eq)]
pub struct Code {
    pub name: &'static str,
    pub explain: &'static str,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// No Plan is made.
    Error,
    /// A Plan is made, likely not the one that was meant.
    Warning,
}

impl Severity {
    pub fn name(self) -> &'static str {
        match self {
            Severity::Error => "error",
            Severity::Warning => "warning",
        }
    }
}

/// A place and what is to be said there.
#[derive(Clone, Debug, PartialEq)]
pub struct Label {
    pub span: Span,
    pub text: String,
    /// Where the problem is; other labels show what it is at odds with.
    pub primary: bool,
}

/// One problem of a scenario.
#[derive(Clone, Debug, PartialEq)]
pub struct Problem {
    pub code: &'static Code,
    pub severity: Severity,
    pub message: String,
    pub labels: Vec<Label>,
    pub notes: Vec<String>,
    /// What to do about it.
    pub help: Option<String>,
    /// A place and the text that should stand there: what `help` says, for machines.
    pub fix: Option<(Span, String)>,
}

impl Problem {
    pub fn error(code: &'static Code, message: impl Into<String>) -> Self {
        Problem {
            code,
            severity: Severity::Error,
            message: message.into(),
            labels: Vec::new(),
            notes: Vec::new(),
            help: None,
            fix: None,
        }
    }

    pub fn warning(code: &'static Code, message: impl Into<String>) -> Self {
        Problem { severity: Severity::Warning, ..Problem::error(code, message) }
    }

    /// Adds the place of the problem.
    pub fn at(mut self, span: Span, text: impl Into<String>) -> Self {
        self.labels.push(Label { span, text: text.into(), primary: true });
        self
    }

    /// Adds another place that matters.
    pub fn with(mut self, span: Span, text: impl Into<String>) -> Self {
        self.labels.push(Label { span, text: text.into(), primary: false });
        self
    }

    pub fn note(mut self, text: impl Into<String>) -> Self {
        self.notes.push(text.into());
        self
    }

    /// What to do about it. `did you mean …?` is a fix too, of the primary place.
    pub fn help(mut self, text: impl Into<String>) -> Self {
        let text = text.into();
        let meant = text.strip_prefix("did you mean `").and_then(|text| text.strip_suffix("`?"));
        if let (Some(meant), Some(span)) = (meant, self.span()) {
            self.fix = Some((span, meant.to_owned()));
        }
        self.help = Some(text);
        self
    }

    /// What should stand at a place instead.
    pub fn fix(mut self, span: Span, text: impl Into<String>) -> Self {
        self.fix = Some((span, text.into()));
        self
    }

    /// The message with its notes and its help, a line each.
    fn told(&self) -> String {
        let mut lines = vec![self.message.clone()];
        lines.extend(self.notes.iter().map(|note| format!("note: {note}")));
        lines.extend(self.help.iter().map(|help| format!("help: {help}")));
        lines.join("\n")
    }

    /// The first primary label's place, else the first label's.
    pub fn span(&self) -> Option<Span> {
        self.labels.iter().find(|label| label.primary).or(self.labels.first()).map(|label| label.span)
    }
}

/// All problems of a compilation.
#[derive(Clone, Debug, Default)]
pub struct Problems {
    all: Vec<Problem>,
}

impl Problems {
    pub fn push(&mut self, problem: Problem) {
        self.all.push(problem);
    }

    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// Number of errors; warnings do not count.
    pub fn errors(&self) -> usize {
        self.all.iter().filter(|problem| problem.severity == Severity::Error).count()
    }

    pub fn has_errors(&self) -> bool {
        self.errors() > 0
    }

    /// In the order of file, place and code, whatever order they were found in.
    pub fn iter(&self) -> impl Iterator<Item = &Problem> {
        let mut sorted: Vec<&Problem> = self.all.iter().collect();
        sorted.sort_by_key(|problem| (problem.span().map(|span| (span.file, span.start)), problem.code.name));
        sorted.into_iter()
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    Plain,
    /// With ANSI colours.
    Coloured,
}

/// Problems that [`render`] shows; the rest are counted.
const SHOWN: usize = 100;

/// Every problem with the lines of the source it is about, in the manner of rustc.
pub fn render(problems: &Problems, sources: &Sources, style: Style) -> String {
    let renderer = match style {
        Style::Plain => Renderer::plain(),
        Style::Coloured => Renderer::styled(),
    };
    let each = problems.iter().take(SHOWN).map(|problem| renderer.render(&[report(problem, sources)]) + "\n");
    let mut texts: Vec<String> = each.collect();
    if problems.all.len() > SHOWN {
        texts.push(format!("… and {} more\n", problems.all.len() - SHOWN));
    }
    texts.join("\n")
}

fn report<'a>(problem: &'a Problem, sources: &'a Sources) -> Group<'a> {
    let level = match problem.severity {
        Severity::Error => Level::ERROR,
        Severity::Warning => Level::WARNING,
    };
    let mut group = Group::with_title(level.primary_title(problem.message.as_str()).id(problem.code.name));
    let mut files: Vec<usize> = problem.span().map(|span| span.file).into_iter().collect();
    for label in &problem.labels {
        if !files.contains(&label.span.file) {
            files.push(label.span.file);
        }
    }
    for index in files {
        let file = sources.file(index);
        let labels = problem.labels.iter().filter(|label| label.span.file == index);
        group = group.element(Snippet::source(file.text.as_str()).path(file.name.as_str()).annotations(
            labels.map(|label| {
                let kind = if label.primary { AnnotationKind::Primary } else { AnnotationKind::Context };
                let text = Some(label.text.as_str()).filter(|text| !text.is_empty());
                kind.span(label.span.start..label.span.end).label(text)
            }),
        ));
    }
    group =
        group.elements(problem.notes.iter().map(|note| Level::NOTE.message(normalize_untrusted_str(note))));
    group.elements(problem.help.iter().map(|help| Level::HELP.message(normalize_untrusted_str(help))))
}

/// One line a problem: `file:line:column: error[code]: message`.
pub fn render_short(problems: &Problems, sources: &Sources) -> String {
    let mut text = String::new();
    for problem in problems.iter() {
        if let Some(span) = problem.span() {
            let place = sources.place(span);
            text += &format!("{}:{}:{}: ", place.file, place.line, place.column);
        }
        let message = normalize_untrusted_str(&problem.message);
        text += &format!("{}[{}]: {message}\n", problem.severity.name(), problem.code.name);
    }
    text
}

/// The candidate most like a name, if any is near enough to be what was meant.
pub fn did_you_mean<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<String> {
    let folded = name.to_lowercase();
    let length = name.chars().count();
    let allowed = if length == 1 { 0 } else { (length / 3).max(1) };
    candidates
        .into_iter()
        .filter(|candidate| candidate.len().abs_diff(name.len()) <= allowed)
        .map(|candidate| (strsim::damerau_levenshtein(&folded, &candidate.to_lowercase()), candidate))
        .filter(|&(distance, candidate)| distance <= allowed && candidate != name)
        .min()
        .map(|(_, candidate)| candidate.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    const ODD: Code = Code { name: "odd", explain: "" };

    #[test]
    fn suggestions_are_near_and_do_not_depend_on_order() {
        assert_eq!(did_you_mean("lenght", ["length", "speed"]).as_deref(), Some("length"));
        assert_eq!(did_you_mean("Side", ["side"]).as_deref(), Some("side"));
        assert_eq!(did_you_mean("xx", ["xy", "xa"]), did_you_mean("xx", ["xa", "xy"]));
        assert_eq!(did_you_mean("M", ["s", "m"]).as_deref(), Some("m"));
        assert_eq!(did_you_mean("k", ["F", "p"]), None);
        assert_eq!(did_you_mean("tolerance", ["side", "gap"]), None);
        assert_eq!(did_you_mean("ab", ["xy"]), None);
    }

    #[test]
    fn problems_show_their_places_in_order() {
        let mut sources = Sources::default();
        let file = sources.add("a.scn", "param a = 1\r\nparam b = \u{202e}2\r\n".to_owned());
        let mut problems = Problems::default();
        let at = |start, end| Span { file, start, end };
        problems.push(
            Problem::warning(&ODD, "second")
                .at(at(19, 20), "here")
                .with(at(6, 7), "there")
                .help("do\n\x1b[31mit"),
        );
        problems.push(Problem::error(&ODD, "first").at(at(6, 7), ""));
        problems.push(Problem::error(&ODD, "nowhere"));
        assert_eq!(
            render_short(&problems, &sources),
            "error[odd]: nowhere\na.scn:1:7: error[odd]: first\na.scn:2:7: warning[odd]: second\n"
        );
        let text = render(&problems, &sources, Style::Plain);
        assert!(
            text.contains("1 | param a = 1\n") && text.contains("here") && text.contains("there"),
            "{text}"
        );
        assert!(!text.contains('\x1b') && !text.contains('\u{202e}'), "{text}");
        assert!(render(&problems, &sources, Style::Coloured).contains('\x1b'));
    }
}
