//! marl-eval's JSON: environment → task → algorithm → run → step → metric.

use std::borrow::Cow;
use std::collections::BTreeMap;

use serde_json::{Map, Value};
use thiserror::Error;

/// A file may not be larger than this.
pub const MAX_BYTES: u64 = 32 << 20;
/// Tasks times metrics.
const MOST_TABLES: usize = 200;
const MOST_ALGORITHMS: usize = 50;
const MOST_RUNS: usize = 1000;
/// Pairs of runs of two algorithms, over all comparisons: what the bootstrap's time goes with.
const MOST_PAIRS: usize = 2_000_000;

/// Why a file cannot be imported. `at` is a path of names, joined by `/`.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ImportError {
    #[error("it is not JSON: {cause}")]
    NotJson { cause: String },
    #[error("{at} should be {wanted}, but is {found}")]
    Wrong { at: String, wanted: &'static str, found: &'static str },
    #[error("{at} holds no {what}")]
    Empty { at: String, what: &'static str },
    #[error("{at} has no step_count")]
    NoStepCount { at: String },
    #[error("{at} has {found} {what}; there can be {most}")]
    TooMany { at: String, what: &'static str, found: usize, most: usize },
}

impl ImportError {
    /// What to do about it.
    pub fn remedy(&self) -> &'static str {
        match self {
            ImportError::NotJson { .. } => "was the file written to its end?",
            ImportError::TooMany { .. } => "split it into several files, or leave some out",
            ImportError::NoStepCount { .. } => {
                "give each step of a run its step_count; values at the end belong in absolute_metrics"
            }
            ImportError::Wrong { .. } | ImportError::Empty { .. } => {
                "the layout is {environment: {task: {algorithm: {run: {step: {\"step_count\": 1000, \"return\": [1.5, 2.5]}}}}}}"
            }
        }
    }
}

/// One value an episode; NaN for null.
pub type Metrics = BTreeMap<String, Vec<f64>>;

pub struct Task {
    pub environment: String,
    pub name: String,
    pub algorithms: Vec<(String, Vec<Run>)>,
}

pub struct Run {
    pub name: String,
    pub absolute: Metrics,
    /// By `step_count`.
    pub steps: Vec<(f64, Metrics)>,
}

/// All tasks, in the order of their names. There is at least one, and each has an algorithm with a run.
pub fn tasks(text: &str) -> Result<Vec<Task>, ImportError> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let value: Value = serde_json::from_str(&in_json(text))
        .map_err(|error| ImportError::NotJson { cause: error.to_string() })?;
    let mut tasks = Vec::new();
    for (environment, value) in object(&value, "the file", "environment")? {
        let environment = plain(environment);
        for (task, value) in object(value, &environment, "task")? {
            let name = plain(task);
            let at = format!("{environment}/{name}");
            let algorithms = object(value, &at, "algorithm")?.iter().map(|(algorithm, value)| {
                let algorithm = plain(algorithm);
                let runs = runs(value, &format!("{at}/{algorithm}"))?;
                Ok((algorithm, runs))
            });
            let algorithms = algorithms.collect::<Result<Vec<_>, ImportError>>()?;
            limit(&at, "algorithms", algorithms.len(), MOST_ALGORITHMS)?;
            tasks.push(Task { environment: environment.clone(), name, algorithms });
        }
    }
    let metrics = |task: &Task| task.metrics().len();
    limit("the file", "metrics of tasks", tasks.iter().map(metrics).sum(), MOST_TABLES)?;
    let pairs = |task: &Task| {
        let runs: Vec<usize> = task.algorithms.iter().map(|(_, runs)| runs.len()).collect();
        let total: usize = runs.iter().sum();
        let alone: usize = runs.iter().map(|n| n * n).sum();
        (total * total - alone) / 2 * metrics(task)
    };
    limit("the file", "pairs of runs to compare", tasks.iter().map(pairs).sum(), MOST_PAIRS)?;
    Ok(tasks)
}

fn runs(value: &Value, at: &str) -> Result<Vec<Run>, ImportError> {
    let runs = object(value, at, "run")?;
    limit(at, "runs", runs.len(), MOST_RUNS)?;
    runs.iter().map(|(name, value)| run(plain(name), value, at)).collect()
}

fn run(name: String, value: &Value, at: &str) -> Result<Run, ImportError> {
    let at = format!("{at}/{name}");
    let mut run = Run { name, absolute: Metrics::new(), steps: Vec::new() };
    for (key, value) in object(value, &at, "step")? {
        let at = format!("{at}/{}", plain(key));
        let fields = value.as_object().ok_or_else(|| wrong(&at, "an object", value))?;
        let metrics = metrics(fields, &at)?;
        if key == "absolute_metrics" {
            run.absolute = metrics;
        } else {
            let count =
                fields.get("step_count").ok_or_else(|| ImportError::NoStepCount { at: at.clone() })?;
            let number =
                count.as_f64().ok_or_else(|| wrong(&format!("{at}/step_count"), "a number", count))?;
            run.steps.push((number, metrics));
        }
    }
    run.steps.sort_by(|a, b| a.0.total_cmp(&b.0));
    Ok(run)
}

/// All but `step_count` and `elapsed_time`, which marl-eval keeps beside the metrics.
fn metrics(fields: &Map<String, Value>, at: &str) -> Result<Metrics, ImportError> {
    let measured = fields.iter().filter(|(name, _)| *name != "step_count" && *name != "elapsed_time");
    let values = measured.map(|(name, value)| {
        let name = plain(name);
        let at = format!("{at}/{name}");
        let items = value.as_array().ok_or_else(|| wrong(&at, "a list of numbers", value))?;
        let number = |(k, item): (usize, &Value)| match item {
            Value::Null => Ok(f64::NAN),
            _ => item.as_f64().ok_or_else(|| wrong(&format!("{at}[{k}]"), "a number", item)),
        };
        Ok((name, items.iter().enumerate().map(number).collect::<Result<Vec<f64>, ImportError>>()?))
    });
    values.collect()
}

/// The members of an object, at least one.
fn object<'a>(value: &'a Value, at: &str, what: &'static str) -> Result<&'a Map<String, Value>, ImportError> {
    let members = value.as_object().ok_or_else(|| wrong(at, "an object", value))?;
    if members.is_empty() {
        return Err(ImportError::Empty { at: at.to_string(), what });
    }
    Ok(members)
}

fn wrong(at: &str, wanted: &'static str, value: &Value) -> ImportError {
    let found = match value {
        Value::Null => "null",
        Value::Bool(_) => "true or false",
        Value::Number(_) => "a number",
        Value::String(_) => "text",
        Value::Array(_) => "a list",
        Value::Object(_) => "an object",
    };
    ImportError::Wrong { at: at.to_string(), wanted, found }
}

fn limit(at: &str, what: &'static str, found: usize, most: usize) -> Result<(), ImportError> {
    let at = at.to_string();
    if found > most { Err(ImportError::TooMany { at, what, found, most }) } else { Ok(()) }
}

/// A name without what disturbs a terminal or turns the direction of text, and not too long.
fn plain(name: &str) -> String {
    const LONGEST: usize = 80;
    let turns =
        |c: char| matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    let shown = |c: char| if c.is_control() || turns(c) { char::REPLACEMENT_CHARACTER } else { c };
    let mut plain: String = name.chars().take(LONGEST).map(shown).collect();
    if name.chars().nth(LONGEST).is_some() {
        plain.push('…');
    }
    plain
}

/// Python writes NaN and Infinity, for which JSON has no words; here they become null.
fn in_json(text: &str) -> Cow<'_, str> {
    const WORDS: [&str; 3] = ["NaN", "-Infinity", "Infinity"];
    if !WORDS.iter().any(|word| text.contains(word)) {
        return Cow::Borrowed(text);
    }
    let mut json = String::with_capacity(text.len());
    let (mut quoted, mut escaped) = (false, false);
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        let word = WORDS.iter().find(|word| !quoted && rest.starts_with(**word));
        if let Some(word) = word {
            json += "null";
            rest = rest.strip_prefix(*word).unwrap_or_default();
            continue;
        }
        quoted ^= c == '"' && !escaped;
        escaped = c == '\\' && !escaped;
        json.push(c);
        rest = rest.strip_prefix(c).unwrap_or_default();
    }
    Cow::Owned(json)
}
