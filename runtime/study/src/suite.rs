//! A suite: scenarios that are run together, and published tables that their results are read beside.

use serde::{Deserialize, Serialize};

use crate::variants::Part;

/// A TOML file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Suite {
    pub title: String,
    #[serde(default)]
    pub about: String,
    /// Files beside the suite, or names of built-in scenarios.
    pub scenarios: Vec<String>,
    #[serde(default, rename = "table")]
    pub tables: Vec<Table>,
}

/// A table or figure of a publication.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Table {
    pub title: String,
    /// Where it is published.
    pub source: String,
    #[serde(default)]
    pub note: String,
    #[serde(rename = "row")]
    pub rows: Vec<Row>,
}

/// What one published value is compared with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Row {
    pub name: String,
    /// The name that the scenario gives itself.
    pub scenario: String,
    #[serde(default)]
    pub variant: String,
    /// Of the scenario's evaluations.
    pub protocol: String,
    /// As in [`crate::summary::Summary::protocols`].
    pub metric: String,
    /// In the units of the metric; a figure has none.
    #[serde(default)]
    pub published: Option<f64>,
    #[serde(default)]
    pub note: String,
}

impl Suite {
    /// Reads a suite. The error has the line and what is wrong there.
    pub fn parse(text: &str) -> Result<Suite, String> {
        toml::from_str(text).map_err(|error| error.to_string().trim_end().to_string())
    }

    /// Looks for every row's study, evaluation and metric, before anything is trained. `studies` holds the parts
    /// of each scenario. The error names the first row that has none, and what there is.
    pub fn check(&self, studies: &[Vec<Part>]) -> Result<(), String> {
        let scenarios: Vec<&str> =
            studies.iter().filter_map(|parts| Some(parts.first()?.plan.name.as_str())).collect();
        for (k, name) in scenarios.iter().enumerate() {
            if scenarios[..k].contains(name) {
                return Err(format!("two scenarios are called `{name}`"));
            }
        }
        let rows = self.tables.iter().flat_map(|table| table.rows.iter().map(move |row| (table, row)));
        for (table, row) in rows {
            let wrong = |kind: &str, name: &str, known: Vec<&str>| {
                let known = if known.is_empty() { "none".into() } else { known.join(", ") };
                Err(format!(
                    "row `{}` of \"{}\": there is no {kind} `{name}`; there is {known}",
                    row.name, table.title
                ))
            };
            let of = |parts: &&Vec<Part>| parts.first().is_some_and(|part| part.plan.name == row.scenario);
            let Some(parts) = studies.iter().find(of) else {
                return wrong("scenario", &row.scenario, scenarios);
            };
            let Some(part) = parts.iter().find(|part| part.variant == row.variant) else {
                let known = parts.iter().map(|part| part.variant.as_str()).filter(|name| !name.is_empty());
                return wrong("variant", &row.variant, known.collect());
            };
            let protocols = || part.plan.protocols.iter();
            let Some(protocol) = protocols().find(|protocol| protocol.name == row.protocol) else {
                return wrong("evaluation", &row.protocol, protocols().map(|it| it.name.as_str()).collect());
            };
            let world = protocol.world.as_deref().unwrap_or(&part.plan.world);
            let terms: Vec<String> =
                world.reward.iter().map(|term| format!("reward/{}", term.name)).collect();
            let known: Vec<&str> = METRICS.into_iter().chain(terms.iter().map(String::as_str)).collect();
            if !known.contains(&row.metric.as_str()) {
                return wrong("metric", &row.metric, known);
            }
        }
        Ok(())
    }
}

/// Metrics that are not named after reward terms.
const METRICS: [&str; 8] = [
    "return",
    "error_m",
    "error_over_oracle",
    "collision_episodes",
    "late_collision_episodes",
    "outside_episodes",
    "hit_episodes",
    "late_hit_episodes",
];

/// The folder of a part of a suite, below that of the suite.
pub fn folder(part: &Part) -> String {
    let name = &part.plan.name;
    if part.folder.is_empty() { name.clone() } else { format!("{name}/{}", part.folder) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::sample;
    use crate::variants::parts;

    const TEXT: &str = "
title = \"A paper\"
scenarios = [\"a\"]
[[table]]
title = \"Tracking\"
source = \"table 1\"
[[table.row]]
name = \"random\"
scenario = \"SCENARIO\"
protocol = \"PROTOCOL\"
metric = \"error_m\"
published = 0.5
";

    #[test]
    fn rows_are_looked_for_before_the_run() {
        let plan = sample::plan();
        let studies = [parts(&plan).unwrap()];
        let text = TEXT.replace("SCENARIO", &plan.name).replace("PROTOCOL", &plan.protocols[0].name);
        let suite = Suite::parse(&text).unwrap();
        assert_eq!(suite.tables[0].rows[0].published, Some(0.5));
        suite.check(&studies).unwrap();
        let told = |from: &str, to: &str| {
            Suite::parse(&text.replace(from, to)).unwrap().check(&studies).unwrap_err()
        };
        let name = format!("scenario = \"{}\"", plan.name);
        assert!(
            told(&name, "scenario = \"x\"").contains(&format!("no scenario `x`; there is {}", plan.name))
        );
        assert!(told(&name, &format!("{name}\nvariant = \"v\"")).contains("no variant `v`; there is none"));
        assert!(told("error_m", "gap").contains("no metric `gap`; there is return"));
        let protocol = format!("protocol = \"{}\"", plan.protocols[0].name);
        assert!(told(&protocol, "protocol = \"y\"").contains("no evaluation `y`"));
        assert!(
            suite.check(&[studies[0].clone(), studies[0].clone()]).unwrap_err().contains("two scenarios")
        );
    }

    #[test]
    fn what_is_wrong_in_the_file_has_its_line() {
        let error = Suite::parse("title = \"x\"\nscenarios = 3\n").unwrap_err();
        assert!(error.contains("line 2"), "{error}");
        assert!(Suite::parse("title = \"x\"\nscenarios = []\nspeed = 1").unwrap_err().contains("speed"));
    }
}
