//! The guard of `numerics_version`: the numbers of two short studies.

use mpgx_lang::plan::{Plan, Setting};
use mpgx_learn::Policy;

use super::sample::*;
use crate::storage::SimulatedDisk;
use crate::*;

const GOLDEN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fixtures/numerics.txt");
const CHANGELOG: &str = include_str!("../../../../CHANGELOG.md");

/// What training and evaluation computed, whatever form it is stored in: the returns of all episodes, and
/// what each policy does in some states. MPG with ReLU, TD3 with tanh; robots that share, a stage, schedules.
fn numbers() -> blake3::Hash {
    let mut hasher = blake3::Hasher::new();
    for mut plan in [plan(), shared()] {
        plan.learners[1].what.settings.insert("activation".into(), Setting::Word("tanh".into()));
        add(&plan, &mut hasher);
    }
    hasher.finalize()
}

fn add(plan: &Plan, hasher: &mut blake3::Hasher) {
    let disk = SimulatedDisk::default();
    hash_of(&disk, plan);
    let study = load(&disk).unwrap();
    for cell in cells(plan).unwrap() {
        let record = &study.records[&cell.id];
        let evaluated = record.protocols.values().map(|evaluation| &evaluation.returns);
        for returns in record.training.iter().map(|training| &training.returns).chain(evaluated) {
            returns.iter().for_each(|value| _ = hasher.update(&value.to_bits().to_le_bytes()));
        }
        let Ok(policy) = read_policy(&disk, &cell) else { continue };
        let mut policy = Policy::from_bytes(&policy).unwrap();
        let rows = 16;
        let states: Vec<f32> = (0..rows * policy.state_len()).map(|k| k as f32 / 10.0 - 1.0).collect();
        let mut actions = vec![0.0; rows * policy.action_len()];
        policy.act(&states, rows, &mut actions);
        actions.iter().for_each(|u| _ = hasher.update(&u.to_bits().to_le_bytes()));
    }
}

#[test]
fn other_numbers_are_another_numerics_version() {
    let found = format!("numerics_version {NUMERICS_VERSION}\n{}\n", numbers().to_hex());
    let golden = std::fs::read_to_string(GOLDEN).unwrap_or_default();
    let version = |text: &str| text.lines().next().unwrap_or_default().to_owned();
    if found != golden {
        assert!(
            version(&found) != version(&golden),
            "the numbers have changed. If they should have: raise NUMERICS_VERSION in runtime/study/src/sealed.rs, run \
             MPGX_BLESS=1 cargo test -p mpgx-study numerics, and say in CHANGELOG.md what changed and why"
        );
        assert!(
            std::env::var_os("MPGX_BLESS").is_some(),
            "another NUMERICS_VERSION needs its numbers: MPGX_BLESS=1 cargo test -p mpgx-study numerics"
        );
        std::fs::write(GOLDEN, &found).unwrap();
    }
    let named = format!("`numerics_version` {NUMERICS_VERSION}");
    assert!(CHANGELOG.contains(&named), "CHANGELOG.md does not name {named}");
}
