//! `mpgx report`: the report of studies or suites, from records alone, of two studies side by side, or of another
//! program's results.

use std::path::{Path, PathBuf};

use mpgx_report::{Compared, Document, Input, Side};
use mpgx_study::storage::{RealDisk, Storage};
use mpgx_study::summary::Summary;
use mpgx_study::{Study, StudyError};
use serde_json::{Value, json};

use crate::failure::{Exit, Failure};
use crate::{import, provenance, suite};

#[derive(clap::Args)]
#[command(after_help = "\
Example: mpgx report runs/square_unison
         mpgx report --compare runs/square_unison runs/wide
         mpgx report runs/square_unison --format latex --out tables.tex
         mpgx report --import benchmarl.json")]
pub struct Args {
    /// Folders of finished studies or suites
    #[arg(required_unless_present_any = ["import", "compare"], value_name = "DIR")]
    studies: Vec<PathBuf>,

    /// Two studies side by side: what they mean otherwise, and how their results differ
    #[arg(long, num_args = 2, value_names = ["A", "B"], conflicts_with_all = ["studies", "import"])]
    compare: Option<Vec<PathBuf>>,

    /// The whole report, its tables for notes or papers, or its numbers
    #[arg(long, value_enum, default_value_t = Format::Html, conflicts_with = "import")]
    format: Format,

    /// Write here [default: report.html in the study's folder, comparison.html; md, latex and json are printed]
    #[arg(long, value_name = "FILE", conflicts_with = "import")]
    out: Option<PathBuf>,

    /// Results of another program as marl-eval's JSON, which BenchMARL writes; the page is put beside it
    #[arg(long, value_name = "FILE.json")]
    import: Vec<PathBuf>,
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Format {
    Html,
    Md,
    Latex,
    Json,
}

pub fn run(args: Args) -> Result<Exit, Failure> {
    if let Some([a, b]) = args.compare.as_deref() {
        compare(a, b, &args)?;
    } else if args.format == Format::Html {
        pages(&args)?;
    } else if !args.studies.is_empty() {
        let reports = args.studies.iter().map(|folder| read(folder)).collect::<Result<Vec<_>, _>>()?;
        give(&args, &text(args.format, &reports))?;
    }
    for file in &args.import {
        let (page, tables) = import::report(file)?;
        println!("{tables}\n{}", page.display());
    }
    Ok(Exit::Done)
}

/// A page in each folder, or one where it is wanted.
fn pages(args: &Args) -> Result<(), Failure> {
    if args.out.is_some() && args.studies.len() > 1 {
        let message = "each study has a page of its own, and --out names one file";
        return Err(Failure::new(Exit::BadInput, message).help("leave out --out, or give one folder"));
    }
    for folder in &args.studies {
        let html = match suite::load(folder)? {
            Some((found, finished)) => suite::html(&found, &suite::members(&finished))?,
            None => page(&load(folder)?, folder, &RealDisk::new(folder))?,
        };
        let file = args.out.clone().unwrap_or_else(|| folder.join("report.html"));
        write(&file, &html)?;
        println!("{}", file.display());
    }
    Ok(())
}

/// Tables and numbers of a study or suite.
type Report = (Document, Value);

fn read(folder: &Path) -> Result<Report, Failure> {
    let study = match suite::load(folder)? {
        Some((found, finished)) => {
            let members = suite::members(&finished);
            let studies: Vec<Value> = finished
                .iter()
                .map(|(part, summary)| json!({ "folder": part.folder, "summary": summary }))
                .collect();
            let value =
                json!({ "title": found.suite.title, "tables": found.suite.tables, "studies": studies });
            return Ok((mpgx_report::suite_tables(&found.suite, &members), value));
        }
        None => load(folder)?,
    };
    let summary = finished(&study, folder)?;
    Ok((mpgx_report::study_tables(&study.plan.name, &study.plan, summary), json!(summary)))
}

fn text(format: Format, reports: &[Report]) -> String {
    let whole =
        || reports.iter().map(|(document, _)| document.clone()).fold(Document::default(), Document::then);
    match format {
        Format::Md => whole().markdown(),
        Format::Latex => whole().latex(),
        Format::Html | Format::Json => match reports {
            [(_, one)] => format!("{one:#}\n"),
            several => format!("{:#}\n", several.iter().map(|(_, one)| one.clone()).collect::<Value>()),
        },
    }
}

fn compare(a: &Path, b: &Path, args: &Args) -> Result<(), Failure> {
    let studies = [load(a)?, load(b)?];
    let [name_a, name_b] = names(a, b);
    let [first, second] = &studies;
    let side =
        |name, study, folder| Ok::<_, Failure>(Side { name, study, summary: finished(study, folder)? });
    let compared = Compared::new(side(name_a, first, a)?, side(name_b, second, b)?);
    if args.format != Format::Html {
        return give(args, &text(args.format, &[(mpgx_report::compare_tables(&compared), compared.json())]));
    }
    let html = mpgx_report::compare_html(&compared)
        .map_err(|error| Failure::new(Exit::Internal, error.to_string()))?;
    let file = args.out.clone().unwrap_or_else(|| "comparison.html".into());
    write(&file, &html)?;
    println!("{}", file.display());
    Ok(())
}

/// What tells two folders apart: their paths from where these part.
fn names(a: &Path, b: &Path) -> [String; 2] {
    let whole = |path: &Path| path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
    let parts = [a, b]
        .map(|path| whole(path).iter().map(|part| part.to_string_lossy().into_owned()).collect::<Vec<_>>());
    let [x, y] = &parts;
    let common = x.iter().zip(y).take_while(|(x, y)| x == y).count();
    let from = common.min(x.len().min(y.len()).saturating_sub(1));
    parts.map(|parts| parts.get(from..).unwrap_or_default().join("/"))
}

/// The study in a folder.
pub fn load(folder: &Path) -> Result<Study, Failure> {
    mpgx_study::load(&RealDisk::new(folder)).map_err(|error| unloaded(folder, error))
}

/// Why the study of a folder cannot be read.
pub fn unloaded(folder: &Path, error: StudyError) -> Failure {
    match error {
        StudyError::NoStudy { .. } => {
            Failure::new(Exit::BadInput, format!("there is no study in {}", folder.display()))
                .help("`mpgx run` makes one; `mpgx list runs` shows those in ./runs")
        }
        error => {
            let failure = Failure::from(error);
            Failure { message: format!("{}: {}", folder.display(), failure.message), ..failure }
        }
    }
}

fn finished<'a>(study: &'a Study, folder: &Path) -> Result<&'a Summary, Failure> {
    study.summary.as_ref().ok_or_else(|| {
        Failure::new(Exit::Io, format!("the study in {} is not finished", folder.display()))
            .help("run the scenario again; it goes on where it stopped")
    })
}

/// Prints the text, or writes it where it is wanted.
fn give(args: &Args, text: &str) -> Result<(), Failure> {
    let Some(file) = &args.out else {
        print!("{text}");
        return Ok(());
    };
    write(file, text)?;
    println!("{}", file.display());
    Ok(())
}

/// Writes a file whole or not at all.
pub fn write(file: &Path, text: &str) -> Result<(), Failure> {
    let Some(name) = file.file_name() else {
        return Err(Failure::new(Exit::BadInput, format!("{} is no name of a file", file.display())));
    };
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let storage = RealDisk::new(folder);
    storage.create_folder("")?;
    Ok(storage.write_atomic(&name.to_string_lossy(), text.as_bytes())?)
}

fn page(study: &Study, folder: &Path, storage: &dyn Storage) -> Result<String, Failure> {
    let summary = finished(study, folder)?;
    mpgx_report::html(&Input {
        plan: &study.plan,
        source: &study.source,
        records: &study.records,
        timings: &study.timings,
        localisers: &study.localisers,
        summary,
        provenance: provenance::kept(storage),
        published: suite::published(&study.plan),
    })
    .map_err(|error| Failure::new(Exit::Internal, error.to_string()))
}

/// Writes `report.html` into the study's folder and gives its path.
pub fn write_report(study: &Study, folder: &Path, storage: &dyn Storage) -> Result<PathBuf, Failure> {
    storage.write_atomic("report.html", page(study, folder, storage)?.as_bytes())?;
    Ok(folder.join("report.html"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_are_told_apart_by_as_little_as_needed() {
        let of = |a: &str, b: &str| names(Path::new(a), Path::new(b));
        assert_eq!(of("/no/runs/a", "/no/runs/b"), ["a", "b"]);
        assert_eq!(of("/no/1/study", "/no/2/study"), ["1/study", "2/study"]);
        assert_eq!(of("/no/runs/a", "/no/runs/a/variants/wide"), ["a", "a/variants/wide"]);
        assert_eq!(of("/no/a", "/no/a"), ["a", "a"]);
    }
}
