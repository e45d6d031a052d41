//! `mpgx export`: the weights and records of a study, for other programs.

use std::path::PathBuf;

use mpgx_learn::Policy;
use mpgx_study::storage::{RealDisk, Storage};
use mpgx_study::{Role, cells, export, read_policy};

use crate::failure::{Exit, Failure};
use crate::verbs::report::load;

#[derive(clap::Args)]
#[command(after_help = "\
Example: mpgx export runs/square_unison
         mpgx export runs/square_unison --format safetensors --out weights

csv          training.csv, health.csv and evaluation.csv: a line an episode or entry
json         records.json: every record whole
safetensors  <method>-<seed>.safetensors: the weights of each trained policy")]
pub struct Args {
    /// Folder of a study; of an unfinished one, what is there
    #[arg(value_name = "DIR")]
    study: PathBuf,
    /// What for
    #[arg(long, value_enum, default_value_t = Format::Csv)]
    format: Format,
    /// Write into this folder [default: export/ in the study's folder]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Format {
    Csv,
    Json,
    Safetensors,
}

pub fn run(args: Args) -> Result<Exit, Failure> {
    let study = load(&args.study)?;
    let folder = args.out.unwrap_or_else(|| args.study.join("export"));
    let out = RealDisk::new(&folder);
    out.create_folder("")?;
    let write = |name: &str, bytes: &[u8]| {
        out.write_atomic(name, bytes)?;
        println!("{}", folder.join(name).display());
        Ok::<_, Failure>(())
    };
    match args.format {
        Format::Csv => {
            export::csv(&study).iter().try_for_each(|(name, text)| write(name, text.as_bytes()))?
        }
        Format::Json => write("records.json", format!("{}\n", export::json(&study)).as_bytes())?,
        Format::Safetensors => {
            let storage = RealDisk::new(&args.study);
            let trained = |id: &String| study.records.get(id).is_some_and(|it| it.failure.is_none());
            for cell in cells(&study.plan)?.iter().filter(|it| it.role == Role::Learner && trained(&it.id)) {
                let policy = Policy::from_bytes(&read_policy(&storage, cell)?)
                    .map_err(|error| Failure::new(Exit::Io, format!("the policy of {}: {error}", cell.id)))?;
                write(&format!("{}.safetensors", cell.id), &export::safetensors(&policy))?;
            }
        }
    }
    Ok(Exit::Done)
}
