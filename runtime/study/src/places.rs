//! Names of source files without the folder they were found in, so that a study is the same from any folder.

use std::path::{Component, Path};

use mpgx_lang::plan::{Place, Plan, World};

/// The Plan and its source with every file named relative to the scenario's folder.
pub(crate) fn without_folder(plan: &Plan, source: &[(String, String)]) -> (Plan, Vec<(String, String)>) {
    let main = plan.learners.first().map(|learner| learner.at.file.clone()).unwrap_or_default();
    let folder = Path::new(&main).parent().unwrap_or(Path::new("")).to_path_buf();
    let name = |file: &str| plain(file, &folder);
    let mut plan = plan.clone();
    each_place(&mut plan, |place| place.file = name(&place.file));
    (plan, source.iter().map(|(file, text)| (name(file), text.clone())).collect())
}

/// The path below `folder` if it lies there and leads nowhere else; the bare file name otherwise.
fn plain(file: &str, folder: &Path) -> String {
    let path = Path::new(file);
    let below = path.strip_prefix(folder).unwrap_or(path);
    if below.components().all(|part| matches!(part, Component::Normal(_))) {
        return below.to_string_lossy().into_owned();
    }
    path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
}

fn each_place(plan: &mut Plan, mut change: impl FnMut(&mut Place)) {
    let mut in_world = |world: &mut World| {
        world.groups.iter_mut().for_each(|group| change(&mut group.at));
        world.formations.iter_mut().for_each(|formation| change(&mut formation.at));
        world.observe.iter_mut().for_each(|observation| change(&mut observation.at));
        world.reward.iter_mut().for_each(|term| change(&mut term.at));
        world.ends.iter_mut().for_each(|end| change(&mut end.at));
    };
    in_world(&mut plan.world);
    plan.protocols.iter_mut().filter_map(|protocol| protocol.world.as_deref_mut()).for_each(in_world);
    plan.params.iter_mut().for_each(|param| change(&mut param.at));
    plan.learners.iter_mut().chain(&mut plan.controllers).for_each(|method| change(&mut method.at));
    plan.protocols.iter_mut().for_each(|protocol| change(&mut protocol.at));
    plan.claims.iter_mut().for_each(|claim| change(&mut claim.at));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_lose_the_scenarios_folder() {
        for (file, main, expected) in [
            ("square.scn", "square.scn", "square.scn"),
            ("a/b/square.scn", "a/b/square.scn", "square.scn"),
            ("a/b/shapes/mine.scn", "a/b/square.scn", "shapes/mine.scn"),
            ("shapes/mine.scn", "a/b/square.scn", "shapes/mine.scn"),
            ("/home/x/square.scn", "/home/x/square.scn", "square.scn"),
            ("../square.scn", "../square.scn", "square.scn"),
            ("../other/mine.scn", "here/square.scn", "mine.scn"),
            ("", "square.scn", ""),
        ] {
            let folder = Path::new(main).parent().unwrap();
            assert_eq!(plain(file, folder), expected, "{file} of {main}");
        }
    }
}
