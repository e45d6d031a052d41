//! The world as a camera sees it.

#![allow(clippy::unwrap_used)]

use mpgx_vision::{
    CameraConfig, Image, LandmarkConfig, LandmarkKind, Moving, Path, Pose, Scene, Shot, TimeOfDay,
    TrajectoryConfig, TrajectoryKind, Trial, TrialConfig, TrialKey, WorldConfig,
};
use proptest::prelude::*;

fn small() -> CameraConfig {
    CameraConfig { width_px: 48, height_px: 36, ..CameraConfig::default() }
}

/// Without noise, and with the same gain for all pictures of a trial.
fn exact() -> CameraConfig {
    CameraConfig { auto_exposure: 0.0, shot_noise: 0.0, read_noise: 0.0, ..small() }
}

fn empty() -> WorldConfig {
    WorldConfig { people: 0, furniture: 0.0, landmarks: vec![], ..WorldConfig::default() }
}

fn key(episode: u32) -> TrialKey {
    TrialKey { episode, ..TrialKey::default() }
}

fn at(x_m: f64, y_m: f64, heading_rad: f64) -> Moving {
    Moving::still(Pose { x_m, y_m, heading_rad })
}

fn take(scene: &Scene, camera: Moving, robots: &[Moving], time_s: f64) -> Image {
    scene.render(&Shot { camera, robots, time_s, number: 0 })
}

/// Another hash is another world: what was trained on the old one has not seen it.
#[test]
fn the_pictures_are_the_same_to_the_bit() {
    let mut hasher = blake3::Hasher::new();
    for (kind, time_of_day) in TrajectoryKind::ALL.into_iter().zip(TimeOfDay::ALL) {
        let trajectory = TrajectoryConfig { kind, ..TrajectoryConfig::default() };
        let path = Path::new(&trajectory, key(5), 0).unwrap();
        let config = TrialConfig { trajectory, time_of_day, ..TrialConfig::default() };
        let trial = Trial::new(&WorldConfig::default(), &small(), &config, key(5)).unwrap();
        let robots = [at(0.5, 0.2, 1.0)];
        let shot = Shot { camera: path.at(1.0), robots: &robots, time_s: 1.0, number: 30 };
        hasher.update(&trial.scene.render(&shot).rgb);
        hasher.update(&trial.frame(100).image.rgb);
        for (time_s, pose) in trial.truth.samples() {
            for number in
                [*time_s, pose.position_m[0], pose.position_m[1], pose.quaternion.w, pose.quaternion.z]
            {
                hasher.update(&number.to_le_bytes());
            }
        }
    }
    let hash = "05f91fd5ad101c224d4766149912cac9227c499b31238cb16ae9854f76bb7367";
    assert_eq!(hasher.finalize().to_hex().as_str(), hash);
}

/// A robot's base is drawn where the pinhole says; beside it nothing changes.
#[test]
fn things_are_drawn_where_they_are_projected() {
    let camera = CameraConfig { width_px: 96, height_px: 72, tilt_rad: 0.15, ..exact() };
    let scene = Scene::new(&empty(), &camera, TimeOfDay::Afternoon, key(1)).unwrap();
    let seen = std::cell::Cell::new(0);
    proptest!(ProptestConfig::with_cases(64), |(x in -1.5..1.5, y in -1.5..1.5, heading in -3.2..3.2, away in 0.7..1.8, side in -0.4..0.4)| {
        let eye = at(x, y, heading);
        let (sin, cos) = libm::sincos(heading + side);
        let other = at(x + away * cos, y + away * sin, 0.0);
        let (without, with) = (take(&scene, eye, &[], 0.0), take(&scene, eye, &[other], 0.0));
        // The middle of the base, places inside it and places beside it.
        let (sin, cos) = libm::sincos(heading);
        let point = |aside: f64| [other.pose.x_m - aside * sin, other.pose.y_m + aside * cos, 0.06];
        for (aside, changes) in [(0.0, true), (0.12, true), (-0.12, true), (0.32, false), (-0.32, false)] {
            let [u, v] = camera.project(&camera.pose(eye.pose), point(aside)).unwrap();
            if (0.0..96.0).contains(&u) && (0.0..72.0).contains(&v) {
                let pixel = (u as usize, v as usize);
                let changed = without.pixel(pixel.0, pixel.1) != with.pixel(pixel.0, pixel.1);
                prop_assert_eq!(changed, changes, "{} {:?}", aside, pixel);
                seen.set(seen.get() + 1);
            }
        }
    });
    assert!(seen.get() > 100, "{seen:?}");
}

#[test]
fn a_landmark_stays_where_it_is_and_the_background_changes() {
    let landmark = LandmarkConfig {
        kind: LandmarkKind::Books,
        pose: Pose { x_m: 1.5, y_m: 0.0, heading_rad: 0.3 },
        height_m: 0.6,
    };
    let bare = WorldConfig { furniture: 0.5, ..empty() };
    let marked = WorldConfig { landmarks: vec![landmark], ..bare.clone() };
    let look = |world: &WorldConfig, episode| {
        take(
            &Scene::new(world, &exact(), TimeOfDay::Evening, key(episode)).unwrap(),
            at(0.0, 0.0, 0.0),
            &[],
            0.0,
        )
    };
    let far = |a: &Image, b: &Image, pixel: usize| {
        (0..3).any(|channel| a.rgb[3 * pixel + channel].abs_diff(b.rgb[3 * pixel + channel]) > 24)
    };
    for episode in 0..3 {
        let (without, with) = (look(&bare, episode), look(&marked, episode));
        let changed: Vec<usize> = (0..48 * 36).filter(|&pixel| far(&without, &with, pixel)).collect();
        assert!(changed.len() > 30, "{}", changed.len());
        assert!(
            changed.iter().all(|pixel| (17..31).contains(&(pixel % 48)) && (12..30).contains(&(pixel / 48))),
            "{changed:?}"
        );
    }
    let (one, other) = (look(&bare, 0), look(&bare, 1));
    assert!((0..48 * 36).filter(|&pixel| far(&one, &other, pixel)).count() > 48 * 36 / 10);
}

#[test]
fn evening_is_warmer_and_people_walk() {
    let scene = |time| Scene::new(&WorldConfig { people: 5, ..empty() }, &exact(), time, key(2)).unwrap();
    let warmth = |time| {
        let image = take(&scene(time), at(0.0, 0.0, -1.5), &[], 0.0);
        let sum = |channel: usize| {
            image.rgb.iter().skip(channel).step_by(3).map(|&byte| f64::from(byte)).sum::<f64>()
        };
        sum(0) / sum(2)
    };
    assert!(warmth(TimeOfDay::Evening) > 1.2 * warmth(TimeOfDay::Afternoon));
    let scene = scene(TimeOfDay::Morning);
    let moments = [0.0, 1.0, 2.0, 3.0]
        .map(|time_s| [0.0, 1.6, 3.1, 4.7].map(|heading| take(&scene, at(0.0, 0.0, heading), &[], time_s)));
    assert!(moments.windows(2).all(|pair| pair[0] != pair[1]));
}

/// A turn while the shutter is open smears upright edges.
#[test]
fn a_turning_camera_blurs() {
    let camera = CameraConfig { samples: 16, exposure_s: 0.03, ..exact() };
    let scene = Scene::new(&WorldConfig::default(), &camera, TimeOfDay::Afternoon, key(3)).unwrap();
    let sharpness = |turn_radps: f64| {
        let image = take(&scene, Moving { turn_radps, ..at(0.0, 0.0, 4.0) }, &[], 0.0);
        let steps =
            |row: &[f32]| row.windows(2).map(|pair| f64::from((pair[1] - pair[0]).powi(2))).sum::<f64>();
        image.grey().chunks(48).map(steps).sum::<f64>()
    };
    assert!(sharpness(3.0) < 0.5 * sharpness(0.0), "{} {}", sharpness(3.0), sharpness(0.0));
}

#[test]
fn noise_differs_between_frames_and_is_as_strong_as_asked() {
    let noisy = CameraConfig { shot_noise: 0.0, read_noise: 0.05, ..exact() };
    let look = |camera: &CameraConfig, number| {
        let scene = Scene::new(&empty(), camera, TimeOfDay::Evening, key(4)).unwrap();
        scene.render(&Shot { camera: at(0.0, 0.0, 0.0), robots: &[], time_s: 0.0, number })
    };
    assert_ne!(look(&noisy, 0), look(&noisy, 1));
    assert_eq!(look(&exact(), 0), look(&exact(), 1));
    let (still, first) = (look(&exact(), 0), look(&noisy, 0));
    let squared =
        still.rgb.iter().zip(&first.rgb).map(|(&a, &b)| (f64::from(a) - f64::from(b)).powi(2)).sum::<f64>();
    let deviation = (squared / still.rgb.len() as f64).sqrt();
    assert!((5.0..20.0).contains(&deviation), "{deviation}");
}

#[test]
fn no_pose_makes_the_camera_fail() {
    let camera = CameraConfig { width_px: 9, height_px: 7, tilt_rad: -0.4, ..small() };
    let scene = Scene::new(&WorldConfig::default(), &camera, TimeOfDay::Morning, key(6)).unwrap();
    let numbers = [0.0, -4.0, 3.5, 1e9, -1e300, f64::NAN, f64::INFINITY];
    for x in numbers {
        for y in numbers {
            for heading in [0.0, 1e12, f64::NAN] {
                let image = take(&scene, at(x, y, heading), &[at(y, x, heading)], x);
                assert_eq!(image.rgb.len(), 9 * 7 * 3);
            }
        }
    }
}

#[test]
fn what_cannot_be_is_told() {
    let told = |world: WorldConfig, camera: CameraConfig| {
        Scene::new(&world, &camera, TimeOfDay::Morning, key(0)).unwrap_err().to_string()
    };
    let (world, camera) = (WorldConfig::default, CameraConfig::default);
    assert_eq!(
        told(WorldConfig { room_x_m: f64::NAN, ..world() }, camera()),
        "the room's length along x is NaN; it must be 2 to 40 m"
    );
    assert_eq!(
        told(WorldConfig { room_y_m: 4.0, ..world() }, camera()),
        "y of a landmark is 2.2; it must be inside the room"
    );
    assert_eq!(
        told(world(), CameraConfig { width_px: 0, ..camera() }),
        "the width of images is 0; it must be 1 to 4096 pixels"
    );
    assert_eq!(
        told(world(), CameraConfig { samples: 0, ..camera() }),
        "the number of rays through a pixel is 0; it must be 1 to 256"
    );
    let trajectory = TrajectoryConfig { speed_mps: 0.0, ..TrajectoryConfig::default() };
    let config = TrialConfig { trajectory, ..TrialConfig::default() };
    assert_eq!(
        Trial::new(&world(), &camera(), &config, key(0)).unwrap_err().to_string(),
        "the speed along the path is 0; it must be 0.01 to 10 m/s"
    );
}

/// It drives in and out of the distance at which it would be looked out of, while the shutter is open.
#[test]
fn a_robot_at_the_camera_does_not_hide_its_view() {
    let scene = Scene::new(&empty(), &exact(), TimeOfDay::Afternoon, key(0)).unwrap();
    let camera = at(0.0, 0.0, 0.0);
    let near = |x_m: f64, speed: f64| Moving { velocity_mps: [speed, 0.0], ..at(x_m, 0.0, 0.0) };
    let alone = take(&scene, camera, &[], 0.0);
    assert_eq!(take(&scene, camera, &[near(0.2, 0.0)], 0.0), alone);
    for speed in [-20.0, 20.0] {
        assert_eq!(take(&scene, camera, &[near(0.249, speed)], 0.0), alone);
        assert_ne!(take(&scene, camera, &[near(0.251, speed)], 0.0), alone);
    }
}
