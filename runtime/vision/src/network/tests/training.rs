use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

use mpgx_random::{Address, Purpose};

use crate::augment::AugmentConfig;
use crate::camera::CameraConfig;
use crate::image::Image;
use crate::network::{
    ImageSet, Localiser, NetworkError, Orientation, ResNetConfig, Source, Stem, TrainConfig, Weighting,
    Weights, train_to,
};
use crate::pose::Pose;
use crate::trials::TrialsConfig;

/// Images of noise, each from another place.
pub(super) fn noise(count: u32) -> Source {
    let mut set = ImageSet::new(16, 16);
    for episode in 0..count {
        let purpose = Purpose::Scene;
        let address = Address { master: 7, purpose, protocol: 0, part: 0, seed: 0, episode, step: 0 };
        let mut stream = address.stream();
        let rgb = (0..16 * 16 * 3).map(|_| stream.below(256) as u8).collect();
        let mut within = |half: f64| half * (2.0 * stream.uniform() - 1.0);
        let pose = Pose { x_m: within(2.0), y_m: within(1.0), heading_rad: within(3.0) };
        set.add(&Image { width: 16, height: 16, rgb }, CameraConfig::default().pose(pose));
    }
    Source::Recorded(Arc::new(set))
}

pub(super) fn tiny() -> TrainConfig {
    TrainConfig {
        network: ResNetConfig { channels: 2, width_px: 16, height_px: 16, ..ResNetConfig::default() },
        weighting: Weighting::Learnt,
        steps: 7,
        batch: 4,
        ..TrainConfig::default()
    }
}

/// Trains until `stop` steps are done, or to the end.
fn run(config: &TrainConfig, source: &Source, path: &Path, stop: u64) -> Result<Weights, NetworkError> {
    train_to(config, source, path, 1000, &mut |progress| {
        if progress.step == stop { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    })
}

fn assert_resumes(config: &TrainConfig, source: &Source) {
    let folder = tempfile::tempdir().unwrap();
    let (whole, parts) = (folder.path().join("whole"), folder.path().join("parts"));
    run(config, source, &whole, 0).unwrap();
    for stop in [1, 3, 6] {
        let weights = run(config, source, &parts, stop).unwrap();
        assert_eq!(weights.record.step, stop);
        assert!(std::fs::read(&whole).unwrap() != std::fs::read(&parts).unwrap());
    }
    run(config, source, &parts, 0).unwrap();
    assert!(std::fs::read(&whole).unwrap() == std::fs::read(&parts).unwrap());
}

#[test]
fn what_was_interrupted_ends_with_the_same_bits() {
    assert_resumes(&tiny(), &noise(12));
}

/// Five steps an epoch of new trials, and an interruption within each of the first two.
#[test]
fn so_does_what_learns_from_new_trials() {
    let camera = CameraConfig { width_px: 16, height_px: 16, samples: 1, ..CameraConfig::default() };
    let trials = TrialsConfig { camera, duration_s: 5.0, images: 10, trials: 2, ..TrialsConfig::default() };
    assert_resumes(&tiny(), &Source::Rendered(Box::new(trials)));
}

#[test]
fn a_training_goes_on_only_with_what_it_began_with() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("net.safetensors");
    run(&tiny(), &noise(12), &path, 2).unwrap();
    let other = TrainConfig { seed: 2, ..tiny() };
    for (config, source) in [(&other, noise(12)), (&tiny(), noise(13))] {
        let error = run(config, &source, &path, 0).unwrap_err();
        assert!(matches!(error, NetworkError::OtherTraining { .. }), "{error}");
    }
    // What is done is left as it is.
    let done = run(&tiny(), &noise(12), &path, 0).unwrap();
    assert_eq!(run(&tiny(), &noise(12), &path, 0).unwrap(), done);
}

#[test]
fn sixteen_images_are_learnt_by_heart() {
    const STILL: AugmentConfig = AugmentConfig {
        brightness: 0.0,
        contrast: 0.0,
        gamma: 0.0,
        tint: 0.0,
        blur_px: 0.0,
        noise: 0.0,
        cut_out: 0.0,
        shift_px: 0.0,
    };
    for orientation in [Orientation::Heading, Orientation::Quaternion] {
        let config = TrainConfig {
            network: ResNetConfig { channels: 4, stem: Stem::Small, ..tiny().network },
            orientation,
            augment: STILL,
            steps: 150,
            batch: 16,
            learning_rate: 0.01,
            ..tiny()
        };
        let folder = tempfile::tempdir().unwrap();
        let mut last = [f64::NAN; 3];
        let source = noise(16);
        let weights = train_to(&config, &source, &folder.path().join("net"), 1000, &mut |progress| {
            last = progress.losses;
            ControlFlow::Continue(())
        });
        assert!(last[0] < 0.02 && last[1] < 0.02, "{orientation:?} {last:?}");
        let Source::Recorded(set) = &source else { unreachable!() };
        let images: Vec<Image> = (0..16).map(|number| set.image(number)).collect();
        for (estimate, truth) in
            Localiser::new(&weights.unwrap()).estimate(&images).unwrap().iter().zip(set.poses())
        {
            let [x, y, _] = estimate.pose.position_m;
            let away = libm::hypot(x - truth.position_m[0], y - truth.position_m[1]);
            assert!(away < 0.25 && estimate.pose.quaternion.angle_rad(truth.quaternion) < 0.2, "{away}");
        }
    }
}

#[test]
fn what_cannot_be_trained_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("net.safetensors");
    let few = run(&tiny(), &noise(3), &path, 0).unwrap_err();
    assert_eq!(few.to_string(), "there are no images to fill a batch");
    for config in [
        TrainConfig { batch: 1, ..tiny() },
        TrainConfig { steps: 0, ..tiny() },
        TrainConfig { learning_rate: f64::NAN, ..tiny() },
        TrainConfig { network: ResNetConfig { depth: 20, ..tiny().network }, ..tiny() },
    ] {
        assert!(matches!(run(&config, &noise(8), &path, 0), Err(NetworkError::Config(_))), "{config:?}");
    }
    assert!(!path.exists());
}
