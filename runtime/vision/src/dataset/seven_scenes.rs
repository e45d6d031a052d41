//! The layout of 7-Scenes (Shotton et al. 2013), read only: `frame-000000.color.png` and `frame-000000.pose.txt`, a 4 × 4
//! matrix from the camera (x right, y down, z forward) to the world. Files of other kinds, as depth, are passed over.

use std::collections::BTreeMap;
use std::path::Path;

use super::error::DatasetError;
use super::file::{numbers, read_lines};
use super::recording::{Entry, Recording};
use crate::pose::{PoseQ, Quaternion};

/// The rate of the camera: the files tell no times.
const IMAGES_HZ: f64 = 30.0;
const COLOUR: &str = ".color.png";
const POSE: &str = ".pose.txt";

/// Reads a sequence, its frames in the order of their numbers.
pub fn read_seven_scenes(folder: &Path) -> Result<Recording, DatasetError> {
    let io = |source: std::io::Error| match source.kind() {
        std::io::ErrorKind::NotFound => DatasetError::Missing { path: folder.into(), by: None },
        _ => DatasetError::Io { path: folder.into(), source },
    };
    // For each number, whether there is an image and a pose.
    let mut numbers: BTreeMap<u32, (bool, bool)> = BTreeMap::new();
    for file in std::fs::read_dir(folder).map_err(io)? {
        let name = file.map_err(io)?.file_name();
        let name = name.to_string_lossy();
        let (stem, is_image) = match (name.strip_suffix(COLOUR), name.strip_suffix(POSE)) {
            (Some(stem), _) => (stem, true),
            (_, Some(stem)) => (stem, false),
            _ => continue,
        };
        let digits = stem.strip_prefix("frame-").filter(|digits| digits.len() == 6);
        let number = digits
            .filter(|digits| digits.bytes().all(|byte| byte.is_ascii_digit()))
            .and_then(|digits| digits.parse().ok());
        let Some(number) = number else {
            let what = "it should be named as frame-000123.color.png or frame-000123.pose.txt".into();
            return Err(DatasetError::Misnamed { path: folder.join(&*name), what });
        };
        let found = numbers.entry(number).or_default();
        if is_image { found.0 = true } else { found.1 = true }
    }
    if numbers.is_empty() {
        return Err(DatasetError::Empty { path: folder.into(), what: "frame-000000.color.png" });
    }
    let entry = |(&number, &(image, pose)): (&u32, &(bool, bool))| {
        let name = |suffix: &str| folder.join(format!("frame-{number:06}{suffix}"));
        let missing =
            |path, other: &Path| DatasetError::Missing { path, by: Some(other.display().to_string()) };
        match (image, pose) {
            (false, _) => Err(missing(name(COLOUR), &name(POSE))),
            (_, false) => Err(missing(name(POSE), &name(COLOUR))),
            _ => {
                let pose = read_pose(&name(POSE))?;
                Ok(Entry { image: name(COLOUR), pose, time_s: f64::from(number) / IMAGES_HZ, named_by: None })
            }
        }
    };
    let entries = numbers.iter().map(entry).collect::<Result<_, _>>()?;
    Ok(Recording { folder: folder.into(), tags: None, entries, without_pose: 0 })
}

/// Reads a 4 × 4 matrix, one row a line.
fn read_pose(path: &Path) -> Result<PoseQ, DatasetError> {
    let lines = read_lines(path, None)?;
    let last = lines.last().map_or(1, |&(line, _)| line);
    let bad = |line: usize, what: String| DatasetError::BadLine { path: path.into(), line, what };
    let [a, b, c, d] = lines.as_slice() else {
        return Err(bad(last, format!("a pose has 4 lines, this one {}", lines.len())));
    };
    let row = |(line, text): &(usize, String)| numbers::<4>(path, *line, text);
    let rows = [row(a)?, row(b)?, row(c)?];
    if row(d)? != [0.0, 0.0, 0.0, 1.0] {
        return Err(bad(d.0, "the last line of a pose is 0 0 0 1".into()));
    }
    let matrix = rows.map(|[x, y, z, _]| [x, y, z]);
    if !is_rotation(&matrix) {
        return Err(bad(a.0, "the left upper 3 × 3 numbers are no rotation".into()));
    }
    Ok(PoseQ { position_m: rows.map(|row| row[3]), quaternion: Quaternion::from_matrix(&matrix) })
}

/// Rows of length 1 at right angles, and no mirror, to a hundredth.
fn is_rotation(m: &[[f64; 3]; 3]) -> bool {
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    };
    let near = |value: f64, wanted: f64| (value - wanted).abs() < 0.01;
    near(dot(m[0], m[0]), 1.0)
        && near(dot(m[1], m[1]), 1.0)
        && near(dot(m[2], m[2]), 1.0)
        && near(dot(m[0], m[1]), 0.0)
        && near(dot(cross(m[0], m[1]), m[2]), 1.0)
}
