use mpgx_lang::plan::*;

use crate::episode::{Episode, EpisodeKey};
use crate::sample::{self, binary, negated, number, position, vector};
use crate::step::Mode;
use crate::task::Task;

const KEY: EpisodeKey = EpisodeKey { master: 5, protocol: 2, seed: 0, episode: 9 };
const I: AgentRef = AgentRef::Var(0);
const J: AgentRef = AgentRef::Var(1);

fn binder(id: VarId) -> Binder {
    Binder { id, name: format!("i{id}") }
}

fn each(id: VarId, set: IndexSet, filter: Option<Expr>) -> Option<Each> {
    Some(Each { var: binder(id), set, filter: filter.map(Box::new) })
}

/// The position of what `over` binds as variable 1, in m.
fn seen(over: Option<Each>) -> Observation {
    Observation {
        text: "p[j]".into(),
        value: position(J),
        vector: true,
        over,
        noise: None,
        delay: 0,
        at: Place::default(),
    }
}

fn nearest(count: usize, to: AgentRef, among: IndexSet) -> IndexSet {
    IndexSet::Nearest { count, to, among: Box::new(among) }
}

/// A leader at the origin and followers at 1, 2 and 3 m on x, each of which observes for itself.
fn swarm(observe: Vec<Observation>) -> World {
    let mut world = sample::unison(sample::point());
    let x = binary(BinaryOp::Mul, Expr::MemberNumber(AgentRef::Member), vector(1.0, 0.0));
    world.groups[1].start = Some(x);
    world.shared = Some(Shared { group: 1, var: binder(0), rewarded: None });
    world.observe = observe;
    world
}

fn began(world: World) -> (Task, Episode) {
    let task = sample::task(world);
    let mut episode = task.episode();
    task.reset(&mut episode, KEY).unwrap();
    (task, episode)
}

fn states(task: &Task, episode: &Episode) -> Vec<Vec<f32>> {
    let state = |member| {
        let mut state = vec![f32::NAN; task.state_len()];
        task.observe_member(episode, member, &mut state);
        state
    };
    (0..task.shared().unwrap_or(1)).map(state).collect()
}

fn refusal(world: World) -> String {
    let plan = sample::plan(world);
    Task::new(&plan, &plan.world).unwrap_err().to_string()
}

#[test]
fn each_member_of_a_shared_policy_sees_its_own_state() {
    let other = Expr::Unary(UnaryOp::Not, Box::new(Expr::Same(I, J)));
    let own = Observation { text: "p[i]".into(), value: position(I), ..seen(None) };
    let others = seen(each(1, IndexSet::Group(1), Some(other)));
    let leader = seen(each(1, IndexSet::Group(0), None));
    let (task, mut episode) = began(swarm(vec![own, others, leader]));
    assert_eq!((task.shared(), task.state_len(), task.action_len()), (Some(3), 8, 6));
    let expected = [[1.0, 0.0, 2.0, 0.0, 3.0, 0.0, 0.0, 0.0], [2.0, 0.0, 1.0, 0.0, 3.0, 0.0, 0.0, 0.0]];
    assert_eq!(states(&task, &episode)[..2], expected);
    let names = ["p[i] x", "p[i] y", "p[j] (1 of 2) x", "p[j] (1 of 2) y"];
    assert_eq!(task.observation_names()[..4], names);
    assert_eq!(task.observation_names()[6], "p[j] (leader) x");
    // The command of member k is entries 2k and 2k + 1.
    task.step(&mut episode, &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0], Mode::Train);
    assert_eq!(states(&task, &episode)[1][1], 0.07);
    assert_eq!(task.action_names()[3], "follower[2] velocity y");
}

#[test]
fn members_must_see_as_much_as_each_other() {
    let first = binary(BinaryOp::Greater, Expr::MemberNumber(J), Expr::MemberNumber(I));
    assert_eq!(
        refusal(swarm(vec![seen(each(1, IndexSet::Group(1), Some(first)))])),
        "observation `p[j]`: every member needs as many entries, but follower[1] has 2 and follower[2] has 1; \
         leave out the filter or change it"
    );
    let near = binary(BinaryOp::Less, Expr::Clearance(I, J), number(1.0));
    let changing = seen(each(1, IndexSet::Group(1), Some(near)));
    assert!(refusal(swarm(vec![changing])).contains("must not change during an episode"));
    let odd = binary(BinaryOp::Equal, Expr::MemberNumber(J), number(1.0));
    let nearest = seen(each(1, nearest(2, I, IndexSet::All), Some(odd)));
    assert!(refusal(swarm(vec![nearest])).contains("must not change during an episode"));
    let mut two = swarm(vec![]);
    two.groups[0].control = Control::Learned;
    assert_eq!(
        refusal(two),
        "`follower` cannot have a policy of its own beside other learned agents, or without any (follower.scn:1:1)"
    );
}

#[test]
fn the_nearest_are_those_that_are_nearest_now() {
    let order = |observation: Observation, places: [[f64; 2]; 4]| {
        let (task, mut episode) = began(swarm(vec![observation]));
        episode.agents.position = places.to_vec();
        states(&task, &episode)
    };
    let places = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]];
    let two = || seen(each(1, nearest(2, I, IndexSet::All), None));
    let found = order(two(), places);
    assert_eq!(found[0], [0.0, 0.0, 2.0, 0.0], "of equals the first");
    assert_eq!(found[2], [2.0, 0.0, 1.0, 0.0]);
    let found = order(two(), [[5.0, 0.0], [1.0, 0.0], [2.0, 0.0], [1.5, 0.0]]);
    assert_eq!(found[0], [1.5, 0.0, 2.0, 0.0]);
    // As many as there can be: the two others of three, and no more than one leader.
    assert_eq!(
        order(seen(each(1, nearest(9, I, IndexSet::Group(1)), None)), places)[0],
        [2.0, 0.0, 3.0, 0.0]
    );
    assert_eq!(order(seen(each(1, nearest(9, I, IndexSet::Group(0)), None)), places)[0], [0.0, 0.0]);
    let (task, _) = began(swarm(vec![two()]));
    assert_eq!(task.observation_names()[2], "p[j] (nearest 2) x");
}

#[test]
fn the_team_has_the_mean_of_what_its_members_are_rewarded() {
    let mut world = swarm(vec![]);
    let x = Expr::Call(Function::X, vec![position(I)]);
    world.reward = vec![sample::term("x", x), sample::term("two", number(2.0))];
    world.ends = vec![sample::end("costly", Expr::Truth(true), Some(0.5))];
    let Some(shared) = &mut world.shared else { panic!("it is shared") };
    shared.rewarded = Some(binder(0));
    let (task, mut episode) = began(world.clone());
    let step = task.step(&mut episode, &[0.0; 6], Mode::Train);
    assert_eq!(episode.member_rewards(), [2.5, 3.5, 4.5]);
    assert_eq!((step.reward, episode.terms()), (3.5, [2.0, 2.0].as_slice()));
    let mut world = swarm(vec![]);
    world.reward = vec![sample::term("two", number(2.0))];
    let (task, mut episode) = began(world);
    task.step(&mut episode, &[0.0; 6], Mode::Train);
    assert_eq!(episode.member_rewards(), [2.0; 3]);
}

#[test]
fn what_is_late_is_what_was() {
    let time = |delay| Observation {
        text: "t".into(),
        value: binary(BinaryOp::Add, Expr::Time, number(1.0)),
        vector: false,
        delay,
        ..seen(None)
    };
    let place = Observation { value: position(AgentRef::Fixed(1)), delay: 1, ..seen(None) };
    let mut world = swarm(vec![time(2), place, time(0), time(3)]);
    (world.shared, world.dt_s) = (None, 1.0);
    let (task, mut episode) = began(world);
    let mut found = Vec::new();
    for _ in 0..6 {
        found.push(states(&task, &episode)[0].clone());
        task.step(&mut episode, &[1.0, 0.0, 0.0, 0.0, 0.0, 0.0], Mode::Train);
    }
    let column = |k: usize| found.iter().map(|state| state[k]).collect::<Vec<_>>();
    assert_eq!(column(0), [1.0, 1.0, 1.0, 2.0, 3.0, 4.0]);
    assert_eq!(column(1), [1.0, 1.0, 1.7, 2.4, 3.1, 3.8]);
    assert_eq!(column(3), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    assert_eq!(column(4), [1.0, 1.0, 1.0, 1.0, 2.0, 3.0]);
    task.reset(&mut episode, KEY).unwrap();
    assert_eq!(states(&task, &episode)[0], found[0]);

    let mut late = swarm(vec![time(1 << 24)]);
    late.shared = None;
    assert!(refusal(late).contains("a delay of 16777216 steps is too long"));
}

#[test]
fn each_member_has_its_own_late_values() {
    let own = Observation { value: position(I), delay: 2, ..seen(None) };
    let late = seen(each(1, IndexSet::All, None));
    let (task, mut episode) = began(swarm(vec![Observation { delay: 1, ..late }, own]));
    let start = states(&task, &episode);
    for action in [[1.0; 6], [-1.0; 6], [0.5; 6]] {
        task.step(&mut episode, &action, Mode::Train);
    }
    for (member, (now, start)) in states(&task, &episode).iter().zip(&start).enumerate() {
        let x = member as f32 + 1.0;
        assert_eq!(start[8..], [x, 0.0]);
        assert_eq!(now[8..], [x + 0.07, 0.07], "after the first step");
        assert_eq!(now[2..4], [1.0, 0.0], "after the second");
    }
}

#[test]
fn noise_is_normal_and_a_function_of_episode_and_step() {
    let noisy = |deviation: f64| {
        let own = Observation { value: position(I), noise: Some(number(deviation)), ..seen(None) };
        let mut world = swarm(vec![own.clone(), Observation { noise: None, ..own }]);
        world.observe.push(seen(each(1, IndexSet::Group(0), None)));
        began(world)
    };
    let (task, mut episode) = noisy(0.5);
    let (twin, mut same) = noisy(1.0);
    let mut draws = Vec::new();
    for step in 0..200 {
        let (found, twins) = (states(&task, &episode), states(&twin, &same));
        assert_eq!(found, states(&task, &episode), "looking twice changes nothing");
        for (state, twin) in found.iter().zip(&twins) {
            for k in 0..2 {
                let noise = f64::from(state[k]) - f64::from(state[2 + k]);
                assert!((2.0 * noise - f64::from(twin[k] - twin[2 + k])).abs() < 1e-5);
                draws.push(noise / 0.5);
            }
            assert_eq!(state[4..], [0.0, 0.0]);
        }
        let action = [(step as f32).sin(); 6];
        task.step(&mut episode, &action, Mode::Train);
        twin.step(&mut same, &[0.0; 6], Mode::Evaluate);
        same.agents.position.clone_from(&episode.agents.position);
    }
    let count = draws.len() as f64;
    let mean = draws.iter().sum::<f64>() / count;
    let variance = draws.iter().map(|x| x * x).sum::<f64>() / count;
    assert!(mean.abs() < 0.1 && (variance - 1.0).abs() < 0.15, "{mean}, {variance}");
    let mut sorted = draws.clone();
    sorted.sort_by(f64::total_cmp);
    assert!(
        sorted.windows(2).all(|pair| pair[1] - pair[0] > 0.0 || pair[0].abs() > 3.0),
        "each its own draw"
    );
    task.reset(&mut episode, EpisodeKey { episode: 10, ..KEY }).unwrap();
    assert!((f64::from(states(&task, &episode)[0][0] - 1.0) / 0.5 - draws[0]).abs() > 1e-6);
}

/// Noise is of the reading, also of what is late; its deviation may depend on the member that is observed.
#[test]
fn noise_comes_upon_late_values() {
    let deviation = Expr::Call(Function::Norm, vec![position(J)]);
    let late = Observation { noise: Some(deviation), delay: 3, ..seen(each(1, IndexSet::All, None)) };
    let mut world = swarm(vec![late]);
    world.shared = None;
    let (task, mut episode) = began(world);
    let mut readings = Vec::new();
    for _ in 0..3 {
        readings.push(states(&task, &episode)[0].clone());
        task.step(&mut episode, &[0.0; 6], Mode::Train);
    }
    assert!(readings.iter().all(|reading| reading[..2] == [0.0, 0.0]), "the leader is at the origin");
    assert!(readings[0][2] != readings[1][2] && readings[1][2] != readings[2][2]);
    let refused = Observation { noise: Some(negated(number(1.0))), ..seen(each(1, IndexSet::All, None)) };
    assert!(refusal(swarm(vec![refused])).contains("not negative, but is -1"));
}
