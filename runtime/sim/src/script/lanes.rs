//! Scripted agents of environments side by side.

use mpgx_random::Purpose;

use super::Script;
use crate::batch::Tile;
use crate::lanes::{Plane, map};
use crate::maths::clamp;
use crate::program::{ManyDraws, Scenes};
use crate::task::Task;

impl Script {
    /// [`Script::advance`] in each lane.
    fn advance_lanes(&self, task: &Task, tile: &mut Tile, step: usize, draws: &mut ManyDraws) -> Plane {
        let time_s = step as f64 * task.dt_s;
        draws.begin(tile.keys.map(|key| key.address(Purpose::Motion, self.agent, step as u64)));
        let own = self.first..self.first + self.states.len();
        for (k, state) in self.states.iter().enumerate() {
            let scene = Scenes::new(&task.model, &tile.agents, &tile.params, time_s);
            let value = state.next.eval_lanes(&mut scene.random(&tile.memory[own.clone()], draws));
            tile.fresh[self.first + k] = value;
        }
        let scene = Scenes::new(&task.model, &tile.agents, &tile.params, time_s);
        self.output.eval_lanes(&mut scene.random(&tile.fresh[own], draws))
    }
}

/// [`super::move_scripted`] in each lane.
pub(crate) fn move_scripted_lanes(task: &Task, tile: &mut Tile, step: usize, draws: &mut ManyDraws) {
    for (k, script) in task.scripts.iter().enumerate() {
        tile.outputs[k] = script.advance_lanes(task, tile, step, draws);
    }
    std::mem::swap(&mut tile.memory, &mut tile.fresh);
    for (k, script) in task.scripts.iter().enumerate() {
        let (output, id) = (tile.outputs[k], script.agent);
        if script.positions {
            tile.agents.position[id] = output;
            continue;
        }
        let (low, high) = task.agents[id].speed_mps;
        task.drive_lanes(tile, id, &output.map(|axis| map(&axis, |x| clamp(x, low, high))));
        let position = &mut tile.agents.position[id];
        *position = task.agents[id].inside_lanes(position);
    }
}
