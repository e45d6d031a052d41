//! Held-out episodes: the same for every method and every seed, whole horizons, no noise.

use mpgx_lang::plan::Extern;
use mpgx_learn::Policy;
use mpgx_sim::{Controller, Episode, EpisodeKey, Fault, Mode, SimError, Task, controller};

use crate::error::{Halt, no_start};
use crate::record::{Evaluation, Told, Trajectory};
use crate::sight::{Belief, ROOMS_SIDE_BY_SIDE, Sight};
use crate::team;

/// Episodes that are stepped side by side, so that the policy sees their states as one batch.
const SIDE_BY_SIDE: usize = 64;

/// Episodes recorded whole, for playback.
pub(crate) const RECORDED: u32 = 3;

/// Collisions and hits count as late after this step.
const SETTLED: usize = 40;

/// What is evaluated.
pub(crate) enum Driver<'a> {
    Policy(Policy),
    Controller(&'a Extern),
}

/// Runs the episodes of one protocol. `key` tells which; its episode number is that of the first. With a `sight` robots act
/// on what they are told of their poses; controllers that know everything do not.
pub(crate) fn evaluate(
    task: &Task,
    sight: Option<&Sight>,
    driver: &mut Driver,
    key: EpisodeKey,
    episodes: usize,
    interrupted: impl Fn() -> bool,
) -> Result<Evaluation, Halt> {
    let sight = sight.filter(|_| !driver.knows_all());
    let told = sight.map(|sight| {
        let agents = sight.agents().map(|agent| agent as u32).collect();
        Told { agents, ..Told::default() }
    });
    let mut evaluation = Evaluation { told, ..Evaluation::default() };
    let side_by_side = if sight.is_some_and(Sight::has_rooms) { ROOMS_SIDE_BY_SIDE } else { SIDE_BY_SIDE };
    let mut done = 0;
    while done < episodes {
        let count = side_by_side.min(episodes - done);
        let mut runs = (done..done + count)
            .map(|episode| {
                Run::begin(task, sight, EpisodeKey { episode: key.episode + episode as u32, ..key })
            })
            .collect::<Result<Vec<Run>, Halt>>()?;
        let mut pilots = Pilots::new(driver, task, count).map_err(no_start)?;
        for _ in 0..task.horizon() {
            if interrupted() {
                return Err(Halt::Interrupted);
            }
            if let Some(sight) = sight {
                let sides = runs.iter_mut().filter_map(|run| Some((run.belief.as_mut()?, &run.episode)));
                sight.tell(task, &mut sides.collect::<Vec<_>>())?;
            }
            pilots.command(task, &runs);
            for (run, action) in runs.iter_mut().zip(pilots.actions.chunks_exact(task.action_len())) {
                run.step(task, action)?;
            }
        }
        runs.into_iter().for_each(|run| run.finish(task, &mut evaluation));
        done += count;
    }
    Ok(evaluation)
}

impl Driver<'_> {
    fn knows_all(&self) -> bool {
        matches!(self, Driver::Controller(what) if knows_all(what))
    }
}

/// Whether a controller is what others are measured by, and so is not misled by a localiser.
pub(crate) fn knows_all(controller: &Extern) -> bool {
    ["oracle", "clairvoyant"].contains(&controller.name.as_str())
}

/// Who commands the episodes that run side by side.
struct Pilots<'a> {
    kind: Kind<'a>,
    states: Vec<f32>,
    actions: Vec<f32>,
}

enum Kind<'a> {
    Policy(&'a mut Policy),
    /// One an episode.
    Controllers(Vec<Box<dyn Controller>>),
}

impl<'a> Pilots<'a> {
    fn new(driver: &'a mut Driver, task: &Task, count: usize) -> Result<Pilots<'a>, SimError> {
        let kind = match driver {
            Driver::Policy(policy) => Kind::Policy(policy),
            Driver::Controller(what) => {
                Kind::Controllers((0..count).map(|_| controller(what, task)).collect::<Result<_, _>>()?)
            }
        };
        let states = vec![0.0; count * team::members(task) * task.state_len()];
        Ok(Pilots { kind, states, actions: vec![0.0; count * task.action_len()] })
    }

    fn command(&mut self, task: &Task, runs: &[Run]) {
        match &mut self.kind {
            Kind::Policy(policy) => {
                let rows = team::members(task);
                for (run, states) in runs.iter().zip(self.states.chunks_exact_mut(rows * task.state_len())) {
                    team::observe(task, run.believed(), states);
                }
                policy.act(&self.states, rows * runs.len(), &mut self.actions);
            }
            Kind::Controllers(controllers) => {
                let actions = self.actions.chunks_exact_mut(task.action_len());
                for ((run, controller), action) in runs.iter().zip(controllers).zip(actions) {
                    controller.command(task, run.believed(), action);
                }
            }
        }
    }
}

/// One held-out episode and what is measured of it.
struct Run {
    episode: Episode,
    /// Of robots that do not know their poses.
    belief: Option<Belief>,
    total: f64,
    terms: Vec<f64>,
    /// Sum of the distances over the second half.
    error_m: f64,
    collision_steps: u32,
    late_collision_steps: u32,
    outside_steps: u32,
    hit_steps: u32,
    late_hit_steps: u32,
    trajectory: Option<Trajectory>,
}

impl Run {
    fn begin(task: &Task, sight: Option<&Sight>, key: EpisodeKey) -> Result<Run, Halt> {
        let mut episode = task.episode();
        task.reset(&mut episode, key).map_err(no_start)?;
        let recorded = key.episode < RECORDED;
        let mut run = Run {
            episode,
            belief: sight.map(|sight| sight.begin(task, key, recorded)).transpose()?,
            total: 0.0,
            terms: vec![0.0; task.term_count()],
            error_m: 0.0,
            collision_steps: 0,
            late_collision_steps: 0,
            outside_steps: 0,
            hit_steps: 0,
            late_hit_steps: 0,
            trajectory: recorded.then(Trajectory::default),
        };
        run.record_frame(task);
        Ok(run)
    }

    /// The episode as those see it who act.
    fn believed(&self) -> &Episode {
        self.belief.as_ref().map_or(&self.episode, |belief| &belief.episode)
    }

    fn step(&mut self, task: &Task, action: &[f32]) -> Result<(), Fault> {
        let step = match &self.belief {
            Some(belief) => task.step_believing(&mut self.episode, &belief.episode, action, Mode::Evaluate),
            None => task.step(&mut self.episode, action, Mode::Evaluate),
        };
        if let Some(fault) = step.fault {
            return Err(*fault);
        }
        let now = self.episode.time_steps();
        self.total += step.reward;
        for (sum, term) in self.terms.iter_mut().zip(self.episode.terms()) {
            *sum += term;
        }
        if 2 * now > task.horizon() {
            self.error_m += step.error_m;
        }
        let (collided, hit) = (u32::from(step.collisions > 0), u32::from(step.hits > 0));
        self.collision_steps += collided;
        self.hit_steps += hit;
        if now > SETTLED {
            self.late_collision_steps += collided;
            self.late_hit_steps += hit;
        }
        self.outside_steps += u32::from(step.outside);
        self.record_frame(task);
        if let Some(trajectory) = &mut self.trajectory {
            trajectory.terms.extend(self.episode.terms().iter().map(|term| *term as f32));
            trajectory.error_m.push(step.error_m as f32);
            trajectory.actions.extend_from_slice(action);
            trajectory.collisions.push(step.collisions);
        }
        Ok(())
    }

    fn record_frame(&mut self, task: &Task) {
        let Some(trajectory) = &mut self.trajectory else { return };
        let episode = &self.episode;
        let pose = |agent| {
            let [x, y] = episode.position(agent);
            [x as f32, y as f32, episode.heading(agent) as f32]
        };
        trajectory.agents.extend((0..task.agents()).map(pose));
        trajectory.slots.extend(episode.slots().iter().map(|slot| slot.map(|x| x as f32)));
    }

    fn finish(self, task: &Task, evaluation: &mut Evaluation) {
        let second_half = task.horizon() - task.horizon() / 2;
        evaluation.returns.push(self.total);
        evaluation.error_m.push(self.error_m / second_half as f64);
        evaluation.terms.push(self.terms);
        evaluation.collision_steps.push(self.collision_steps);
        evaluation.late_collision_steps.push(self.late_collision_steps);
        evaluation.outside_steps.push(self.outside_steps);
        evaluation.hit_steps.push(self.hit_steps);
        evaluation.late_hit_steps.push(self.late_hit_steps);
        evaluation.trajectories.extend(self.trajectory);
        if let (Some(belief), Some(told)) = (self.belief, &mut evaluation.told) {
            belief.finish(told);
        }
    }
}

#[cfg(test)]
mod tests {
    use mpgx_lang::plan::*;

    use super::*;
    use crate::cell::cells;
    use crate::tests::sample;
    use crate::training::Trainer;
    use crate::worlds::Worlds;

    const KEY: EpisodeKey = EpisodeKey { master: 0, protocol: 1, seed: 0, episode: 0 };

    fn fixed(x: f64, y: f64) -> Expr {
        Expr::Vector(Box::new(Expr::Number(x)), Box::new(Expr::Number(y)))
    }

    /// A leader that stands still; its follower starts 1 m from the slot and may go 0.07 m in a step.
    fn standing() -> Plan {
        let mut plan = sample::plan();
        plan.world.horizon = 50;
        plan.world.groups[0].start = Some(fixed(0.0, 0.0));
        plan.world.groups[0].speed_mps = (0.0, 0.0);
        plan.world.groups[1].start = Some(fixed(0.2, 1.0));
        plan
    }

    fn by_oracle(plan: &Plan, episodes: usize) -> Evaluation {
        let task = Task::new(plan, &plan.world).unwrap();
        let oracle = plan.controllers[0].what.clone();
        match evaluate(&task, None, &mut Driver::Controller(&oracle), KEY, episodes, || false) {
            Ok(evaluation) => evaluation,
            Err(_) => panic!("it did not end"),
        }
    }

    /// Distances 0.93, 0.86, … 0.3 over ten steps, by hand.
    #[test]
    fn measures_are_those_of_their_definition() {
        let mut plan = standing();
        plan.world.horizon = 10;
        plan.world.safety_m = 0.5;
        let evaluation = by_oracle(&plan, 1);
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-6, "{a} is not {b}");
        near(evaluation.returns[0], -(10.0 - 0.07 * 55.0));
        near(evaluation.terms[0][0], evaluation.returns[0]);
        near(evaluation.error_m[0], 1.0 - 0.07 * 8.0);
        // 0.2 m beside the leader, it is nearer than 0.5 m from a distance of 0.458 m on: steps 8 to 10.
        assert_eq!(evaluation.collision_steps, [3]);
        assert_eq!(evaluation.late_collision_steps, [0]);
        assert_eq!(evaluation.outside_steps, [0]);
    }

    /// The follower starts outside and needs 8 steps to come in; an end neither stops an episode nor is free.
    #[test]
    fn the_whole_horizon_runs_and_costs_are_charged() {
        let mut plan = standing();
        plan.world.safety_m = 0.21;
        plan.world.groups[1].arena = Some(Area { x_m: (-2.0, 2.0), y_m: (0.5, 2.0) });
        let evaluation = by_oracle(&plan, 1);
        assert_eq!(evaluation.trajectories[0].error_m.len(), 50);
        // It is put back to y = 0.5 in each step after the seventh.
        assert_eq!(evaluation.outside_steps, [43]);
        let gaps = evaluation.trajectories[0].error_m.iter().map(|error| f64::from(*error)).sum::<f64>();
        assert!((evaluation.returns[0] + gaps + 43.0).abs() < 1e-4);
        assert_eq!(evaluation.collision_steps, [0]);
        plan.world.groups[1].arena = None;
        assert_eq!(by_oracle(&plan, 1).late_collision_steps, [10]);
    }

    #[test]
    fn episodes_differ_but_not_by_how_many_run_beside_them() {
        let plan = sample::plan();
        let many = by_oracle(&plan, SIDE_BY_SIDE + 3);
        let few = by_oracle(&plan, 5);
        assert_eq!(many.returns[..5], few.returns);
        assert_eq!(many.trajectories, few.trajectories);
        let mut returns: Vec<u64> = many.returns.iter().map(|total| total.to_bits()).collect();
        returns.sort_unstable();
        returns.dedup();
        assert_eq!(returns.len(), SIDE_BY_SIDE + 3);
    }

    #[test]
    fn the_first_episodes_are_recorded_whole() {
        let plan = sample::plan();
        let evaluation = by_oracle(&plan, 5);
        assert_eq!(evaluation.trajectories.len(), RECORDED as usize);
        for trajectory in &evaluation.trajectories {
            assert_eq!((trajectory.agents.len(), trajectory.slots.len()), (2 * 8, 8));
            assert_eq!((trajectory.terms.len(), trajectory.error_m.len()), (7, 7));
            assert_eq!((trajectory.actions.len(), trajectory.collisions.len()), (14, 7));
            assert!(trajectory.actions.iter().all(|action| action.abs() <= 1.0));
        }
    }

    /// Each action is that of the policy for the member's own state, with two members as with three.
    #[test]
    fn a_shared_policy_acts_for_each_member() {
        let plan = sample::shared();
        let worlds = Worlds::new(&plan).unwrap();
        let cell = &cells(&plan).unwrap()[0];
        let (_, mut policy) =
            Trainer::new(&worlds.training, &plan.stages, cell, 0).map(Trainer::finish).unwrap();
        assert_eq!((policy.state_len(), policy.action_len()), (2, 2));
        for (task, members) in worlds.held_out.iter().zip([2, 3]) {
            let mut driver = Driver::Policy(policy.clone());
            let Ok(evaluation) = evaluate(task, None, &mut driver, KEY, 2, || false) else {
                panic!("it did not end")
            };
            let Trajectory { agents, slots, actions, .. } = &evaluation.trajectories[1];
            assert_eq!(actions.len(), 7 * members * 2);
            for (k, action) in actions.chunks(2).enumerate() {
                let (step, member) = (k / members, k % members);
                let ([x, y], [px, py, _]) = (slots[k], agents[step * (members + 1) + 1 + member]);
                let mut own = [0.0; 2];
                policy.act(&[x - px, y - py], 1, &mut own);
                assert!(own.iter().zip(action).all(|(a, b)| (a - b).abs() < 1e-4), "{own:?} {action:?}");
            }
        }
    }
}
