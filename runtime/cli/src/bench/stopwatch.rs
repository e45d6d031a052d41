//! Time of a piece of work: the median over windows of processor time, so that others on the machine count less.

use std::time::{Duration, Instant};

/// How long to measure: so many windows of so many seconds.
#[derive(Clone, Copy)]
pub struct Windows {
    pub count: usize,
    pub seconds: f64,
}

/// Time that this thread has had a core, where Linux tells it.
fn on_cpu() -> Option<Duration> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    text.split(' ').next()?.parse().ok().map(Duration::from_nanos)
}

/// Seconds of one run.
pub fn seconds_a_run(windows: Windows, mut run: impl FnMut()) -> f64 {
    let mut seconds: Vec<f64> =
        (0..windows.count.max(1)).map(|_| window(windows.seconds, &mut run)).collect();
    seconds.sort_by(f64::total_cmp);
    seconds[seconds.len() / 2]
}

/// Seconds of one run, as the mean over one window.
fn window(seconds: f64, run: &mut impl FnMut()) -> f64 {
    let (begin, busy, mut runs, mut many) = (Instant::now(), on_cpu(), 0u64, 1u64);
    loop {
        (0..many).for_each(|_| run());
        runs += many;
        let passed = begin.elapsed().as_secs_f64();
        if passed >= seconds {
            let taken = match (busy, on_cpu()) {
                (Some(before), Some(after)) => (after - before).as_secs_f64(),
                _ => passed,
            };
            return taken / runs as f64;
        }
        // Looks at the clock about thirty times.
        let left = (seconds - passed) * runs as f64 / passed.max(1e-9);
        many = (left as u64).clamp(1, 1 + runs / 4);
    }
}
