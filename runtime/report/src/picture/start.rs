//! The start of an episode, and what it would be worth with one agent elsewhere, from a Plan alone.

use mpgx_lang::plan::{Constraint, Control, Plan, World};
use mpgx_sim::{Episode, EpisodeKey, Mode, SimError, Task, Worth};

use super::{Landscape, Moment, extent, grid, nodes};

/// Pairs of agents that a landscape may look at: of large worlds it has fewer nodes.
const PAIRS: usize = 100_000_000;

/// An episode that has just begun.
pub struct Start<'a> {
    pub moment: Moment<'a>,
    task: Task,
    episode: Episode,
}

impl<'a> Start<'a> {
    /// Of the first training episode of a seed.
    ///
    /// # Errors
    /// If there is no such task, or no start that the scenario allows.
    pub fn new(plan: &'a Plan, seed: u32) -> Result<Start<'a>, SimError> {
        let task = Task::new(plan, &plan.world)?;
        let mut episode = task.episode();
        task.reset(&mut episode, EpisodeKey { seed, ..EpisodeKey::default() })?;
        Ok(Start { moment: moment(&plan.world, &task, &episode), task, episode })
    }

    /// The reward, or the term of an index, over the positions of an agent, on about `most` nodes.
    pub fn landscape(&self, agent: usize, term: Option<usize>, most: usize) -> Landscape {
        let world = self.moment.world;
        let area = extent(&self.moment);
        let fewest = most.min(400);
        let room = (PAIRS / world.agents().pow(2).max(1)).clamp(fewest, most);
        let (columns, rows) = grid(area, room);
        let worth = self.task.worth(&self.episode, agent, &nodes(area, columns, rows));
        let failed =
            |worth: &Worth| world.ends.iter().zip(&worth.ends).any(|(end, holds)| end.failure && *holds);
        let value = |worth: &Worth| match term {
            Some(k) => worth.terms.get(k).copied().unwrap_or(f64::NAN),
            None => worth.reward,
        };
        let name = term.and_then(|k| world.reward.get(k)).map_or("reward", |term| term.name.as_str());
        Landscape {
            agent,
            name: name.to_string(),
            dimension: world.reward.first().map(|term| term.dimension.clone()).unwrap_or_default(),
            columns,
            values: worth.iter().map(value).collect(),
            failed: worth.iter().map(failed).collect(),
        }
    }
}

/// The moment, and the ways that scripted agents and obstacles will go while those that learn stand still.
fn moment<'a>(world: &'a World, task: &Task, episode: &Episode) -> Moment<'a> {
    let positions = |episode: &Episode| (0..task.agents()).map(|k| episode.position(k)).collect::<Vec<_>>();
    let moved: Vec<bool> = world
        .groups
        .iter()
        .flat_map(|group| vec![matches!(group.control, Control::Motion(_)); group.size])
        .collect();
    let start = positions(episode);
    let mut ways: Vec<Vec<[f64; 2]>> =
        start.iter().zip(&moved).map(|(at, moves)| if *moves { vec![*at] } else { Vec::new() }).collect();
    let mut later = episode.clone();
    while moved.contains(&true) && later.time_steps() < task.horizon() {
        task.idle(&mut later, Mode::Evaluate);
        for (way, at) in ways.iter_mut().zip(positions(&later)).filter(|(way, _)| !way.is_empty()) {
            way.push(at);
        }
    }
    let mut slots = episode.slots().iter().copied();
    let lengths_m: Vec<Vec<f64>> = (0..world.formations.len()).map(|k| task.lengths(episode, k)).collect();
    let places_m = world
        .formations
        .iter()
        .map(|formation| match formation.constraint {
            Constraint::Displacements { .. } => {
                let members = world.groups.get(formation.group).map_or(0, |group| group.size);
                slots.by_ref().take(members).collect()
            }
            Constraint::Distances(_) => Vec::new(),
        })
        .collect();
    let headings = (0..task.agents()).map(|k| task.heading(episode, k)).collect();
    Moment { world, positions_m: start, headings, ways_m: ways, places_m, lengths_m }
}
