//! A contact sheet of the world, and how fast it was drawn:
//! `cargo run --release -p mpgx-vision --example render -- OUT.png`

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use mpgx_vision::dataset::write_png;
use mpgx_vision::{
    CameraConfig, Image, Moving, Pose, Scene, Shot, TimeOfDay, TrajectoryConfig, TrajectoryKind, Trial,
    TrialConfig, TrialKey, WorldConfig,
};

fn main() -> Result<(), Box<dyn Error>> {
    let out = std::env::args().nth(1).ok_or("say where to: a PNG file")?;
    let mut rows = large()?;
    rows.extend(as_networks_see()?);
    write_png(Path::new(&out), &sheet(&rows))?;
    Ok(())
}

/// Three trials in the light of morning, afternoon and evening; then somebody who walks by, other robots and a fast turn.
fn large() -> Result<Vec<Vec<Image>>, Box<dyn Error>> {
    let world = WorldConfig::default();
    let camera = CameraConfig {
        width_px: 240,
        height_px: 180,
        samples: 24,
        shot_noise: 0.008,
        ..CameraConfig::default()
    };
    let key = |episode: u32| TrialKey { episode, ..TrialKey::default() };
    let stand = |x_m: f64, y_m: f64, heading_rad: f64| Moving::still(Pose { x_m, y_m, heading_rad });
    let take = |scene: &Scene, camera: Moving, robots: &[Moving], time_s: f64| {
        scene.render(&Shot { camera, robots, time_s, number: 0 })
    };
    let mut rows = Vec::new();
    for (episode, place) in
        [stand(-1.2, -0.6, 0.2), stand(0.3, -1.2, 1.75), stand(0.8, -0.4, 3.0)].into_iter().enumerate()
    {
        let row = TimeOfDay::ALL.map(|time| {
            Ok::<Image, Box<dyn Error>>(take(
                &Scene::new(&world, &camera, time, key(episode as u32))?,
                place,
                &[],
                6.0,
            ))
        });
        rows.push(row.into_iter().collect::<Result<_, _>>()?);
    }
    let busy = Scene::new(&WorldConfig { people: 4, ..world.clone() }, &camera, TimeOfDay::Morning, key(7))?;
    let robots = [stand(1.2, 0.3, 2.2), Moving { velocity_mps: [0.0, -0.7], ..stand(0.6, -0.3, -1.5) }];
    let evening = Scene::new(&world, &camera, TimeOfDay::Evening, key(8))?;
    let afternoon = Scene::new(&world, &camera, TimeOfDay::Afternoon, key(9))?;
    let turning = Moving { turn_radps: 2.5, ..stand(-0.5, 0.0, 4.4) };
    rows.push(vec![
        take(&busy, stand(-1.4, 0.4, 0.0), &[], 9.0),
        take(&evening, stand(-0.6, 0.0, 0.0), &robots, 0.0),
        take(&afternoon, turning, &[], 0.0),
    ]);
    Ok(rows)
}

/// Seven frames of each kind of trajectory, of the size that networks see.
fn as_networks_see() -> Result<Vec<Vec<Image>>, Box<dyn Error>> {
    let mut rows = Vec::new();
    for (kind, time_of_day) in TrajectoryKind::ALL.into_iter().zip(TimeOfDay::ALL) {
        let trajectory = TrajectoryConfig { kind, ..TrajectoryConfig::default() };
        let config = TrialConfig { trajectory, time_of_day, ..TrialConfig::default() };
        let start = Instant::now();
        let key = TrialKey { episode: 20, ..TrialKey::default() };
        let trial = Trial::new(&WorldConfig::default(), &CameraConfig::default(), &config, key)?;
        let made = start.elapsed();
        let start = Instant::now();
        let frames: Vec<Image> = (0..300).map(|number| trial.frame(3 * number).image).collect();
        let rate = 300.0 / start.elapsed().as_secs_f64();
        println!(
            "{:9} {:9}: made in {made:.0?}, {rate:.0} frames/s of 96 × 96",
            kind.name(),
            time_of_day.name()
        );
        rows.push(frames.into_iter().step_by(40).take(7).collect());
    }
    Ok(rows)
}

/// Rows of images of one height, one below the other.
fn sheet(rows: &[Vec<Image>]) -> Image {
    let width = rows.iter().map(|row| row.iter().map(|tile| tile.width).sum()).max().unwrap_or(0);
    let mut rgb = Vec::new();
    for row in rows {
        for y in 0..row.first().map_or(0, |tile| tile.height) {
            let end = rgb.len() + 3 * width;
            for tile in row {
                rgb.extend_from_slice(&tile.rgb[3 * y * tile.width..3 * (y + 1) * tile.width]);
            }
            rgb.resize(end, 255);
        }
    }
    Image { width, height: rgb.len() / (3 * width).max(1), rgb }
}
