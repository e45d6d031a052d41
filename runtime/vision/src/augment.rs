//! Changes to images that leave their poses true: other light, another lens, something in front of it. Never a mirror: a
//! mirrored room is another room.

use mpgx_random::{Address, Stream};
use serde::{Deserialize, Serialize};

use crate::image::Image;

/// How far each change goes at most; 0 leaves it out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AugmentConfig {
    /// Added to all values, of 1.
    pub brightness: f64,
    /// Factor of the distance from the mean, 1 ± this.
    pub contrast: f64,
    /// Exponent, from 1 / (1 + this) to 1 + this.
    pub gamma: f64,
    /// Factor of each colour, 1 ± this.
    pub tint: f64,
    /// Standard deviation of a Gaussian.
    pub blur_px: f64,
    /// Standard deviation, of 1.
    pub noise: f64,
    /// Side of a rectangle of one colour, as a share of the image's.
    pub cut_out: f64,
    /// Along x and y, edges repeated.
    pub shift_px: f64,
}

impl AugmentConfig {
    /// Nothing changes. For images that are rendered anew: a shift or a rectangle only hides what they show.
    pub const NONE: AugmentConfig = AugmentConfig {
        brightness: 0.0,
        contrast: 0.0,
        gamma: 0.0,
        tint: 0.0,
        blur_px: 0.0,
        noise: 0.0,
        cut_out: 0.0,
        shift_px: 0.0,
    };
}

impl Default for AugmentConfig {
    fn default() -> AugmentConfig {
        AugmentConfig {
            brightness: 0.12,
            contrast: 0.25,
            gamma: 0.3,
            tint: 0.1,
            blur_px: 0.8,
            noise: 0.03,
            cut_out: 0.3,
            shift_px: 1.0,
        }
    }
}

/// The image, changed by what is drawn at the address.
pub fn augment(image: &Image, config: &AugmentConfig, address: Address) -> Image {
    let mut light: Vec<f32> = image.rgb.iter().map(|&byte| f32::from(byte) / 255.0).collect();
    augment_light(&mut light, image.width, image.height, config, address);
    let rgb = light.iter().map(|value| (255.0 * value + 0.5) as u8).collect();
    Image { width: image.width, height: image.height, rgb }
}

/// [`augment`] for values in 0..=1, laid out as an image's bytes; they stay in 0..=1. Values beyond the image are left as
/// they are.
pub fn augment_light(
    light: &mut [f32],
    width: usize,
    height: usize,
    config: &AugmentConfig,
    address: Address,
) {
    let stream = &mut address.stream();
    let mut around = |most: f64| (most * (2.0 * stream.uniform() - 1.0)) as f32;
    let shift = [around(config.shift_px), around(config.shift_px)];
    let blur = around(config.blur_px).abs();
    let (brightness, contrast) = (around(config.brightness), 1.0 + around(config.contrast));
    let gamma = libm::exp2f(around(libm::log2(1.0 + config.gamma)));
    let tint = [1.0 + around(config.tint), 1.0 + around(config.tint), 1.0 + around(config.tint)];
    let noise = around(config.noise).abs();

    if config.shift_px > 0.0 {
        filter(light, [width, height], &shifting(shift[0]), &shifting(shift[1]));
    }
    if config.blur_px > 0.0 {
        filter(light, [width, height], &gaussian(blur), &gaussian(blur));
    }
    let (pixels, _) = light.as_chunks_mut::<3>();
    let count = (3 * pixels.len()).max(1) as f32;
    let mean = pixels.iter().flatten().sum::<f32>() / count;
    // The exponent by a table: powers are slow.
    let powers: Vec<f32> = (0..=256).map(|entry| libm::powf(entry as f32 / 256.0, gamma)).collect();
    let power = |value: f32| {
        let place = value.clamp(0.0, 1.0) * 256.0;
        let below = (place as usize).min(255);
        powers[below] + (powers[below + 1] - powers[below]) * (place - below as f32)
    };
    for pixel in pixels.iter_mut() {
        for (value, tint) in pixel.iter_mut().zip(tint) {
            *value = power((mean + contrast * (*value - mean) + brightness) * tint);
        }
    }
    if config.cut_out > 0.0 {
        cut_out(light, [width, height], config.cut_out, stream);
    }
    if config.noise > 0.0 {
        for value in light.iter_mut() {
            *value = (*value + noise * stream.normal() as f32).clamp(0.0, 1.0);
        }
    }
}

/// Weights of neighbours, by how far they lie to the right or below.
type Weights = Vec<(isize, f32)>;

/// Reads from `shift` px before, between two pixels.
fn shifting(shift: f32) -> Weights {
    let whole = libm::floorf(-shift);
    let share = -shift - whole;
    vec![(whole as isize, 1.0 - share), (whole as isize + 1, share)]
}

fn gaussian(deviation: f32) -> Weights {
    let reach = libm::ceilf(2.5 * deviation) as isize;
    let weight = |offset: isize| {
        let x = offset as f32 / deviation.max(1e-3);
        libm::expf(-0.5 * x * x)
    };
    let sum: f32 = (-reach..=reach).map(weight).sum();
    (-reach..=reach).map(|offset| (offset, weight(offset) / sum)).collect()
}

/// Weighted sums along rows, then along columns; beyond the edge lies the edge.
fn filter(light: &mut [f32], [width, height]: [usize; 2], along: &Weights, down: &Weights) {
    for (weights, count, step, lines, line_step) in
        [(along, width, 3, height, 3 * width), (down, height, 3 * width, width, 3)]
    {
        let mut line = vec![0.0; count];
        for start in (0..lines).flat_map(|line| (0..3).map(move |channel| line * line_step + channel)) {
            for (i, value) in line.iter_mut().enumerate() {
                *value = light.get(start + i * step).copied().unwrap_or(0.0);
            }
            for i in 0..count {
                let at = |offset: isize| line[i.saturating_add_signed(offset).min(count - 1)];
                let sum = weights.iter().map(|&(offset, weight)| weight * at(offset)).sum();
                if let Some(value) = light.get_mut(start + i * step) {
                    *value = sum;
                }
            }
        }
    }
}

/// A rectangle of one colour, up to `side` of the image long and wide, anywhere.
fn cut_out(light: &mut [f32], [width, height]: [usize; 2], side: f64, stream: &mut Stream) {
    let mut span = |count: usize| {
        let length = (side * stream.uniform() * count as f64) as usize;
        let start = (stream.uniform() * (count - length.min(count)) as f64) as usize;
        start..(start + length).min(count)
    };
    let (columns, rows) = (span(width), span(height));
    let colour = [stream.uniform() as f32, stream.uniform() as f32, stream.uniform() as f32];
    let (pixels, _) = light.as_chunks_mut::<3>();
    for row in pixels.chunks_mut(width.max(1)).take(rows.end).skip(rows.start) {
        for pixel in row.iter_mut().take(columns.end).skip(columns.start) {
            *pixel = colour;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mpgx_random::Purpose;

    const NOTHING: AugmentConfig = AugmentConfig {
        brightness: 0.0,
        contrast: 0.0,
        gamma: 0.0,
        tint: 0.0,
        blur_px: 0.0,
        noise: 0.0,
        cut_out: 0.0,
        shift_px: 0.0,
    };

    fn address(step: u64) -> Address {
        Address { master: 1, purpose: Purpose::Augment, protocol: 0, part: 0, seed: 0, episode: 0, step }
    }

    /// A grey ramp to the right, redder below.
    fn picture() -> Image {
        let byte = |i: usize| {
            40 + (5 * (i / 3 % 24)) as u8 + if i.is_multiple_of(3) { 3 * (i / 72) as u8 } else { 0 }
        };
        Image { width: 24, height: 20, rgb: (0..24 * 20 * 3).map(byte).collect() }
    }

    #[test]
    fn nothing_asked_nothing_changed() {
        assert_eq!(augment(&picture(), &NOTHING, address(0)), picture());
    }

    #[test]
    fn an_address_tells_one_change_and_no_image_is_mirrored() {
        let config = AugmentConfig::default();
        assert_eq!(augment(&picture(), &config, address(3)), augment(&picture(), &config, address(3)));
        for step in 0..50 {
            let changed =
                augment(&picture(), &AugmentConfig { cut_out: 0.0, ..config.clone() }, address(step));
            assert_ne!(changed, augment(&picture(), &config, address(step + 1)));
            let side = |from: usize| -> u32 {
                (0..20)
                    .flat_map(|y| (from..from + 8).map(move |x| (x, y)))
                    .map(|(x, y)| u32::from(changed.pixel(x, y).unwrap()[1]))
                    .sum()
            };
            assert!(side(0) < side(16), "{step}");
        }
    }

    #[test]
    fn each_change_does_what_it_says() {
        let mean = |image: &Image| image.grey().iter().sum::<f32>() / 480.0;
        let spread = |image: &Image| {
            let mean = mean(image);
            image.grey().iter().map(|value| (value - mean).powi(2)).sum::<f32>()
        };
        let some = |change: fn(&mut AugmentConfig)| {
            let mut config = NOTHING;
            change(&mut config);
            move |step: u64| augment(&picture(), &config, address(step))
        };
        let brightness = some(|config| config.brightness = 0.2);
        let means: Vec<f32> = (0..40).map(|step| mean(&brightness(step)) - mean(&picture())).collect();
        assert!(means.iter().any(|&x| x > 0.1) && means.iter().any(|&x| x < -0.1));
        assert!(means.iter().all(|x| x.abs() < 0.21));
        let contrast = some(|config| config.contrast = 0.5)(2);
        assert!((mean(&contrast) - mean(&picture())).abs() < 0.01);
        assert!((spread(&contrast) / spread(&picture()) - 1.0).abs() > 0.1);
        let blurred = some(|config| config.blur_px = 3.0)(2);
        assert!(spread(&blurred) < 0.999 * spread(&picture()));
        assert!((mean(&blurred) - mean(&picture())).abs() < 0.01);
        let cut = some(|config| config.cut_out = 0.5)(2);
        let changed = cut.rgb.iter().zip(&picture().rgb).filter(|(a, b)| a != b).count();
        assert!(changed > 0 && changed < 24 * 20 * 3 / 4 + 100, "{changed}");
        let noisy = some(|config| config.noise = 0.1)(2);
        assert_ne!(noisy, picture());
        assert!((mean(&noisy) - mean(&picture())).abs() < 0.01);
    }

    /// On a ramp of 5 a pixel a shift by s changes every pixel inside by −5 s.
    #[test]
    fn a_shift_moves_the_picture_by_fractions_of_a_pixel() {
        let config = AugmentConfig { shift_px: 2.0, ..NOTHING };
        for step in 0..20 {
            let shift = (2.0 * (2.0 * address(step).stream().uniform() - 1.0)) as f32;
            let moved = augment(&picture(), &config, address(step));
            let change =
                f32::from(moved.pixel(12, 0).unwrap()[1]) - f32::from(picture().pixel(12, 0).unwrap()[1]);
            assert!((change + 5.0 * shift).abs() <= 0.5 + 1e-3, "{shift} {change}");
        }
    }
}
