//! `mpgx new`: a first scenario of one's own.

use std::path::Path;

use clap::ValueEnum;
use mpgx_study::storage::{RealDisk, Storage};

use crate::failure::{Exit, Failure};

#[derive(clap::Args)]
#[command(after_help = "Example: mpgx new my_square --template unison")]
pub struct Args {
    /// Its name: letters, digits and _, beginning with a letter
    name: String,
    /// What it begins from
    #[arg(long, value_enum, default_value_t = Template::Track)]
    template: Template,
}

#[derive(Clone, Copy, ValueEnum)]
enum Template {
    /// One robot follows a leader
    Track,
    /// Several robots keep a shape about a leader
    Unison,
}

impl Template {
    fn text(self) -> &'static str {
        match self {
            Template::Track => include_str!("../../templates/track.scn"),
            Template::Unison => include_str!("../../templates/unison.scn"),
        }
    }
}

pub fn run(args: Args) -> Result<Exit, Failure> {
    let name = args.name.strip_suffix(".scn").unwrap_or(&args.name);
    let text = args.template.text().replacen("scenario template", &format!("scenario {name}"), 1);
    let compiled = mpgx_lang::compile("", text.clone(), &[], &mpgx_lang::source::NoFiles);
    if compiled.problems.has_errors() {
        return Err(Failure::new(Exit::BadInput, format!("`{name}` cannot be the name of a scenario"))
            .help("use letters, digits and _, begin with a letter, and no word of the language"));
    }
    let file = format!("{name}.scn");
    if Path::new(&file).exists() || !RealDisk::new(".").create_new(&file, text.as_bytes())? {
        return Err(Failure::new(Exit::BadInput, format!("{file} is there already"))
            .help("choose another name, or move the file away"));
    }
    println!("{file}");
    eprintln!("next: `mpgx explain {file}`, then `mpgx run {file}`");
    Ok(Exit::Done)
}
