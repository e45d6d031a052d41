//! Names of source files without the folder they were found in, so that a study is the same from any folder.

use std::path::{Component, Path};

use mpgx_lang::plan::{Place, Plan};
use serde_json::Value;

use crate::error::StudyError;

/// The Plan and its source with every file named relative to the scenario's folder.
pub(crate) fn without_folder(
    plan: &Plan,
    source: &[(String, String)],
) -> Result<(Plan, Vec<(String, String)>), StudyError> {
    let main = plan.learners.first().map(|learner| learner.at.file.clone()).unwrap_or_default();
    let folder = Path::new(&main).parent().unwrap_or(Path::new("")).to_path_buf();
    let unclear = |why: serde_json::Error| {
        let cause = format!("the Plan cannot be frozen, perhaps for a number that is not finite: {why}");
        StudyError::Plan { cause, at: Place::default() }
    };
    let mut tree = serde_json::to_value(plan).map_err(unclear)?;
    rename(&mut tree, &folder);
    let plan = serde_json::from_value(tree).map_err(unclear)?;
    Ok((plan, source.iter().map(|(file, text)| (plain(file, &folder), text.clone())).collect()))
}

/// Renames the file of every place, wherever it stands: what has a file, a line and a column is one.
fn rename(value: &mut Value, folder: &Path) {
    match value {
        Value::Object(fields) if fields.contains_key("line") && fields.contains_key("column") => {
            if let Some(Value::String(file)) = fields.get_mut("file") {
                *file = plain(file, folder);
            }
        }
        Value::Object(fields) => fields.values_mut().for_each(|value| rename(value, folder)),
        Value::Array(values) => values.iter_mut().for_each(|value| rename(value, folder)),
        _ => {}
    }
}

/// The path below `folder` if it lies there and leads nowhere else; the bare file name otherwise.
fn plain(file: &str, folder: &Path) -> String {
    let path = Path::new(file);
    let below = path.strip_prefix(folder).unwrap_or(path);
    if below.components().all(|part| matches!(part, Component::Normal(_))) {
        return below.to_string_lossy().into_owned();
    }
    path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use mpgx_lang::plan::Variant;

    use super::*;
    use crate::tests::sample;

    #[test]
    fn names_lose_the_scenarios_folder() {
        for (file, main, expected) in [
            ("square.scn", "square.scn", "square.scn"),
            ("a/b/square.scn", "a/b/square.scn", "square.scn"),
            ("a/b/shapes/mine.scn", "a/b/square.scn", "shapes/mine.scn"),
            ("shapes/mine.scn", "a/b/square.scn", "shapes/mine.scn"),
            ("/home/x/square.scn", "/home/x/square.scn", "square.scn"),
            ("../square.scn", "../square.scn", "square.scn"),
            ("../other/mine.scn", "here/square.scn", "mine.scn"),
            ("", "square.scn", ""),
        ] {
            let folder = Path::new(main).parent().unwrap();
            assert_eq!(plain(file, folder), expected, "{file} of {main}");
        }
    }

    /// In stages, protocols and variants, too; and nothing else changes, not a bit of a number.
    /// Seen to fail when nothing is renamed.
    #[test]
    fn every_place_is_renamed() {
        let mut plan = sample::shared();
        plan.world.dt_s = 0.1 + f64::EPSILON;
        plan.world.safety_m = f64::from_bits(1);
        let at = plan.learners[0].at.clone();
        let alone = plan.clone();
        plan.variants.push(Variant { name: "b".into(), text: "".into(), plan: Box::new(alone), at });
        let (renamed, _) = without_folder(&plan, &[]).unwrap();
        let (before, after) = (plan.to_ron(), renamed.to_ron());
        assert!(before.contains("folder/sample.scn") && !after.contains("folder"));
        assert_eq!(before.replace("folder/sample.scn", "sample.scn"), after);
        plan.world.safety_m = f64::NAN;
        assert!(without_folder(&plan, &[]).unwrap_err().to_string().contains("not finite"));
    }
}
