//! Stepping environments side by side.

use super::{Mode, Step};
use crate::batch::{Scratch, Tile};
use crate::lanes::{
    EVERYBODY, LANES, Lanes, Mask, NOBODY, Plane, ZEROS, and, at, by_axis, map, map_vectors, map2, put,
    select, select_plane, some,
};
use crate::maths::{clamp, distance};
use crate::program::{Scenes, clearance_lanes};
use crate::script::move_scripted_lanes;
use crate::task::{Agent, Task};

impl Task {
    pub(crate) fn scenes<'a>(&'a self, tile: &'a Tile, step: usize) -> Scenes<'a> {
        Scenes::new(&self.model, &tile.agents, &tile.params, step as f64 * self.dt_s)
    }

    pub(crate) fn bind_lanes(&self, scene: &mut Scenes, member: usize) {
        if let Some(members) = &self.shared {
            scene.bind(members.start + member);
        }
    }

    /// [`Task::step`] in each lane; `step` counts this one. `actions` and `out` have a row for each lane in use.
    pub(crate) fn step_lanes(
        &self,
        tile: &mut Tile,
        step: usize,
        actions: &[f32],
        mode: Mode,
        scratch: &mut Scratch,
        out: &mut [Step],
    ) {
        let row = self.action_len();
        for (k, &id) in self.learned.iter().enumerate() {
            let agent = &self.agents[id];
            let mut asked = [ZEROS; 2];
            for (lane, action) in actions.chunks_exact(row).enumerate() {
                put(&mut asked, lane, [action[2 * k], action[2 * k + 1]].map(|u| agent.command(u)));
            }
            tile.asked[k] = asked;
        }
        tile.before.copy_from_slice(&tile.agents.position);
        tile.agents.last_command.copy_from_slice(&tile.agents.command);
        self.guard_lanes(tile, scratch, out.len());
        for (k, &id) in self.learned.iter().enumerate() {
            let asked = tile.asked[k];
            self.drive_lanes(tile, id, &asked);
        }
        move_scripted_lanes(self, tile, step, &mut scratch.draws);
        let hits = self.hits_lanes(tile);
        self.stop_lanes(tile, scratch, out.len());
        self.settle_lanes(tile, step, mode);
        self.refresh_slots_lanes(tile, step);
        self.remember_lanes(tile, step);
        self.judge_lanes(tile, step, scratch, out);
        for (out, hits) in out.iter_mut().zip(hits) {
            out.hits = hits;
        }
    }

    pub(crate) fn drive_lanes(&self, tile: &mut Tile, id: usize, command: &Plane) {
        let (body, agents) = (&self.agents[id].body, &mut tile.agents);
        let command = body.limited_lanes(&agents.command[id], command);
        agents.command[id] = command;
        body.move_lanes(&mut agents.position[id], &mut agents.heading[id], &command, self.dt_s);
    }

    fn hits_lanes(&self, tile: &Tile) -> [u16; LANES] {
        let mut count = [0u16; LANES];
        for &(agent, obstacle) in &self.barred {
            let clearance = clearance_lanes(&self.model, &tile.agents.position, agent, obstacle);
            add_where(&mut count, &clearance, 0.0);
        }
        count
    }

    /// Each lane by itself.
    fn stop_lanes(&self, tile: &mut Tile, scratch: &mut Scratch, used: usize) {
        if self.stopped.is_empty() {
            return;
        }
        let episode = &mut scratch.episode;
        for lane in 0..used {
            for id in 0..self.agents.len() {
                episode.agents.position[id] = at(&tile.agents.position[id], lane);
                episode.before[id] = at(&tile.before[id], lane);
            }
            self.stop(episode);
            for &(id, _) in &self.stopped {
                put(&mut tile.agents.position[id], lane, episode.agents.position[id]);
            }
        }
    }

    fn settle_lanes(&self, tile: &mut Tile, step: usize, mode: Mode) {
        let agents = &mut tile.agents;
        for (id, agent) in self.agents.iter().enumerate() {
            agents.outside[id] = agent.is_outside_lanes(&agents.position[id]);
        }
        if mode == Mode::Evaluate {
            for &id in &self.learned {
                agents.position[id] = self.agents[id].inside_lanes(&agents.position[id]);
            }
        }
        for id in 0..self.agents.len() {
            let way = by_axis(&agents.position[id], &tile.before[id], |now, before| now - before);
            let velocity = way.map(|axis| map(&axis, |x| x / self.dt_s));
            let mut moves = NOBODY;
            for (lane, moves) in moves.iter_mut().enumerate() {
                *moves = velocity[0][lane] != 0.0 || velocity[1][lane] != 0.0;
            }
            agents.velocity[id] = velocity;
            agents.course[id] = select_plane(&moves, &velocity, &agents.course[id]);
        }
        for &id in &self.uncommanded {
            agents.command[id] = agents.velocity[id];
        }
        if step == 1 {
            agents.last_command.copy_from_slice(&agents.command);
        }
    }

    fn refresh_slots_lanes(&self, tile: &mut Tile, step: usize) {
        let mut slots = std::mem::take(&mut tile.slots);
        let mut scene = self.scenes(tile, step);
        let mut places = slots.iter_mut();
        for (k, formation) in self.model.formations.iter().enumerate() {
            for (member, slot) in places.by_ref().take(formation.places()).enumerate() {
                *slot = scene.slot(k, formation.first + member);
            }
        }
        tile.slots = slots;
    }

    fn judge_lanes(&self, tile: &mut Tile, step: usize, scratch: &mut Scratch, out: &mut [Step]) {
        let mut terms = std::mem::take(&mut tile.terms);
        let mut rewards = std::mem::take(&mut tile.rewards);
        let mut scene = self.scenes(tile, step);
        let mut reward = self.reward_lanes(&mut scene, &mut terms, &mut rewards);
        let mut ended = [None; LANES];
        for (k, end) in self.ends.iter().enumerate() {
            let holds = end.when.eval_lanes(&mut scene);
            if !some(holds) {
                continue;
            }
            for (ended, _) in ended.iter_mut().zip(holds).filter(|(_, holds)| *holds) {
                *ended = ended.or(Some(k as u16));
            }
            if let Some(cost) = &end.cost {
                scene.active = holds;
                let cost = cost.eval_lanes(&mut scene);
                scene.active = EVERYBODY;
                let charged = |reward: &Lanes| select(&holds, &map2(reward, &cost, |a, b| a - b), reward);
                reward = charged(&reward);
                rewards.iter_mut().for_each(|reward| *reward = charged(reward));
            }
        }
        let (error_m, collisions) = (self.error_lanes(tile, step), self.collisions_lanes(tile));
        let mut outside = NOBODY;
        let mut finite = reward.map(f64::is_finite);
        for (position, out) in tile.agents.position.iter().zip(&tile.agents.outside) {
            outside = crate::lanes::or(outside, *out);
            for axis in position {
                finite = and(finite, axis.map(f64::is_finite));
            }
        }
        (tile.terms, tile.rewards) = (terms, rewards);
        for (lane, out) in out.iter_mut().enumerate() {
            let fault = if finite[lane] {
                None
            } else {
                tile.take(lane, step, &mut scratch.episode);
                self.fault(&scratch.episode, reward[lane])
            };
            *out = Step {
                reward: reward[lane],
                ended: ended[lane],
                error_m: error_m[lane],
                collisions: collisions[lane],
                hits: 0,
                outside: outside[lane],
                last: step >= self.horizon,
                fault,
            };
        }
    }

    fn reward_lanes(&self, scene: &mut Scenes, terms: &mut [Lanes], rewards: &mut [Lanes]) -> Lanes {
        if !self.rewarded {
            let mut reward = ZEROS;
            for (value, term) in terms.iter_mut().zip(&self.terms) {
                *value = term.value.eval_lanes(scene);
                reward = sum(&reward, value);
            }
            rewards.fill(reward);
            return reward;
        }
        terms.fill(ZEROS);
        for (member, reward) in rewards.iter_mut().enumerate() {
            self.bind_lanes(scene, member);
            *reward = ZEROS;
            for (total, term) in terms.iter_mut().zip(&self.terms) {
                let value = term.value.eval_lanes(scene);
                *reward = sum(reward, &value);
                *total = sum(total, &value);
            }
        }
        let members = rewards.len() as f64;
        terms.iter_mut().for_each(|total| *total = map(total, |total| total / members));
        map(&rewards.iter().fold([-0.0; LANES], |a, b| sum(&a, b)), |total| total / members)
    }

    fn error_lanes(&self, tile: &Tile, step: usize) -> Lanes {
        let position = &tile.agents.position;
        let mut slots = tile.slots.iter();
        let (mut total, mut count) = (ZEROS, tile.slots.len());
        for (k, formation) in self.model.formations.iter().enumerate() {
            let places = slots.by_ref().take(formation.places());
            let away = position[formation.first..].iter().zip(places);
            let away = away.fold([-0.0; LANES], |a, (p, f)| sum(&a, &map_vectors(p, f, distance)));
            total = sum(&total, &away);
            if !formation.edges().is_empty() {
                let mut scene = self.scenes(tile, step);
                for (edge, &[a, b]) in formation.edges().iter().enumerate() {
                    let apart = map_vectors(&position[a], &position[b], distance);
                    let off = map2(&apart, &scene.rest(k, edge, [a, b]), |apart, rest| (apart - rest).abs());
                    total = sum(&total, &off);
                }
                count += formation.edges().len();
            }
        }
        map(&total, |total| total / count.max(1) as f64)
    }

    fn collisions_lanes(&self, tile: &Tile) -> [u16; LANES] {
        let (position, radii) = (&tile.agents.position, &self.model.radii);
        let mut count = [0u16; LANES];
        for (k, &i) in self.everyone.iter().enumerate() {
            for &j in &self.everyone[k + 1..] {
                let away = map_vectors(&position[i], &position[j], distance);
                let clearance = map(&away, |away| away - radii[j] - radii[i]);
                add_where(&mut count, &clearance, self.safety_m);
            }
        }
        count
    }
}

fn sum(a: &Lanes, b: &Lanes) -> Lanes {
    map2(a, b, |a, b| a + b)
}

/// Counts the lanes that are below a limit.
fn add_where(count: &mut [u16; LANES], x: &Lanes, limit: f64) {
    for (count, x) in count.iter_mut().zip(x) {
        *count = count.saturating_add(u16::from(*x < limit));
    }
}

impl Agent {
    /// [`Agent::inside`] in each lane.
    pub fn inside_lanes(&self, position: &Plane) -> Plane {
        let Some(arena) = self.arena else { return *position };
        [(&position[0], arena.x_m), (&position[1], arena.y_m)]
            .map(|(axis, (low, high))| map(axis, |x| clamp(x, low, high)))
    }

    /// [`Agent::is_outside`] in each lane.
    fn is_outside_lanes(&self, position: &Plane) -> Mask {
        std::array::from_fn(|lane| self.is_outside(at(position, lane)))
    }
}
