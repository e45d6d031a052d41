//! What a camera showed in a recorded episode, made again from the record.

use mpgx_lang::plan::{Extern, Plan, Setting};
use mpgx_vision::declared::{camera_config, time_of_day, world_config};
use mpgx_vision::{Image, Moving, Scene, Shot, TimeOfDay, TrialKey};

use crate::record::Trajectory;
use crate::run::REPORTING_MASTER;
use crate::worlds::episodes_of;

/// The pictures of the camera on `agent` at some frames of an episode (by its number) of a protocol (by its place in the
/// Plan). `None` if it has no camera. Poses of records are rounded, so a picture may differ from what was seen by as much.
pub fn film(
    plan: &Plan,
    protocol: usize,
    episode: u32,
    trajectory: &Trajectory,
    agent: usize,
    frames: impl Iterator<Item = usize>,
) -> Option<Vec<Image>> {
    let world = plan.protocols.get(protocol)?.world.as_deref().unwrap_or(&plan.world);
    let bodies: Vec<&mpgx_lang::plan::Group> =
        world.groups.iter().flat_map(|group| std::iter::repeat_n(group, group.size)).collect();
    let camera = camera_config(bodies.get(agent)?.camera.as_ref()?).ok()?;
    let scenery = world.scenery.as_ref()?;
    let light = match &scenery.lighting {
        Some(lighting) => time_of_day(lighting).ok()?,
        None => TimeOfDay::of_trial(episode),
    };
    let key = TrialKey { master: REPORTING_MASTER, protocol: episodes_of(plan, protocol), seed: 0, episode };
    let scene = Scene::new(&world_config(scenery).ok()?, &camera, light, key).ok()?;
    let agents = bodies.len();
    let moving = |frame: usize, agent: usize| {
        let stand = |frame: usize| {
            let &[x, y, heading] = trajectory.agents.get(frame * agents + agent)?;
            let heading = f64::from(heading);
            let (sin, cos) = libm::sincos(heading);
            let hand = hand_m(&bodies.get(agent)?.body);
            Some([f64::from(x) - hand * cos, f64::from(y) - hand * sin, heading])
        };
        let now = stand(frame)?;
        Some(Moving::between(stand(frame.saturating_sub(1))?, now, world.dt_s))
    };
    let picture = |frame: usize| {
        let others = (0..agents)
            .filter(|&other| other != agent && bodies.get(other).is_some_and(|it| it.solid.is_none()));
        let robots = others.map(|other| moving(frame, other)).collect::<Option<Vec<Moving>>>()?;
        let camera = moving(frame, agent)?;
        let number = (frame * agents + agent) as u64;
        Some(scene.render(&Shot { camera, robots: &robots, time_s: frame as f64 * world.dt_s, number }))
    };
    frames.map(picture).collect()
}

/// Distance of a body's hand point ahead of its axle, m.
fn hand_m(body: &Extern) -> f64 {
    match body.settings.get("hand") {
        Some(Setting::Number(hand_m)) => *hand_m,
        _ => 0.0,
    }
}
