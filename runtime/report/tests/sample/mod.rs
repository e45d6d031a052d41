//! A made-up study of the right shape: followers that chase their slots with more or less lag and noise.

use std::collections::BTreeMap;

use mpgx_lang::plan::{Method, Plan, Protocol};
use mpgx_lang::source::NoFiles;
use mpgx_random::{Address, Purpose, Stream};
use mpgx_report::{Input, Provenance};
use mpgx_study::Study;
use mpgx_study::record::{
    CellRecord, Evaluation, Failure, Health, LocaliserRecord, Timing, Training, Trajectory,
};
use mpgx_study::summarise::summarise;
use mpgx_study::summary::Summary;

pub mod hostile;

const SOURCE: &str = include_str!("../../../../scenarios/square_unison.scn");
const FILE: &str = "square_unison.scn";
const DT: f64 = 0.1;
const STEPS: usize = 200;
const EPISODES: usize = 10;
const SAFETY: f64 = 0.1;
const SIDE: f64 = 0.4;
const SLOTS: [[f64; 2]; 3] = [[-SIDE, 0.0], [-SIDE, -SIDE], [0.0, -SIDE]];

pub struct Sample {
    pub plan: Plan,
    pub source: Vec<(String, String)>,
    pub records: BTreeMap<String, CellRecord>,
    pub timings: BTreeMap<String, Timing>,
    pub localisers: BTreeMap<String, LocaliserRecord>,
    pub summary: Summary,
}

impl Sample {
    pub fn new(plan: Plan, records: BTreeMap<String, CellRecord>) -> Sample {
        let timings = records
            .iter()
            .map(|(id, record)| {
                let training_s =
                    if record.training.is_some() { 9.5 + f64::from(record.seed) * 0.1 } else { 0.0 };
                (id.clone(), Timing { training_s, evaluation_s: 0.4 })
            })
            .collect();
        let summary = Summary {
            version: "0.1.0".into(),
            numerics_version: 1,
            meaning_hash: "5d1e0c3b9f".repeat(6),
            study_hash: "a07c44e2d8".repeat(6),
            ..summarise(&plan, &records, &timings)
        };
        let source = vec![(FILE.to_string(), SOURCE.to_string())];
        Sample { plan, source, records, timings, localisers: BTreeMap::new(), summary }
    }

    /// The same as it is read from a folder.
    pub fn finished(self) -> Study {
        let Sample { plan, source, records, timings, localisers, summary } = self;
        Study { plan, source, records, timings, localisers, summary: Some(summary) }
    }

    pub fn input(&self) -> Input<'_> {
        Input {
            plan: &self.plan,
            source: &self.source,
            records: &self.records,
            timings: &self.timings,
            localisers: &self.localisers,
            summary: &self.summary,
            provenance: Provenance {
                command: "mpgx run square_unison.scn".into(),
                cpu: "two cores of a common processor".into(),
                threads: "2".into(),
                duration: "3 min 20 s".into(),
            },
            published: None,
        }
    }
}

/// A whole study: `seeds` seeds of two learners, two controllers, and the named protocols.
pub fn study(seeds: u32, protocols: &[&str]) -> Sample {
    learners(&["mpg", "td3"], seeds, protocols)
}

/// The same with other learners.
pub fn learners(labels: &[&str], seeds: u32, protocols: &[&str]) -> Sample {
    let mut plan = plan(seeds as usize, protocols);
    let one = plan.learners[0].clone();
    plan.learners = labels.iter().map(|label| Method { label: label.to_string(), ..one.clone() }).collect();
    let mut records = BTreeMap::new();
    for seed in 0..seeds {
        for (k, label) in labels.iter().enumerate() {
            records
                .insert(format!("{label}-{seed:03}"), cell(label, seed, 0.02 + 0.03 * k as f64, protocols));
        }
    }
    records.insert("oracle".into(), controller("oracle", 0.0, protocols));
    records.insert("proportional".into(), controller("proportional", 0.09, protocols));
    Sample::new(plan, records)
}

/// A scenario without any record.
pub fn untrained(source: &str) -> Sample {
    let plan = mpgx_lang::compile("o.scn", source.to_string(), &[], &NoFiles).plan.unwrap();
    Sample::new(plan, BTreeMap::new())
}

/// A controller's study of a world with obstacles that nothing moves in.
pub fn obstacles() -> Sample {
    let mut plan = untrained(include_str!("../../../../scenarios/regulation_obstacles.scn")).plan;
    plan.protocols.truncate(1);
    let world = &plan.world;
    let (steps, agents) = (3, world.agents());
    let trajectory = Trajectory {
        agents: (0..(steps + 1) * agents).map(|k| [(k % agents) as f32 * 0.3, 0.5, 0.0]).collect(),
        slots: vec![[0.0; 2]; steps + 1],
        terms: vec![-0.5; steps * world.reward.len()],
        error_m: vec![0.5; steps],
        actions: vec![0.0; steps * 2],
        collisions: vec![0; steps],
    };
    let evaluation =
        Evaluation { trajectories: vec![trajectory], error_m: vec![0.5], ..Evaluation::default() };
    let record = CellRecord {
        method: "proportional".into(),
        seed: 0,
        training: None,
        failure: None,
        protocols: [(plan.protocols[0].name.clone(), evaluation)].into(),
    };
    Sample::new(plan, [("proportional-000".to_string(), record)].into())
}

/// One that failed with NaN at a place of the scenario.
pub fn fail(record: &mut CellRecord) {
    record.failure = Some(Failure {
        step: 812,
        cause: "the reward term `gap` is not a number".into(),
        at: format!("{FILE}:36:5"),
    });
    record.protocols.clear();
    if let Some(training) = &mut record.training {
        training.steps.truncate(30);
    }
}

fn stream(method: &str, seed: u32, episode: u32, step: u64) -> Stream {
    let part = method.bytes().map(u16::from).sum();
    Address { master: 7, purpose: Purpose::Motion, protocol: 0, part, seed, episode, step }.stream()
}

fn cell(method: &str, seed: u32, lag: f64, protocols: &[&str]) -> CellRecord {
    CellRecord { training: Some(training(method, seed, lag)), ..controller_of(method, seed, lag, protocols) }
}

fn controller(method: &str, lag: f64, protocols: &[&str]) -> CellRecord {
    controller_of(method, 0, lag, protocols)
}

fn controller_of(method: &str, seed: u32, lag: f64, protocols: &[&str]) -> CellRecord {
    let lag = lag * (1.0 + 0.3 * stream(method, seed, 0, 0).uniform());
    let evaluate = |(k, name): (usize, &&str)| (name.to_string(), evaluation(method, seed, k as u32, lag));
    CellRecord {
        method: method.into(),
        seed,
        training: None,
        failure: None,
        protocols: protocols.iter().enumerate().map(evaluate).collect(),
    }
}

fn training(method: &str, seed: u32, lag: f64) -> Training {
    let mut noise = stream(method, seed, 1, 0);
    let mut training = Training { updates: 20_000, ..Training::default() };
    let mut steps = 0;
    while steps < 20_000 {
        let progress = steps as f64 / 20_000.0;
        let error = 0.05 + lag + 0.9 * libm::exp(-9.0 * progress) * (1.0 + 0.5 * noise.uniform());
        let failed = noise.uniform() < 0.8 * libm::exp(-12.0 * progress);
        let length = if failed { 10 + noise.below(100) } else { STEPS as u64 };
        steps += length;
        let crashes = noise.below(1 + (30.0 * libm::exp(-10.0 * progress)) as u64) as f64;
        let gap = -3.0 * error * length as f64 * (0.9 + 0.2 * noise.uniform());
        training.steps.push(steps);
        training.returns.push(gap - crashes - f64::from(u8::from(failed)));
        training.error_m.push(error * (0.9 + 0.2 * noise.uniform()));
        training.terms.push(vec![gap, -crashes]);
        training.ended.push(failed.then_some(1));
    }
    training.health = health(&mut noise);
    training
}

fn health(noise: &mut Stream) -> Health {
    let updates: Vec<u64> = (1..=40).map(|k| 500 * k).collect();
    let mut columns = BTreeMap::new();
    let curve = |noise: &mut Stream, from: f64, to: f64, spread: f64| -> Vec<f32> {
        let value = |&u: &u64| to + (from - to) * libm::exp(-(u as f64) / 3000.0);
        updates.iter().map(|u| (value(u) + spread * noise.normal()) as f32).collect()
    };
    for (name, from, to, spread) in [
        ("q/q1", -0.1, -2.1, 0.05),
        ("q/q2", -0.2, -2.15, 0.05),
        ("q/gap", 0.8, 0.07, 0.01),
        ("q/delta_adj", 0.7, 0.06, 0.01),
        ("noise/explore", 2.0, 0.05, 0.0),
        ("loss/critic", 1.5, 0.02, 0.004),
    ] {
        columns.insert(name.into(), curve(noise, from, to, spread));
    }
    Health { updates, columns }
}

fn evaluation(method: &str, seed: u32, protocol: u32, lag: f64) -> Evaluation {
    let mut evaluation = Evaluation::default();
    for episode in 0..EPISODES as u32 {
        let trajectory = trajectory(method, seed, protocol, episode, lag);
        let gap: f64 = trajectory.terms.iter().step_by(2).map(|&x| f64::from(x)).sum();
        let crash: f64 = trajectory.terms.iter().skip(1).step_by(2).map(|&x| f64::from(x)).sum();
        let late = &trajectory.error_m[STEPS / 2..];
        let steps =
            |from: usize| trajectory.collisions[from..].iter().filter(|&&pairs| pairs > 0).count() as u32;
        evaluation.returns.push(gap + crash);
        evaluation.terms.push(vec![gap, crash]);
        evaluation.error_m.push(late.iter().map(|&x| f64::from(x)).sum::<f64>() / late.len() as f64);
        evaluation.collision_steps.push(steps(0));
        evaluation.late_collision_steps.push(steps(40));
        evaluation.outside_steps.push(0);
        if episode < 3 {
            evaluation.trajectories.push(trajectory);
        }
    }
    evaluation
}

/// Followers that move a share of the way to where their slot was, plus noise. The leader is the same for all.
fn trajectory(method: &str, seed: u32, protocol: u32, episode: u32, lag: f64) -> Trajectory {
    let mut wind = stream("leader", 0, episode, u64::from(protocol));
    let mut noise = stream(method, seed, episode, 1 + u64::from(protocol));
    let mut leader = [0.6 * (2.0 * wind.uniform() - 1.0), 0.6 * (2.0 * wind.uniform() - 1.0)];
    let mut phase = std::f64::consts::TAU * wind.uniform();
    if protocol > 0 {
        leader = [0.6 * libm::cos(phase), 0.6 * libm::sin(phase)];
    }
    let mut followers: Vec<[f64; 3]> = SLOTS
        .iter()
        .map(|slot| {
            let place = |k: usize| leader[k] + slot[k];
            let mut off = || 0.4 * wind.uniform() - 0.2;
            [place(0) + off(), place(1) + off(), 3.0 * off()]
        })
        .collect();
    let mut out = Trajectory::default();
    let frame = |out: &mut Trajectory, leader: [f64; 2], followers: &[[f64; 3]]| {
        out.agents.push([leader[0] as f32, leader[1] as f32, 0.0]);
        out.agents.extend(followers.iter().map(|f| f.map(|x| x as f32)));
        out.slots.extend(SLOTS.map(|slot| [(leader[0] + slot[0]) as f32, (leader[1] + slot[1]) as f32]));
    };
    frame(&mut out, leader, &followers);
    for _ in 0..STEPS {
        let before = leader;
        if protocol > 0 {
            phase += 0.05;
            leader = [0.6 * libm::cos(phase), 0.6 * libm::sin(phase)];
        } else {
            for x in &mut leader {
                *x = (*x + DT * wind.normal().clamp(-0.7, 0.7)).clamp(-1.0, 1.0);
            }
        }
        let mut error = 0.0;
        for (follower, slot) in followers.iter_mut().zip(SLOTS) {
            let mut moved = [0.0; 2];
            for k in 0..2 {
                let wanted = before[k] + slot[k] - follower[k] + lag * noise.normal();
                moved[k] = wanted.clamp(-0.07, 0.07);
                follower[k] += moved[k];
                out.actions.push((moved[k] / 0.07) as f32);
            }
            if libm::hypot(moved[0], moved[1]) > 0.01 {
                let turn = libm::atan2(moved[1], moved[0]) - follower[2];
                follower[2] += 0.5 * libm::atan2(libm::sin(turn), libm::cos(turn));
            }
            error += libm::hypot(follower[0] - leader[0] - slot[0], follower[1] - leader[1] - slot[1]);
        }
        frame(&mut out, leader, &followers);
        let mut places = vec![leader];
        places.extend(followers.iter().map(|f| [f[0], f[1]]));
        let close = |i: usize, j: usize| {
            libm::hypot(places[i][0] - places[j][0], places[i][1] - places[j][1]) < SAFETY
        };
        let pairs =
            (0..4).flat_map(|i| (i + 1..4).map(move |j| (i, j))).filter(|&(i, j)| close(i, j)).count();
        out.error_m.push((error / 3.0) as f32);
        out.terms.extend([-error as f32, -(pairs as f32)]);
        out.collisions.push(pairs as u16);
    }
    out
}

/// The compiled scenario with other seeds and protocols.
pub fn plan(seeds: usize, protocols: &[&str]) -> Plan {
    let mut plan = mpgx_lang::compile(FILE, SOURCE.to_string(), &[], &NoFiles).plan.unwrap();
    let (protocol, claim) = (plan.protocols[0].clone(), plan.claims[0].clone());
    let protocol = |name: &&str| Protocol { name: name.to_string(), episodes: EPISODES, ..protocol.clone() };
    plan.seeds = seeds;
    plan.protocols = protocols.iter().map(protocol).collect();
    plan.claims = vec![claim];
    plan
}
