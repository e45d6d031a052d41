//! Settings of a learner without the language.

use std::collections::BTreeMap;

use mpgx_lang::plan::{Extern, Setting};

/// The defaults of `stdlib/learn.scn`, with these layers and batch.
pub fn settings(algorithm: &str, hidden: &[usize], batch: usize) -> Extern {
    let numbers = [
        ("episodes", 200.0),
        ("steps", 1e9),
        ("gamma", 0.99),
        ("actor_rate", 1e-3),
        ("critic_rate", 1e-2),
        ("rate_end", 1.0),
        ("batch", batch as f64),
        ("replay", 1e6),
        ("warm_up", 0.0),
        ("tau", 0.005),
        ("inner", 1.0),
        ("delay", 2.0),
        ("train_noise", 0.2),
        ("train_clip", 1e9),
        ("explore_noise", 2.0),
        ("explore_min", 0.01),
        ("explore_decay", 0.99),
    ];
    let words = [
        ("activation", "relu"),
        ("polyak", "target"),
        ("delay_counter", "run"),
        ("inner_batch", "fresh"),
        ("critic_pair", "taken"),
        ("explore_bound", "max"),
        ("explore_every", "episode"),
        ("noise_reading", "variance"),
        ("delta_kind", "element"),
        ("backend", "native"),
    ];
    let mut settings = BTreeMap::new();
    settings.extend(numbers.map(|(name, value)| (name.to_owned(), Setting::Number(value))));
    settings.extend(words.map(|(name, word)| (name.to_owned(), Setting::Word(word.to_owned()))));
    for name in ["delta_reset", "target_actor", "terminal_mask"] {
        settings.insert(name.to_owned(), Setting::Truth(false));
    }
    let hidden = hidden.iter().map(|&units| units as f64).collect();
    settings.insert("hidden".to_owned(), Setting::List(hidden));
    Extern { name: algorithm.to_owned(), settings }
}
