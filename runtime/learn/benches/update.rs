//! Updates a second on one core: `cargo bench -p mpgx-learn [-- batch…]`. State 6, action 6, layers of 400 and 300.

#[path = "../tests/support/mod.rs"]
mod support;

use std::time::{Duration, Instant};

use mpgx_learn::{Backend, Config, LearnError, Learner, Transition, force_simd};

const STATE: usize = 6;
const ACTION: usize = 6;
const SPAN: Duration = Duration::from_millis(100);

/// Time that this thread has had a core, where Linux tells it: others on the machine do not count.
fn on_cpu() -> Option<Duration> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    text.split(' ').next()?.parse().ok().map(Duration::from_nanos)
}

/// Explores and steps through a made-up task until there have been updates for a while, several times;
/// the best and the median rate.
fn rate(batch: usize, backend: Backend) -> Result<(f64, f64), LearnError> {
    let config = Config::from_extern(&support::settings("mpg", &[400, 300], batch))?;
    let config = Config { backend, ..config };
    let mut learner = Learner::new(config, STATE, ACTION, 0, 0)?;
    let mut state = [0.1f32; STATE];
    let mut step = |learner: &mut Learner| {
        let mut action = [0.0; ACTION];
        learner.explore(&state, &mut action);
        let next: [f32; STATE] = std::array::from_fn(|i| 0.9 * state[i] + 0.1 * action[i]);
        let reward = -next.iter().map(|x| x * x).sum::<f32>();
        let transition = Transition { state: &state, action: &action, reward, next: &next, failure: false };
        let done = learner.step([transition]);
        state = next;
        done
    };
    while learner.updates() < 200 {
        step(&mut learner)?;
    }
    let mut rates = Vec::new();
    for _ in 0..21 {
        let (start, busy, before) = (Instant::now(), on_cpu(), learner.updates());
        while start.elapsed() < SPAN {
            step(&mut learner)?;
        }
        let seconds = match (busy, on_cpu()) {
            (Some(before), Some(after)) => (after - before).as_secs_f64(),
            _ => start.elapsed().as_secs_f64(),
        };
        rates.push((learner.updates() - before) as f64 / seconds);
    }
    rates.sort_by(f64::total_cmp);
    Ok((rates[20], rates[10]))
}

fn main() -> Result<(), LearnError> {
    let mut batches: Vec<usize> = std::env::args().filter_map(|batch| batch.parse().ok()).collect();
    if batches.is_empty() {
        batches = vec![16];
    }
    for batch in batches {
        for simd in ["avx512", "avx2"] {
            if let Err(error) = force_simd(simd) {
                println!("batch {batch:4}  {simd:7} {error}");
                continue;
            }
            let (best, median) = rate(batch, Backend::Native)?;
            println!("batch {batch:4}  {simd:7} {best:6.0} updates/s, median {median:6.0}");
        }
        let (best, median) = rate(batch, Backend::Dfdx)?;
        println!("batch {batch:4}  dfdx    {best:6.0} updates/s, median {median:6.0}");
    }
    Ok(())
}
