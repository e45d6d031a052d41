//! The proportional controller: a velocity of `gain` times the way to the place.

use super::Controller;
use super::aims::{Aims, asking};
use crate::episode::Episode;
use crate::maths::{scale, subtract};
use crate::task::Task;

pub(super) struct Proportional {
    aims: Aims,
    /// 1/s.
    gain: f64,
}

impl Proportional {
    pub fn new(aims: Aims, gain: f64) -> Self {
        Proportional { aims, gain }
    }
}

impl Controller for Proportional {
    fn command(&mut self, task: &Task, episode: &Episode, action: &mut [f32]) {
        self.aims.command(task, episode, action, |agent, place| {
            let velocity = scale(subtract(place, episode.position(agent)), self.gain);
            asking(task, episode, agent, velocity)
        });
    }
}
