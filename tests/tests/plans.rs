//! Plans of all scenarios: they come back from RON, and the rooms behind the compiler accept them.

use std::path::PathBuf;

use mpgx_lang::meaning_hash;
use mpgx_lang::plan::Plan;
use mpgx_lang::problem::{Style, render};
use mpgx_tests::{compiled, golden, root, scenarios_in};

fn plans() -> Vec<(PathBuf, Plan)> {
    let mut files = scenarios_in(&root().join("scenarios"));
    files.extend(scenarios_in(&golden::folder("plan")));
    let plan = |path: PathBuf| {
        let it = compiled(&path);
        let plan = it.plan.unwrap_or_else(|| panic!("{}", render(&it.problems, &it.sources, Style::Plain)));
        (path, plan)
    };
    files.into_iter().map(plan).collect()
}

#[test]
fn a_plan_comes_back_from_its_text() {
    for (path, plan) in plans() {
        let back =
            Plan::from_ron(&plan.to_ron()).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        assert_eq!(back, plan, "{}", path.display());
        assert_eq!(meaning_hash(&back), meaning_hash(&plan));
    }
}

#[test]
fn scenarios_have_no_problems_at_all() {
    for path in scenarios_in(&root().join("scenarios")) {
        let it = compiled(&path);
        assert!(it.problems.is_empty(), "{}", render(&it.problems, &it.sources, Style::Plain));
    }
}

#[test]
fn the_simulator_and_the_learners_accept_every_plan() {
    for (path, plan) in plans() {
        let worlds =
            std::iter::once(&plan.world).chain(plan.protocols.iter().filter_map(|it| it.world.as_deref()));
        for world in worlds {
            let task = mpgx_sim::Task::new(&plan, world);
            let task = task.unwrap_or_else(|error| panic!("{}: {error}", path.display()));
            for controller in &plan.controllers {
                mpgx_sim::controller(&controller.what, &task)
                    .unwrap_or_else(|error| panic!("{}: {error}", path.display()));
            }
        }
        for learner in &plan.learners {
            mpgx_learn::Config::from_extern(&learner.what)
                .unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        }
    }
}
