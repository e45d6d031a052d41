//! Held-out episodes of robots that do not know their poses: they act on what a localiser tells them.

mod filter;

use std::collections::BTreeMap;

use mpgx_lang::plan::{Localised, Place, Plan, World};
use mpgx_random::{Address, Purpose, Stream};
use mpgx_sim::{Episode, EpisodeKey, Fault, Task};
use mpgx_vision::declared::{PoseNoise, Wheels, camera_config, time_of_day, wheels, world_config};
use mpgx_vision::{
    CameraConfig, Fix, Image, Moving, Reliability, Scene, Shot, TimeOfDay, TrialKey, WorldConfig,
};

use crate::error::Halt;
use crate::record::Told;
use filter::{Filter, Odometer, way};

/// A localiser, ready to tell poses.
pub(crate) enum Teller {
    /// The truth with normal noise of these standard deviations.
    Noise(PoseNoise),
    /// What tells poses from images, and how wrong it is.
    #[cfg_attr(not(feature = "vision"), allow(dead_code, reason = "only networks tell poses from images"))]
    Eyes(Box<dyn Eyes>, Reliability),
}

/// Tells from images where each was taken from.
pub(crate) trait Eyes: Send + Sync {
    fn fixes(&self, images: &[Image]) -> Result<Vec<Fix>, String>;
}

/// Who is told its pose in the episodes of a protocol, and by what.
pub(crate) struct Sight<'a> {
    groups: Vec<Group<'a>>,
    /// Agents that a camera sees: all that are no obstacles.
    robots: Vec<usize>,
    room: Option<(WorldConfig, Option<TimeOfDay>)>,
    dt_s: f64,
}

/// Robots that one localiser tells.
struct Group<'a> {
    agents: std::ops::Range<usize>,
    teller: &'a Teller,
    camera: Option<CameraConfig>,
    /// What is joined to what they are told.
    wheels: Option<Wheels>,
}

/// What robots believe in one episode.
pub(crate) struct Belief {
    pub episode: Episode,
    key: EpisodeKey,
    /// One for each group that looks.
    scenes: Vec<Option<Scene>>,
    /// Of those that count their ways.
    joined: BTreeMap<usize, (Odometer, Filter)>,
    /// Where all agents stood one step ago.
    before: Vec<[f64; 3]>,
    position_error_m: f64,
    heading_error_rad: f64,
    looks: usize,
    /// What was told, if the episode is recorded.
    poses: Option<Vec<[f32; 3]>>,
}

/// Episodes with rooms of their own that run side by side; a room takes some megabytes.
pub(crate) const ROOMS_SIDE_BY_SIDE: usize = 8;

impl<'a> Sight<'a> {
    /// `None` if everybody knows its pose. `tellers` are those of the Plan, in its order.
    pub fn new(plan: &Plan, world: &World, tellers: &'a [Teller]) -> Result<Option<Sight<'a>>, String> {
        if world.localised.is_empty() {
            return Ok(None);
        }
        let group = |localised: &Localised| {
            let group = world.groups.get(localised.group).ok_or("a group that is not there is localised")?;
            let teller = tellers.get(localised.via).ok_or("a localiser that is not there is asked")?;
            let first = world.first_of(localised.group);
            let camera =
                group.camera.as_ref().map(camera_config).transpose().map_err(|why| why.to_string())?;
            let wheels = match (&group.odometry, localised.odometry) {
                (_, false) => None,
                (Some(odometry), true) => Some(wheels(odometry).map_err(|why| why.to_string())?),
                (None, true) => return Err("a group that does not count its way joins it".to_owned()),
            };
            let agents = first..first + group.size;
            Ok(Group { agents, teller, camera: camera.filter(|_| teller.looks()), wheels })
        };
        let groups = world.localised.iter().map(group).collect::<Result<Vec<_>, String>>()?;
        let room = match world.scenery.as_ref().or(plan.world.scenery.as_ref()) {
            Some(scenery) if groups.iter().any(|group| group.camera.is_some()) => {
                let light = scenery.lighting.as_ref().map(time_of_day).transpose();
                let room = world_config(scenery).map_err(|why| why.to_string())?;
                Some((room, light.map_err(|why| why.to_string())?))
            }
            _ => None,
        };
        let solid = world.groups.iter().flat_map(|group| vec![group.solid.is_some(); group.size]);
        let robots = solid.enumerate().filter(|(_, solid)| !solid).map(|(agent, _)| agent).collect();
        Ok(Some(Sight { groups, robots, room, dt_s: world.dt_s }))
    }

    pub fn has_rooms(&self) -> bool {
        self.room.is_some()
    }

    /// Who is told, in the order of [`Told::poses`].
    pub fn agents(&self) -> impl Iterator<Item = usize> {
        self.groups.iter().flat_map(|group| group.agents.clone())
    }

    pub fn begin(&self, task: &Task, key: EpisodeKey, recorded: bool) -> Result<Belief, Halt> {
        let scene = |group: &Group| -> Result<Option<Scene>, Halt> {
            let (Some(camera), Some((room, light))) = (&group.camera, &self.room) else { return Ok(None) };
            let EpisodeKey { master, protocol, seed, episode } = key;
            let light = light.unwrap_or_else(|| TimeOfDay::of_trial(episode));
            let trial = TrialKey { master, protocol, seed, episode };
            Scene::new(room, camera, light, trial).map(Some).map_err(|why| blind(&why.to_string()))
        };
        Ok(Belief {
            episode: task.episode(),
            key,
            scenes: self.groups.iter().map(scene).collect::<Result<_, _>>()?,
            joined: BTreeMap::new(),
            before: Vec::new(),
            position_error_m: 0.0,
            heading_error_rad: 0.0,
            looks: 0,
            poses: recorded.then(Vec::new),
        })
    }

    /// Tells all robots of episodes side by side their poses of this step.
    pub fn tell(&self, task: &Task, sides: &mut [(&mut Belief, &Episode)]) -> Result<(), Halt> {
        let mut told: Vec<Vec<(usize, [f64; 3])>> = vec![Vec::new(); sides.len()];
        for (number, group) in self.groups.iter().enumerate() {
            let answers = self.answers(task, number, group, sides)?;
            for ((told, answers), (belief, truth)) in told.iter_mut().zip(answers).zip(sides.iter_mut()) {
                told.extend(group.agents.clone().zip(answers).map(|(agent, answer)| match group.wheels {
                    None => (agent, answer.pose),
                    Some(wheels) => (agent, belief.join(task, truth, agent, answer, group.teller, wheels)),
                }));
            }
        }
        for (told, (belief, truth)) in told.iter().zip(sides.iter_mut()) {
            belief.remember(task, truth, told);
        }
        Ok(())
    }

    /// The poses of a group's robots in each episode as its localiser tells them.
    fn answers(
        &self,
        task: &Task,
        number: usize,
        group: &Group,
        sides: &[(&mut Belief, &Episode)],
    ) -> Result<Vec<Vec<Fix>>, Halt> {
        match &group.teller {
            &&Teller::Noise(PoseNoise { position_m, heading_rad }) => {
                let noisy = |(belief, truth): &(&mut Belief, &Episode), agent: usize| {
                    let mut stream = belief.stream(Purpose::Localiser, truth, agent);
                    let mut noise = |deviation: f64| deviation * stream.normal();
                    let [x, y, heading] = task.stand(truth, agent);
                    let pose = [x + noise(position_m), y + noise(position_m), heading + noise(heading_rad)];
                    Fix { pose, spread: [1.0; 3] }
                };
                let all = |side| group.agents.clone().map(|agent| noisy(side, agent)).collect();
                Ok(sides.iter().map(all).collect())
            }
            Teller::Eyes(eyes, _) => {
                let images = sides.iter().flat_map(|(belief, truth)| self.look(task, number, belief, truth));
                let fixes = eyes.fixes(&images.collect::<Vec<Image>>()).map_err(|why| blind(&why))?;
                Ok(fixes.chunks(group.agents.len().max(1)).map(<[_]>::to_vec).collect())
            }
        }
    }

    /// What each robot of a group sees in an episode.
    fn look(&self, task: &Task, group: usize, belief: &Belief, truth: &Episode) -> Vec<Image> {
        let (Some(Some(scene)), Some(it)) = (belief.scenes.get(group), self.groups.get(group)) else {
            return Vec::new();
        };
        let moving = |agent: usize| {
            let now = task.stand(truth, agent);
            Moving::between(belief.before.get(agent).copied().unwrap_or(now), now, self.dt_s)
        };
        let all = self.robots.iter().map(|&agent| (agent, moving(agent))).collect::<Vec<_>>();
        let image = |agent: usize| {
            let others = all.iter().filter(|(other, _)| *other != agent);
            let robots: Vec<Moving> = others.map(|(_, moving)| *moving).collect();
            let time_s = truth.time_steps() as f64 * self.dt_s;
            let number = (truth.time_steps() * task.agents() + agent) as u64;
            scene.render(&Shot { camera: moving(agent), robots: &robots, time_s, number })
        };
        it.agents.clone().map(image).collect()
    }
}

impl Teller {
    fn looks(&self) -> bool {
        !matches!(self, Teller::Noise(_))
    }

    fn reliability(&self) -> Reliability {
        match self {
            &Teller::Noise(PoseNoise { position_m, heading_rad }) => Reliability {
                mean_square: [position_m, position_m, heading_rad].map(|deviation| deviation * deviation),
                correlation: [0.0; 3],
            },
            Teller::Eyes(_, reliability) => *reliability,
        }
    }
}

impl Belief {
    /// What a robot takes its pose to be, from an answer and from what its wheels have counted since the answer before.
    fn join(
        &mut self,
        task: &Task,
        truth: &Episode,
        agent: usize,
        answer: Fix,
        teller: &Teller,
        wheels: Wheels,
    ) -> [f64; 3] {
        let reliability = teller.reliability();
        let mut stream = self.stream(Purpose::Odometry, truth, agent);
        match (self.joined.get_mut(&agent), self.before.get(agent)) {
            (Some((odometer, filter)), Some(&before)) => {
                filter.go(odometer.count(way(before, task.stand(truth, agent)), &mut stream));
                filter.correct(answer.pose, reliability.lasting(answer.spread));
                filter.pose()
            }
            _ => {
                let has_heading = task.has_heading(agent);
                let filter =
                    Filter::new(answer.pose, reliability.variance(answer.spread), wheels, has_heading);
                let pose = filter.pose();
                self.joined.insert(agent, (Odometer::new(wheels, &mut stream), filter));
                pose
            }
        }
    }

    /// Random numbers for an agent's step; those of step 0 are for the whole episode.
    fn stream(&self, purpose: Purpose, truth: &Episode, agent: usize) -> Stream {
        let EpisodeKey { master, protocol, seed, episode } = self.key;
        let step = truth.time_steps() as u64;
        Address { master, purpose, protocol, part: agent as u16, seed, episode, step }.stream()
    }

    fn remember(&mut self, task: &Task, truth: &Episode, told: &[(usize, [f64; 3])]) {
        task.believe(&mut self.episode, truth, told);
        for &(agent, [x, y, heading]) in told {
            let [true_x, true_y, true_heading] = task.stand(truth, agent);
            self.position_error_m += libm::hypot(x - true_x, y - true_y);
            self.heading_error_rad += libm::remainder(heading - true_heading, std::f64::consts::TAU).abs();
            self.looks += 1;
            if let Some(poses) = &mut self.poses {
                let [x, y] = self.episode.position(agent);
                poses.push([x as f32, y as f32, self.episode.heading(agent) as f32]);
            }
        }
        self.before = (0..task.agents()).map(|agent| task.stand(truth, agent)).collect();
    }

    pub fn finish(self, told: &mut Told) {
        let looks = self.looks.max(1) as f64;
        told.position_error_m.push(self.position_error_m / looks);
        told.heading_error_rad.push(self.heading_error_rad / looks);
        told.poses.extend(self.poses);
    }
}

fn blind(why: &str) -> Halt {
    Halt::Fault(Fault { cause: format!("no pose was told: {why}"), at: Place::default() })
}

#[cfg(test)]
pub(crate) mod tests;
