use super::*;
use crate::problem::render_short;
use crate::{problem, stdlib};

fn parsed(text: &str) -> (File, String) {
    let (mut sources, mut problems) = (Sources::default(), Problems::default());
    let file = sources.add("a.scn", text.to_owned());
    let tree = parse(&sources, file, &mut problems);
    println!("{}", problem::render(&problems, &sources, problem::Style::Plain));
    (tree, render_short(&problems, &sources))
}

#[test]
fn the_standard_library_and_the_scenarios_parse() {
    let scenarios = [
        include_str!("../../../scenarios/square_unison.scn"),
        include_str!("../../../scenarios/track_random.scn"),
    ];
    for text in stdlib::MODULES.iter().map(|(_, text)| *text).chain(scenarios) {
        let (file, problems) = parsed(text);
        assert_eq!(problems, "");
        assert!(!file.items.is_empty() && !file.doc.is_empty());
        println!("{file:#?}");
    }
}
