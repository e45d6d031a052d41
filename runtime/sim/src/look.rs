//! Looking at a world without training: what the reward would be with one agent elsewhere.

use crate::episode::Episode;
use crate::maths::{Vec2, clamp_axes};
use crate::step::{Mode, Step};
use crate::task::Task;

/// What a state is worth.
#[derive(Clone, Debug, PartialEq)]
pub struct Worth {
    /// Of the team, less the costs of the ends that hold; not finite where the scenario makes it so.
    pub reward: f64,
    /// Each reward term; if members are rewarded for themselves, its mean.
    pub terms: Vec<f64>,
    /// Whether each end holds, in the Plan's order.
    pub ends: Vec<bool>,
}

impl Task {
    /// What the present state would be worth with an agent at rest at each of some positions, m, all others as
    /// they are.
    ///
    /// # Panics
    /// If there is no such agent, or if the episode is of another task.
    pub fn worth(&self, episode: &Episode, agent: usize, positions: &[[f64; 2]]) -> Vec<Worth> {
        let mut elsewhere = episode.clone();
        let worth = |position: &[f64; 2]| {
            self.put(&mut elsewhere, agent, *position);
            let reward = self.judge(&mut elsewhere).reward;
            let mut scene = self.scene(&elsewhere);
            let ends = self.ends.iter().map(|end| end.when.eval(&mut scene)).collect();
            Worth { reward, terms: elsewhere.terms.clone(), ends }
        };
        positions.iter().map(worth).collect()
    }

    /// A step in which the learned agents stand still, as far as the limits of their speed let them.
    pub fn idle(&self, episode: &mut Episode, mode: Mode) -> Step {
        for (asked, &id) in episode.asked.iter_mut().zip(&self.learned) {
            *asked = clamp_axes([0.0; 2], self.agents[id].speed_mps);
        }
        self.advance(episode, mode)
    }

    /// The lengths that the edges of a formation's graph should have now, in order, m; none if it tells places.
    ///
    /// # Panics
    /// If there is no such formation, or if the episode is of another task.
    pub fn lengths(&self, episode: &Episode, formation: usize) -> Vec<f64> {
        let mut scene = self.scene(episode);
        let edges = self.model.formations[formation].edges().iter().enumerate();
        edges.map(|(k, ends)| scene.rest(formation, k, *ends)).collect()
    }

    /// The heading of an agent whose body has one, rad.
    pub fn heading(&self, episode: &Episode, agent: usize) -> Option<f64> {
        self.model.headed[agent].then(|| episode.heading(agent))
    }

    /// Puts an agent at a position, m, at rest.
    pub(crate) fn put(&self, episode: &mut Episode, agent: usize, position: Vec2) {
        let agents = &mut episode.agents;
        agents.position[agent] = position;
        agents.velocity[agent] = [0.0; 2];
        agents.command[agent] = [0.0; 2];
        agents.last_command[agent] = [0.0; 2];
        agents.outside[agent] = self.agents[agent].is_outside(position);
        self.refresh_slots(episode);
    }
}

#[cfg(test)]
mod tests {
    use mpgx_lang::plan::*;

    use super::*;
    use crate::EpisodeKey;
    use crate::sample::{self, binary, group, number, position, term, vector};

    fn begun(world: World) -> (Task, Episode) {
        let task = sample::task(world);
        let mut episode = task.episode();
        task.reset(&mut episode, EpisodeKey::default()).unwrap();
        (task, episode)
    }

    /// A square of edge 1 about the origin; the others stand in their places.
    #[test]
    fn the_worth_of_a_place_is_what_the_reward_says_of_it() {
        let mut world = sample::unison(sample::point());
        world.groups[1].start = Some(Expr::Slot(0, AgentRef::Member));
        world.groups[1].arena = Some(Area { x_m: (-2.0, 2.0), y_m: (-2.0, 2.0) });
        let miss = sample::distance(Expr::Slot(0, AgentRef::Var(0)), position(AgentRef::Var(0)));
        let gap = sample::reduce(Reduction::Sum, &[0], IndexSet::Group(1), miss);
        world.reward = vec![term("gap", sample::negated(gap)), term("more", number(0.25))];
        let outside = Expr::Agent(Quantity::Outside, AgentRef::Fixed(1));
        world.ends = vec![
            sample::end("never", Expr::Truth(false), Some(9.0)),
            sample::end("lost", outside, Some(2.0)),
        ];
        let (task, episode) = begun(world);
        let before = episode.clone();
        let home = episode.slots()[0];
        let worth = task.worth(&episode, 1, &[home, [home[0] + 0.3, home[1] + 0.4], [home[0], 3.0]]);
        assert_eq!(worth[0], Worth { reward: 0.25, terms: vec![0.0, 0.25], ends: vec![false, false] });
        assert!((worth[1].reward + 0.25).abs() < 1e-12, "{worth:?}");
        assert_eq!(worth[2].ends, [false, true]);
        assert!((worth[2].reward - (worth[2].terms[0] + 0.25 - 2.0)).abs() < 1e-12, "{worth:?}");
        assert_eq!(episode, before);
    }

    /// The places of the others go with the leader.
    #[test]
    fn places_follow_the_agent_they_are_about() {
        let mut world = sample::unison(sample::point());
        world.groups[1].start = Some(Expr::Slot(0, AgentRef::Member));
        let miss = sample::distance(Expr::Slot(0, AgentRef::Var(0)), position(AgentRef::Var(0)));
        world.reward = vec![term("gap", sample::reduce(Reduction::Sum, &[0], IndexSet::Group(1), miss))];
        let (task, episode) = begun(world);
        let worth = task.worth(&episode, 0, &[[0.0, 0.0], [3.0, 4.0]]);
        assert_eq!((worth[0].reward, worth[1].reward), (0.0, 15.0));
    }

    /// It is put there at rest, also if it moves.
    #[test]
    fn an_agent_is_judged_at_rest() {
        let mut world = sample::unison(sample::point());
        let speed = |agent| {
            let velocity = Expr::Agent(Quantity::Velocity, AgentRef::Fixed(agent));
            Expr::Call(Function::Norm, vec![velocity])
        };
        world.reward = vec![term("first", speed(1)), term("second", speed(2))];
        let (task, mut episode) = begun(world);
        task.step(&mut episode, &[1.0; 6], Mode::Train);
        let terms = &task.worth(&episode, 1, &[[0.0, 0.0]])[0].terms;
        assert_eq!(terms[0], 0.0);
        assert!(terms[1] > 0.9, "{terms:?}");
    }

    #[test]
    fn idle_agents_stand_unless_they_cannot() {
        let mut world = sample::unison(sample::point());
        world.groups[0].control = sample::velocity(vector(0.5, 0.0));
        let (task, mut episode) = begun(world.clone());
        let before = episode.clone();
        task.idle(&mut episode, Mode::Evaluate);
        assert_eq!(episode.position(1), before.position(1));
        assert!((episode.position(0)[0] - before.position(0)[0] - 0.05).abs() < 1e-12);
        world.groups[1].speed_mps = (0.2, 0.6);
        let (task, mut episode) = begun(world);
        let before = episode.position(1);
        task.idle(&mut episode, Mode::Evaluate);
        assert!((episode.position(1)[0] - before[0] - 0.02).abs() < 1e-12);
    }

    #[test]
    fn lengths_are_those_of_the_edges() {
        let mut world = sample::unison(sample::point());
        world.groups.truncate(1);
        world.groups.push(group("three", 3, sample::point(), Control::Learned, Some(vector(0.0, 0.0))));
        let lengths = vec![number(0.5), binary(BinaryOp::Add, number(0.5), Expr::Time)];
        world.formations = vec![Formation {
            group: 1,
            about: None,
            constraint: Constraint::Distances(lengths),
            graph: Graph::Path,
            ..world.formations[0].clone()
        }];
        world.observe.clear();
        world.reward.clear();
        let (task, mut episode) = begun(world);
        assert_eq!(task.lengths(&episode, 0), [0.5, 0.5]);
        task.idle(&mut episode, Mode::Train);
        assert_eq!(task.lengths(&episode, 0), [0.5, 0.6]);
        assert_eq!(task.heading(&episode, 0), None);
        let (task, episode) = begun(sample::unison(sample::unicycle()));
        assert_eq!(task.heading(&episode, 1), Some(episode.heading(1)));
        assert_eq!(task.lengths(&episode, 0), [0.0; 0]);
    }
}
