//! The layout of TUM RGB-D (Sturm et al. 2012): `rgb.txt` with times and images, `groundtruth.txt` with times and poses,
//! `t tx ty tz qx qy qz qw`, from the camera (x right, y down, z forward) to the world. `tags.json` is ours, and may be absent.

use std::fmt::Write;
use std::path::{Component, Path};

use super::error::DatasetError;
use super::file::{make_folder, numbers, read_lines, write, write_png};
use super::pair::Truth;
use super::recording::{Entry, Recording, Tags};
use crate::image::Frame;
use crate::pose::{PoseQ, Quaternion};

/// Widest gap between measured poses that an image may lie in, s: poses at 10 Hz and more are good enough.
const GAP_S: f64 = 0.11;

/// Reads a recording; images between poses more than 0.11 s apart, or before or after all poses, are left out and counted.
pub fn read_tum(folder: &Path) -> Result<Recording, DatasetError> {
    let truth = read_truth(&folder.join("groundtruth.txt"))?;
    let list = folder.join("rgb.txt");
    let mut entries: Vec<Entry> = Vec::new();
    let mut without_pose = 0;
    let mut last_s = f64::NEG_INFINITY;
    for (line, text) in read_lines(&list, None)? {
        let bad = |what: String| DatasetError::BadLine { path: list.clone(), line, what };
        let Some((time, name)) = text.split_once(char::is_whitespace) else {
            return Err(bad(format!("a time and the name of an image belong here, not `{text}`")));
        };
        let [time_s] = numbers(&list, line, time)?;
        rising(&list, line, &mut last_s, time_s)?;
        let name = Path::new(name.trim());
        if !name.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir)) {
            return Err(bad(format!("`{}` does not lie in the recording's folder", name.display())));
        }
        let image = folder.join(name);
        let by = format!("{}, line {line},", list.display());
        if !image.is_file() {
            return Err(DatasetError::Missing { path: image, by: Some(by) });
        }
        match truth.at(time_s, GAP_S) {
            Ok(pose) => entries.push(Entry { image, pose, time_s, named_by: Some(by) }),
            Err(_) => without_pose += 1,
        }
    }
    if entries.is_empty() {
        return Err(DatasetError::Empty { path: list, what: "image at whose time a pose was measured" });
    }
    Ok(Recording {
        folder: folder.into(),
        tags: read_tags(&folder.join("tags.json"))?,
        entries,
        without_pose,
    })
}

/// Reads the poses of `groundtruth.txt`.
pub fn read_truth(path: &Path) -> Result<Truth, DatasetError> {
    let mut samples = Vec::new();
    let mut last_s = f64::NEG_INFINITY;
    for (line, text) in read_lines(path, None)? {
        let [time_s, tx, ty, tz, x, y, z, w] = numbers(path, line, &text)?;
        rising(path, line, &mut last_s, time_s)?;
        let quaternion = Quaternion { w, x, y, z };
        let off = quaternion.dot(quaternion).sqrt() - 1.0;
        if off.abs() > 0.01 {
            let what = format!("the quaternion has length {}; it must be 1", off + 1.0);
            return Err(DatasetError::BadLine { path: path.into(), line, what });
        }
        // What we wrote stays as it is, to the bit.
        let quaternion = if off.abs() < 1e-12 { quaternion } else { quaternion.unit() };
        samples.push((time_s, PoseQ { position_m: [tx, ty, tz], quaternion }));
    }
    if samples.is_empty() {
        return Err(DatasetError::Empty { path: path.into(), what: "pose" });
    }
    Ok(Truth::of(samples))
}

/// Writes a recording into a new or empty folder, one image at a time.
pub fn write_tum(
    folder: &Path,
    tags: &Tags,
    truth: &Truth,
    frames: impl IntoIterator<Item = Frame>,
) -> Result<(), DatasetError> {
    make_folder(folder)?;
    let io = |source| DatasetError::Io { path: folder.into(), source };
    if std::fs::read_dir(folder).map_err(io)?.next().is_some() {
        return Err(DatasetError::Misnamed { path: folder.into(), what: "the folder is not empty".into() });
    }
    make_folder(&folder.join("rgb"))?;
    let mut list = String::from("# time (s), image\n");
    for Frame { image, time_s, .. } in frames {
        let name = format!("rgb/{time_s:.6}.png");
        write_png(&folder.join(&name), &image)?;
        // Writing to a String does not fail.
        let _ = writeln!(list, "{time_s} {name}");
    }
    let mut poses = String::from("# time (s), camera to world: tx ty tz (m) qx qy qz qw\n");
    for (time_s, PoseQ { position_m: [tx, ty, tz], quaternion: Quaternion { w, x, y, z } }) in truth.samples()
    {
        let _ = writeln!(poses, "{time_s} {tx} {ty} {tz} {x} {y} {z} {w}");
    }
    write(&folder.join("groundtruth.txt"), poses.as_bytes())?;
    let path = folder.join("tags.json");
    let tags = serde_json::to_vec(tags)
        .map_err(|error| DatasetError::Io { path: path.clone(), source: error.into() })?;
    write(&path, &tags)?;
    // Last, so that a recording without it is known to be unfinished.
    write(&folder.join("rgb.txt"), list.as_bytes())
}

fn rising(path: &Path, line: usize, last_s: &mut f64, time_s: f64) -> Result<(), DatasetError> {
    if time_s <= *last_s {
        let what = format!("times must rise, {time_s} s comes after {last_s} s");
        return Err(DatasetError::BadLine { path: path.into(), line, what });
    }
    *last_s = time_s;
    Ok(())
}

fn read_tags(path: &Path) -> Result<Option<Tags>, DatasetError> {
    if !path.exists() {
        return Ok(None);
    }
    let lines = read_lines(path, None)?;
    let text: Vec<&str> = lines.iter().map(|(_, line)| line.as_str()).collect();
    serde_json::from_str(&text.join("\n")).map(Some).map_err(|error| DatasetError::BadLine {
        path: path.into(),
        line: error.line(),
        what: error.to_string(),
    })
}
