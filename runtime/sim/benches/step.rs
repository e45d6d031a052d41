//! Steps a second of the simulator, one core: `cargo bench -p mpgx-sim`.

use std::time::Instant;

use mpgx_lang::source::NoFiles;
use mpgx_sim::{EpisodeKey, Mode, Task};

const SCENARIOS: [(&str, &str); 2] = [
    ("track_random", include_str!("../../../scenarios/track_random.scn")),
    ("square_unison", include_str!("../../../scenarios/square_unison.scn")),
];

fn main() {
    for (name, text) in SCENARIOS {
        measure(&format!("{name}, as it is"), text);
        measure(&format!("{name}, points"), &text.replace("unicycle(hand = 0.15 m)", "point"));
    }
}

fn measure(name: &str, text: &str) {
    let plan = mpgx_lang::compile(name, text.into(), &[], &NoFiles).plan;
    let Some(task) = plan.and_then(|plan| Task::new(&plan, &plan.world).ok()) else {
        println!("{name}: does not compile");
        return;
    };
    let mut episode = task.episode();
    let mut state = vec![0.0; task.state_len()];
    let action: Vec<f32> = (0..task.action_len()).map(|k| (k as f32).sin()).collect();
    let (mut steps, mut reward, begin) = (0u32, 0.0, Instant::now());
    for number in 0..1500 {
        let key = EpisodeKey { episode: number, ..EpisodeKey::default() };
        if task.reset(&mut episode, key).is_err() {
            continue;
        }
        for _ in 0..task.horizon() {
            reward += task.step(&mut episode, &action, Mode::Evaluate).reward;
            task.observe(&episode, &mut state);
            steps += 1;
        }
    }
    let nanoseconds = begin.elapsed().as_nanos() as f64 / f64::from(steps);
    println!("{name}: {nanoseconds:.0} ns a step (mean reward {:.3})", reward / f64::from(steps));
}
