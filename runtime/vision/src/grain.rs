//! Noise for surfaces: a table of addressed random numbers, read smoothly.

use mpgx_random::Stream;

const SIDE: usize = 128;

/// 128 × 128 numbers in 0..1; they repeat beyond.
#[derive(Clone, Debug)]
pub(crate) struct Grain(Vec<f32>);

impl Grain {
    pub fn new(stream: &mut Stream) -> Grain {
        Grain((0..SIDE * SIDE).map(|_| stream.uniform() as f32).collect())
    }

    /// The number of a cell.
    pub fn cell(&self, x: i32, y: i32) -> f32 {
        let wrap = |i: i32| i.rem_euclid(SIDE as i32) as usize;
        self.0[wrap(y) * SIDE + wrap(x)]
    }

    /// Smooth between the cells' numbers.
    pub fn at(&self, x: f32, y: f32) -> f32 {
        let (x0, y0) = (libm::floorf(x), libm::floorf(y));
        let ease = |share: f32| share * share * (3.0 - 2.0 * share);
        let (along, down) = (ease(x - x0), ease(y - y0));
        let (x0, y0) = (x0 as i32, y0 as i32);
        let row = |y: i32| {
            let (a, b) = (self.cell(x0, y), self.cell(x0 + 1, y));
            a + (b - a) * along
        };
        let (top, bottom) = (row(y0), row(y0 + 1));
        top + (bottom - top) * down
    }

    /// Three octaves of [`at`](Grain::at), still in 0..1.
    pub fn cloud(&self, x: f32, y: f32) -> f32 {
        (4.0 * self.at(x, y)
            + 2.0 * self.at(2.0 * x + 17.0, 2.0 * y + 31.0)
            + self.at(4.0 * x + 53.0, 4.0 * y + 7.0))
            / 7.0
    }
}
