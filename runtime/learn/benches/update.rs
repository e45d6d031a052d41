//! Updates a second on one core: `cargo bench -p mpgx-learn [-- batch…]`. State 6, action 6, layers of 400 and 300.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use mpgx_lang::plan::{Extern, Setting};
use mpgx_learn::{Config, Learner, Transition, force_simd};

const STATE: usize = 6;
const ACTION: usize = 6;
const SPAN: Duration = Duration::from_secs(1);

fn config(batch: usize) -> Config {
    let numbers = [
        ("episodes", 1e9),
        ("steps", 1e9),
        ("gamma", 0.99),
        ("actor_rate", 1e-3),
        ("critic_rate", 1e-2),
        ("rate_end", 1.0),
        ("batch", batch as f64),
        ("replay", 1e6),
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
        ("delay_counter", "run"),
        ("inner_batch", "fresh"),
        ("explore_every", "episode"),
        ("noise_reading", "variance"),
        ("delta_kind", "element"),
    ];
    let mut settings = BTreeMap::new();
    settings.extend(numbers.map(|(name, value)| (name.to_owned(), Setting::Number(value))));
    settings.extend(words.map(|(name, word)| (name.to_owned(), Setting::Word(word.to_owned()))));
    for name in ["delta_reset", "target_actor", "terminal_mask"] {
        settings.insert(name.to_owned(), Setting::Truth(false));
    }
    settings.insert("hidden".to_owned(), Setting::List(vec![400.0, 300.0]));
    Config::from_extern(&Extern { name: "mpg".to_owned(), settings }).expect("the defaults of std")
}

/// Explores and steps through a made-up task until there have been updates for a while, several times;
/// the best and the median rate.
fn rate(batch: usize) -> (f64, f64) {
    let mut learner = Learner::new(config(batch), STATE, ACTION, 0, 0).expect("a valid learner");
    let mut state = [0.1f32; STATE];
    let mut step = |learner: &mut Learner| {
        let mut action = [0.0; ACTION];
        learner.explore(&state, &mut action);
        let next: [f32; STATE] = std::array::from_fn(|i| 0.9 * state[i] + 0.1 * action[i]);
        let reward = -next.iter().map(|x| x * x).sum::<f32>();
        learner
            .step(Transition { state: &state, action: &action, reward, next: &next, failure: false })
            .expect("finite");
        state = next;
    };
    while learner.updates() < 200 {
        step(&mut learner);
    }
    let mut rates: Vec<f64> = (0..5)
        .map(|_| {
            let (start, before) = (Instant::now(), learner.updates());
            while start.elapsed() < SPAN / 2 {
                step(&mut learner);
            }
            (learner.updates() - before) as f64 / start.elapsed().as_secs_f64()
        })
        .collect();
    rates.sort_by(f64::total_cmp);
    (rates[4], rates[2])
}

fn main() {
    let mut batches: Vec<usize> = std::env::args().filter_map(|batch| batch.parse().ok()).collect();
    if batches.is_empty() {
        batches = vec![16];
    }
    for batch in batches {
        for simd in ["avx512", "avx2"] {
            match force_simd(simd) {
                Ok(()) => {
                    let (best, median) = rate(batch);
                    println!("batch {batch:4}  {simd:7} {best:6.0} updates/s, median {median:6.0}");
                }
                Err(error) => println!("batch {batch:4}  {simd:7} {error}"),
            }
        }
    }
}
