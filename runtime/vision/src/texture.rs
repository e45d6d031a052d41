//! Tables of colours with their means over 2×2, 4×4, … texels, so that what is far away does not flicker.

use crate::colour::{BLACK, Rgb, greatest, least};

#[derive(Clone, Debug)]
pub(crate) struct Texture {
    /// Each half as wide and high as the one before, down to one texel.
    levels: Vec<Level>,
}

#[derive(Clone, Debug)]
struct Level {
    width: usize,
    height: usize,
    /// Red, green, blue and nothing: four numbers are read at once.
    texels: Vec<[f32; 4]>,
}

impl Texture {
    /// A table of `width` × `height` colours of a function of (0..1, 0..1), at the texels' centres.
    pub fn of(width: usize, height: usize, colour: impl Fn(f32, f32) -> Rgb) -> Texture {
        let mut texels = Vec::with_capacity(width * height);
        for y in 0..height {
            let v = (y as f32 + 0.5) / height as f32;
            texels.extend((0..width).map(|x| padded(colour((x as f32 + 0.5) / width as f32, v))));
        }
        let mut levels = vec![Level { width, height, texels }];
        while let Some(last) = levels.last().filter(|level| level.width * level.height > 1) {
            levels.push(last.halved());
        }
        Texture { levels }
    }

    pub fn plain(colour: Rgb) -> Texture {
        Texture { levels: vec![Level { width: 1, height: 1, texels: vec![padded(colour)] }] }
    }

    /// The mean of all.
    pub fn mean(&self) -> Rgb {
        self.levels.last().and_then(|level| level.texels.first()).map_or(BLACK, |&[r, g, b, _]| [r, g, b])
    }

    #[cfg(test)]
    pub fn texels(&self) -> usize {
        self.levels.iter().map(|level| level.texels.len()).sum()
    }

    /// Texels of the finest table across the whole width.
    pub fn width(&self) -> f32 {
        self.levels.first().map_or(1.0, |level| level.width as f32)
    }

    /// The colour at (0..1, 0..1), of the table whose texels are about as large as `footprint` squared texels of the
    /// finest one; bilinear.
    #[inline]
    pub fn sample(&self, u: f32, v: f32, footprint: f32) -> Rgb {
        // Half of the exponent of the area is the logarithm of the side.
        let exponent = (greatest(footprint, 1.0).to_bits() >> 23) as usize - 127;
        let level = exponent.div_ceil(2).min(self.levels.len() - 1);
        self.levels[level].sample(u, v)
    }
}

impl Level {
    #[inline]
    fn sample(&self, u: f32, v: f32) -> Rgb {
        let (x, right, share_x) = neighbours(u, self.width);
        let (y, below, share_y) = neighbours(v, self.height);
        let (upper, lower) = (y * self.width, below * self.width);
        let (a, b) = (self.texels[upper + x], self.texels[upper + right]);
        let (c, d) = (self.texels[lower + x], self.texels[lower + right]);
        let [r, g, b, _] = std::array::from_fn(|i| {
            let top = a[i] + (b[i] - a[i]) * share_x;
            let bottom = c[i] + (d[i] - c[i]) * share_x;
            top + (bottom - top) * share_y
        });
        [r, g, b]
    }

    fn halved(&self) -> Level {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let mut texels = Vec::with_capacity(width * height);
        for y in 0..height {
            let rows = [2 * y, (2 * y + 1).min(self.height - 1)];
            for x in 0..width {
                let columns = [2 * x, (2 * x + 1).min(self.width - 1)];
                let mut sum = [0.0; 4];
                for texel in rows.iter().flat_map(|y| columns.map(|x| self.texels[y * self.width + x])) {
                    for (sum, value) in sum.iter_mut().zip(texel) {
                        *sum += value / 4.0;
                    }
                }
                texels.push(sum);
            }
        }
        Level { width, height, texels }
    }
}

fn padded([r, g, b]: Rgb) -> [f32; 4] {
    [r, g, b, 0.0]
}

/// The two texels beside a place in 0..1 and the share of the second.
#[inline]
fn neighbours(place: f32, count: usize) -> (usize, usize, f32) {
    let last = (count - 1) as f32;
    let texel = least(greatest(place * count as f32 - 0.5, 0.0), last);
    let first = texel as usize;
    (first, first + usize::from(first + 1 < count), texel - first as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_texels_are_seen_and_far_ones_are_mixed() {
        let checks = Texture::of(64, 32, |u, v| {
            let odd = ((u * 64.0) as usize + (v * 32.0) as usize) % 2;
            [odd as f32, 0.25, 0.0]
        });
        assert_eq!(checks.sample(0.5 / 64.0, 0.5 / 32.0, 1.0), [0.0, 0.25, 0.0]);
        assert_eq!(checks.sample(1.5 / 64.0, 0.5 / 32.0, 1.0), [1.0, 0.25, 0.0]);
        // Between two texels, half of each.
        assert_eq!(checks.sample(1.0 / 64.0, 0.5 / 32.0, 1.0), [0.5, 0.25, 0.0]);
        // Two texels wide and more: the mean everywhere.
        for footprint in [4.0, 100.0, 1e9] {
            assert_eq!(checks.sample(0.3, 0.8, footprint), [0.5, 0.25, 0.0]);
        }
        assert_eq!(checks.mean(), [0.5, 0.25, 0.0]);
    }

    #[test]
    fn places_outside_take_the_edge() {
        let ramp = Texture::of(8, 1, |u, _| [u, 0.0, 0.0]);
        assert_eq!(ramp.sample(-3.0, 2.0, 1.0), ramp.sample(0.0, 0.5, 1.0));
        assert_eq!(ramp.sample(f32::NAN, 0.5, 1.0), ramp.sample(0.0, 0.5, 1.0));
    }
}
