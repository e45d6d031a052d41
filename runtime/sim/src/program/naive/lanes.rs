//! Programs over lanes against the same programs in each lane by itself.

use super::*;
use crate::lanes::{LANES, put};
use crate::program::{Crowd, ManyDraws, Scenes};

const STATES: [Vec2; 2] = [[0.75, 0.0], [-0.5, 0.25]];

/// Agents of each lane, side by side.
fn side_by_side(lanes: &[Agents]) -> Crowd {
    let plane = |column: fn(&Agents) -> &Vec<Vec2>| {
        let mut out = vec![[[0.0; LANES]; 2]; 8];
        for (lane, agents) in lanes.iter().enumerate() {
            column(agents).iter().zip(&mut out).for_each(|(v, out)| put(out, lane, *v));
        }
        out
    };
    Crowd {
        position: plane(|agents| &agents.position),
        velocity: plane(|agents| &agents.velocity),
        course: plane(|agents| &agents.course),
        command: plane(|agents| &agents.command),
        last_command: plane(|agents| &agents.last_command),
        heading: (0..8).map(|k| std::array::from_fn(|lane| lanes[lane].heading[k])).collect(),
        outside: (0..8).map(|k| std::array::from_fn(|lane| lanes[lane].outside[k])).collect(),
    }
}

proptest! {
    #![proptest_config(sample::cases(4000))]

    #[test]
    fn each_lane_gets_the_bits_of_its_own(seed: u64, kind in 0..3, draws: bool, depth in 0u32..6) {
        let mut author = Author::new(stream(seed, 0).stream().clone(), draws);
        let expr = match kind {
            0 => author.number(depth),
            1 => author.vector(depth),
            _ => author.truth(depth),
        };
        let plan = world();
        let layout = Layout::new(&plan.params, &plan.world, model(&plan));
        let scope = Scope { member: Some(1), states: &[false, true], draws, ..Scope::default() };
        let program = match Compiler::new(&layout, scope).program(&expr) {
            Err(Flaw::TooManyDraws { .. }) => return Ok(()),
            compiled => compiled.map_err(|flaw| TestCaseError::fail(flaw.to_string()))?,
        };
        let lanes: Vec<Agents> = (0..LANES as u16).map(|lane| crowd(stream(seed, 100 + lane).stream())).collect();
        let drawn: [f64; LANES] = std::array::from_fn(|lane| DRAWN - lane as f64 / 8.0);
        let states = STATES.map(|state| state.map(|x| std::array::from_fn(|lane| x + lane as f64 / 4.0)));
        let addresses = std::array::from_fn(|lane| address(seed, 200 + lane as u16));
        let crowd = side_by_side(&lanes);
        let mut many = ManyDraws::new(addresses);
        let params = [drawn];
        let mut scenes = Scenes::new(&layout.model, &crowd, &params, 1.25).random(&states, &mut many);
        let found = match &program {
            Program::Truth(truth) => [truth.eval_lanes(&mut scenes).map(|truth| f64::from(u8::from(truth))), [0.0; LANES]],
            other => other.eval_lanes(&mut scenes),
        };
        for lane in 0..LANES {
            let states = [0, 1].map(|k: usize| [states[k][0][lane], states[k][1][lane]]);
            let mut draws = Draws::new(addresses[lane]);
            let param = [drawn[lane]];
            let mut scene = Scene::new(&layout.model, &lanes[lane], &param, 1.25).random(&states, &mut draws);
            let expected = match &program {
                Program::Truth(truth) => [f64::from(truth.eval(&mut scene)), 0.0],
                other => other.eval(&mut scene),
            };
            prop_assert_eq!(bits([found[0][lane], found[1][lane]]), bits(expected), "lane {} of {:?}", lane, expr);
        }
    }
}
