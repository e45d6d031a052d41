//! Controllers: what steers without training, from what the scenario knows.

mod oracle;
mod proportional;

use mpgx_lang::plan::{Extern, Place};

use crate::episode::Episode;
use crate::error::SimError;
use crate::maths::Vec2;
use crate::settings::{Settings, list};
use crate::task::Task;
use oracle::{Clairvoyant, Oracle};
use proportional::Proportional;

/// The names of all controllers.
pub const CONTROLLERS: &[&str] = &["oracle", "clairvoyant", "proportional"];

/// The settings that a controller reads; `None` if there is no such controller.
pub fn controller_settings(name: &str) -> Option<&'static [&'static str]> {
    match name {
        "oracle" | "clairvoyant" => Some(&[]),
        "proportional" => Some(&["gain"]),
        _ => None,
    }
}

/// Something that commands the learned agents of a task.
pub trait Controller: Send {
    /// Writes the action for the present state: x and y of each learned agent, in [−1, 1].
    fn command(&mut self, task: &Task, episode: &Episode, action: &mut [f32]);
}

/// Makes the controller of a Plan for one task.
///
/// # Errors
/// If there is no such controller, if its settings are wrong, or if a learned agent has no slot to go to.
pub fn controller(what: &Extern, task: &Task) -> Result<Box<dyn Controller>, SimError> {
    let at = Place::default();
    let Some(known) = controller_settings(&what.name) else {
        let (kind, known) = ("controller", list(CONTROLLERS));
        return Err(SimError::Unknown { kind, name: what.name.clone(), known, at });
    };
    let settings = Settings::new(what, known, &at)?;
    let aims = Aims::new(task, &what.name)?;
    Ok(match what.name.as_str() {
        "oracle" => Box::new(Oracle::new(aims)),
        "clairvoyant" => Box::new(Clairvoyant::new(aims)),
        _ => Box::new(Proportional::new(aims, settings.positive("gain", true)?)),
    })
}

/// Which slot each learned agent steers to: its own in the first formation of its group.
pub(crate) struct Aims {
    /// Agent and entry of [`Episode::slots`].
    aims: Vec<(usize, usize)>,
}

impl Aims {
    fn new(task: &Task, controller: &str) -> Result<Aims, SimError> {
        let aim = |&agent: &usize| match task.slot_of(agent) {
            Some(slot) => Ok((agent, slot)),
            None => Err(SimError::NoSlot {
                controller: controller.into(),
                agent: task.agents[agent].name.clone(),
                at: task.agents[agent].at.clone(),
            }),
        };
        Ok(Aims { aims: task.learned.iter().map(aim).collect::<Result<_, _>>()? })
    }

    /// Fills the action with what `velocity` gives for each learned agent and its slot in `slots`, m/s.
    fn command(
        &self,
        task: &Task,
        slots: &[Vec2],
        action: &mut [f32],
        velocity: impl Fn(usize, Vec2) -> Vec2,
    ) {
        for (&(agent, slot), action) in self.aims.iter().zip(action.chunks_exact_mut(2)) {
            let wanted = velocity(agent, slots[slot]);
            action.copy_from_slice(&wanted.map(|v| task.agents[agent].action(v)));
        }
    }
}

#[cfg(test)]
mod tests;
