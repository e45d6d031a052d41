//! How fast the networks are: one image of 64 × 64 at a time, and images a second of training.
//! `RAYON_NUM_THREADS=1 cargo run --release -p mpgx-vision --features vision --example latency`

use std::error::Error;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Instant;

use mpgx_vision::network::{ImageSet, Localiser, ResNetConfig, Source, TrainConfig, train_to};
use mpgx_vision::{CameraConfig, Image, Pose};

const BATCH: usize = 16;

fn main() -> Result<(), Box<dyn Error>> {
    let mut set = ImageSet::new(64, 64);
    for image in 0..4 * BATCH {
        let bytes = (0..3 * 64 * 64).map(|byte| (byte * (image + 7) % 251) as u8).collect();
        let pose = Pose { x_m: image as f64, y_m: (image % 7) as f64, heading_rad: 0.1 * image as f64 };
        set.add(&Image { width: 64, height: 64, rgb: bytes }, CameraConfig::default().pose(pose));
    }
    let image = set.image(0);
    let source = Source::Recorded(Arc::new(set));
    let folder = std::env::temp_dir().join(format!("mpgx-latency-{}", std::process::id()));
    std::fs::create_dir_all(&folder)?;
    for (depth, steps) in [(18, 20), (50, 12)] {
        let network = ResNetConfig { depth, ..ResNetConfig::default() };
        let config = TrainConfig { network, steps, batch: BATCH, ..TrainConfig::default() };
        let mut times = vec![Instant::now()];
        let weights =
            train_to(&config, &source, &folder.join(format!("{depth}.safetensors")), steps, &mut |_| {
                times.push(Instant::now());
                ControlFlow::Continue(())
            })?;
        // The first steps warm up.
        let trained = BATCH as f64 / median(times.windows(2).skip(3).map(|pair| pair[1] - pair[0]));
        let localiser = Localiser::new(&weights);
        let mut timed = Vec::new();
        for _ in 0..30 {
            let start = Instant::now();
            localiser.estimate(std::slice::from_ref(&image))?;
            timed.push(start.elapsed());
        }
        let forward = 1e3 * median(timed.into_iter().skip(5));
        println!(
            "resnet{depth}: {forward:.1} ms an image, {trained:.1} images/s of training (batch {BATCH})"
        );
    }
    std::fs::remove_dir_all(folder)?;
    Ok(())
}

/// Seconds.
fn median(times: impl Iterator<Item = std::time::Duration>) -> f64 {
    let mut times: Vec<f64> = times.map(|time| time.as_secs_f64()).collect();
    times.sort_by(f64::total_cmp);
    times.get(times.len() / 2).copied().unwrap_or(f64::NAN)
}
