//! Time of a compilation, with what it reads of the standard library.

use mpgx_lang::Compilation;
use mpgx_lang::source::NoFiles;

use super::Figure;
use super::stopwatch::{Windows, seconds_a_run};
use crate::scenario;

/// Two hundred lines with most of what the language has, three evaluations and two variants among it.
const CONVOY: &str = include_str!("convoy.scn");

/// Every scenario that comes with mpgx; two hundred lines, with more and more terms of the reward; few robots and many.
pub fn figures(windows: Windows) -> Vec<Figure> {
    let time = |name: &str, text: &str| {
        let seconds = seconds_a_run(windows, || {
            std::hint::black_box(compile(text));
        });
        Figure::new(format!("{name}, {} lines", text.lines().count()), seconds * 1e3, "ms")
    };
    let mut figures: Vec<Figure> = scenario::EMBEDDED.iter().map(|(name, text)| time(name, text)).collect();
    figures.extend([0, 100, 200].map(|terms| time("convoy", &with_terms(terms))));
    figures.extend([3, 1000].map(|robots| time(&format!("{robots} robots"), &with_robots(robots))));
    figures
}

fn compile(text: &str) -> Compilation {
    mpgx_lang::compile("a.scn", text.to_string(), &[], &NoFiles)
}

fn with_terms(count: usize) -> String {
    let term = |k| format!("    more_{k} = -k_o * sum(i in carrier) obstacle_range(i, reach)\n");
    CONVOY.replace("reward {\n", &format!("reward {{\n{}", (0..count).map(term).collect::<String>()))
}

fn with_robots(count: usize) -> String {
    let (_, text) = scenario::embedded("growth").unwrap_or_default();
    text.replace("robot[1]", &format!("robot[{count}]"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_measured_compiles() {
        assert_eq!(CONVOY.lines().count(), 200);
        assert_eq!(with_terms(100).lines().count(), 300);
        for text in [with_terms(0), with_terms(10), with_robots(3)] {
            assert_eq!(compile(&text).problems.iter().count(), 0);
        }
        let many = compile(&with_robots(1000)).plan.unwrap();
        assert!(many.world.groups.iter().any(|group| group.size == 1000));
    }
}
