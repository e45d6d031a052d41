//! Who acts on one policy: all learned agents together, or each member of a team from its own state.

use mpgx_sim::{Episode, Step, Task};

/// How often the policy acts in a step: once, or once for each member.
pub(crate) fn members(_task: &Task) -> usize {
    1
}

/// Entries of a state that the policy sees and of an action that it gives.
pub(crate) fn sizes(task: &Task) -> (usize, usize) {
    (task.state_len(), task.action_len() / members(task).max(1))
}

/// The state of each member, `[members][state]`.
pub(crate) fn observe(task: &Task, episode: &Episode, out: &mut [f32]) {
    task.observe(episode, out);
}

/// What each member is rewarded with for the last step.
pub(crate) fn rewards<'a>(_task: &Task, _episode: &'a Episode, step: &'a Step) -> &'a [f64] {
    std::slice::from_ref(&step.reward)
}

/// Pairs of an agent and an obstacle that met in a step.
pub(crate) fn hits(_step: &Step) -> u16 {
    0
}
