//! Controllers: what steers without training, from what the scenario knows.

mod aims;
mod arrange;
mod bonds;
mod consensus;
mod distance_gradient;
mod oracle;
mod potential_field;
mod predictive;
mod proportional;
mod search;

use mpgx_lang::plan::{Extern, Place};

use crate::episode::Episode;
use crate::error::SimError;
use crate::settings::{Settings, list};
use crate::task::Task;
use aims::Aims;
use bonds::Bonds;
use consensus::Consensus;
use distance_gradient::DistanceGradient;
use oracle::{Clairvoyant, Oracle};
use potential_field::PotentialField;
use predictive::Predictive;
use proportional::Proportional;

/// The names of all controllers.
pub const CONTROLLERS: &[&str] = &[
    "oracle",
    "clairvoyant",
    "proportional",
    "consensus",
    "distance_gradient",
    "potential_field",
    "predictive",
];

/// The settings that a controller reads; `None` if there is no such controller.
pub fn controller_settings(name: &str) -> Option<&'static [&'static str]> {
    match name {
        "oracle" | "clairvoyant" => Some(&[]),
        "proportional" | "distance_gradient" => Some(&["gain"]),
        "consensus" => Some(&["gain", "feedforward"]),
        "potential_field" => Some(&["attraction", "repulsion", "reach"]),
        "predictive" => Some(&["ahead", "margin"]),
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
/// If there is no such controller, if its settings are wrong, or if a learned agent has no place or
/// neighbour to steer by.
pub fn controller(what: &Extern, task: &Task) -> Result<Box<dyn Controller>, SimError> {
    let at = Place::default();
    let Some(known) = controller_settings(&what.name) else {
        let (kind, known) = ("controller", list(CONTROLLERS));
        return Err(SimError::Unknown { kind, name: what.name.clone(), known, at });
    };
    let settings = Settings::new(what, known, &at)?;
    let aims = || Aims::new(task, &what.name);
    let bonds = || Bonds::new(task, &what.name);
    Ok(match what.name.as_str() {
        "oracle" => Box::new(Oracle::new(aims()?)),
        "clairvoyant" => Box::new(Clairvoyant::new(aims()?)),
        "consensus" => Box::new(Consensus::new(
            task,
            bonds()?,
            settings.positive("gain", true)?,
            settings.truth("feedforward")?,
        )?),
        "distance_gradient" => Box::new(DistanceGradient::new(bonds()?, settings.positive("gain", true)?)),
        "potential_field" => Box::new(PotentialField {
            aims: aims()?,
            attraction: settings.positive("attraction", true)?,
            repulsion: settings.positive("repulsion", true)?,
            reach: settings.positive("reach", true)?,
        }),
        "predictive" => Box::new(Predictive {
            aims: aims()?,
            ahead: settings.count("ahead", 1, predictive::MOST_STEPS)?,
            margin: settings.positive("margin", true)?,
        }),
        _ => Box::new(Proportional::new(aims()?, settings.positive("gain", true)?)),
    })
}

#[cfg(test)]
mod tests;
