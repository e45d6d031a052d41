//! `mpgx vision eval` and `mpgx vision predict`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use mpgx_vision::dataset::{Recording, Tags, read_png, read_seven_scenes, read_tum};
use mpgx_vision::measure::{COMPONENTS, Evaluation, Localisation, evaluate};
use mpgx_vision::network::{HeldOut, Localiser, NetworkError, SourceRecord, Weights, answers, held_out};
use mpgx_vision::{Frame, Image, TrialsConfig};
use serde_json::json;

use crate::failure::{Exit, Failure};

#[derive(clap::Args)]
#[command(after_help = "Example: mpgx vision eval resnet.safetensors --trials 9

Errors are means in percent of the ranges of the true poses, as in the paper's table.")]
pub struct EvalArgs {
    /// Made by `mpgx vision train`
    weights: PathBuf,
    /// Folders of recordings, TUM RGB-D or 7-Scenes
    recordings: Vec<PathBuf>,
    /// Without recordings, trials never seen in the network's own world
    #[arg(long, default_value_t = 9, value_name = "N")]
    trials: u32,
    /// Images of a trial
    #[arg(long, default_value_t = 100, value_name = "N")]
    images: usize,
    /// One JSON object
    #[arg(long)]
    json: bool,
}

#[derive(clap::Args)]
#[command(after_help = "Example: mpgx vision predict resnet.safetensors photo.png")]
pub struct PredictArgs {
    /// Made by `mpgx vision train`
    weights: PathBuf,
    /// PNG files
    #[arg(required = true)]
    images: Vec<PathBuf>,
    /// One JSON array
    #[arg(long)]
    json: bool,
}

pub fn eval(args: EvalArgs) -> Result<Exit, Failure> {
    let weights = Weights::read(&args.weights)?;
    let localiser = Localiser::new(&weights);
    let (network, others) = if args.recordings.is_empty() {
        let SourceRecord::Rendered(trials) = &weights.record.source else {
            let message = "the network was trained on recordings; there is no world to render";
            return Err(Failure::new(Exit::BadInput, message).help("name recordings to measure it on"));
        };
        let trials = TrialsConfig { images: args.images, ..(**trials).clone() };
        let HeldOut { network, retrieval, reckoning } = held_out(&localiser, &trials, args.trials)?;
        (network, vec![("retrieval", retrieval), ("dead reckoning, 5 s", reckoning)])
    } else {
        let mut found = Vec::new();
        for recording in recordings(&args.recordings)? {
            let tags = recording.tags.clone().unwrap_or_else(|| untagged(&recording));
            let frames = recording.frames().collect::<Result<Vec<Frame>, _>>()?;
            found.extend(answers(&localiser, &tags, &frames)?);
        }
        let found = evaluate(&found).ok_or(NetworkError::NoImages { what: "measure with" })?;
        (found, Vec::new())
    };
    if args.json {
        let step = weights.record.step;
        let others: BTreeMap<&str, Evaluation> = others.into_iter().collect();
        println!("{}", json!({ "step": step, "network": network, "others": others }));
    } else {
        print(&network, &others);
    }
    Ok(Exit::Done)
}

pub fn predict(args: PredictArgs) -> Result<Exit, Failure> {
    let localiser = Localiser::new(&Weights::read(&args.weights)?);
    let images = args.images.iter().map(|path| read_png(path)).collect::<Result<Vec<Image>, _>>()?;
    let estimates = localiser.estimate(&images)?;
    if args.json {
        let found = args.images.iter().zip(&estimates);
        let found = found.map(|(path, estimate)| {
            json!({ "image": path, "pose": estimate.pose, "landmarks_m": estimate.landmarks_m })
        });
        println!("{}", serde_json::Value::from_iter(found));
        return Ok(Exit::Done);
    }
    for (path, estimate) in args.images.iter().zip(&estimates) {
        let pose = estimate.pose.planar();
        print!(
            "{}: x {:.3} m  y {:.3} m  heading {:.1}°",
            path.display(),
            pose.x_m,
            pose.y_m,
            pose.heading_rad.to_degrees()
        );
        for (number, away_m) in estimate.landmarks_m.iter().enumerate() {
            print!("{}{away_m:.2}", if number == 0 { "  landmarks (m) " } else { " " });
        }
        println!();
    }
    Ok(Exit::Done)
}

/// Recordings of either layout.
pub fn recordings(folders: &[PathBuf]) -> Result<Vec<Recording>, Failure> {
    let read = |folder: &Path| {
        if folder.join("rgb.txt").exists() { read_tum(folder) } else { read_seven_scenes(folder) }
    };
    Ok(folders.iter().map(|folder| read(folder)).collect::<Result<_, _>>()?)
}

fn untagged(recording: &Recording) -> Tags {
    let name = recording.folder.file_name().unwrap_or_default().to_string_lossy();
    Tags { lighting: name.clone().into(), trajectory: name.into() }
}

fn print(network: &Evaluation, others: &[(&str, Evaluation)]) {
    print!("{:<22}", "mean error, % of range");
    for component in COMPONENTS {
        print!("{component:>7}");
    }
    println!("  median m   rad  within 5 cm and 5°");
    line("network", &network.all);
    for (name, found) in network.by_lighting.iter().chain(&network.by_trajectory) {
        line(&format!("  {name}"), found);
    }
    for (name, found) in others {
        line(name, &found.all);
    }
    let ranges = &network.all.ranges;
    println!("ranges, low:  {:6.2?}\n        high: {:6.2?}", ranges.low, ranges.high);
}

fn line(name: &str, found: &Localisation) {
    print!("{name:<22}");
    for percent in found.percent {
        match percent {
            Some(percent) => print!("{percent:7.2}"),
            None => print!("{:>7}", "-"),
        }
    }
    println!(
        "{:10.3}{:6.3}{:9.1} %",
        found.translation.median(),
        found.rotation.median(),
        100.0 * found.recall_5cm_5deg
    );
}

impl From<NetworkError> for Failure {
    fn from(error: NetworkError) -> Self {
        let exit = match error {
            NetworkError::Io { .. } | NetworkError::Dataset(_) | NetworkError::BadWeights { .. } => Exit::Io,
            NetworkError::Diverged { .. } | NetworkError::NotFinite => Exit::NotAsExpected,
            NetworkError::Threads(_) => Exit::Internal,
            _ => Exit::BadInput,
        };
        Failure::new(exit, error.to_string())
    }
}
