//! Settings in, configuration or a clear error out.

mod support;

use mpgx_lang::plan::{Curve, Extern, Schedule, Setting};
use mpgx_learn::{ALGORITHMS, Config, LearnError, SETTINGS};
use support::settings;

fn changed(name: &str, value: Setting) -> Result<Config, LearnError> {
    let mut what = settings("mpg", &[8], 4);
    assert!(what.settings.insert(name.to_owned(), value).is_some(), "{name} is no setting");
    Config::from_extern(&what)
}

#[test]
fn every_algorithm_reads_every_setting() {
    for algorithm in ALGORITHMS {
        let what = settings(algorithm, &[8, 9], 4);
        let config = Config::from_extern(&what).unwrap();
        assert_eq!((config.hidden, config.batch, config.train_clip), (vec![8, 9], 4, 1e9));
        assert_eq!(what.settings.len(), SETTINGS.len());
        for setting in SETTINGS {
            let mut what = what.clone();
            what.settings.remove(*setting);
            let error = LearnError::MissingSetting { algorithm: (*algorithm).to_owned(), setting };
            assert_eq!(Config::from_extern(&what), Err(error));
        }
    }
}

/// The names that `stdlib/learn.scn` declares for `mpg`, one a line: `name : type = default`.
#[test]
fn the_settings_are_those_of_std() {
    let text = include_str!("../../../stdlib/learn.scn");
    let declaration = text.split("extern algorithm mpg(").nth(1).unwrap().split("\n)").next().unwrap();
    let lines = declaration.lines().filter(|line| !line.trim_start().starts_with("///"));
    let names: Vec<&str> = lines.filter_map(|line| Some(line.split_once(':')?.0.trim())).collect();
    assert_eq!(names, SETTINGS);
}

#[test]
fn unknown_names_are_errors() {
    let mut what = settings("mpg", &[8], 4);
    what.settings.insert("momentum".to_owned(), Setting::Number(1.0));
    let error = Config::from_extern(&what).unwrap_err();
    assert_eq!(error.to_string(), "`mpg` has no setting `momentum`");
    let what = Extern { name: "dqn".to_owned(), ..settings("mpg", &[8], 4) };
    assert_eq!(
        Config::from_extern(&what).unwrap_err().to_string(),
        "there is no algorithm `dqn`; there are mpg, td3, td3_original, mean, ddpg"
    );
}

#[test]
fn wrong_values_are_errors() {
    use Setting::{List, Number, Range, Truth, Word};
    for (name, value) in [
        ("gamma", Number(1.1)),
        ("gamma", Number(f64::NAN)),
        ("actor_rate", Number(-1e-3)),
        ("tau", Truth(true)),
        ("batch", Number(0.0)),
        ("batch", Number(2.5)),
        ("batch", Number(1e300)),
        ("inner", Range(1.0, 2.0)),
        ("hidden", List(vec![])),
        ("hidden", List(vec![8.0, 0.0])),
        ("hidden", List(vec![65536.0, 65536.0])),
        ("delay_counter", Word("often".to_owned())),
        ("delta_reset", Number(1.0)),
    ] {
        match changed(name, value.clone()) {
            Err(LearnError::WrongSetting { setting, .. }) => assert_eq!(setting, name),
            other => panic!("{name} = {value:?}: {other:?}"),
        }
    }
    let error = changed("batch", Number(0.0)).unwrap_err();
    assert_eq!(
        error.to_string(),
        "the setting `batch` must be a whole number in 1 .. 65536, not Number(0.0)"
    );
}

/// The settings that may change over training, and schedules that are none.
#[test]
fn schedules_are_taken_where_they_are_sound() {
    let schedule = |curve, from, to, begin, end| Setting::Schedule(Schedule { curve, from, to, begin, end });
    let sound = schedule(Curve::Geometric, 0.5, 0.25, 0.0, 1.0);
    let taking: Vec<&str> =
        SETTINGS.iter().copied().filter(|name| changed(name, sound.clone()).is_ok()).collect();
    assert_eq!(taking, ["gamma", "actor_rate", "critic_rate", "tau", "train_noise", "explore_noise"]);
    for unsound in [
        schedule(Curve::Geometric, 0.5, 0.0, 0.0, 1.0),
        schedule(Curve::Linear, 0.5, 1.5, 0.0, 1.0),
        schedule(Curve::Linear, -0.5, 0.5, 0.0, 1.0),
        schedule(Curve::Cosine, 0.5, f64::NAN, 0.0, 1.0),
        schedule(Curve::Linear, 0.5, 0.5, 0.6, 0.4),
        schedule(Curve::Linear, 0.5, 0.5, 0.6, 1.1),
        schedule(Curve::Linear, 0.5, 0.5, f64::NAN, 1.0),
    ] {
        assert!(changed("gamma", unsound.clone()).is_err(), "{unsound:?}");
    }
}
