//! The worlds of a Plan, compiled and checked before anything is written or trained.

use mpgx_lang::plan::{Place, Plan, Stage, World};
use mpgx_learn::Config;
use mpgx_sim::{Task, controller};

use crate::curriculum::MEASURES;
use crate::error::StudyError;
use crate::team;

/// A study with more seeds is a slip of the pen.
const MOST_SEEDS: usize = 100_000;
/// The protocol is told in 16 bits of an address, the episode in 32; 0 is training.
const MOST_PROTOCOLS: usize = u16::MAX as usize;
const MOST_EPISODES: usize = u32::MAX as usize;

/// The number that a protocol's episodes are drawn under, from 1: the first one's of the same world, whoever knows its pose
/// there, so that nothing but that tells their results apart.
pub(crate) fn episodes_of(plan: &Plan, protocol: usize) -> u16 {
    let world = |number: usize| {
        let own = plan.protocols.get(number).and_then(|protocol| protocol.world.as_deref());
        World { localised: Vec::new(), ..own.unwrap_or(&plan.world).clone() }
    };
    let own = world(protocol);
    let first = (0..protocol).find(|&number| world(number) == own).unwrap_or(protocol);
    first as u16 + 1
}

pub(crate) struct Worlds {
    /// The stages of the curriculum in order, then the world of training.
    pub training: Vec<Ground>,
    /// In the order of the Plan's protocols.
    pub held_out: Vec<Task>,
}

/// A world to train in.
pub(crate) struct Ground {
    pub task: Task,
    /// Of each end, whether it is a failure.
    pub failures: Vec<bool>,
}

impl Ground {
    fn new(plan: &Plan, world: &World, at: &Place) -> Result<Ground, StudyError> {
        let task = Task::new(plan, world).or_else(|why| wrong(why, at))?;
        Ok(Ground { task, failures: world.ends.iter().map(|end| end.failure).collect() })
    }
}

impl Worlds {
    /// Compiles all worlds and checks whatever a cell will need.
    pub fn new(plan: &Plan) -> Result<Worlds, StudyError> {
        let nowhere = Place::default();
        if plan.first_seed.saturating_add(plan.seeds) > MOST_SEEDS {
            return wrong(
                format!("{} seeds are asked for; at most {MOST_SEEDS} are possible", plan.seeds),
                &nowhere,
            );
        }
        if plan.protocols.len() > MOST_PROTOCOLS {
            return wrong(format!("at most {MOST_PROTOCOLS} evaluations are possible"), &nowhere);
        }
        let main = Ground::new(plan, &plan.world, &nowhere)?;
        if main.task.action_len() == 0 || main.task.state_len() == 0 {
            return wrong("nobody is controlled by the policy, or nothing is observed", &nowhere);
        }
        for method in &plan.learners {
            Config::from_extern(&method.what).or_else(|why| wrong(why, &method.at))?;
        }
        let mut held_out = Vec::new();
        for (index, protocol) in plan.protocols.iter().enumerate() {
            if plan.protocols.iter().take(index).any(|other| other.name == protocol.name) {
                return wrong(format!("two evaluations are called `{}`", protocol.name), &protocol.at);
            }
            if protocol.episodes > MOST_EPISODES {
                return wrong(format!("at most {MOST_EPISODES} episodes are possible"), &protocol.at);
            }
            let world = protocol.world.as_deref().unwrap_or(&plan.world);
            let task = Task::new(plan, world).or_else(|why| wrong(why, &nowhere))?;
            fits(&task, &main.task, &protocol.name, &protocol.at)?;
            for method in &plan.controllers {
                controller(&method.what, &task).or_else(|why| wrong(why, &method.at))?;
            }
            held_out.push(task);
        }
        let stages = plan.stages.iter().map(|stage| ground_of(plan, stage, &main.task));
        let mut training = stages.collect::<Result<Vec<Ground>, StudyError>>()?;
        training.push(main);
        Ok(Worlds { training, held_out })
    }
}

fn ground_of(plan: &Plan, stage: &Stage, main: &Task) -> Result<Ground, StudyError> {
    let ground = Ground::new(plan, &stage.world, &stage.at)?;
    fits(&ground.task, main, &stage.name, &stage.at)?;
    match &stage.until {
        None if stage.most_steps.is_none() => wrong(format!("stage `{}` has no end", stage.name), &stage.at),
        Some(until) if until.episodes == 0 || !until.bound.is_finite() => wrong(
            format!("stage `{}` cannot be judged by its bound over its episodes", stage.name),
            &stage.at,
        ),
        Some(until) if !MEASURES.contains(&until.measure.as_str()) => {
            let (name, measure) = (&stage.name, &until.measure);
            let cause = format!("stage `{name}` ends by `{measure}`; there are {}", MEASURES.join(", "));
            wrong(cause, &stage.at)
        }
        _ => Ok(ground),
    }
}

/// One policy must do in both worlds. Where it is shared, the number of those who share it may differ.
fn fits(task: &Task, main: &Task, name: &str, at: &Place) -> Result<(), StudyError> {
    let sizes = |task: &Task| (team::sizes(task), task.term_count());
    if sizes(task) == sizes(main) {
        return Ok(());
    }
    let (((state, action), terms), ((state_main, action_main), terms_main)) = (sizes(task), sizes(main));
    let cause = format!(
        "`{name}` has {state} numbers of state, {action} of action and {terms} reward terms, training has \
         {state_main}, {action_main} and {terms_main}; they must be the same"
    );
    wrong(cause, at)
}

fn wrong<T>(cause: impl std::fmt::Display, at: &Place) -> Result<T, StudyError> {
    Err(StudyError::Plan { cause: cause.to_string(), at: at.clone() })
}
