//! The hash of what a scenario means.

use serde_json::{Map, Value};

use crate::plan::Plan;

/// BLAKE3 of the Plan without places, comments, texts as written, the names of index variables and tests, as
/// hexadecimal digits. Layout, comments, line ends and the names of files do not change it; whatever changes a run
/// does.
pub fn meaning_hash(plan: &Plan) -> String {
    let mut tree = serde_json::to_value(plan).unwrap_or_default();
    strip(&mut tree);
    blake3::hash(tree.to_string().as_bytes()).to_hex().to_string()
}

/// Whether a field of the Plan says where something stands, or repeats it for people.
pub(crate) fn is_remark(field: &str) -> bool {
    matches!(field, "at" | "doc" | "text")
}

/// Whether this is an index variable: its number, and its name in the source.
pub(crate) fn is_binder(fields: &Map<String, Value>) -> bool {
    fields.len() == 2 && fields.contains_key("id") && fields.contains_key("name")
}

fn strip(value: &mut Value) {
    match value {
        Value::Object(fields) => {
            let binder = is_binder(fields);
            fields.retain(|field, _| !(is_remark(field) || binder && field == "name"));
            if let Some(Value::Array(tests)) = fields.get_mut("tests") {
                tests.clear();
            }
            fields.values_mut().for_each(strip);
        }
        Value::Array(values) => values.iter_mut().for_each(strip),
        _ => {}
    }
}
