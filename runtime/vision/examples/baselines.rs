//! What a network has to be better than, on trials never seen:
//! `cargo run --release -p mpgx-vision --example baselines`
//!
//! Retrieval knows 27 trials, three of each lighting and kind of trajectory, every third image; both baselines answer for
//! nine other trials, in rooms with other furniture, pictures and weather.

use std::error::Error;

use mpgx_vision::baseline::{Retrieval, dead_reckoning};
use mpgx_vision::measure::{COMPONENTS, Localisation, Ranges, measure, measure_groups};
use mpgx_vision::{
    CameraConfig, PoseQ, TimeOfDay, TrajectoryConfig, TrajectoryKind, Trial, TrialConfig, TrialKey,
    WorldConfig,
};

/// A group of trials, a true pose and an estimate.
type Answer = (String, PoseQ, PoseQ);

fn main() -> Result<(), Box<dyn Error>> {
    let mut known = Retrieval::default();
    let mut poses = Vec::new();
    for episode in 0..3 {
        for trial in trials(0, episode)? {
            for number in (0..trial.frames).step_by(3) {
                let frame = trial.frame(number);
                known.add(&frame.image, frame.pose);
                poses.push(frame.pose);
            }
        }
    }
    let ranges = Ranges::of(&poses).ok_or("no poses")?;
    let (mut retrieved, mut reckoned): (Vec<Answer>, Vec<Answer>) = Default::default();
    for trial in trials(1, 0)? {
        let truth: Vec<(f64, PoseQ)> =
            (0..trial.frames).map(|number| (trial.time_s(number), trial.pose(number))).collect();
        let group = |name: &str| format!("{:9} {name}", "");
        let groups = [group(&trial.tags.lighting), group(&trial.tags.trajectory)];
        for number in (0..trial.frames).step_by(5) {
            let frame = trial.frame(number);
            let estimate = known.estimate(&frame.image).ok_or("nothing known")?;
            retrieved.extend(groups.iter().map(|group| (group.clone(), frame.pose, estimate)));
        }
        for (estimate, (_, pose)) in dead_reckoning(&truth, 5.0).into_iter().zip(truth) {
            reckoned.extend(groups.iter().map(|group| (group.clone(), pose, estimate)));
        }
    }
    print!("{:22}", "mean error, % of range");
    for component in COMPONENTS {
        print!("{component:>7}");
    }
    println!("  median m   rad  within 5 cm and 5°");
    for (name, answers) in [("retrieval", retrieved), ("dead reckoning, 5 s", reckoned)] {
        let pairs: Vec<(PoseQ, PoseQ)> =
            answers.iter().map(|&(_, truth, estimate)| (truth, estimate)).collect();
        print_line(name, measure(&pairs, &ranges));
        for (group, found) in measure_groups(answers, &ranges) {
            print_line(&group, found);
        }
    }
    println!("ranges, low:  {:6.2?}\n        high: {:6.2?}", ranges.low, ranges.high);
    Ok(())
}

/// One trial of each lighting and kind of trajectory.
fn trials(protocol: u16, episode: u32) -> Result<Vec<Trial>, Box<dyn Error>> {
    let mut made = Vec::new();
    for time_of_day in TimeOfDay::ALL {
        for kind in TrajectoryKind::ALL {
            let trajectory = TrajectoryConfig { kind, ..TrajectoryConfig::default() };
            let config = TrialConfig { time_of_day, trajectory, ..TrialConfig::default() };
            let key = TrialKey { protocol, episode: 9 * episode + made.len() as u32, ..TrialKey::default() };
            made.push(Trial::new(&WorldConfig::default(), &CameraConfig::default(), &config, key)?);
        }
    }
    Ok(made)
}

fn print_line(name: &str, found: Option<Localisation>) {
    let Some(found) = found else { return println!("{name:22} nothing to measure") };
    print!("{name:22}");
    for percent in found.percent {
        print!("{:7.2}", percent.unwrap_or(f64::NAN));
    }
    let (metres, radians) = (found.translation.median(), found.rotation.median());
    println!("  {metres:8.3} {radians:5.3}  {:.1} %", 100.0 * found.recall_5cm_5deg);
}
