//! Scripted agents: the motions of the Plan, compiled.

mod lanes;

use mpgx_lang::plan::{Motion, MotionOutput};
use mpgx_random::Purpose;

use crate::episode::Episode;
use crate::error::Flaw;
use crate::maths::{Vec2, clamp_axes};
use crate::program::{Compiler, Draws, Layout, Program, Scene, Scope, Vector};
use crate::task::Task;
pub(crate) use lanes::move_scripted_lanes;

/// What moves one scripted agent.
#[derive(Clone, Debug)]
pub(crate) struct Script {
    pub agent: usize,
    /// Whether the output is a position (and no velocity).
    pub positions: bool,
    /// Where its states lie in the memory of the episode.
    first: usize,
    states: Vec<State>,
    output: Vector,
}

/// A state variable.
#[derive(Clone, Debug)]
struct State {
    start: Program,
    next: Program,
}

impl Script {
    /// Compiles a motion whose states lie at `first` and after. Its start may look only at agents that are
    /// placed before it (`placed`).
    pub fn new(
        layout: &Layout,
        motion: &Motion,
        agent: usize,
        first: usize,
        placed: &[bool],
    ) -> Result<Script, Flaw> {
        let mut kinds = Vec::new();
        let mut starts = Vec::new();
        for state in &motion.states {
            let scope = Scope {
                member: Some(agent),
                states: &kinds,
                draws: true,
                placed: Some(placed),
                ..Scope::default()
            };
            let start = Compiler::new(layout, scope).program(&state.start)?;
            let vector = match start {
                Program::Number(_) => false,
                Program::Vector(_) => true,
                Program::Truth(_) => {
                    return Err(Flaw::Kind { expected: "a number or a vector", found: start.kind() });
                }
            };
            starts.push(start);
            kinds.push(vector);
        }
        let scope = Scope { member: Some(agent), states: &kinds, draws: true, ..Scope::default() };
        let mut states = Vec::new();
        for (start, state) in starts.into_iter().zip(&motion.states) {
            let next = Compiler::new(layout, scope).program(&state.next)?;
            if next.kind() != start.kind() {
                return Err(Flaw::Kind { expected: start.kind(), found: next.kind() });
            }
            states.push(State { start, next });
        }
        let (output, scope, positions) = match &motion.output {
            MotionOutput::Velocity(output) => (output, scope, false),
            MotionOutput::Position(output) => (output, Scope { placed: Some(placed), ..scope }, true),
        };
        let output = Compiler::new(layout, scope).vector(output)?;
        Ok(Script { agent, positions, first, states, output })
    }

    /// Number of entries in the memory of the episode.
    pub fn memory(&self) -> usize {
        self.states.len()
    }

    /// Draws the start states, and places the agent if the motion tells positions.
    pub fn start(&self, task: &Task, episode: &mut Episode) {
        let mut draws = Draws::new(episode.key.address(Purpose::Motion, self.agent, 0));
        let own = self.first..self.first + self.states.len();
        for (k, state) in self.states.iter().enumerate() {
            let scene = task.scene(episode);
            let value = state.start.eval(&mut scene.random(&episode.memory[own.clone()], &mut draws));
            episode.memory[self.first + k] = value;
        }
        if self.positions {
            let scene = task.scene(episode);
            let position = self.output.eval(&mut scene.random(&episode.memory[own], &mut draws));
            episode.agents.position[self.agent] = position;
        }
    }

    /// Changes the states (all at once, in `episode.fresh`) and gives the output, both at the time of the
    /// end of step `step`.
    fn advance(&self, task: &Task, episode: &mut Episode, step: usize) -> Vec2 {
        let time_s = step as f64 * task.dt_s;
        let mut draws = Draws::new(episode.key.address(Purpose::Motion, self.agent, step as u64));
        let own = self.first..self.first + self.states.len();
        for (k, state) in self.states.iter().enumerate() {
            let scene = Scene::new(&task.model, &episode.agents, &episode.params, time_s);
            let value = state.next.eval(&mut scene.random(&episode.memory[own.clone()], &mut draws));
            episode.fresh[self.first + k] = value;
        }
        let scene = Scene::new(&task.model, &episode.agents, &episode.params, time_s);
        self.output.eval(&mut scene.random(&episode.fresh[own], &mut draws))
    }
}

/// Moves all scripted agents through the step that follows; they see each other where they were.
pub(crate) fn move_scripted(task: &Task, episode: &mut Episode) {
    let step = episode.step + 1;
    for (k, script) in task.scripts.iter().enumerate() {
        episode.outputs[k] = script.advance(task, episode, step);
    }
    std::mem::swap(&mut episode.memory, &mut episode.fresh);
    for (k, script) in task.scripts.iter().enumerate() {
        let output = episode.outputs[k];
        if script.positions {
            episode.agents.position[script.agent] = output;
            continue;
        }
        task.drive(episode, script.agent, clamp_axes(output, task.agents[script.agent].speed_mps));
        let position = &mut episode.agents.position[script.agent];
        *position = task.agents[script.agent].inside(*position);
    }
}
