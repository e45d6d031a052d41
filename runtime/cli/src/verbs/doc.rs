//! `mpgx doc`: the reference of the standard library, or of one's own file.

use std::path::PathBuf;

use mpgx_lang::document::{index, markdown};
use mpgx_lang::stdlib::MODULES;
use mpgx_study::storage::{RealDisk, Storage};

use crate::failure::{Exit, Failure};
use crate::scenario;

#[derive(clap::Args)]
#[command(after_help = "Example: mpgx doc std.motion")]
pub struct Args {
    /// A module of the standard library, or a file [default: a list of the modules]
    #[arg(value_name = "MODULE|FILE")]
    what: Option<String>,
    /// Write Markdown files here: the list and every module
    #[arg(long, value_name = "DIR", conflicts_with = "what")]
    out: Option<PathBuf>,
}

pub fn run(args: Args) -> Result<Exit, Failure> {
    if let Some(folder) = args.out {
        let disk = RealDisk::new(&folder);
        disk.create_folder("")?;
        disk.write_atomic("README.md", index(MODULES).as_bytes())?;
        for (name, text) in MODULES {
            disk.write_atomic(&format!("{name}.md"), markdown(name, text).as_bytes())?;
        }
        println!("{}", folder.join("README.md").display());
        return Ok(Exit::Done);
    }
    let Some(what) = args.what else {
        print!("{}", index(MODULES));
        return Ok(Exit::Done);
    };
    let module = MODULES.iter().find(|(name, _)| *name == what || name.strip_prefix("std.") == Some(&what));
    match module {
        Some((name, text)) => print!("{}", markdown(name, text)),
        None if what.ends_with(".scn") => print!("{}", markdown(&what, &scenario::read(what.as_ref())?)),
        None => {
            let failure = Failure::new(Exit::BadInput, format!("no module is called `{what}`"));
            let names =
                MODULES.iter().flat_map(|(name, _)| [Some(*name), name.strip_prefix("std.")]).flatten();
            return Err(match mpgx_lang::problem::did_you_mean(&what, names) {
                Some(close) => failure.help(format!("did you mean `{close}`?")),
                None => failure.help("`mpgx list std` shows the modules"),
            });
        }
    }
    Ok(Exit::Done)
}
