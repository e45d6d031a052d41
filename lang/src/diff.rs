//! What differs between two Plans, in the words of the scenario.
//!
//! The Plans are compared as the trees that they serialise to, so that new fields show up by themselves. Named things
//! are found by their names, conditions and observations by what they say: order does not count.

mod leaves;

use std::collections::BTreeSet;

use crate::plan::Plan;
use leaves::{Leaves, Path, leaves};

/// One difference.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Change {
    /// `param side`, `reward gap`, `evaluate regular leader motion`
    pub what: String,
    /// `None`: it is new.
    pub before: Option<String>,
    /// `None`: it is gone.
    pub after: Option<String>,
}

/// What is different in `after`, from the general to the particular.
pub fn diff(before: &Plan, after: &Plan) -> Vec<Change> {
    let (before, after) = (leaves(before), leaves(after));
    let paths: BTreeSet<&Path> = before.keys().chain(after.keys()).collect();
    let (old, new) = (elements(&before), elements(&after));
    let mut told: BTreeSet<&[String]> = BTreeSet::new();
    let mut changes = Vec::new();
    for path in paths {
        let (a, b) = (before.get(path), after.get(path));
        if a.map(|leaf| &leaf.meaning) == b.map(|leaf| &leaf.meaning) {
            continue;
        }
        let element = path.get(..2).unwrap_or(path);
        // Of what is new or gone as a whole, one line.
        let whole = match (old.contains(element), new.contains(element)) {
            (true, false) => Some(&before),
            (false, true) => Some(&after),
            _ => None,
        };
        match whole {
            Some(_) if !told.insert(element) => {}
            Some(side) => {
                let shown = Some(gist(side, element));
                let gone = std::ptr::eq(side, &before);
                let (before, after) = if gone { (shown, None) } else { (None, shown) };
                changes.push(Change { what: words(element), before, after });
            }
            None => changes.push(Change {
                what: words(path),
                before: a.map(|leaf| leaf.shown.clone()),
                after: b.map(|leaf| leaf.shown.clone()),
            }),
        }
    }
    changes
}

/// The differences as text, a line each, or three where a formula changed.
pub fn render(changes: &[Change]) -> String {
    let line = |change: &Change| {
        let what = &change.what;
        let with =
            |sign: &str, text: &str| format!("{sign} {what}: {text}").trim_end_matches([':', ' ']).to_owned();
        match (&change.before, &change.after) {
            (Some(before), Some(after)) if before.chars().count() + after.chars().count() > 60 => {
                format!("~ {what}\n    - {before}\n    + {after}\n")
            }
            (Some(before), Some(after)) => format!("~ {what}: {before} → {after}\n"),
            (Some(before), None) => with("-", before) + "\n",
            (None, after) => with("+", after.as_deref().unwrap_or_default()) + "\n",
        }
    };
    changes.iter().map(line).collect()
}

/// The things that some leaves belong to.
fn elements(leaves: &Leaves) -> BTreeSet<&[String]> {
    leaves.keys().filter_map(|path| path.get(..2)).collect()
}

/// What is most worth saying of a thing.
fn gist(leaves: &Leaves, element: &[String]) -> String {
    let of = |field: &str| leaves.get(&[element, &[field.to_owned()]].concat());
    let gist = leaves.get(element).or(of("value")).or(of("when")).or(of("name"));
    gist.map_or(String::new(), |leaf| leaf.shown.clone())
}

/// A path as one would say it.
fn words(path: &[String]) -> String {
    const SAID: &[(&str, &str)] = &[
        ("name", "scenario"),
        ("params", "param"),
        ("groups", "agents"),
        ("formations", "formation"),
        ("ends", "end"),
        ("learners", "learner"),
        ("controllers", "controller"),
        ("protocols", "evaluate"),
        ("claims", "expect"),
        ("stages", "stage"),
        ("variants", "variant"),
        ("tests", "test"),
        ("slots", "slot"),
        ("states", "state"),
        ("tracks", "track"),
        ("localisers", "localiser"),
        ("localised", "poses of"),
    ];
    #[rustfmt::skip]
    const UNSAID: &[&str] = &[
        "name", "value", "what", "settings", "kind", "when", "output", "control", "constraint", "displacements", "list",
    ];
    let mut words = Vec::new();
    for (depth, word) in path.iter().enumerate() {
        let said = SAID.iter().find(|(field, _)| depth != 1 && field == word).map(|(_, said)| *said);
        let nameless = depth == 1 && matches!(path[0].as_str(), "observe" | "require" | "claims");
        let unsaid = depth > 1 && UNSAID.contains(&word.as_str());
        if !nameless && !unsaid {
            words.push(said.unwrap_or(leaves::without_unit(word)));
        }
    }
    words.join(" ")
}
