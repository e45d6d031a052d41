//! The studies that one scenario asks for: its own, and one for each variant.

use mpgx_lang::plan::Plan;

use crate::cell::check_names;
use crate::error::StudyError;

/// A study of a scenario: the name of the variant (empty: the scenario itself), the folder below that of the
/// scenario, and the Plan.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    pub variant: String,
    pub folder: String,
    pub plan: Plan,
}

/// The scenario itself, then its variants in order. A study knows nothing of variants and of tests.
pub fn parts(plan: &Plan) -> Result<Vec<Part>, StudyError> {
    check_names("variants", plan.variants.iter().map(|variant| (&variant.name, &variant.at)))?;
    let alone = |plan: &Plan| Plan { variants: Vec::new(), tests: Vec::new(), ..plan.clone() };
    let itself = Part { variant: String::new(), folder: String::new(), plan: alone(plan) };
    let variants = plan.variants.iter().map(|variant| Part {
        variant: variant.name.clone(),
        folder: format!("variants/{}", variant.name),
        plan: alone(&variant.plan),
    });
    Ok(std::iter::once(itself).chain(variants).collect())
}

#[cfg(test)]
mod tests {
    use mpgx_lang::plan::{Place, Test, Variant};

    use super::*;
    use crate::tests::sample;

    #[test]
    fn each_variant_is_a_study_of_its_own() {
        let variant = |name: &str, horizon| {
            let mut plan = sample::plan();
            plan.world.horizon = horizon;
            Variant { name: name.into(), text: String::new(), plan: Box::new(plan), at: Place::default() }
        };
        let test = Test { name: "stands".into(), steps: Vec::new(), at: Place::default() };
        let variants = vec![variant("short", 3), variant("long", 9)];
        let plan = Plan { variants, tests: vec![test], ..sample::plan() };
        let found = parts(&plan).unwrap();
        let told = found.iter().map(|part| (part.folder.as_str(), part.plan.world.horizon));
        assert_eq!(told.collect::<Vec<_>>(), [("", 7), ("variants/short", 3), ("variants/long", 9)]);
        assert_eq!(found[0].plan, sample::plan());

        let named = |a: &str, b: &str| {
            parts(&Plan { variants: vec![variant(a, 3), variant(b, 3)], ..sample::plan() }).unwrap_err()
        };
        assert!(named("a", "../b").to_string().contains("cannot name a folder"));
        assert!(named("a", "a").to_string().contains("two variants are called `a`"));
    }
}
