//! From light to bytes: exposure, noise, the curve of the film.

use mpgx_random::{Purpose, Stream};

use crate::camera::CameraConfig;
use crate::colour::{Rgb, greatest, luminance, scaled};
use crate::image::Image;
use crate::world::{Part, TrialKey};

/// Numbers of the noise; every row of an image reads from a drawn place.
const NOISE: usize = 1 << 15;
/// Entries of the curve, by the root of the light up to 4.
const CURVE: usize = 4096;

/// What the sensor makes of the light in one trial.
#[derive(Clone, Debug)]
pub(crate) struct Sensor {
    /// The luminance that the trial's fixed exposure is made for.
    usual: f32,
    /// A little more or less in every trial.
    bias: f32,
    auto: f32,
    shot: f32,
    read: f32,
    noise: Vec<f32>,
    curve: Vec<u8>,
}

impl Sensor {
    /// `usual` is the mean luminance of the room.
    pub fn new(camera: &CameraConfig, usual: f32, key: TrialKey) -> Sensor {
        let mut stream = key.stream(Purpose::Scene, Part::Exposure, 0);
        let bias = libm::exp2f(0.5 * (2.0 * stream.uniform() as f32 - 1.0));
        let mut stream = TrialKey::default().stream(Purpose::Camera, Part::Grain, 0);
        let noise = (0..NOISE).map(|_| stream.normal() as f32).collect();
        Sensor {
            usual: usual.max(1e-4),
            bias,
            auto: camera.auto_exposure as f32,
            shot: camera.shot_noise as f32,
            read: camera.read_noise as f32,
            noise,
            curve: (0..CURVE).map(curve).collect(),
        }
    }

    /// The image of a film of `width` columns, row by row. `stream` draws its noise.
    pub fn develop(&self, film: &[Rgb], width: usize, stream: &mut Stream) -> Image {
        let height = film.len() / width;
        // What is far brighter than the room, as a window, counts little.
        let bright = 3.0 * self.usual;
        let mean = film.iter().map(|&light| luminance(light).min(bright)).sum::<f32>() / film.len() as f32;
        let gain = 0.27 * self.bias / (self.usual * libm::powf(mean.max(1e-4) / self.usual, self.auto));
        let mut rgb = Vec::with_capacity(3 * film.len());
        let (middle_x, middle_y) = (width as f32 / 2.0, height as f32 / 2.0);
        let corner = middle_x * middle_x + middle_y * middle_y;
        for (y, row) in film.chunks_exact(width).enumerate() {
            let start = stream.below((NOISE - (3 * width).min(NOISE - 1)) as u64) as usize;
            let mut noise = self.noise[start..].iter().cycle();
            let dy = y as f32 + 0.5 - middle_y;
            for (x, &light) in row.iter().enumerate() {
                let dx = x as f32 + 0.5 - middle_x;
                let vignette = 1.0 - 0.22 * (dx * dx + dy * dy) / corner;
                for value in scaled(light, gain * vignette) {
                    let deviation = (self.read * self.read + self.shot * self.shot * value).sqrt();
                    let value = value + deviation * noise.next().copied().unwrap_or(0.0);
                    let entry = greatest(value, 0.0).sqrt() * (CURVE as f32 / 4.0);
                    rgb.push(self.curve[(entry as usize).min(CURVE - 1)]);
                }
            }
        }
        Image { width, height, rgb }
    }
}

/// Saturates softly, then the curve of sRGB (IEC 61966-2-1).
fn curve(entry: usize) -> u8 {
    let root = (entry as f32 + 0.5) * 4.0 / CURVE as f32;
    let value = 1.0 - libm::expf(-1.25 * root * root);
    let coded = if value <= 0.0031308 { 12.92 * value } else { 1.055 * libm::powf(value, 1.0 / 2.4) - 0.055 };
    (255.0 * coded + 0.5) as u8
}
