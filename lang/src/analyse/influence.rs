//! Who has an influence on what: terms that learning cannot change, agents that nothing is seen or said of.

use std::collections::BTreeSet;

use super::Ground;
use super::bounds::of_member;
use super::eval::{Eval, Who};
use super::scene::Scene;
use crate::plan::{Constraint, Control, Expr, GroupId, IndexSet, MotionOutput, Slots, World};
use crate::problem::{Code, Problem};

/// What the value of an expression depends on.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Reads {
    /// Groups whose members' state counts.
    pub groups: BTreeSet<GroupId>,
    pub time: bool,
    /// Random draws, also of randomised parameters.
    pub chance: bool,
}

impl Reads {
    fn of(eval: &mut Eval, expr: &Expr) -> Reads {
        let mut reads = Reads::default();
        reads.add(eval, expr);
        reads
    }

    fn add(&mut self, eval: &mut Eval, expr: &Expr) {
        let world = eval.scene.world;
        match expr {
            Expr::Time => self.time = true,
            Expr::Draw { .. } => self.chance = true,
            Expr::Param(id) => self.chance |= world.randomise.iter().any(|drawn| drawn.param == *id),
            Expr::Agent(_, agent) => self.groups.extend(eval.who(agent).groups),
            Expr::Clearance(a, b) => {
                self.groups.extend(eval.who(a).groups);
                self.groups.extend(eval.who(b).groups);
            }
            Expr::Slot(formation, _) | Expr::Rest(formation, ..) => {
                let Some(it) = world.formations.get(*formation) else { return };
                if matches!(expr, Expr::Slot(..)) {
                    self.groups.extend(it.about.and_then(|about| eval.scene.group_of(about)));
                }
                match &it.constraint {
                    Constraint::Displacements { slots: Slots::List(all), .. }
                    | Constraint::Distances(all) => {
                        all.iter().for_each(|part| self.add(eval, part));
                    }
                    Constraint::Displacements { slots: Slots::Rule(rule), .. } => self.add(eval, rule),
                }
                return;
            }
            Expr::Reduce { vars, over, .. } => {
                self.sought(eval, over);
                let groups =
                    eval.members(over).into_iter().flat_map(|(who, _)| who).flat_map(|who| who.groups);
                let who = Who { groups: groups.collect(), agent: None };
                let outer = eval.vars.len();
                eval.vars.extend(vars.iter().map(|var| (var.id, who.clone())));
                expr.parts().into_iter().for_each(|part| self.add(eval, part));
                eval.vars.truncate(outer);
                return;
            }
            _ => {}
        }
        expr.parts().into_iter().for_each(|part| self.add(eval, part));
    }

    /// Who is nearest depends on where all are.
    fn sought(&mut self, eval: &Eval, set: &IndexSet) {
        if let IndexSet::Nearest { to, among, .. } = set {
            self.groups.extend(eval.who(to).groups);
            let among = eval.members(among).into_iter().flat_map(|(who, _)| who);
            self.groups.extend(among.flat_map(|who| who.groups));
        }
    }
}

/// What each group's movement depends on, itself among it.
pub fn movers(scene: &Scene) -> Vec<BTreeSet<GroupId>> {
    let groups = &scene.world.groups;
    let mut movers: Vec<BTreeSet<GroupId>> = Vec::new();
    for (id, group) in groups.iter().enumerate() {
        let mut reads = Reads::default();
        if let Control::Motion(motion) = &group.control {
            let mut eval = scene.of_member(id);
            motion.states.iter().for_each(|state| reads.add(&mut eval, &state.next));
            let (MotionOutput::Velocity(output) | MotionOutput::Position(output)) = &motion.output;
            reads.add(&mut eval, output);
        }
        movers.push(reads.groups.into_iter().chain([id]).collect());
    }
    loop {
        let further = |of: &BTreeSet<GroupId>| -> BTreeSet<GroupId> {
            of.iter().flat_map(|group| movers.get(*group).into_iter().flatten().copied()).collect()
        };
        let next: Vec<BTreeSet<GroupId>> = movers.iter().map(further).collect();
        if next == movers {
            return movers;
        }
        movers = next;
    }
}

/// Whether where a group's members are differs between steps or episodes.
fn varies(scene: &Scene, id: GroupId) -> bool {
    let Some(group) = scene.world.groups.get(id) else { return false };
    if group.control != Control::Still || scene.world.groups.iter().any(|other| other.stops.contains(&id)) {
        return true;
    }
    let reads = |start: &Expr| Reads::of(&mut scene.of_member(id), start);
    group.start.as_ref().map(reads).is_some_and(|reads| {
        reads.chance || reads.groups.into_iter().any(|other| other < id && varies(scene, other))
    })
}

fn is_learned(world: &World, group: GroupId) -> bool {
    world.groups.get(group).is_some_and(|group| group.control == Control::Learned)
}

pub fn influence(scene: &Scene, ground: &mut Ground) {
    let movers = movers(scene);
    let all = |reads: &Reads| -> BTreeSet<GroupId> {
        reads.groups.iter().flat_map(|group| movers.get(*group).into_iter().flatten().copied()).collect()
    };
    let world = scene.world;
    let ends: Vec<Reads> = world.ends.iter().map(|end| Reads::of(&mut Eval::new(scene), &end.when)).collect();
    let can_stop = ends.iter().any(|end| all(end).iter().any(|group| is_learned(world, *group)));
    let mut said: BTreeSet<GroupId> = ends.iter().flat_map(&all).collect();
    for (k, term) in world.reward.iter().enumerate() {
        let reads = Reads::of(&mut of_member(scene), &term.value);
        let groups = all(&reads);
        said.extend(&groups);
        if groups.iter().any(|group| is_learned(world, *group)) {
            continue;
        }
        let still = !reads.time && !reads.chance && !reads.groups.iter().any(|group| varies(scene, *group));
        match still {
            // It rewards staying in the episode.
            true if can_stop => {}
            true => ground.constant_term(k),
            false => ground.no_influence(k, &reads),
        }
    }
    let mut seen = BTreeSet::new();
    for (k, observation) in world.observe.iter().enumerate() {
        let mut eval = Eval::new(scene);
        if let Some(shared) = &world.shared {
            eval = eval.bind(shared.var.id, Who::group(shared.group));
        }
        let mut reads = Reads::default();
        if let Some(over) = &observation.over {
            reads.sought(&eval, &over.set);
            let groups =
                eval.members(&over.set).into_iter().flat_map(|(who, _)| who).flat_map(|who| who.groups);
            let who = Who { groups: groups.collect(), agent: None };
            eval = eval.bind(over.var.id, who);
        }
        reads.add(&mut eval, &observation.value);
        seen.extend(all(&reads));
        let still = !reads.time && !reads.chance && !reads.groups.iter().any(|group| varies(scene, *group));
        if still && observation.noise.is_none() {
            ground.constant_observation(k);
        }
    }
    for group in (0..world.groups.len()).filter(|group| is_learned(world, *group)) {
        if !seen.contains(&group) {
            ground.not_observed(group);
        }
        if !said.contains(&group) {
            ground.not_rewarded(group);
        }
    }
}

impl Ground<'_> {
    fn constant_term(&mut self, term: usize) {
        let name = self.term_name(term);
        let problem = Problem::warning(&CONSTANT_TERM, format!("the term `{name}` is always the same"));
        let problem = at(problem, self.term_span(term), "nothing in it changes");
        self.problems.push(problem.help("take it out: what no action changes teaches nothing"));
    }

    fn no_influence(&mut self, term: usize, reads: &Reads) {
        let name = self.term_name(term);
        let message = format!("no learned agent has an influence on the term `{name}`");
        let mut names: Vec<String> =
            reads.groups.iter().map(|group| format!("`{}`", self.group_name(*group))).collect();
        names.extend(reads.time.then(|| "time".to_owned()));
        names.extend(reads.chance.then(|| "chance".to_owned()));
        let label = format!("depends on {} only", names.join(" and "));
        let mut problem = at(Problem::warning(&NO_INFLUENCE, message), self.term_span(term), label);
        if let Some(span) = reads.groups.first().and_then(|group| self.group_span(*group)) {
            problem = problem.with(span, "goes its own way");
        }
        let learned = self.plan.world.groups.iter().find(|group| group.control == Control::Learned);
        let problem = problem.help(match learned {
            Some(group) => format!("say in it what is wanted of `{}`, or take it out", group.name),
            None => "take it out".to_owned(),
        });
        self.problems.push(problem);
    }

    fn constant_observation(&mut self, observation: usize) {
        let Some(it) = self.plan.world.observe.get(observation) else { return };
        let problem = Problem::warning(&CONSTANT_OBSERVATION, format!("`{}` never changes", it.text));
        let span = self.hir.world.observe.get(observation).map(|it| it.span);
        let problem = at(problem, span, "the same at every step of every episode");
        self.problems
            .push(problem.help("observe it relative to a learned agent, let it vary, or take it out"));
    }

    fn not_observed(&mut self, group: GroupId) {
        let name = self.group_name(group);
        let message = format!("nothing that is observed depends on `{name}`");
        let problem =
            at(Problem::warning(&NOT_OBSERVED, message), self.group_span(group), "is controlled blindly");
        let own = if self.plan.world.groups.get(group).is_some_and(|group| group.size == 1) {
            format!("p[{name}]")
        } else {
            format!("p[i] for i in {name}")
        };
        self.problems.push(problem.help(format!("observe where it is, for example `{own}`")));
    }

    fn not_rewarded(&mut self, group: GroupId) {
        let name = self.group_name(group);
        let message = format!("neither a reward nor an end depends on `{name}`");
        let problem =
            at(Problem::warning(&NOT_REWARDED, message), self.group_span(group), "may do what it likes");
        self.problems.push(
            problem.help("reward what is wanted of it, or give it a motion instead of `control = learned`"),
        );
    }
}

/// With a label, if there is a place for it.
pub(super) fn at(problem: Problem, span: Option<crate::ast::Span>, text: impl Into<String>) -> Problem {
    match span {
        Some(span) => problem.at(span, text),
        None => problem,
    }
}

pub const NO_INFLUENCE: Code = Code {
    name: "no-influence",
    explain: "\
A term of the reward depends on nothing that a learned agent does, so nothing can be learned from it; it only adds noise.
What agents with a motion do is not learned, unless the motion looks at learned agents.

    reward { gap = -|p[leader]| }                       // only the leader's own way
    reward { gap = -|p[leader] - p[follower]| }         // how far the follower is from it",
};

pub const CONSTANT_TERM: Code = Code {
    name: "constant-term",
    explain: "\
A term of the reward has the same value at every step of every episode, and no end that a learned agent could bring
about or avoid makes an episode shorter: it changes the numbers in the report, and nothing that is learned.

    reward { gap = -|p[leader] - p[follower]|, bonus = 1 m }        // `bonus` has no effect

With an end, for example `end { crash when collisions() > 0 }`, a constant rewards staying in the episode.",
};

pub const CONSTANT_OBSERVATION: Code = Code {
    name: "constant-observation",
    explain: "\
An observation has the same value at every step of every episode: the network learns nothing from it. In an evaluation
where it has another value, the network has never seen that.

    observe { p[o] for o in obstacles }                     // of obstacles that always stand in the same places
    observe { p[o] - p[follower] for o in obstacles }       // where they are as the follower sees it",
};

pub const NOT_OBSERVED: Code = Code {
    name: "not-observed",
    explain: "\
Nothing that is observed depends on where the agents of a learned group are: they are controlled blindly.

    observe { p[leader] }                       // and where is the follower?
    observe { p[leader] - p[follower] }",
};

pub const NOT_REWARDED: Code = Code {
    name: "not-rewarded",
    explain: "\
Neither a term of the reward nor an end depends on what the agents of a learned group do. Whatever they do is right.

    agents follower[2] : point { control = learned … }
    agent scout : point { control = learned … }
    reward { gap = -sum(i in follower) |p[i] - F[i]| }      // and what is wanted of `scout`?",
};
