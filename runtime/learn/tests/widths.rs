//! A run gives the same bits in every vector width, on every machine. Alone in its binary: the choice of the width is global.
#![allow(clippy::unwrap_used)]

mod support;
#[path = "support/task.rs"]
mod task;

use mpgx_learn::{Config, LearnError, force_simd, simd_level};

#[test]
fn a_run_is_the_same_in_every_width() {
    let config = Config::from_extern(&support::settings("mpg", &[40, 30], 16)).unwrap();
    let mut results = Vec::new();
    for width in ["avx512", "avx2", "scalar"] {
        if let Err(error) = force_simd(width) {
            eprintln!("not compared: {error}");
            continue;
        }
        assert_eq!(simd_level(), width);
        let mut learner = task::learner(&config, 0);
        task::Task::new().steps(&mut learner, 200);
        let mut action = [0.0];
        learner.act(&[0.5, 1.0], &mut action);
        // A change of these bits is a new `numerics_version`.
        assert_eq!(action[0].to_bits(), 3209380860, "{width}");
        results.push((task::saved(&learner), learner.policy().to_bytes()));
    }
    assert!(results.windows(2).all(|pair| pair[0] == pair[1]));
    assert_eq!(force_simd("mmx"), Err(LearnError::NoSuchSimd { name: "mmx".to_owned() }));
}
