//! What a robot counts of its way and what it is told of its pose, joined: an extended Kalman filter of the pose and of
//! the biases of the odometry (Thrun, Burgard and Fox, "Probabilistic Robotics", 2005, chapter 3).

use std::f64::consts::TAU;

use mpgx_random::Stream;
use mpgx_vision::declared::Wheels;

/// x and y (m), heading (rad); the biases of ways ahead, to the left, and of turns.
const STATES: usize = 6;

/// Squared distance in standard deviations beyond which an answer counts less: 99.9 % of the χ² distributions of two
/// degrees of freedom (places) and three (places and headings) lie below.
const GATES: [f64; 2] = [13.816, 16.266];

/// What a robot takes its pose to be.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Filter {
    mean: [f64; STATES],
    covariance: [[f64; STATES]; STATES],
    slip: f64,
    has_heading: bool,
}

/// What counts a robot's way, in an episode.
pub(crate) struct Odometer {
    slip: f64,
    /// Of ways ahead, to the left, and of turns.
    bias: [f64; 3],
}

impl Odometer {
    /// Draws the biases.
    pub fn new(wheels: Wheels, stream: &mut Stream) -> Odometer {
        Odometer { slip: wheels.slip, bias: std::array::from_fn(|_| wheels.bias * stream.normal()) }
    }

    /// What it tells of a way.
    pub fn count(&self, way: [f64; 3], stream: &mut Stream) -> [f64; 3] {
        std::array::from_fn(|k| way[k] * (1.0 + self.bias[k] + self.slip * stream.normal()))
    }
}

/// How a robot moved between two poses (x and y in m, heading in rad): ahead and to its left, m, in the middle of its
/// turn, rad.
pub(crate) fn way(from: [f64; 3], to: [f64; 3]) -> [f64; 3] {
    let turn = wrapped(to[2] - from[2]);
    let (sin, cos) = libm::sincos(from[2] + turn / 2.0);
    let (x, y) = (to[0] - from[0], to[1] - from[1]);
    [x * cos + y * sin, y * cos - x * sin, turn]
}

impl Filter {
    /// Believes the first answer, which has these variances (m², m², rad²). Robots without a heading are told none.
    pub fn new(answer: [f64; 3], variance: [f64; 3], wheels: Wheels, has_heading: bool) -> Filter {
        let ([x, y, heading], [of_x, of_y, of_heading]) = (answer, variance);
        let (heading, of_heading) = if has_heading { (heading, of_heading) } else { (0.0, 0.0) };
        let of_bias = wheels.bias * wheels.bias;
        let variances = [of_x, of_y, of_heading, of_bias, of_bias, of_bias];
        let mut covariance = [[0.0; STATES]; STATES];
        for (number, variance) in variances.into_iter().enumerate() {
            covariance[number][number] = variance;
        }
        Filter { mean: [x, y, heading, 0.0, 0.0, 0.0], covariance, slip: wheels.slip, has_heading }
    }

    /// Goes on by a way as [`way`] gives it that was counted as `counted`. Of what is counted, c = u (1 + b + slip·n), the
    /// way is u ≈ c (1 − b) with the variance (slip·c)².
    pub fn go(&mut self, counted: [f64; 3]) {
        let [_, _, heading, biases @ ..] = self.mean;
        let [ahead, left, turn]: [f64; 3] = std::array::from_fn(|k| counted[k] * (1.0 - biases[k]));
        let (sin, cos) = libm::sincos(heading + turn / 2.0);
        let (x, y) = (ahead * cos - left * sin, ahead * sin + left * cos);
        for (mean, change) in self.mean.iter_mut().zip([x, y, turn]) {
            *mean += change;
        }
        // What ways ahead, to the left and turns change of x, y and heading.
        let by_way = [[cos, -sin, -y / 2.0], [sin, cos, x / 2.0], [0.0, 0.0, 1.0]];
        let mut by_state: [[f64; STATES]; STATES] =
            std::array::from_fn(|row| std::array::from_fn(|column| f64::from(u8::from(row == column))));
        (by_state[0][2], by_state[1][2]) = (-y, x);
        for (row, by_way) in by_state.iter_mut().zip(by_way) {
            for k in 0..3 {
                row[3 + k] = -by_way[k] * counted[k];
            }
        }
        self.covariance = product(&by_state, &transposed(&product(&by_state, &self.covariance)));
        for row in 0..3 {
            for column in 0..3 {
                let of_slip = |k: usize| by_way[row][k] * by_way[column][k] * counted[k] * counted[k];
                self.covariance[row][column] += self.slip * self.slip * (0..3).map(of_slip).sum::<f64>();
            }
        }
    }

    /// Corrects the pose by an answer whose errors are independent and have these variances. One that is too far away to
    /// be believed (squared distance d² beyond the gate g) is taken for one of greater variance, so that it lies on the
    /// gate: the correction is that of the answer times g / d².
    pub fn correct(&mut self, answer: [f64; 3], variance: [f64; 3]) {
        let (mut mean, mut covariance) = (self.mean, self.covariance);
        let mut squared_distance = 0.0;
        for told in 0..if self.has_heading { 3 } else { 2 } {
            let error = answer[told] - mean[told];
            let error = if told == 2 { wrapped(error) } else { error };
            let row = covariance[told];
            let spread = row[told] + variance[told];
            if spread <= 0.0 {
                continue;
            }
            squared_distance += error * error / spread;
            for (k, mean) in mean.iter_mut().enumerate() {
                *mean += row[k] * error / spread;
                for (column, value) in covariance[k].iter_mut().enumerate() {
                    *value -= row[k] * row[column] / spread;
                }
            }
        }
        let gate = GATES[usize::from(self.has_heading)];
        let weight = if squared_distance > gate { gate / squared_distance } else { 1.0 };
        let own = self.mean.iter_mut().chain(self.covariance.as_flattened_mut());
        for (own, whole) in own.zip(mean.iter().chain(covariance.as_flattened())) {
            *own += weight * (whole - *own);
        }
    }

    /// x and y (m), heading (rad) in −π..=π.
    pub fn pose(&self) -> [f64; 3] {
        let [x, y, heading, ..] = self.mean;
        [x, y, wrapped(heading)]
    }
}

fn wrapped(angle: f64) -> f64 {
    libm::remainder(angle, TAU)
}

type Matrix = [[f64; STATES]; STATES];

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|row| {
        std::array::from_fn(|column| (0..STATES).map(|k| a[row][k] * b[k][column]).sum())
    })
}

fn transposed(a: &Matrix) -> Matrix {
    std::array::from_fn(|row| std::array::from_fn(|column| a[column][row]))
}

#[cfg(test)]
mod tests;
