//! Suites: finding one, and the report over its studies.

use std::path::{Path, PathBuf};

use mpgx_lang::meaning_hash;
use mpgx_lang::plan::Plan;
use mpgx_report::{Member, Published};
use mpgx_study::Part;
use mpgx_study::storage::{RealDisk, Storage};
use mpgx_study::suite::{Row, Suite, Table};
use mpgx_study::summary::Summary;

use crate::failure::{Exit, Failure};
use crate::scenario;

/// The suites that come with mpgx: name and text.
pub const EMBEDDED: &[(&str, &str)] = &[
    ("beyond", include_str!("../../../scenarios/beyond.toml")),
    ("paper", include_str!("../../../scenarios/paper.toml")),
];

/// The suite's file in its folder of results.
const FILE: &str = "suite.toml";

/// A suite and where it was found.
pub struct Found {
    /// Of its folder of results.
    pub name: String,
    pub suite: Suite,
    text: String,
    /// Where its scenarios may lie; `None`: it is built in.
    beside: Option<PathBuf>,
}

/// The suite of that name: a file that ends in `.toml`, or one that is built in.
pub fn find(name: &str) -> Result<Option<Found>, Failure> {
    let path = Path::new(name);
    let plain = name.strip_suffix(".toml").unwrap_or(name);
    let (text, beside) = if path.extension().is_some_and(|extension| extension == "toml") && path.is_file() {
        (scenario::read(path)?, path.parent().map(Path::to_path_buf))
    } else if let Some((_, text)) = EMBEDDED.iter().find(|(name, _)| *name == plain) {
        ((*text).to_string(), None)
    } else {
        return Ok(None);
    };
    let suite = Suite::parse(&text).map_err(|why| Failure::new(Exit::BadInput, format!("{name}: {why}")))?;
    let stem = path.file_stem().map_or(plain.into(), |stem| stem.to_string_lossy());
    Ok(Some(Found { name: stem.into_owned(), suite, text, beside }))
}

impl Found {
    /// Where to find one of its scenarios: a file beside it, or the name of a built-in one.
    pub fn scenario(&self, name: &str) -> String {
        let file = self.beside.as_ref().map(|folder| folder.join(name)).filter(|file| file.is_file());
        file.map_or_else(|| name.to_string(), |file| file.to_string_lossy().into_owned())
    }
}

/// A finished study as the report sees it. `part.folder` is below that of the suite.
pub fn member<'a>(part: &'a Part, summary: &'a Summary) -> Member<'a> {
    let report = format!("{}/report.html", part.folder);
    Member { plan: &part.plan, variant: &part.variant, report, summary }
}

/// The page over all of them.
pub fn html(found: &Found, members: &[Member]) -> Result<String, Failure> {
    mpgx_report::suite_html(&found.suite, members)
        .map_err(|error| Failure::new(Exit::Internal, error.to_string()))
}

/// Writes `report.html` and the suite itself into the folder of results, and gives the report's path.
pub fn write_report(found: &Found, members: &[Member], folder: &Path) -> Result<PathBuf, Failure> {
    let html = html(found, members)?;
    let storage = RealDisk::new(folder);
    storage.write_atomic(FILE, found.text.as_bytes())?;
    storage.write_atomic("report.html", html.as_bytes())?;
    Ok(folder.join("report.html"))
}

/// Studies of a suite that are finished.
type Finished = Vec<(Part, Summary)>;

/// A suite and its finished studies as they lie in a folder of results; `None` if it is no suite's.
pub fn load(results: &Path) -> Result<Option<(Found, Finished)>, Failure> {
    let file = results.join(FILE);
    if !file.is_file() {
        return Ok(None);
    }
    let Some(found) = find(&file.to_string_lossy())? else { return Ok(None) };
    let mut finished = Vec::new();
    for scenario in studies_in(results) {
        let variants = results.join(&scenario).join("variants");
        let variants =
            studies_in(&variants).into_iter().map(|name| (format!("{scenario}/variants/{name}"), name));
        for (folder, variant) in std::iter::once((scenario.clone(), String::new())).chain(variants) {
            let study = mpgx_study::load(&RealDisk::new(results.join(&folder)))?;
            if let Some(summary) = study.summary {
                finished.push((Part { variant, folder, plan: study.plan }, summary));
            }
        }
    }
    Ok(Some((found, finished)))
}

/// The finished studies as the report sees them.
pub fn members(finished: &[(Part, Summary)]) -> Vec<Member<'_>> {
    finished.iter().map(|(part, summary)| member(part, summary)).collect()
}

/// The folders in `folder` that hold a study, in order; none if it cannot be read.
pub fn studies_in(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().filter_map(|entry| entry.ok());
    let studies = entries.filter(|entry| entry.path().join("plan.ron").is_file());
    let mut studies: Vec<String> =
        studies.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    studies.sort();
    studies
}

/// What the built-in suites have published of a study, if it is one of their scenarios as it is: the same
/// meaning with any seeds.
pub fn published(study: &Plan) -> Option<Published> {
    let plan = scenario::built_in(&study.name)?;
    let meaning = |plan: &Plan| meaning_hash(&Plan { first_seed: 0, seeds: 0, ..plan.clone() });
    let wanted = meaning(study);
    let part = mpgx_study::parts(&plan).ok()?.into_iter().find(|part| meaning(&part.plan) == wanted)?;
    let suites = EMBEDDED.iter().filter_map(|(_, text)| Suite::parse(text).ok());
    let of = |row: &Row| row.scenario == study.name && row.variant == part.variant;
    let tables: Vec<Table> = suites
        .flat_map(|suite| suite.tables)
        .map(|table| Table { rows: table.rows.iter().filter(|row| of(row)).cloned().collect(), ..table })
        .filter(|table| !table.rows.is_empty())
        .collect();
    (!tables.is_empty()).then_some(Published { variant: part.variant, tables })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_very_scenario_has_published_rows() {
        let plan = scenario::built_in("regulation_obstacles").unwrap();
        let parts = mpgx_study::parts(&plan).unwrap();
        let seeds = Plan { seeds: 3, ..parts[0].plan.clone() };
        let found = published(&seeds).unwrap();
        assert!(found.variant.is_empty());
        assert!(found.tables.iter().flat_map(|table| &table.rows).all(|row| row.variant.is_empty()));
        let strong = parts.iter().find(|part| part.variant == "printed_strong").unwrap();
        let rows: Vec<_> =
            published(&strong.plan).unwrap().tables.into_iter().flat_map(|it| it.rows).collect();
        assert!(!rows.is_empty() && rows.iter().all(|row| row.variant == "printed_strong"));
        let mut other = seeds;
        other.world.horizon += 1;
        assert_eq!(published(&other), None);
        assert_eq!(published(&Plan { name: "mine".into(), ..other }), None);
    }

    #[test]
    fn every_row_of_a_built_in_suite_has_a_study() {
        for (name, _) in EMBEDDED {
            let found = find(name).unwrap().unwrap();
            let plan = |name: &String| scenario::plan(&found.scenario(name), &[]).unwrap().0;
            let studies: Vec<Vec<Part>> =
                found.suite.scenarios.iter().map(|name| mpgx_study::parts(&plan(name)).unwrap()).collect();
            assert_eq!(found.suite.check(&studies), Ok(()), "{name}");
        }
    }
}
