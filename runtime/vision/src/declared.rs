//! What a Plan declares of seeing, as configurations of this crate.

use mpgx_lang::plan::{Extern, Scenery, Setting};

use crate::camera::CameraConfig;
use crate::light::TimeOfDay;
use crate::pose::Pose;
use crate::world::{ConfigError, LandmarkConfig, LandmarkKind, WorldConfig};

/// Names that a Plan may use, each with its settings.
pub type Names = &'static [(&'static str, &'static [&'static str])];

pub const ROOMS: Names = &[("indoor", &["width", "depth", "height", "people", "furniture", "look"])];

pub const LIGHTINGS: Names = &[("morning", &[]), ("afternoon", &[]), ("evening", &[])];

pub const CAMERAS: Names = &[(
    "pinhole",
    &[
        "height",
        "tilt",
        "field",
        "pixels",
        "exposure",
        "samples",
        "auto_exposure",
        "shot_noise",
        "read_noise",
    ],
)];

pub const ODOMETRIES: Names = &[("wheels", &["slip", "bias"])];

pub const LANDMARKS: Names = &[("books", &["height"]), ("robot", &["height"])];

/// `resnet` is trained with the feature `vision`.
pub const LOCALISERS: Names = &[
    (
        "resnet",
        &["layers", "channels", "stem", "orientation", "bins", "weighting", "steps", "batch", "rate", "seed"],
    ),
    ("noisy", &["position", "heading"]),
];

/// Normal noise on a pose: the standard deviations on each of x and y and on the heading.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PoseNoise {
    pub position_m: f64,
    pub heading_rad: f64,
}

/// How wrongly a robot counts its way: standard deviations, as shares of the way.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wheels {
    /// Anew at each step.
    pub slip: f64,
    /// Throughout an episode.
    pub bias: f64,
}

/// The room and its landmarks.
pub fn world_config(scenery: &Scenery) -> Result<WorldConfig, ConfigError> {
    let room = Declared::new("room", ROOMS, &scenery.room)?;
    let landmarks = scenery.landmarks.iter().map(|landmark| {
        let what = Declared::new("landmark", LANDMARKS, &landmark.what)?;
        let kind = if landmark.what.name == "robot" { LandmarkKind::Robot } else { LandmarkKind::Books };
        let (x_m, y_m) = landmark.position_m;
        let pose = Pose { x_m, y_m, heading_rad: landmark.heading_rad };
        Ok(LandmarkConfig { kind, pose, height_m: what.number("height")? })
    });
    let config = WorldConfig {
        room_x_m: room.number("width")?,
        room_y_m: room.number("depth")?,
        room_height_m: room.number("height")?,
        landmarks: landmarks.collect::<Result<_, _>>()?,
        people: room.count("people")? as usize,
        furniture: room.number("furniture")?,
        look: room.count("look")?,
    };
    config.check()?;
    Ok(config)
}

/// The light of a trial.
pub fn time_of_day(lighting: &Extern) -> Result<TimeOfDay, ConfigError> {
    Declared::new("lighting", LIGHTINGS, lighting)?;
    let named = TimeOfDay::ALL.into_iter().find(|time| time.name() == lighting.name);
    Ok(named.unwrap_or_default())
}

/// The camera on each robot of a group.
pub fn camera_config(camera: &Extern) -> Result<CameraConfig, ConfigError> {
    let camera = Declared::new("camera", CAMERAS, camera)?;
    let pixels = camera.count("pixels")? as usize;
    let config = CameraConfig {
        width_px: pixels,
        height_px: pixels,
        height_m: camera.number("height")?,
        tilt_rad: camera.number("tilt")?,
        fov_rad: camera.number("field")?,
        exposure_s: camera.number("exposure")?,
        samples: camera.count("samples")? as usize,
        auto_exposure: camera.number("auto_exposure")?,
        shot_noise: camera.number("shot_noise")?,
        read_noise: camera.number("read_noise")?,
    };
    config.check()?;
    Ok(config)
}

/// How the robots of a group count their ways.
pub fn wheels(odometry: &Extern) -> Result<Wheels, ConfigError> {
    let what = Declared::new("odometry", ODOMETRIES, odometry)?;
    Ok(Wheels { slip: what.number("slip")?, bias: what.number("bias")? })
}

/// What `noisy` adds to true poses; `None`: the localiser looks at images.
pub fn pose_noise(localiser: &Extern) -> Result<Option<PoseNoise>, ConfigError> {
    let what = Declared::new("localiser", LOCALISERS, localiser)?;
    if localiser.name != "noisy" {
        return Ok(None);
    }
    Ok(Some(PoseNoise { position_m: what.number("position")?, heading_rad: what.number("heading")? }))
}

/// The training of a `resnet` that looks at square images of so many pixels a side, rendered anew.
#[cfg(feature = "vision")]
pub fn train_config(
    localiser: &Extern,
    pixels: usize,
) -> Result<crate::network::TrainConfig, crate::network::NetworkError> {
    use crate::augment::AugmentConfig;
    use crate::network::{Orientation, ResNetConfig, Stem, TrainConfig, Weighting};

    let what = Declared::new("localiser", &LOCALISERS[..1], localiser)?;
    let config = TrainConfig {
        network: ResNetConfig {
            depth: what.count("layers")? as usize,
            channels: what.count("channels")? as usize,
            stem: what.one_of("stem", &[("standard", Stem::Standard), ("small", Stem::Small)])?,
            width_px: pixels,
            height_px: pixels,
        },
        orientation: what.one_of(
            "orientation",
            &[("heading", Orientation::Heading), ("quaternion", Orientation::Quaternion)],
        )?,
        bins: what.count("bins")? as usize,
        weighting: what
            .one_of("weighting", &[("fixed", Weighting::default()), ("learnt", Weighting::Learnt)])?,
        steps: what.count("steps")?,
        batch: what.count("batch")? as usize,
        learning_rate: what.number("rate")?,
        seed: what.count("seed")?,
        augment: AugmentConfig::NONE,
    };
    config.check()?;
    Ok(config)
}

/// Something that is known by its name, with its settings.
struct Declared<'a>(&'a Extern);

impl<'a> Declared<'a> {
    fn new(kind: &'static str, known: Names, what: &'a Extern) -> Result<Declared<'a>, ConfigError> {
        let Some((_, settings)) = known.iter().find(|(name, _)| *name == what.name) else {
            let known = known.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
            return Err(ConfigError::Unknown { kind, name: what.name.clone(), known });
        };
        match what.settings.keys().find(|name| !settings.contains(&name.as_str())) {
            None => Ok(Declared(what)),
            Some(name) => {
                let (kind, known) = ("setting", settings.join(", "));
                Err(ConfigError::Unknown { kind, name: format!("{}.{name}", what.name), known })
            }
        }
    }

    fn wrong(&self, name: &'static str, must: &'static str) -> ConfigError {
        ConfigError::Setting { of: self.0.name.clone(), name, must }
    }

    fn number(&self, name: &'static str) -> Result<f64, ConfigError> {
        match self.0.settings.get(name) {
            Some(Setting::Number(value)) if value.is_finite() => Ok(*value),
            _ => Err(self.wrong(name, "a finite number")),
        }
    }

    fn count(&self, name: &'static str) -> Result<u64, ConfigError> {
        match self.0.settings.get(name) {
            Some(Setting::Number(value)) if (0.0..=1e9).contains(value) && value.fract() == 0.0 => {
                Ok(*value as u64)
            }
            _ => Err(self.wrong(name, "a whole number up to 1000000000")),
        }
    }

    #[cfg(feature = "vision")]
    fn one_of<T: Copy>(&self, name: &'static str, known: &[(&str, T)]) -> Result<T, ConfigError> {
        let word = match self.0.settings.get(name) {
            Some(Setting::Word(word)) => word.as_str(),
            _ => "",
        };
        let found = known.iter().find(|(known, _)| *known == word);
        found.map(|(_, value)| *value).ok_or_else(|| self.wrong(name, "one of the words declared"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn extern_(name: &str, settings: &[(&str, f64)]) -> Extern {
        let settings = settings.iter().map(|(name, value)| ((*name).to_owned(), Setting::Number(*value)));
        Extern { name: name.to_owned(), settings: settings.collect() }
    }

    fn indoor() -> Extern {
        let settings = [("width", 6.0), ("depth", 5.0), ("height", 3.0)];
        extern_("indoor", &[&settings[..], &[("people", 1.0), ("furniture", 0.2), ("look", 3.0)]].concat())
    }

    fn landmark(name: &str, x_m: f64) -> mpgx_lang::plan::Landmark {
        mpgx_lang::plan::Landmark {
            name: "shelf".to_owned(),
            what: extern_(name, &[("height", 0.7)]),
            position_m: (x_m, -1.0),
            heading_rad: 0.5,
            at: Default::default(),
        }
    }

    #[test]
    fn a_room_has_its_sides_and_its_landmarks() {
        let landmarks = vec![landmark("books", 1.0), landmark("robot", 2.0)];
        let scenery = Scenery { room: indoor(), lighting: None, landmarks };
        let config = world_config(&scenery).unwrap();
        let pose = |x_m| Pose { x_m, y_m: -1.0, heading_rad: 0.5 };
        let thing = |kind, x_m| LandmarkConfig { kind, pose: pose(x_m), height_m: 0.7 };
        let expected = WorldConfig {
            room_x_m: 6.0,
            room_y_m: 5.0,
            room_height_m: 3.0,
            landmarks: vec![thing(LandmarkKind::Books, 1.0), thing(LandmarkKind::Robot, 2.0)],
            people: 1,
            furniture: 0.2,
            look: 3,
        };
        assert_eq!(config, expected);
    }

    #[test]
    fn what_is_unknown_missing_or_out_of_range_is_refused() {
        let world = |room, landmarks| {
            world_config(&Scenery { room, lighting: None, landmarks }).unwrap_err().to_string()
        };
        let named = Extern { name: "outdoor".into(), ..indoor() };
        assert_eq!(world(named, vec![]), "there is no room `outdoor`; known: indoor");
        let mut half = indoor();
        half.settings.insert("people".into(), Setting::Number(1.5));
        assert_eq!(world(half, vec![]), "`people` of `indoor` must be a whole number up to 1000000000");
        let mut more = indoor();
        more.settings.insert("windows".into(), Setting::Number(1.0));
        assert!(world(more, vec![]).starts_with("there is no setting `indoor.windows`"));
        assert!(world(indoor(), vec![landmark("books", 3.1)]).contains("inside the room"));
        assert!(camera_config(&extern_("pinhole", &[])).unwrap_err().to_string().contains("`pixels`"));
        assert!(time_of_day(&extern_("night", &[])).is_err());
    }

    #[test]
    fn lightings_are_the_times_of_day() {
        for (time, (name, _)) in TimeOfDay::ALL.iter().zip(LIGHTINGS) {
            assert_eq!(time_of_day(&extern_(name, &[])), Ok(*time));
        }
    }

    #[test]
    fn wheels_slip_and_have_a_bias() {
        let declared = extern_("wheels", &[("slip", 0.05), ("bias", 0.01)]);
        assert_eq!(wheels(&declared), Ok(Wheels { slip: 0.05, bias: 0.01 }));
        assert!(wheels(&extern_("wheels", &[("slip", 0.05)])).is_err());
        assert!(wheels(&extern_("tracks", &[])).is_err());
    }

    #[test]
    fn noise_is_that_of_noisy_only() {
        let noise = PoseNoise { position_m: 0.04, heading_rad: 0.1 };
        let noisy = extern_("noisy", &[("position", 0.04), ("heading", 0.1)]);
        assert_eq!(pose_noise(&noisy), Ok(Some(noise)));
        assert_eq!(pose_noise(&extern_("resnet", &[])), Ok(None));
        assert!(pose_noise(&extern_("noisy", &[("position", 0.04)])).is_err());
    }
}
