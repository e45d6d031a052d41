//! Recordings on disk: what is written is read, what is broken is told.

#![allow(clippy::unwrap_used)]

use std::f64::consts::FRAC_1_SQRT_2;
use std::fs;
use std::path::Path;
use std::sync::LazyLock;

use mpgx_vision::dataset::{read_png, read_seven_scenes, read_tum, write_png, write_tum};
use mpgx_vision::{
    CameraConfig, Frame, Image, TimeOfDay, TrajectoryConfig, TrajectoryKind, Trial, TrialConfig, TrialKey,
    WorldConfig,
};

static TRIAL: LazyLock<Trial> = LazyLock::new(|| {
    let camera = CameraConfig { width_px: 20, height_px: 15, ..CameraConfig::default() };
    let trajectory = TrajectoryConfig { kind: TrajectoryKind::Whirlpool, ..TrajectoryConfig::default() };
    let config = TrialConfig {
        time_of_day: TimeOfDay::Evening,
        trajectory,
        duration_s: 0.4,
        ..TrialConfig::default()
    };
    Trial::new(&WorldConfig::default(), &camera, &config, TrialKey::default()).unwrap()
});

/// A recording of a few frames.
fn recorded(folder: &Path) -> &'static Trial {
    write_tum(folder, &TRIAL.tags, &TRIAL.truth, TRIAL.frames()).unwrap();
    &TRIAL
}

#[test]
fn a_trial_comes_back_from_disk_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    let trial = recorded(folder.path());
    let recording = read_tum(folder.path()).unwrap();
    let read: Vec<Frame> = recording.frames().collect::<Result<_, _>>().unwrap();
    let made: Vec<Frame> = trial.frames().collect();
    assert_eq!(made.len(), 12);
    assert_eq!(read, made);
    assert_eq!((recording.tags, recording.without_pose), (Some(trial.tags.clone()), 0));
    assert_eq!((trial.tags.lighting.as_str(), trial.tags.trajectory.as_str()), ("evening", "whirlpool"));
    assert_eq!(trial.truth.samples().len(), 145);
    // The pose of an image is that of the path at its time, not that of a neighbour 1/720 s away.
    let (found, meant) = (read[3].pose.planar(), trial.robots(3).0.pose);
    assert!(
        (found.x_m - meant.x_m).abs() < 1e-5 && (found.y_m - meant.y_m).abs() < 1e-5,
        "{found:?} {meant:?}"
    );
}

#[test]
fn a_recording_is_not_written_over_another() {
    let folder = tempfile::tempdir().unwrap();
    let trial = recorded(folder.path());
    let again = write_tum(folder.path(), &trial.tags, &trial.truth, trial.frames());
    assert_eq!(
        again.unwrap_err().to_string(),
        format!("{}: the folder is not empty", folder.path().display())
    );
}

/// Images taken before and after the poses, and in a gap between them, as in the recordings of TUM.
#[test]
fn images_without_a_pose_are_left_out_and_counted() {
    let folder = tempfile::tempdir().unwrap();
    recorded(folder.path());
    let truth = fs::read_to_string(folder.path().join("groundtruth.txt")).unwrap();
    let lines: Vec<&str> = truth.lines().collect();
    let kept = [&lines[..60], &lines[110..]].concat();
    fs::write(folder.path().join("groundtruth.txt"), kept.join("\n")).unwrap();
    let recording = read_tum(folder.path()).unwrap();
    assert_eq!((recording.entries.len(), recording.without_pose), (8, 4));
}

/// Each damage to a good recording, and the one error it gives.
#[test]
fn every_damage_of_a_tum_recording_is_told() {
    type Damage = fn(&Path);
    fn edit(path: &Path, change: impl Fn(&str) -> String) {
        fs::write(path, change(&fs::read_to_string(path).unwrap())).unwrap();
    }
    fn first_image(folder: &Path) -> std::path::PathBuf {
        let mut names: Vec<_> =
            fs::read_dir(folder.join("rgb")).unwrap().map(|file| file.unwrap().path()).collect();
        names.sort();
        names.remove(0)
    }
    let cases: [(Damage, &str); 14] = [
        (|at| fs::remove_file(at.join("rgb.txt")).unwrap(), "AT/rgb.txt is missing"),
        (|at| fs::remove_file(at.join("groundtruth.txt")).unwrap(), "AT/groundtruth.txt is missing"),
        (|at| fs::remove_file(first_image(at)).unwrap(), "IMAGE is missing; AT/rgb.txt, line 2, needs it"),
        (
            |at| edit(&at.join("rgb.txt"), |text| text.replace("rgb/", "../rgb/")),
            "AT/rgb.txt, line 2: `../rgb/NAME` does not lie in the recording's folder",
        ),
        (
            |at| edit(&at.join("rgb.txt"), |text| text.replacen(" rgb/", "rgb/", 1)),
            "AT/rgb.txt, line 2: a time and the name of an image belong here, not `TIMErgb/NAME`",
        ),
        (
            |at| edit(&at.join("rgb.txt"), |text| format!("{text}0 rgb/x.png\n")),
            "AT/rgb.txt, line 14: times must rise, 0 s comes after LAST s",
        ),
        (
            |at| fs::write(at.join("rgb.txt"), "# none\n").unwrap(),
            "AT/rgb.txt holds no image at whose time a pose was measured",
        ),
        (
            |at| edit(&at.join("groundtruth.txt"), |text| text[..text.len() - 60].to_string()),
            "AT/groundtruth.txt, line 146: 8 numbers belong here, 5 words were found",
        ),
        (
            |at| fs::write(at.join("groundtruth.txt"), "0 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 one\n").unwrap(),
            "AT/groundtruth.txt, line 2: `one` is no number",
        ),
        (
            |at| fs::write(at.join("groundtruth.txt"), "0 0 0 0 0 0 0 nan\n").unwrap(),
            "AT/groundtruth.txt, line 1: `nan` is no number",
        ),
        (
            |at| fs::write(at.join("groundtruth.txt"), "0 0 0 0 1 0 0 1\n").unwrap(),
            "AT/groundtruth.txt, line 1: the quaternion has length 1.4142135623730951; it must be 1",
        ),
        (|at| fs::write(at.join("groundtruth.txt"), "").unwrap(), "AT/groundtruth.txt holds no pose"),
        (
            |at| fs::write(at.join("tags.json"), "{\n \"lighting\": 3}").unwrap(),
            "AT/tags.json, line 2: invalid type: integer `3`, expected a string at line 2 column 13",
        ),
        (
            |at| {
                let image = first_image(at);
                let bytes = fs::read(&image).unwrap();
                fs::write(&image, &bytes[..bytes.len() / 2]).unwrap();
            },
            "IMAGE is no image that can be read: unexpected end of file",
        ),
    ];
    for (damage, told) in cases {
        let folder = tempfile::tempdir().unwrap();
        let trial = recorded(folder.path());
        let image = first_image(folder.path());
        damage(folder.path());
        let found =
            read_tum(folder.path()).and_then(|recording| recording.frames().collect::<Result<Vec<_>, _>>());
        let told = told
            .replace("AT", &folder.path().display().to_string())
            .replace("IMAGE", &image.display().to_string())
            .replace("NAME", &image.file_name().unwrap().to_string_lossy())
            .replace("TIME", &trial.time_s(0).to_string())
            .replace("LAST", &trial.time_s(11).to_string());
        assert_eq!(found.unwrap_err().to_string(), told);
    }
}

#[test]
fn huge_files_and_images_are_not_read() {
    let folder = tempfile::tempdir().unwrap();
    recorded(folder.path());
    let path = folder.path().join("groundtruth.txt");
    fs::File::create(&path).unwrap().set_len(300 << 20).unwrap();
    let told = read_tum(folder.path()).unwrap_err().to_string();
    assert_eq!(told, format!("{} has 314572800 bytes; more than 268435456 are not read", path.display()));
    let path = folder.path().join("wide.png");
    write_png(&path, &Image::new(9000, 1)).unwrap();
    let told = read_png(&path).unwrap_err().to_string();
    let why = "its 9000 × 1 pixels are more than 8192 along a side";
    assert_eq!(told, format!("{} is no image that can be read: {why}", path.display()));
}

#[test]
fn pngs_of_other_kinds_are_read_as_colour() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("image.png");
    let write = |colour: png::ColorType, depth: png::BitDepth, palette: Option<Vec<u8>>, bytes: &[u8]| {
        let mut encoder = png::Encoder::new(fs::File::create(&path).unwrap(), 2, 1);
        encoder.set_color(colour);
        encoder.set_depth(depth);
        if let Some(palette) = palette {
            encoder.set_palette(palette);
        }
        encoder.write_header().unwrap().write_image_data(bytes).unwrap();
        read_png(&path).unwrap().rgb
    };
    let (eight, sixteen) = (png::BitDepth::Eight, png::BitDepth::Sixteen);
    assert_eq!(write(png::ColorType::Grayscale, eight, None, &[7, 9]), [7, 7, 7, 9, 9, 9]);
    assert_eq!(write(png::ColorType::GrayscaleAlpha, eight, None, &[7, 0, 9, 255]), [7, 7, 7, 9, 9, 9]);
    assert_eq!(write(png::ColorType::Rgba, eight, None, &[1, 2, 3, 0, 4, 5, 6, 9]), [1, 2, 3, 4, 5, 6]);
    assert_eq!(write(png::ColorType::Grayscale, sixteen, None, &[7, 200, 9, 1]), [7, 7, 7, 9, 9, 9]);
    let palette = Some(vec![1, 2, 3, 4, 5, 6]);
    assert_eq!(
        write(png::ColorType::Indexed, png::BitDepth::One, palette, &[0b0100_0000]),
        [1, 2, 3, 4, 5, 6]
    );
}

/// A camera that looks along the world's x, its right along −y: by hand, q = (1, −1, 1, −1) / 2.
const AHEAD: &str = "0 0 1 1.5\n-1 0 0 -2\n0 -1 0 0.25\n0 0 0 1\n";

fn scene(folder: &Path, numbers: &[u32]) {
    for number in numbers {
        write_png(&folder.join(format!("frame-{number:06}.color.png")), &Image::new(4, 3)).unwrap();
        fs::write(folder.join(format!("frame-{number:06}.pose.txt")), AHEAD).unwrap();
        fs::write(folder.join(format!("frame-{number:06}.depth.png")), "not read").unwrap();
    }
}

#[test]
fn a_sequence_of_7_scenes_is_read_in_order() {
    let folder = tempfile::tempdir().unwrap();
    scene(folder.path(), &[12, 3, 0]);
    let turned = format!(
        "{FRAC_1_SQRT_2} {} 0 0\n{FRAC_1_SQRT_2}\t{FRAC_1_SQRT_2} 0 0\n0 0 1 0\n0 0 0 1",
        -FRAC_1_SQRT_2
    );
    fs::write(folder.path().join("frame-000003.pose.txt"), turned).unwrap();
    let frames: Vec<Frame> =
        read_seven_scenes(folder.path()).unwrap().frames().collect::<Result<_, _>>().unwrap();
    let times: Vec<f64> = frames.iter().map(|frame| frame.time_s).collect();
    assert_eq!(times, [0.0, 0.1, 0.4]);
    let pose = frames[0].pose;
    assert_eq!(pose.position_m, [1.5, -2.0, 0.25]);
    let q = pose.quaternion;
    assert_eq!([q.w, q.x, q.y, q.z], [0.5, -0.5, 0.5, -0.5]);
    // An eighth of a turn about z.
    let q = frames[1].pose.quaternion;
    let wanted = [0.9238795325112867, 0.0, 0.0, 0.3826834323650898];
    assert!([q.w, q.x, q.y, q.z].iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-15), "{q:?}");
}

#[test]
fn every_damage_of_a_sequence_of_7_scenes_is_told() {
    type Damage = fn(&Path);
    let cases: [(Damage, &str); 9] = [
        (
            |at| fs::remove_file(at.join("frame-000001.color.png")).unwrap(),
            "AT/frame-000001.color.png is missing; AT/frame-000001.pose.txt needs it",
        ),
        (
            |at| fs::remove_file(at.join("frame-000001.pose.txt")).unwrap(),
            "AT/frame-000001.pose.txt is missing; AT/frame-000001.color.png needs it",
        ),
        (
            |at| fs::rename(at.join("frame-000001.color.png"), at.join("frame-1.color.png")).unwrap(),
            "AT/frame-1.color.png: it should be named as frame-000123.color.png or frame-000123.pose.txt",
        ),
        (
            |at| fs::write(at.join("frame-000001.pose.txt"), "1 0 0 0\n0 1 0 0\n0 0 1 0\n").unwrap(),
            "AT/frame-000001.pose.txt, line 3: a pose has 4 lines, this one 3",
        ),
        (
            |at| fs::write(at.join("frame-000001.pose.txt"), "1 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n").unwrap(),
            "AT/frame-000001.pose.txt, line 1: 4 numbers belong here, 3 words were found",
        ),
        (
            |at| fs::write(at.join("frame-000001.pose.txt"), "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 1 1\n").unwrap(),
            "AT/frame-000001.pose.txt, line 4: the last line of a pose is 0 0 0 1",
        ),
        (
            |at| {
                fs::write(at.join("frame-000001.pose.txt"), "1 0 0 0\n0 1 0 0\n0 0 -1 0\n0 0 0 1\n").unwrap()
            },
            "AT/frame-000001.pose.txt, line 1: the left upper 3 × 3 numbers are no rotation",
        ),
        (
            |at| fs::write(at.join("frame-000001.color.png"), "no PNG").unwrap(),
            "AT/frame-000001.color.png is no image that can be read: Invalid PNG signature.",
        ),
        (
            |at| {
                for file in fs::read_dir(at).unwrap() {
                    fs::remove_file(file.unwrap().path()).unwrap();
                }
            },
            "AT holds no frame-000000.color.png",
        ),
    ];
    for (damage, told) in cases {
        let folder = tempfile::tempdir().unwrap();
        scene(folder.path(), &[0, 1]);
        damage(folder.path());
        let found = read_seven_scenes(folder.path())
            .and_then(|recording| recording.frames().collect::<Result<Vec<_>, _>>());
        assert_eq!(found.unwrap_err().to_string(), told.replace("AT", &folder.path().display().to_string()));
    }
    let nowhere = Path::new("/nowhere/at/all");
    assert_eq!(read_seven_scenes(nowhere).unwrap_err().to_string(), "/nowhere/at/all is missing");
}
