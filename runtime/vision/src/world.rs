//! What a scenario says of the world to look at, and the scene of one trial made of it.

use mpgx_random::{Address, Purpose, Stream};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::camera::CameraConfig;
use crate::colour::{luminance, plus, scaled, times};
use crate::exposure::Sensor;
use crate::light::{Glow, Light, TimeOfDay};
use crate::people::Walker;
use crate::pose::Pose;
use crate::props::{Furniture, Skins, books, furniture, robot};
use crate::room::{Decor, Face, Room};
use crate::solid::Solid;
use crate::texture::Texture;

/// The world that all trials share.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WorldConfig {
    /// Length along x, around 0.
    pub room_x_m: f64,
    /// Length along y, around 0. The windows are in the wall of greatest y.
    pub room_y_m: f64,
    pub room_height_m: f64,
    pub landmarks: Vec<LandmarkConfig>,
    /// People who walk about in every trial.
    pub people: usize,
    /// How long the pieces of furniture along the walls are together, as a share of the walls. They, the pictures and the
    /// paint of the walls change with every trial.
    pub furniture: f64,
    /// The number of the world: its floor and the covers of its books.
    pub look: u64,
}

/// Something that stays where it is in every trial.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LandmarkConfig {
    pub kind: LandmarkKind,
    pub pose: Pose,
    pub height_m: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LandmarkKind {
    /// A pile of books.
    Books,
    /// Another robot.
    Robot,
}

impl Default for WorldConfig {
    /// 8 m × 7 m with six piles of books and two robots around the middle, 2.3 to 2.9 m from it.
    fn default() -> WorldConfig {
        let places = [
            (2.6, 0.5),
            (1.9, 2.2),
            (-0.3, 2.5),
            (-2.2, 1.9),
            (-2.7, -0.4),
            (-1.7, -2.3),
            (0.4, -2.4),
            (2.3, -1.7),
        ];
        let landmark = |(number, (x_m, y_m)): (usize, (f64, f64))| {
            let kind = if number % 4 == 2 { LandmarkKind::Robot } else { LandmarkKind::Books };
            let pose = Pose { x_m, y_m, heading_rad: 1.9 * number as f64 };
            LandmarkConfig { kind, pose, height_m: 0.5 }
        };
        WorldConfig {
            room_x_m: 8.0,
            room_y_m: 7.0,
            room_height_m: 2.8,
            landmarks: places.into_iter().enumerate().map(landmark).collect(),
            people: 2,
            furniture: 0.4,
            look: 1,
        }
    }
}

/// Which trial: the same key gives the same furniture, pictures, weather, people and noise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TrialKey {
    /// Of the study.
    pub master: u64,
    /// 0 for training, k + 1 for protocol k.
    pub protocol: u16,
    /// Of the training run; 0 for evaluation.
    pub seed: u32,
    pub episode: u32,
}

impl TrialKey {
    pub(crate) fn stream(self, purpose: Purpose, part: Part, step: u64) -> Stream {
        let TrialKey { master, protocol, seed, episode } = self;
        Address { master, purpose, protocol, part: part as u16, seed, episode, step }.stream()
    }
}

/// Parts of the addresses. Never reuse one.
#[derive(Clone, Copy)]
pub(crate) enum Part {
    /// The same in all trials of a world.
    Floor = 0,
    Landmark = 1,
    Background = 2,
    Lighting = 3,
    Furniture = 4,
    People = 5,
    Exposure = 6,
    Grain = 7,
    Noise = 8,
    Path = 9,
    Clock = 10,
    Scatter = 11,
}

/// Why a scene cannot be made.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ConfigError {
    #[error("{what} is {value}; it must be {must}")]
    OutOfRange { what: &'static str, value: f64, must: &'static str },

    #[error("there is no {kind} `{name}`; known: {known}")]
    Unknown { kind: &'static str, name: String, known: String },

    #[error("`{name}` of `{of}` must be {must}")]
    Setting { of: String, name: &'static str, must: &'static str },
}

/// Checks that `value` is finite and in `low..=high`.
pub(crate) fn within(
    what: &'static str,
    value: f64,
    (low, high): (f64, f64),
    must: &'static str,
) -> Result<(), ConfigError> {
    let fine = value >= low && value <= high;
    if fine { Ok(()) } else { Err(ConfigError::OutOfRange { what, value, must }) }
}

/// A room in one trial, ready to be looked at with [`Scene::render`].
#[derive(Clone, Debug)]
pub struct Scene {
    pub(crate) camera: CameraConfig,
    pub(crate) key: TrialKey,
    pub(crate) room: Room,
    pub(crate) light: Light,
    /// The light that the sides of the room send, in the order of [`Face::ALL`].
    pub(crate) faces: [Texture; 6],
    pub(crate) skins: Skins,
    /// What does not move, and the light on it.
    pub(crate) solids: Vec<Solid>,
    pub(crate) glows: Vec<Glow>,
    pub(crate) people: Vec<Walker>,
    /// Other robots, by the colours they come in.
    pub(crate) robots: Vec<Vec<Solid>>,
    pub(crate) sensor: Sensor,
}

/// Side of a texel of the room's sides, and of a cell of the light on them, m.
const TEXEL_M: f32 = 0.02;
const CELL_M: f32 = 0.06;

const COLOURS_OF_ROBOTS: usize = 6;

impl Scene {
    /// The room of a trial: a pure function of its arguments. The same key with another time of day gives the same
    /// things in other light.
    pub fn new(
        world: &WorldConfig,
        camera: &CameraConfig,
        time: TimeOfDay,
        key: TrialKey,
    ) -> Result<Scene, ConfigError> {
        world.check()?;
        camera.check()?;
        let room = Room {
            half: [world.room_x_m as f32 / 2.0, world.room_y_m as f32 / 2.0],
            height: world.room_height_m as f32,
        };
        let fixed = TrialKey { master: world.look, ..TrialKey::default() };
        let mut skins = Skins::default();
        let mut solids = Vec::new();
        for (number, landmark) in world.landmarks.iter().enumerate() {
            let mut stream = fixed.stream(Purpose::Scene, Part::Landmark, number as u64);
            let model = match landmark.kind {
                LandmarkKind::Books => books(landmark.height_m as f32, &mut skins, &mut stream),
                LandmarkKind::Robot => robot(landmark.height_m as f32, number, &mut skins),
            };
            let Pose { x_m, y_m, heading_rad } = landmark.pose;
            let (sin, cos) = libm::sincosf(heading_rad as f32);
            solids.extend(model.iter().map(|solid| solid.placed([x_m as f32, y_m as f32], [cos, sin])));
        }
        let mut stream = key.stream(Purpose::Scene, Part::Lighting, time as u64);
        let light = Light::of(time, room.half, room.height, &mut stream);
        let mut stream = key.stream(Purpose::Scene, Part::Furniture, 0);
        furnish(&room, &light, world.furniture as f32, &mut skins, &mut solids, &mut stream);
        let people = (0..world.people as u64)
            .map(|number| {
                Walker::drawn(&room, &mut skins, &mut key.stream(Purpose::Scene, Part::People, number))
            })
            .collect();
        let decor = Decor::new(
            room,
            light.windows.len(),
            &mut fixed.stream(Purpose::Scene, Part::Floor, 0),
            &mut key.stream(Purpose::Scene, Part::Background, 0),
        );
        let robots = (0..COLOURS_OF_ROBOTS).map(|number| robot(0.42, number + 40, &mut skins)).collect();
        let glows = solids.iter().map(|solid| light.at(solid.centre, |_, _| false)).collect();
        let faces = Face::ALL.map(|face| bake(face, &room, &decor, &light, &solids));
        let mean = faces.iter().map(|face| luminance(face.mean())).sum::<f32>() / 6.0;
        let sensor = Sensor::new(camera, mean, key);
        Ok(Scene {
            camera: camera.clone(),
            key,
            room,
            light,
            faces,
            skins,
            solids,
            glows,
            people,
            robots,
            sensor,
        })
    }
}

impl WorldConfig {
    /// Memory of a [`Scene`] in it, bytes: the texels of the room's sides and the means of four, of sixteen and so on.
    pub fn scene_bytes(&self) -> f64 {
        let (x, y, height) = (self.room_x_m, self.room_y_m, self.room_height_m);
        let sides_m2 = 2.0 * (x * y + x * height + y * height);
        let texel = std::mem::size_of::<[f32; 4]>() as f64;
        4.0 / 3.0 * texel * sides_m2 / f64::from(TEXEL_M * TEXEL_M)
    }

    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        for (what, side) in
            [("the room's length along x", self.room_x_m), ("the room's length along y", self.room_y_m)]
        {
            within(what, side, (2.0, 40.0), "2 to 40 m")?;
        }
        within("the room's height", self.room_height_m, (2.0, 10.0), "2 to 10 m")?;
        within("the number of people", self.people as f64, (0.0, 100.0), "at most 100")?;
        within("the share of the walls with furniture", self.furniture, (0.0, 0.8), "0 to 0.8")?;
        within("the number of landmarks", self.landmarks.len() as f64, (0.0, 1000.0), "at most 1000")?;
        for LandmarkConfig { pose, height_m, .. } in &self.landmarks {
            let (x, y) = (self.room_x_m / 2.0, self.room_y_m / 2.0);
            within("x of a landmark", pose.x_m, (-x, x), "inside the room")?;
            within("y of a landmark", pose.y_m, (-y, y), "inside the room")?;
            within("the heading of a landmark", pose.heading_rad, (-1e6, 1e6), "finite")?;
            within("the height of a landmark", *height_m, (0.05, 2.0), "0.05 to 2 m")?;
        }
        Ok(())
    }
}

/// Puts drawn furniture along the walls until it covers a share of them, never two pieces at one place nor one before the
/// door; low pieces only before windows.
fn furnish(
    room: &Room,
    light: &Light,
    share: f32,
    skins: &mut Skins,
    solids: &mut Vec<Solid>,
    stream: &mut Stream,
) {
    for wall in 0..4 {
        let length = room.size(Face::Wall(wall))[0];
        let mut taken: Vec<(f32, f32)> =
            if wall == 2 { vec![(length / 2.0 - 2.2, length / 2.0 - 1.0)] } else { vec![] };
        let mut covered = 0.0;
        for _ in 0..12 {
            if covered >= share * length {
                break;
            }
            let Furniture { solids: model, width, depth } = furniture(wall == 3, skins, stream);
            let place = width / 2.0 + 0.5 + (length - width - 1.0) * stream.uniform() as f32;
            let (start, end) = (place - width / 2.0 - 0.1, place + width / 2.0 + 0.1);
            if taken.iter().any(|&(a, b)| start < b && a < end) {
                continue;
            }
            taken.push((start, end));
            covered += width;
            let [x, y, _] = room.place(Face::Wall(wall), place, 0.0);
            let [nx, ny, _] = Face::Wall(wall).normal();
            let off = depth / 2.0 + 0.02;
            // The back (y) points against the wall's normal.
            let turn = [-ny, nx];
            solids.extend(model.iter().map(|solid| solid.placed([x + off * nx, y + off * ny], turn)));
        }
    }
    // A radiator below each window.
    let metal = skins.0.len();
    skins.0.push(Texture::of(64, 8, |u, _| {
        scaled([0.72, 0.71, 0.68], if (u * 16.0).fract() < 0.3 { 0.5 } else { 1.0 })
    }));
    for window in &light.windows {
        let size = [0.7 * window.width, 0.08, 0.5];
        solids.push(Solid::block([window.x, room.half[1] - 0.06, 0.4], size, [metal; 3]));
    }
}

/// The light that a side of the room sends: its paint under the light that falls on it, darker in corners and near things.
fn bake(face: Face, room: &Room, decor: &Decor, light: &Light, solids: &[Solid]) -> Texture {
    let [width, height] = room.size(face);
    let near: Vec<&Solid> = solids.iter().filter(|solid| beside(face, room, solid)).collect();
    let shaded = |place: [f32; 3], sunwards: [f32; 3]| {
        let above: [f32; 3] = std::array::from_fn(|i| place[i] + 0.01 * sunwards[i]);
        solids.iter().any(|solid| solid.meets(above, sunwards).is_finite())
    };
    let normal = face.normal();
    let count = |length: f32, side: f32| (length / side).max(1.0) as usize;
    let (columns, rows) = (count(width, CELL_M), count(height, CELL_M));
    let falling = Texture::of(columns, rows, |u, v| {
        let place = room.place(face, u * width, v * height);
        let corner = |distance: f32| 1.0 - 0.3 * libm::expf(-distance / 0.25);
        let edges = corner(u.min(1.0 - u) * width) * corner(v.min(1.0 - v) * height);
        let things = near.iter().map(|solid| 1.0 - 0.5 * libm::expf(-solid.distance(place) / 0.07));
        scaled(light.at(place, shaded).on(normal), edges * things.product::<f32>().max(0.3))
    });
    Texture::of(count(width, TEXEL_M), count(height, TEXEL_M), |u, v| {
        let (albedo, sent) = decor.paint(face, u * width, v * height, light);
        plus(times(albedo, falling.sample(u, v, 1.0)), sent)
    })
}

/// Whether a solid is near enough to a side to darken it.
fn beside(face: Face, room: &Room, solid: &Solid) -> bool {
    let normal = face.normal();
    let on = room.place(face, 0.0, 0.0);
    let away: f32 = (0..3).map(|i| normal[i] * (solid.centre[i] - on[i])).sum();
    away - solid.shape.reach(normal) < 0.3
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_room_holds_as_many_texels_as_told() {
        for (room_x_m, room_y_m, room_height_m) in [(8.0, 7.0, 2.8), (3.0, 2.5, 4.0), (20.0, 15.0, 3.0)] {
            let landmarks = Vec::new();
            let world =
                WorldConfig { room_x_m, room_y_m, room_height_m, landmarks, ..WorldConfig::default() };
            let key = TrialKey { master: 1, protocol: 0, seed: 0, episode: 0 };
            let scene = Scene::new(&world, &CameraConfig::default(), TimeOfDay::Morning, key).unwrap();
            let texels: usize = scene.faces.iter().map(Texture::texels).sum();
            let ratio = world.scene_bytes() / (texels * std::mem::size_of::<[f32; 4]>()) as f64;
            assert!((0.95..1.05).contains(&ratio), "{ratio}");
        }
    }
}
