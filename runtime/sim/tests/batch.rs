//! A batch gives every environment the bits that it gets by itself, in all scenarios.

#![allow(clippy::unwrap_used)]

use std::path::{Path, PathBuf};

use mpgx_lang::plan::{Plan, World};
use mpgx_lang::problem::{Style, render};
use mpgx_lang::source::NoFiles;
use mpgx_random::{Address, Purpose};
use mpgx_sim::{Episode, EpisodeKey, Mode, Task};

/// Two whole tiles and a part of one.
const COUNT: usize = 35;
/// Steps of an environment of ten agents or fewer; with more it takes fewer.
const STEPS: usize = 60;

fn plans() -> Vec<(PathBuf, Plan)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut files = Vec::new();
    for folder in ["scenarios", "tests/golden/plan", "runtime/sim/tests"] {
        let entries = std::fs::read_dir(root.join(folder)).unwrap();
        files.extend(entries.map(|entry| entry.unwrap().path()));
    }
    files.retain(|file| file.extension().is_some_and(|extension| extension == "scn"));
    files.sort();
    let plan = |file: PathBuf| {
        let text = std::fs::read_to_string(&file).unwrap();
        let compiled = mpgx_lang::compile("test.scn", text, &[], &NoFiles);
        let problems = || render(&compiled.problems, &compiled.sources, Style::Plain);
        match compiled.plan {
            Some(plan) => (file, plan),
            None => panic!("{}: {}", file.display(), problems()),
        }
    };
    files.into_iter().map(plan).collect()
}

fn worlds(plan: &Plan) -> impl Iterator<Item = &World> {
    std::iter::once(&plan.world).chain(plan.protocols.iter().filter_map(|it| it.world.as_deref()))
}

fn key(episode: usize) -> EpisodeKey {
    EpisodeKey { master: 3, protocol: 1, seed: 2, episode: episode as u32 }
}

/// What an environment is like, to the last bit: no two numbers are written the same.
fn bits(episode: &Episode) -> String {
    format!("{episode:?}")
}

fn observed(task: &Task, episode: &Episode) -> Vec<u32> {
    let mut state = vec![0.0; task.state_len()];
    let mut all = Vec::new();
    for member in 0..task.shared().unwrap_or(1) {
        task.observe_member(episode, member, &mut state);
        all.extend(state.iter().map(|x| x.to_bits()));
    }
    all
}

/// Steps the same episodes in a batch and one by one.
fn compare(name: &str, task: &Task, mode: Mode) {
    let mut batch = task.batch(COUNT);
    task.reset_batch(&mut batch, &(0..COUNT).map(key).collect::<Vec<_>>()).unwrap();
    let mut alone: Vec<Episode> = (0..COUNT).map(|_| task.episode()).collect();
    for (number, episode) in alone.iter_mut().enumerate() {
        task.reset(episode, key(number)).unwrap();
    }
    let here = Address {
        master: 9,
        purpose: Purpose::Exploration,
        protocol: 0,
        part: 0,
        seed: 0,
        episode: 0,
        step: 0,
    };
    let mut noise = here.stream();
    let mut copy = task.episode();
    let mut states = vec![0.0; COUNT * task.shared().unwrap_or(1) * task.state_len()];
    let steps = (10 * STEPS / task.agents().max(10)).clamp(2, STEPS.min(task.horizon()).max(2));
    for step in 0..steps {
        let row = task.action_len();
        let actions: Vec<f32> = (0..COUNT * row).map(|_| noise.normal() as f32).collect();
        let steps = task.step_batch(&mut batch, &actions, mode).to_vec();
        task.observe_batch(&batch, &mut states);
        let rows = states.chunks(states.len() / COUNT);
        for (number, (episode, (found, states))) in alone.iter_mut().zip(steps.iter().zip(rows)).enumerate() {
            let expected = task.step(episode, &actions[number * row..][..row], mode);
            let place = format!("{name}, {mode:?}, step {step} of episode {number}");
            assert_eq!(format!("{found:?}"), format!("{expected:?}"), "{place}");
            batch.copy_to(number, &mut copy);
            assert_eq!(bits(&copy), bits(episode), "{place}");
            assert!(batch.terms(number).eq(episode.terms().iter().copied()), "{place}");
            let states: Vec<u32> = states.iter().map(|x| x.to_bits()).collect();
            assert_eq!(states, observed(task, episode), "{place}");
        }
    }
}

#[test]
fn a_batch_gives_the_bits_of_one_by_one() {
    let plans = plans();
    assert!(plans.len() > 15, "{} scenarios", plans.len());
    for (file, plan) in &plans {
        for world in worlds(plan) {
            let task = Task::new(plan, world).unwrap();
            for mode in [Mode::Train, Mode::Evaluate] {
                compare(&file.display().to_string(), &task, mode);
            }
        }
    }
}
