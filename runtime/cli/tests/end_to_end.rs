//! The binary as a user meets it: two commands, exit codes, kills, resumes, slower kernels; always the same study hash.

#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};

use tempfile::TempDir;

const SCENARIO: &str = include_str!("small.scn");

fn mpgx(folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_mpgx"));
    command.current_dir(folder).env_remove("MPGX_SIMD").env_remove("MPGX_LOG");
    command
}

fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("small.scn"), SCENARIO).unwrap();
    folder
}

fn run(folder: &Path, arguments: &[&str]) -> Output {
    mpgx(folder).args(arguments).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// Runs the small study to its end and gives its hash.
fn study_hash(folder: &Path, arguments: &[&str]) -> String {
    let output = run(folder, &[&["run", "small.scn"], arguments].concat());
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let study: serde_json::Value =
        serde_json::from_slice(&fs::read(folder.join("runs/small/study.json")).unwrap()).unwrap();
    study["study_hash"].as_str().unwrap().to_string()
}

#[test]
fn a_run_leaves_a_study_and_a_report_and_a_second_run_recomputes_nothing() {
    let folder = folder();
    let first = study_hash(folder.path(), &[]);
    let records = |cell: &str| folder.path().join(format!("runs/small/cells/{cell}/record.bin"));
    let written = fs::metadata(records("mpg-000")).unwrap().modified().unwrap();
    let report = fs::read_to_string(folder.path().join("runs/small/report.html")).unwrap();
    assert!(report.contains("</html>") && report.contains("<math"));

    assert_eq!(study_hash(folder.path(), &[]), first);
    assert_eq!(fs::metadata(records("mpg-000")).unwrap().modified().unwrap(), written);

    assert_ne!(study_hash(folder.path(), &["--seeds", "3"]), first);
    assert_eq!(fs::metadata(records("mpg-000")).unwrap().modified().unwrap(), written);
    assert!(records("mpg-002").exists());
}

/// Seen to fail when a dry run runs.
#[test]
fn a_range_of_seeds_runs_and_a_dry_run_tells_what_it_would_take() {
    let folder = folder();
    let output = run(folder.path(), &["run", "small.scn", "--seeds", "5..7", "--dry-run"]);
    let told = text(&output.stderr);
    assert!(told.contains("2 seeds of mpg, td3; 6 cells") && told.contains("1,600 steps"), "{told}");
    assert!(!folder.path().join("runs").exists());
    study_hash(folder.path(), &["--seeds", "5..7"]);
    let cells = fs::read_dir(folder.path().join("runs/small/cells")).unwrap();
    let mut cells: Vec<_> = cells.map(|cell| cell.unwrap().file_name().into_string().unwrap()).collect();
    cells.sort();
    assert_eq!(cells, ["mpg-005", "mpg-006", "oracle-000", "proportional-000", "td3-005", "td3-006"]);
}

/// Robots that share a policy, a curriculum, an obstacle, schedules, variants.
#[test]
fn a_flock_runs_with_its_variants_and_its_tables_tell_of_hits() {
    let folder = folder();
    let flock = SCENARIO
        .replace("observe { F[i] - p[i] for i in follower }", "observe each i in follower { F[i] - p[i] }")
        .replace("steps = 400", "steps = 150, explore_noise = linear(2, 0.1)")
        + "\nobstacles pillar[1] : disc(8 cm) { position = (0.5 m, 0.5 m) }"
        + "\nstage still { leader.speed = -0.01 m/s .. 0.01 m/s } until error < 1 m over 2 episodes within 60 steps"
        + "\nvariant three { follower.size = 3 }\nvariant near { side = 0.3 m }\nevaluate four { follower.size = 4, episodes = 2 }\n";
    fs::write(folder.path().join("small.scn"), flock).unwrap();
    let hash = study_hash(folder.path(), &["--threads", "1"]);
    for study in ["", "variants/three", "variants/near"] {
        let summary = folder.path().join("runs/small").join(study).join("study.json");
        assert!(fs::read_to_string(&summary).unwrap().contains("late_hit_episodes"), "{study}");
    }
    let output = run(folder.path(), &["run", "small.scn"]);
    let told = text(&output.stdout);
    let table = told.rsplit("held_out").next().unwrap();
    for line in ["small: mpg", "small: oracle", "variant three: td3", "variant near: proportional"] {
        assert!(table.contains(line), "{told}");
    }
    assert!(told.contains("hits"), "{told}");
    assert!(text(&output.stderr).contains("in all 18 cells of 3 studies"), "{}", text(&output.stderr));
    assert!(text(&run(folder.path(), &["list", "runs"]).stdout).contains("variant near"));
    let other = self::folder();
    fs::copy(folder.path().join("small.scn"), other.path().join("small.scn")).unwrap();
    assert_eq!(study_hash(other.path(), &["--threads", "3"]), hash);
}

#[test]
fn tests_in_scenarios_pass_and_fail_with_their_place() {
    let folder = folder();
    let with = |bound: &str| {
        let test = format!(
            "\ntest \"it starts near\" {{\n    check error < 1 m\n}}\ntest \"it is far\" {{\n    place leader at (0 m, 0 m)\n    place follower[1] at (1 m, 0 m)\n    check |p[follower[1]] - p[leader]| < {bound}\n}}\n"
        );
        fs::write(folder.path().join("small.scn"), format!("{SCENARIO}{test}")).unwrap();
        let output = run(folder.path(), &["test", "small.scn"]);
        (output.status.code(), text(&output.stdout))
    };
    let (code, told) = with("2 m");
    assert!(code == Some(0) && told.contains("small.scn: it is far ... ok"), "{told}");
    let (code, told) = with("0.5 m");
    let line = SCENARIO.lines().count() + 8;
    assert_eq!(code, Some(1), "{told}");
    assert!(told.contains("it starts near ... ok") && told.contains("it is far ... FAILED"), "{told}");
    assert!(told.contains(&format!("small.scn:{line}:")) && told.contains("it is 1"), "{told}");
    assert!(told.contains("1 passed, 1 failed"), "{told}");
}

/// Two scenarios, one row beside a published value; a row that names nothing is told before anything runs.
#[test]
fn a_suite_runs_its_scenarios_and_puts_them_beside_published_tables() {
    let folder = folder();
    let short = SCENARIO.replace("steps = 400", "steps = 60");
    fs::write(folder.path().join("small.scn"), &short).unwrap();
    fs::write(folder.path().join("other.scn"), short.replace("scenario small", "scenario other")).unwrap();
    let suite = "title = \"All <of> it\"\nscenarios = [\"small.scn\", \"other.scn\"]\n\
        [[table]]\ntitle = \"Tracking\"\nsource = \"table 1\"\n\
        [[table.row]]\nname = \"held out\"\nscenario = \"other\"\nprotocol = \"held_out\"\nmetric = \"error_m\"\npublished = 0.25\n";
    fs::write(folder.path().join("all.toml"), suite.replace("held_out", "random")).unwrap();
    let output = run(folder.path(), &["run", "all.toml"]);
    assert_eq!(output.status.code(), Some(2));
    let told = text(&output.stderr);
    assert!(told.contains("no evaluation `random`; there is held_out"), "{told}");
    assert!(!folder.path().join("runs").exists());

    fs::write(folder.path().join("all.toml"), suite).unwrap();
    let output = run(folder.path(), &["run", "all.toml"]);
    let told = text(&output.stdout);
    assert!(told.contains("published     0.25   mpg "), "{told}{}", text(&output.stderr));
    let results = folder.path().join("runs/all");
    for study in ["small", "other"] {
        assert!(results.join(study).join("study.json").is_file());
    }
    let report = fs::read_to_string(results.join("report.html")).unwrap();
    for part in ["All &lt;of&gt; it", "<td>250</td>", "other&#x2f;report.html", "Tracking"] {
        assert!(report.contains(part), "{part}");
    }
    fs::remove_file(results.join("report.html")).unwrap();
    run(folder.path(), &["report", "runs/all"]);
    assert_eq!(fs::read_to_string(results.join("report.html")).unwrap(), report);
    let again = run(folder.path(), &["run", "all.toml"]);
    assert!(!text(&again.stderr).contains("updates/s"), "{}", text(&again.stderr));
}

#[test]
fn threads_and_kernels_leave_the_hash_alone() {
    let reference = study_hash(folder().path(), &["--threads", "1"]);
    for threads in ["2", "3", "8"] {
        assert_eq!(study_hash(folder().path(), &["--threads", threads]), reference, "{threads} threads");
    }
    for kernels in ["avx2", "scalar"] {
        let folder = folder();
        let output =
            mpgx(folder.path()).args(["run", "small.scn"]).env("MPGX_SIMD", kernels).output().unwrap();
        if output.status.code() == Some(2) {
            continue; // this processor has no such kernels
        }
        assert_eq!(study_hash(folder.path(), &[]), reference, "{kernels}");
    }
}

/// Time zone, language, folder, and a home that is not there.
/// Seen to fail when the time zone or the folder is part of the hash.
#[test]
fn where_and_when_a_study_runs_leaves_the_hash_alone() {
    let reference = study_hash(folder().path(), &[]);
    for (place, zone, language) in
        [("a b/ä$'", "Asia/Kathmandu", "tr_TR.UTF-8"), ("deep/er", "America/St_Johns", "C")]
    {
        let folder = folder();
        let here = folder.path().join(place);
        fs::create_dir_all(&here).unwrap();
        fs::write(here.join("small.scn"), SCENARIO).unwrap();
        let mut command = mpgx(&here);
        command.env("TZ", zone).env("LANG", language).env("LC_ALL", language).env("HOME", "/nowhere");
        let output = command.args(["run", "small.scn", "--threads", "3"]).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        let told = text(&output.stdout);
        assert!(told.contains(&reference), "{place}, {zone}, {language}: {told}");
        assert_eq!(study_hash(&here, &[]), reference, "{place}, {zone}, {language}");
    }
}

/// The bits are those of automatic differentiation, and threads leave them alone, too.
#[test]
fn a_scenario_trains_by_automatic_differentiation() {
    let hash = |backend: &str, threads| {
        let folder = folder();
        let scenario = SCENARIO.replace("steps = 400", &format!("steps = 120, backend = {backend}"));
        fs::write(folder.path().join("small.scn"), scenario).unwrap();
        study_hash(folder.path(), &["--threads", threads])
    };
    let dfdx = hash("dfdx", "1");
    assert_eq!(hash("dfdx", "3"), dfdx);
    assert_ne!(hash("native", "1"), dfdx);
}

/// Seen to fail when a learner comes back from its checkpoint without its last differences of the critics.
#[test]
fn kill_nine_between_checkpoints_and_the_same_command_goes_on_to_the_same_hash() {
    let long = || {
        let folder = folder();
        let scenario = SCENARIO.replace("steps = 400", "steps = 9000").replace("seeds 2", "seeds 1");
        fs::write(folder.path().join("small.scn"), scenario).unwrap();
        folder
    };
    let reference = study_hash(long().path(), &[]);
    let folder = long();
    let cell = folder.path().join("runs/small/cells/mpg-000");
    for checkpoint in ["checkpoint.0", "checkpoint.1"] {
        let mut child = start(folder.path());
        while child.try_wait().unwrap().is_none() && !cell.join(checkpoint).exists() {
            std::thread::yield_now();
        }
        child.kill().unwrap();
        child.wait().unwrap();
        assert!(cell.join(checkpoint).exists() && !cell.join("record.bin").exists(), "killed too late");
    }
    assert_eq!(study_hash(folder.path(), &[]), reference);
}

/// Each signal of a batch system or a terminal: exit 75 with a checkpoint, and the same command goes on to the same hash.
/// Seen to fail when it ends with another code, or nobody listens for SIGUSR1.
#[test]
fn signals_checkpoint_and_the_same_command_goes_on_to_the_same_hash() {
    let long = || {
        let folder = folder();
        let scenario = SCENARIO.replace("steps = 400", "steps = 3000").replace("seeds 2", "seeds 1");
        fs::write(folder.path().join("small.scn"), scenario).unwrap();
        folder
    };
    let reference = study_hash(long().path(), &[]);
    for signal in ["INT", "TERM", "HUP", "USR1"] {
        let folder = long();
        let mut child = start(folder.path());
        let cells = folder.path().join("runs/small/cells");
        while child.try_wait().unwrap().is_none() && !cells.exists() {
            std::thread::yield_now();
        }
        let sent = Command::new("kill").args(["-s", signal, &child.id().to_string()]).status().unwrap();
        assert!(sent.success());
        assert_eq!(child.wait().unwrap().code(), Some(75), "SIG{signal}");
        assert!(!folder.path().join("runs/small/study.json").exists());
        assert_eq!(study_hash(folder.path(), &[]), reference, "SIG{signal}");
    }
}

fn start(folder: &Path) -> Child {
    mpgx(folder)
        .args(["run", "small.scn", "--threads", "1"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

/// Seen to fail when `--max-memory` or the limit of 1 MiB is not held, or another byte is told.
#[test]
fn bad_input_ends_with_2_and_says_what_to_do() {
    let folder = folder();
    let with = |arguments: &[&str], said: &str| {
        let output = run(folder.path(), arguments);
        let stderr = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {stderr}");
        assert!(stderr.contains(said), "{arguments:?}: {stderr}");
    };
    with(&["run", "square_unisn"], "did you mean `square_unison`?");
    with(&["run", "small.scn", "--set", "sid=1m"], "side");
    with(&["run", "small.scn", "--algorithms", "ppo"], "no method `ppo`");
    with(&["run", "small.scn", "--seeds", "0"], "--seeds");
    with(&["run", "small.scn", "--seeds", "4..4"], "A..B");
    with(&["run", "small.scn", "--variant", "wide"], "no variant `wide`");
    with(&["run", "small.scn", "--max-memory", "1MB"], "more than 1.0 MB");
    with(&["run", "small.scn", "--max-memory", "lots"], "500MB");
    with(&["vision", "render", "out", "--trials", "0"], "--trials");
    with(&["vision", "render", "out", "--size", "0"], "width of images is 0");
    fs::write(folder.path().join("bad.scn"), SCENARIO.replace("0.1 s", "0.1 m")).unwrap();
    with(&["run", "bad.scn"], "bad.scn:");
    fs::write(folder.path().join("bytes.scn"), [0x66, 0xff, 0x66]).unwrap();
    with(&["check", "bytes.scn"], "byte 1");
    fs::write(folder.path().join("large.scn"), vec![b'/'; (1 << 20) + 1]).unwrap();
    with(&["check", "large.scn"], "1 MiB");
    assert!(!folder.path().join("runs").exists(), "nothing may be left behind");
}

#[test]
fn another_scenario_in_the_same_folder_is_refused() {
    let folder = folder();
    study_hash(folder.path(), &[]);
    let output = run(folder.path(), &["run", "small.scn", "--set", "side=0.5m"]);
    assert_eq!(output.status.code(), Some(2), "{}", text(&output.stderr));
    assert!(text(&output.stderr).contains("another study"), "{}", text(&output.stderr));
}

/// Seen to fail when claims do not count.
#[test]
fn a_claim_that_fails_ends_with_1() {
    let folder = folder();
    let claim = format!("{SCENARIO}\nexpect held_out.error < 1 mm at 95%\n");
    fs::write(folder.path().join("small.scn"), claim).unwrap();
    let output = run(folder.path(), &["run", "small.scn"]);
    assert_eq!(output.status.code(), Some(1), "{}", text(&output.stderr));
    assert!(text(&output.stdout).contains("✗ held_out.error < 1 mm at 95%"), "{}", text(&output.stdout));
}

#[test]
fn every_verb_helps_and_every_built_in_scenario_compiles() {
    let folder = folder();
    let help = text(&run(folder.path(), &["--help"]).stdout);
    for verb in [
        "run", "check", "compile", "explain", "test", "diff", "doc", "new", "fmt", "hash", "list", "report",
        "view", "bench", "export", "eval",
    ] {
        assert!(help.contains(verb));
        assert!(text(&run(folder.path(), &[verb, "--help"]).stdout).contains("Example: mpgx"), "{verb}");
    }
    for line in text(&run(folder.path(), &["list"]).stdout).lines() {
        let name = line.split_whitespace().next().unwrap();
        assert_eq!(run(folder.path(), &["check", name, "--pedantic"]).status.code(), Some(0), "{name}");
        assert_eq!(run(folder.path(), &["explain", name]).status.code(), Some(0), "{name}");
    }
}

#[test]
fn golden_files_of_ones_own_are_written_and_compared() {
    let folder = folder();
    assert_eq!(run(folder.path(), &["test", "--bless"]).status.code(), Some(0));
    assert_eq!(run(folder.path(), &["test"]).status.code(), Some(0));
    let golden: PathBuf = folder.path().join("small.reward");
    fs::write(&golden, fs::read_to_string(&golden).unwrap().replace("gap", "gab")).unwrap();
    assert_eq!(run(folder.path(), &["test"]).status.code(), Some(1));
}

#[test]
fn a_study_is_compared_with_its_variant_and_told_in_every_format() {
    let folder = folder();
    let study = |name: &str, option: &[&str]| {
        let output = run(folder.path(), &[&["run", "small.scn", "--out", name], option].concat());
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    };
    study("one", &[]);
    study("two", &["--seeds", "3"]);
    let report = |arguments: &[&str]| {
        let output = run(folder.path(), &[&["report"], arguments].concat());
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        text(&output.stdout)
    };
    assert_eq!(report(&["--compare", "one", "two"]), "comparison.html\n");
    let page = fs::read_to_string(folder.path().join("comparison.html")).unwrap();
    assert!(page.contains("too few seeds") && page.contains("one against two"));
    let json: serde_json::Value =
        serde_json::from_str(&report(&["--compare", "one", "two", "--format", "json"])).unwrap();
    assert_eq!(json["evaluations"][0]["same_episodes"], true);
    assert_eq!(json["evaluations"][0]["pairs"][0]["paired"], false);
    assert_eq!((&json["studies"][0]["name"], &json["changes"][0]["what"]), (&"one".into(), &"seeds".into()));

    let file = fs::read(folder.path().join("one/study.json")).unwrap();
    let printed: serde_json::Value = serde_json::from_str(&report(&["one", "--format", "json"])).unwrap();
    assert_eq!(printed, serde_json::from_slice::<serde_json::Value>(&file).unwrap());
    let both = report(&["one", "two", "--format", "md"]);
    assert_eq!(both.matches("## small").count(), 2, "{both}");
    assert_eq!(report(&["one", "--format", "latex", "--out", "t.tex"]), "t.tex\n");
    assert!(fs::read_to_string(folder.path().join("t.tex")).unwrap().contains("\\toprule"));

    for arguments in [["report", "nowhere"].as_slice(), &["report", "one", "two", "--out", "x.html"]] {
        let output = run(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        let error = text(&output.stderr);
        assert!(
            error.contains("help: ") && (error.contains("nowhere") || error.contains("--out")),
            "{error}"
        );
    }
}

#[test]
fn weights_and_records_are_exported() {
    let folder = folder();
    let path = |name: &str| folder.path().join("runs/small/export").join(name);
    study_hash(folder.path(), &[]);
    let export = |format: &str| {
        let output = run(folder.path(), &["export", "runs/small", "--format", format]);
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        text(&output.stdout).lines().count()
    };
    assert_eq!((export("csv"), export("json"), export("safetensors")), (3, 1, 4));

    let study: serde_json::Value =
        serde_json::from_slice(&fs::read(folder.path().join("runs/small/study.json")).unwrap()).unwrap();
    let csv = fs::read_to_string(path("evaluation.csv")).unwrap();
    let of_first: Vec<f64> = csv
        .lines()
        .filter(|line| line.starts_with("mpg,0,held_out,"))
        .map(|line| line.split(',').nth(4).unwrap().parse().unwrap())
        .collect();
    let mean = of_first.iter().sum::<f64>() / of_first.len() as f64;
    let told = study["protocols"]["held_out"]["mpg"]["return"]["per_seed"][0].as_f64().unwrap();
    assert!((mean - told).abs() < 1e-12, "{mean} {told}");
    let columns = |line: &str| line.split(',').count();
    for name in ["training.csv", "health.csv", "evaluation.csv"] {
        let csv = fs::read_to_string(path(name)).unwrap();
        let head = columns(csv.lines().next().unwrap());
        assert!(csv.lines().all(|line| columns(line) == head), "{name}");
        // Four hundred updates are too few for an entry of health.
        assert_eq!(csv.lines().count() > 1, name != "health.csv", "{name}");
    }
    let records: serde_json::Value =
        serde_json::from_slice(&fs::read(path("records.json")).unwrap()).unwrap();
    assert!(records["cells"]["td3-001"]["training"]["returns"][0].is_number());

    let bytes = fs::read(path("mpg-000.safetensors")).unwrap();
    let length = u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize;
    let header: serde_json::Value = serde_json::from_slice(&bytes[8..8 + length]).unwrap();
    assert_eq!(header["layers.0.weight"]["shape"][0], 16, "{header}");
    assert_eq!(header["layers.1.weight"]["shape"], serde_json::json!([12, 16]));
    let last = header["layers.2.bias"]["data_offsets"][1].as_u64().unwrap() as usize;
    assert_eq!((8 + length) % 8, 0);
    assert_eq!(8 + length + last, bytes.len());
}

#[test]
fn a_reader_that_has_enough_is_no_error() {
    let folder = folder();
    let mut command = mpgx(folder.path());
    command.args(["doc", "std.formation"]).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!(text(&output.stderr), "");
    assert!(matches!(output.status.code(), Some(0 | 141)), "{output:?}");
}
