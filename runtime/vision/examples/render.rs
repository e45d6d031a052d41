//! A contact sheet of the world: `cargo run --release -p mpgx-vision --example render -- OUT.png`

use std::error::Error;
use std::path::Path;

use mpgx_vision::dataset::write_png;
use mpgx_vision::{CameraConfig, Image, Moving, Pose, Scene, Shot, TimeOfDay, TrialKey, WorldConfig};

fn main() -> Result<(), Box<dyn Error>> {
    let out = std::env::args().nth(1).ok_or("say where to: a PNG file")?;
    let world = WorldConfig::default();
    let camera = CameraConfig { width_px: 320, height_px: 240, samples: 16, ..CameraConfig::default() };
    let mut rows = Vec::new();
    for (episode, heading_rad) in [0.1, 1.6, 2.9, 4.4].into_iter().enumerate() {
        let mut row = Vec::new();
        for time in TimeOfDay::ALL {
            let key = TrialKey { episode: episode as u32, ..TrialKey::default() };
            let scene = Scene::new(&world, &camera, time, key)?;
            let pose = Pose { x_m: -0.3, y_m: -0.8, heading_rad };
            let start = std::time::Instant::now();
            let shot = Shot { camera: Moving::still(pose), robots: &[], time_s: 3.0, number: 0 };
            row.push(scene.render(&shot));
            eprintln!("{:?}", start.elapsed());
        }
        rows.push(row);
    }
    write_png(Path::new(&out), &sheet(&rows))?;
    Ok(())
}

fn sheet(rows: &[Vec<Image>]) -> Image {
    let (w, h) = (rows[0][0].width, rows[0][0].height);
    let mut image = Image::new(w * rows[0].len(), h * rows.len());
    for (r, row) in rows.iter().enumerate() {
        for (c, tile) in row.iter().enumerate() {
            for y in 0..h {
                let to = 3 * ((r * h + y) * image.width + c * w);
                image.rgb[to..to + 3 * w].copy_from_slice(&tile.rgb[3 * y * w..3 * (y + 1) * w]);
            }
        }
    }
    image
}
