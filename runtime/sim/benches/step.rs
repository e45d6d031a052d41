//! Steps of the simulator on one core, by processor time: `cargo bench -p mpgx-sim --bench step [-- COUNT ...]`.
//!
//! One environment runs by itself, several run as a batch. Observation and reset are included, the actions are
//! the same in each step. The best and the median of several rounds of whole episodes.

use std::hint::black_box;
use std::time::Instant;

use mpgx_lang::source::NoFiles;
use mpgx_sim::{EpisodeKey, Mode, Task};

const SCENARIOS: [(&str, &str); 3] = [
    ("track_random", include_str!("../../../scenarios/track_random.scn")),
    ("square_unison_points", include_str!("../../../scenarios/square_unison_points.scn")),
    ("square_unison", include_str!("../../../scenarios/square_unison.scn")),
];
const ROUNDS: usize = 9;
/// Steps of environments in a round, at least.
const STEPS: usize = 400_000;

fn main() {
    let mut counts: Vec<usize> = std::env::args().filter_map(|argument| argument.parse().ok()).collect();
    if counts.is_empty() {
        counts = vec![1, 32, 4096];
    }
    println!("scenario environments ns_a_step million_agent_steps_a_second (median, best of {ROUNDS})");
    for (name, text) in SCENARIOS {
        let plan = mpgx_lang::compile(name, text.into(), &[], &NoFiles).plan;
        let Some(task) = plan.and_then(|plan| Task::new(&plan, &plan.world).ok()) else {
            println!("{name}: does not compile");
            continue;
        };
        for &count in &counts {
            let mut rounds: Vec<f64> = (0..ROUNDS as u32).map(|round| measure(&task, count, round)).collect();
            rounds.sort_by(f64::total_cmp);
            let rate = |nanoseconds: f64| 1e3 * task.agents() as f64 / nanoseconds;
            let (median, best) = (rounds[ROUNDS / 2], rounds[0]);
            println!("{name} {count} {median:.0} {:.2} {best:.0} {:.2}", rate(median), rate(best));
        }
    }
}

/// Nanoseconds of one step of one environment.
fn measure(task: &Task, count: usize, round: u32) -> f64 {
    let key = |k: usize| EpisodeKey { seed: round, episode: k as u32, ..EpisodeKey::default() };
    let actions: Vec<f32> = (0..count * task.action_len()).map(|k| (k as f32).sin()).collect();
    let mut states = vec![0.0; count * task.state_len()];
    let mut steps = 0;
    let mut number = 0;
    let begin = now_ns();
    if count == 1 {
        let mut episode = task.episode();
        while steps < STEPS && task.reset(&mut episode, key(number)).is_ok() {
            for _ in 0..task.horizon() {
                black_box(task.step(&mut episode, &actions, Mode::Evaluate));
                task.observe(&episode, &mut states);
            }
            steps += task.horizon();
            number += 1;
        }
    } else {
        let mut batch = task.batch(count);
        while steps < STEPS {
            let keys: Vec<EpisodeKey> = (number..number + count).map(key).collect();
            if task.reset_batch(&mut batch, &keys).is_err() {
                break;
            }
            for _ in 0..task.horizon() {
                black_box(task.step_batch(&mut batch, &actions, Mode::Evaluate));
                task.observe_batch(&batch, &mut states);
            }
            steps += count * task.horizon();
            number += count;
        }
    }
    black_box(&states);
    (now_ns() - begin) / steps as f64
}

/// Processor time of this process, which other work on the machine does not lengthen; wall time where it is
/// not told.
fn now_ns() -> f64 {
    thread_local!(static BEGIN: Instant = Instant::now());
    let told = std::fs::read_to_string("/proc/self/schedstat").ok();
    let told = told.and_then(|text| text.split_whitespace().next().and_then(|first| first.parse().ok()));
    told.unwrap_or_else(|| BEGIN.with(|begin| begin.elapsed().as_nanos() as f64))
}
