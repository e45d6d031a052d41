//! Who acts on one policy: all learned agents together, or each member of a team from its own state.

use mpgx_sim::{Episode, Task};

/// How often the policy acts in a step: once, or once for each member.
pub(crate) fn members(task: &Task) -> usize {
    task.shared().unwrap_or(1)
}

/// Entries of a state that the policy sees and of an action that it gives.
pub(crate) fn sizes(task: &Task) -> (usize, usize) {
    (task.state_len(), task.action_len() / members(task).max(1))
}

/// The state of each member, `[members][state]`.
pub(crate) fn observe(task: &Task, episode: &Episode, out: &mut [f32]) {
    match task.shared() {
        None => task.observe(episode, out),
        Some(_) => {
            for (member, out) in out.chunks_exact_mut(task.state_len().max(1)).enumerate() {
                task.observe_member(episode, member, out);
            }
        }
    }
}
