//! Finding and compiling scenarios: a file, or one that is embedded in the binary.

use std::fs::File;
use std::io::Read;
use std::path::{Component, Path, PathBuf};

use mpgx_lang::plan::Plan;
use mpgx_lang::problem::{Style, render};
use mpgx_lang::source::Loader;
use mpgx_lang::{Compilation, Override};

use crate::failure::{Exit, Failure};

/// The scenarios that come with mpgx: name and text.
pub const EMBEDDED: &[(&str, &str)] = &[
    ("angular_or_xy", include_str!("../../../scenarios/angular_or_xy.scn")),
    ("consensus_triangle", include_str!("../../../scenarios/consensus_triangle.scn")),
    ("flock_among_pillars", include_str!("../../../scenarios/flock_among_pillars.scn")),
    ("growth", include_str!("../../../scenarios/growth.scn")),
    ("kinematics", include_str!("../../../scenarios/kinematics.scn")),
    ("larger_teams", include_str!("../../../scenarios/larger_teams.scn")),
    ("leader_changes", include_str!("../../../scenarios/leader_changes.scn")),
    ("leader_loss", include_str!("../../../scenarios/leader_loss.scn")),
    ("literal_listing", include_str!("../../../scenarios/literal_listing.scn")),
    ("localise_and_follow", include_str!("../../../scenarios/localise_and_follow.scn")),
    ("regulation_obstacles", include_str!("../../../scenarios/regulation_obstacles.scn")),
    ("robust_sensing", include_str!("../../../scenarios/robust_sensing.scn")),
    ("scaling", include_str!("../../../scenarios/scaling.scn")),
    ("square_unison", include_str!("../../../scenarios/square_unison.scn")),
    ("square_unison_points", include_str!("../../../scenarios/square_unison_points.scn")),
    ("track_circle", include_str!("../../../scenarios/track_circle.scn")),
    ("track_paper", include_str!("../../../scenarios/track_paper.scn")),
    ("track_random", include_str!("../../../scenarios/track_random.scn")),
    ("track_random_unicycle", include_str!("../../../scenarios/track_random_unicycle.scn")),
    ("track_square", include_str!("../../../scenarios/track_square.scn")),
    ("unison_by_sight", include_str!("../../../scenarios/unison_by_sight.scn")),
];

/// A source file may not be larger than this.
const MAX_BYTES: u64 = 1 << 20;

/// Compiles the file `name`, or the embedded scenario of that name. Warnings and errors are in the result.
pub fn compile(name: &str, overrides: &[Override]) -> Result<Compilation, Failure> {
    let path = Path::new(name);
    if path.exists() && !path.is_dir() {
        let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
        return Ok(mpgx_lang::compile(name, read(path)?, overrides, &Folder(folder)));
    }
    match embedded(name) {
        Some((name, text)) => Ok(mpgx_lang::compile(
            &format!("{name}.scn"),
            text.to_string(),
            overrides,
            &mpgx_lang::source::NoFiles,
        )),
        None => Err(not_found(name)),
    }
}

/// Compiles, prints all problems on stderr, and gives the Plan if there were no errors.
pub fn plan(name: &str, overrides: &[Override]) -> Result<(Plan, Compilation), Failure> {
    checked(name, compile(name, overrides)?)
}

/// The same of what was compiled already.
pub fn checked(name: &str, mut compilation: Compilation) -> Result<(Plan, Compilation), Failure> {
    if !compilation.problems.is_empty() {
        anstream::eprint!("{}", render(&compilation.problems, &compilation.sources, Style::Coloured));
    }
    match compilation.plan.take() {
        Some(plan) => Ok((plan, compilation)),
        None => {
            let errors = compilation.problems.errors();
            let things = if errors == 1 { "1 error".into() } else { format!("{errors} errors") };
            Err(Failure::new(Exit::BadInput, format!("{name} has {things}"))
                .help("`mpgx explain CODE` tells the story of a code in brackets"))
        }
    }
}

/// Name and text of the scenario's own files, the main one first; not `--set`.
pub fn files(compilation: &Compilation) -> Vec<(String, String)> {
    let own = |name: &str| name.ends_with(".scn") && !name.starts_with("--set ");
    let files = compilation.sources.iter().filter(|file| own(&file.name));
    files.map(|file| (file.name.clone(), file.text.clone())).collect()
}

/// The Plan of the embedded scenario of that name.
pub fn built_in(name: &str) -> Option<Plan> {
    let (name, text) = embedded(name)?;
    mpgx_lang::compile(&format!("{name}.scn"), text.to_string(), &[], &mpgx_lang::source::NoFiles).plan
}

/// The name and text of an embedded scenario.
pub fn embedded(name: &str) -> Option<(&'static str, &'static str)> {
    let wanted = name.strip_suffix(".scn").unwrap_or(name);
    EMBEDDED.iter().copied().find(|(name, _)| *name == wanted)
}

fn not_found(name: &str) -> Failure {
    if Path::new(name).is_dir() {
        return Failure::new(Exit::BadInput, format!("{name} is a folder, not a scenario"))
            .help("give the scenario's file; a study goes on with the command that began it");
    }
    let failure =
        Failure::new(Exit::BadInput, format!("no file and no built-in scenario is called `{name}`"));
    let stem = Path::new(name).file_stem().and_then(|stem| stem.to_str()).unwrap_or(name);
    match mpgx_lang::problem::did_you_mean(stem, EMBEDDED.iter().map(|(name, _)| *name)) {
        Some(close) => failure.help(format!("did you mean `{close}`?")),
        None => failure.help("`mpgx list` shows the built-in scenarios"),
    }
}

/// Reads a source file whole, but never more than the limit, whatever the file claims to be.
pub fn read(path: &Path) -> Result<String, Failure> {
    let shown = path.display().to_string();
    let file =
        File::open(path).map_err(|why| Failure::new(Exit::Io, format!("cannot read {shown}: {why}")))?;
    read_all(file, &shown)
}

/// The same of anything that can be read, called `shown`.
pub fn read_all(from: impl Read, shown: &str) -> Result<String, Failure> {
    let mut bytes = Vec::new();
    from.take(MAX_BYTES + 1)
        .read_to_end(&mut bytes)
        .map_err(|why| Failure::new(Exit::Io, format!("cannot read {shown}: {why}")))?;
    if bytes.len() as u64 > MAX_BYTES {
        return Err(Failure::new(Exit::BadInput, format!("{shown} is larger than 1 MiB"))
            .help("a scenario is a few hundred lines; is this the right file?"));
    }
    String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        Failure::new(Exit::BadInput, format!("{shown} is not UTF-8 text: the first bad byte is byte {at}"))
            .help("save it as UTF-8")
    })
}

/// The files among some paths, and the `.scn` files of the folders among them, sorted.
pub fn collect(paths: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    let mut files = Vec::new();
    for path in paths {
        let cannot =
            |why: std::io::Error| Failure::new(Exit::Io, format!("cannot read {}: {why}", path.display()));
        if !path.is_dir() {
            files.push(path.clone());
            continue;
        }
        for entry in std::fs::read_dir(path).map_err(cannot)? {
            let entry = entry.map_err(cannot)?.path();
            if entry.extension().is_some_and(|extension| extension == "scn") {
                files.push(entry);
            }
        }
    }
    files.sort();
    Ok(files)
}

/// Modules beside the scenario; nothing outside its folder.
struct Folder(PathBuf);

impl Loader for Folder {
    fn load(&self, path: &str) -> Result<String, String> {
        let relative = Path::new(path);
        if relative.components().any(|part| !matches!(part, Component::Normal(_))) {
            return Err(format!("`{path}` leads out of the scenario's folder"));
        }
        let file = self.0.join(relative);
        let inside = |file: &Path| Some((file.canonicalize().ok()?, self.root().canonicalize().ok()?));
        if let Some((file, root)) = inside(&file)
            && !file.starts_with(&root)
        {
            return Err(format!("`{path}` is a link out of the scenario's folder"));
        }
        read(&file).map_err(|failure| failure.message)
    }
}

impl Folder {
    fn root(&self) -> &Path {
        if self.0.as_os_str().is_empty() { Path::new(".") } else { &self.0 }
    }
}
