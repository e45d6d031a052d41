//! Pictures: rows of bytes.

use crate::pose::PoseQ;

/// An image of 8-bit sRGB, row by row from the top left: pixel (x, y) is at `3 * (y * width + x)`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    pub width: usize,
    pub height: usize,
    /// `3 * width * height` bytes: red, green, blue.
    pub rgb: Vec<u8>,
}

/// An image, and where the camera was and when.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    pub image: Image,
    /// Of the camera in the world.
    pub pose: PoseQ,
    pub time_s: f64,
}

impl Image {
    /// A black image.
    pub fn new(width: usize, height: usize) -> Image {
        Image { width, height, rgb: vec![0; 3 * width * height] }
    }

    /// The pixel (x, y), or nothing outside.
    pub fn pixel(&self, x: usize, y: usize) -> Option<[u8; 3]> {
        let start = 3 * (y * self.width + x);
        let rgb = (x < self.width).then(|| self.rgb.get(start..start + 3))??;
        rgb.try_into().ok()
    }

    /// The image in another size; every new pixel is the mean of the area that it covers.
    pub fn resized(&self, width: usize, height: usize) -> Image {
        let columns = shares(self.width, width);
        let rows = shares(self.height, height);
        let mut rgb = Vec::with_capacity(3 * width * height);
        for row in &rows {
            for column in &columns {
                let mut sum = [0.0; 3];
                for &(y, share_y) in row {
                    for &(x, share_x) in column {
                        let pixel = self.pixel(x, y).unwrap_or_default();
                        for (sum, byte) in sum.iter_mut().zip(pixel) {
                            *sum += share_y * share_x * f64::from(byte);
                        }
                    }
                }
                rgb.extend(sum.map(|value| (value + 0.5) as u8));
            }
        }
        Image { width, height, rgb }
    }

    /// Luma of every pixel in 0..=1 by Rec. 601, row by row.
    pub fn grey(&self) -> Vec<f32> {
        let (pixels, _) = self.rgb.as_chunks::<3>();
        let luma = |&[r, g, b]: &[u8; 3]| 0.299 * f32::from(r) + 0.587 * f32::from(g) + 0.114 * f32::from(b);
        pixels.iter().map(|pixel| luma(pixel) / 255.0).collect()
    }
}

/// For each of `to` new cells the old cells it covers, with their shares of it, which sum to 1.
fn shares(from: usize, to: usize) -> Vec<Vec<(usize, f64)>> {
    let scale = from as f64 / to as f64;
    let cell = |new: usize| {
        let (start, end) = (new as f64 * scale, (new + 1) as f64 * scale);
        let last = (libm::ceil(end - 1e-9) as usize).min(from);
        (start as usize..last)
            .map(|old| (old, (end.min(old as f64 + 1.0) - start.max(old as f64)) / scale))
            .collect()
    };
    (0..to).map(cell).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pixel_outside_is_none() {
        let image = Image { width: 2, height: 1, rgb: vec![1, 2, 3, 4, 5, 6] };
        assert_eq!(image.pixel(1, 0), Some([4, 5, 6]));
        assert_eq!((image.pixel(2, 0), image.pixel(0, 1)), (None, None));
    }

    #[test]
    fn a_smaller_image_holds_means_of_areas() {
        let image = Image { width: 3, height: 1, rgb: vec![0, 0, 0, 90, 90, 90, 30, 30, 30] };
        // Halves of three pixels: (0 + 90/2) / 1.5 and (90/2 + 30) / 1.5.
        assert_eq!(image.resized(2, 1).rgb, [30, 30, 30, 50, 50, 50]);
        assert_eq!(image.resized(6, 2).resized(3, 1), image);
        assert_eq!(image.resized(3, 1), image);
    }
}
