//! A run gives the same bits in every vector width, on every machine. Alone in its binary: the choice of the width is global.
#![allow(clippy::unwrap_used)]

mod support;
#[path = "support/task.rs"]
mod task;

use mpgx_learn::{Activation, Config, LearnError, force_simd, simd_level};

/// A run's layers, batch and activation, and the bits of an action at its end. A change of these bits is a new
/// `numerics_version`.
const RUNS: [(&[usize], usize, Activation, u32); 3] = [
    (&[40, 30], 16, Activation::Relu, 3209380860),
    (&[40, 30], 16, Activation::Tanh, 1059788226),
    (&[17, 1, 7], 15, Activation::Tanh, 3199343788),
];

#[test]
fn a_run_is_the_same_in_every_width() {
    for (hidden, batch, activation, expected) in RUNS {
        let config = Config::from_extern(&support::settings("mpg", hidden, batch)).unwrap();
        let config = Config { activation, ..config };
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
            assert_eq!(action[0].to_bits(), expected, "{width} {hidden:?}");
            results.push((task::saved(&learner), learner.policy().to_bytes()));
        }
        assert!(results.windows(2).all(|pair| pair[0] == pair[1]), "{hidden:?}");
    }
    assert_eq!(force_simd("mmx"), Err(LearnError::NoSuchSimd { name: "mmx".to_owned() }));
}
