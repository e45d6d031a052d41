//! A study that takes milliseconds, and a listener that writes down what happens in it.

use std::collections::BTreeSet;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use mpgx_lang::plan::*;

use crate::owner::Owner;
use crate::storage::Storage;
use crate::*;

pub const SEEDS: usize = 2;

fn at(line: usize) -> Place {
    Place { file: "folder/sample.scn".into(), line, column: 5 }
}

fn position(agent: AgentRef) -> Expr {
    Expr::Agent(Quantity::Position, agent)
}

fn minus(a: Expr, b: Expr) -> Expr {
    Expr::Binary(BinaryOp::Sub, Box::new(a), Box::new(b))
}

/// |p − F| of the follower.
pub fn gap() -> Expr {
    let slot = Expr::Slot(0, AgentRef::Fixed(1));
    Expr::Call(Function::Norm, vec![minus(position(AgentRef::Fixed(1)), slot)])
}

pub fn negated(expr: Expr) -> Expr {
    Expr::Unary(UnaryOp::Neg, Box::new(expr))
}

pub fn term(name: &str, value: Expr) -> Term {
    Term { name: name.into(), doc: String::new(), value, dimension: "length".into(), at: at(9) }
}

fn normal(site: usize) -> Expr {
    let (mean, deviation) = (Box::new(Expr::Number(0.0)), Box::new(Expr::Number(1.0)));
    Expr::Draw { distribution: Distribution::Normal { mean, deviation }, site }
}

fn world() -> World {
    let area = |half: f64| Some(Area { x_m: (-half, half), y_m: (-half, half) });
    let point = || Extern { name: "point".into(), settings: Default::default() };
    let group = |name: &str, arena, control, start| Group {
        name: name.into(),
        size: 1,
        body: point(),
        arena,
        speed_mps: (-0.7, 0.7),
        control,
        start: Some(start),
        at: at(3),
        ..Group::default()
    };
    let wander = Motion {
        name: "random_velocity".into(),
        states: Vec::new(),
        output: MotionOutput::Velocity(Expr::Vector(Box::new(normal(0)), Box::new(normal(1)))),
    };
    let disc = || Expr::Draw { distribution: Distribution::UnitDisc, site: 0 };
    World {
        dt_s: 0.1,
        horizon: 7,
        safety_m: 0.1,
        groups: vec![
            group("leader", area(1.0), Control::Motion(wander), disc()),
            group("follower", area(1.0), Control::Learned, disc()),
        ],
        formations: vec![Formation {
            name: "F".into(),
            shape: "coincide".into(),
            group: 1,
            about: Some(0),
            constraint: Constraint::Displacements {
                slots: Slots::List(vec![Expr::Vector(
                    Box::new(Expr::Number(0.2)),
                    Box::new(Expr::Number(0.0)),
                )]),
                frame: Frame::Global,
            },
            graph: Graph::Star,
            at: at(5),
        }],
        observe: vec![Observation {
            text: "F[follower] - p[follower]".into(),
            value: minus(Expr::Slot(0, AgentRef::Fixed(1)), position(AgentRef::Fixed(1))),
            vector: true,
            over: None,
            noise: None,
            delay: 0,
            at: at(7),
        }],
        reward: vec![term("gap", negated(gap()))],
        ends: vec![End {
            name: "lost".into(),
            when: Expr::Agent(Quantity::Outside, AgentRef::Fixed(1)),
            failure: true,
            cost: Some(Expr::Number(1.0)),
            at: at(11),
        }],
        ..World::default()
    }
}

/// A learner of this name with a tiny network.
pub fn learner(name: &str, steps: f64) -> Method {
    let numbers = [
        ("episodes", 1e9),
        ("steps", steps),
        ("gamma", 0.9),
        ("actor_rate", 1e-3),
        ("critic_rate", 1e-2),
        ("rate_end", 0.1),
        ("batch", 3.0),
        ("replay", 20.0),
        ("warm_up", 0.0),
        ("tau", 0.005),
        ("inner", 1.0),
        ("delay", 2.0),
        ("train_noise", 0.2),
        ("train_clip", 1e9),
        ("explore_noise", 2.0),
        ("explore_min", 0.01),
        ("explore_decay", 0.9),
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
    let truths = ["delta_reset", "target_actor", "terminal_mask"];
    let mut settings: std::collections::BTreeMap<String, Setting> =
        [("hidden".to_string(), Setting::List(vec![16.0, 16.0]))].into();
    settings.extend(numbers.map(|(name, value)| (name.to_string(), Setting::Number(value))));
    settings.extend(words.map(|(name, word)| (name.to_string(), Setting::Word(word.into()))));
    settings.extend(truths.map(|name| (name.to_string(), Setting::Truth(false))));
    Method { label: name.into(), what: Extern { name: name.into(), settings }, at: at(15) }
}

pub fn oracle() -> Method {
    let what = Extern { name: "oracle".into(), settings: Default::default() };
    Method { label: "oracle".into(), what, at: at(17) }
}

/// A stage in the world of training, where reaching the leader ends an episode and is no failure.
pub fn stage(most_steps: Option<usize>) -> Stage {
    let mut world = world();
    let near = Expr::Binary(BinaryOp::Less, Box::new(gap()), Box::new(Expr::Number(0.05)));
    world.ends.push(End { name: "there".into(), when: near, failure: false, cost: None, at: at(12) });
    Stage { name: "near".into(), world: Box::new(world), until: None, most_steps, at: at(13) }
}

/// MPG and TD3, two seeds each, and the oracle: five cells of 30 steps.
pub fn plan() -> Plan {
    Plan {
        name: "sample".into(),
        world: world(),
        learners: vec![learner("mpg", 30.0), learner("td3", 30.0)],
        controllers: vec![oracle()],
        seeds: SEEDS,
        protocols: vec![Protocol { name: "random".into(), episodes: 4, world: None, at: at(19) }],
        claims: Vec::new(),
        ..Plan::default()
    }
}

/// The member that the policy acts for, and the one that is rewarded.
const OWN: [VarId; 2] = [7, 8];

/// Two robots share a policy, each rewarded for its own gap; three of them are held out. Training begins in a
/// shorter stage, and noise follows a schedule.
pub fn shared() -> Plan {
    let mut plan = plan();
    let own = |id: VarId, name: &str| Binder { id, name: name.into() };
    let gap_of = |id| minus(Expr::Slot(0, AgentRef::Var(id)), position(AgentRef::Var(id)));
    let world = &mut plan.world;
    world.groups[1].size = 2;
    let side = Expr::Binary(BinaryOp::Mul, Box::new(Expr::Number(0.2)), Box::new(Expr::SlotNumber));
    let rule = Slots::Rule(Expr::Vector(Box::new(side), Box::new(Expr::Number(0.1))));
    world.formations[0].constraint = Constraint::Displacements { slots: rule, frame: Frame::Global };
    world.shared = Some(Shared { group: 1, var: own(OWN[0], "i"), rewarded: Some(own(OWN[1], "j")) });
    world.observe[0].value = gap_of(OWN[0]);
    world.reward[0].value = negated(Expr::Call(Function::Norm, vec![gap_of(OWN[1])]));
    world.ends[0].cost = None;
    let mut three = world.clone();
    three.groups[1].size = 3;
    let stage = Stage { world: Box::new(World { horizon: 4, ..world.clone() }), ..stage(Some(10)) };
    plan.stages.push(stage);
    plan.protocols.push(Protocol {
        name: "three".into(),
        episodes: 2,
        world: Some(Box::new(three)),
        at: at(20),
    });
    let noise = Schedule { curve: Curve::Geometric, from: 1.0, to: 0.1, begin: 0.1, end: 0.8 };
    for learner in &mut plan.learners {
        learner.what.settings.insert("explore_noise".into(), Setting::Schedule(noise));
        learner.what.settings.insert("terminal_mask".into(), Setting::Truth(true));
    }
    plan
}

/// One thread, a checkpoint every ten steps, and an owner that is dead as soon as it is looked for.
pub fn options() -> Options {
    let owner = Owner { pid: u32::MAX, began: Some(0), ..Owner::this_process() };
    Options { threads: 1, checkpoint_steps: 10, owner, ..Options::default() }
}

pub fn source() -> Vec<(String, String)> {
    vec![("folder/sample.scn".into(), "scenario sample".into())]
}

pub fn run_on(disk: &dyn Storage, plan: &Plan, listener: &Listener) -> Result<Outcome, StudyError> {
    let options = Options { interrupt: listener.interrupt.clone(), ..options() };
    listener.interrupt.store(false, Ordering::Relaxed);
    run(plan, &source(), disk, &options, listener)
}

/// Runs to the end and gives the hash.
pub fn hash_of(disk: &dyn Storage, plan: &Plan) -> String {
    hash(run_on(disk, plan, &Listener::default()))
}

pub fn hash(outcome: Result<Outcome, StudyError>) -> String {
    match outcome {
        Ok(Outcome::Finished(study)) => study.summary.unwrap().study_hash,
        other => panic!("not finished: {other:?}"),
    }
}

/// What happened, and what shall.
#[derive(Default)]
pub struct Listener {
    pub started: Mutex<Vec<(CellId, u64)>>,
    pub kept: Mutex<BTreeSet<CellId>>,
    pub finished: Mutex<BTreeSet<CellId>>,
    pub warnings: Mutex<Vec<String>>,
    pub episodes: Mutex<usize>,
    /// Interrupt the run after this many episodes.
    pub interrupt_after: Option<usize>,
    /// Panic in the first episode of this cell.
    pub panic_in: Option<CellId>,
    pub interrupt: Arc<AtomicBool>,
}

impl Listener {
    pub fn started(&self) -> Vec<CellId> {
        self.started.lock().unwrap().iter().map(|(id, _)| id.clone()).collect()
    }
}

impl Progress for Listener {
    fn cell_kept(&self, cell: &Cell, _: &record::CellRecord) {
        self.kept.lock().unwrap().insert(cell.id.clone());
    }

    fn cell_started(&self, cell: &Cell, steps: u64, _: u64) {
        self.started.lock().unwrap().push((cell.id.clone(), steps));
    }

    fn episode(&self, cell: &Cell, _: u64, _: u64, _: f64, _: f64) {
        let mut episodes = self.episodes.lock().unwrap();
        *episodes += 1;
        if self.interrupt_after == Some(*episodes) {
            self.interrupt.store(true, Ordering::Relaxed);
        }
        drop(episodes);
        assert!(self.panic_in.as_ref() != Some(&cell.id), "a panic on purpose");
    }

    fn cell_finished(&self, cell: &Cell, _: &record::CellRecord, _: &record::Timing) {
        self.finished.lock().unwrap().insert(cell.id.clone());
    }

    fn warning(&self, _: &Cell, text: &str) {
        self.warnings.lock().unwrap().push(text.to_string());
    }
}
