//! People who walk about: around the room, slower and faster, without looking where the robots are.

use mpgx_random::Stream;

use crate::props::{Clothes, Skins};
use crate::room::Room;
use crate::solid::Solid;

#[derive(Clone, Debug)]
pub(crate) struct Walker {
    clothes: Clothes,
    /// Of the ellipse that they walk, m.
    half: [f32; 2],
    start: f32,
    /// rad/s along the ellipse, its sign the sense.
    rate: f32,
    /// They slow down and hurry, rad/s and rad.
    rhythm: f32,
    shift: f32,
}

impl Walker {
    pub fn drawn(room: &Room, skins: &mut Skins, stream: &mut Stream) -> Walker {
        let clothes = Clothes::drawn(skins, stream);
        let mut between = |low: f32, high: f32| low + (high - low) * stream.uniform() as f32;
        let half = [between(0.72, 0.82) * room.half[0], between(0.70, 0.80) * room.half[1]];
        let start = between(0.0, std::f32::consts::TAU);
        let rate = between(0.15, 0.35) * if between(-1.0, 1.0) < 0.0 { -1.0 } else { 1.0 };
        Walker {
            clothes,
            half,
            start,
            rate,
            rhythm: between(0.2, 0.5),
            shift: between(0.0, std::f32::consts::TAU),
        }
    }

    /// What is seen of them at a time.
    pub fn at(&self, time_s: f32) -> impl Iterator<Item = Solid> {
        let pace = self.rhythm * time_s + self.shift;
        let angle = self.start + self.rate * (time_s + 0.9 / self.rhythm * libm::sinf(pace));
        let (sin, cos) = libm::sincosf(angle);
        let sense = self.rate.signum();
        let [along, up] = [-self.half[0] * sin * sense, self.half[1] * cos * sense];
        let length = (along * along + up * up).sqrt().max(1e-6);
        let (place, turn) = ([self.half[0] * cos, self.half[1] * sin], [along / length, up / length]);
        // A pair of steps takes 1.4 m.
        let phase = angle.abs() * (self.half[0] + self.half[1]) / 2.0 * std::f32::consts::TAU / 1.4;
        self.clothes.walker(phase).into_iter().map(move |solid| solid.placed(place, turn))
    }
}
