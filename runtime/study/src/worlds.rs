//! The worlds of a Plan, compiled and checked before anything is written or trained.

use mpgx_lang::plan::{Place, Plan};
use mpgx_learn::Config;
use mpgx_sim::{Task, controller};

use crate::error::StudyError;

/// A study with more seeds is a slip of the pen.
const MOST_SEEDS: usize = 100_000;
/// The protocol is told in 16 bits of an address, the episode in 32; 0 is training.
const MOST_PROTOCOLS: usize = u16::MAX as usize;
const MOST_EPISODES: usize = u32::MAX as usize;

pub(crate) struct Worlds {
    pub training: Task,
    /// In the order of the Plan's protocols.
    pub held_out: Vec<Task>,
}

impl Worlds {
    /// Compiles all worlds and checks whatever a cell will need.
    pub fn new(plan: &Plan) -> Result<Worlds, StudyError> {
        let nowhere = Place::default();
        if plan.seeds > MOST_SEEDS {
            return wrong(
                format!("{} seeds are asked for; at most {MOST_SEEDS} are possible", plan.seeds),
                &nowhere,
            );
        }
        if plan.protocols.len() > MOST_PROTOCOLS {
            return wrong(format!("at most {MOST_PROTOCOLS} evaluations are possible"), &nowhere);
        }
        let training = Task::new(plan, &plan.world).or_else(|why| wrong(why, &nowhere))?;
        if training.action_len() == 0 || training.state_len() == 0 {
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
            let sizes = |task: &Task| (task.state_len(), task.action_len(), task.term_count());
            if sizes(&task) != sizes(&training) {
                let cause = format!("`{}` has another state, action or reward than training", protocol.name);
                return wrong(cause, &protocol.at);
            }
            for method in &plan.controllers {
                controller(&method.what, &task).or_else(|why| wrong(why, &method.at))?;
            }
            held_out.push(task);
        }
        Ok(Worlds { training, held_out })
    }
}

fn wrong<T>(cause: impl std::fmt::Display, at: &Place) -> Result<T, StudyError> {
    Err(StudyError::Plan { cause: cause.to_string(), at: at.clone() })
}
