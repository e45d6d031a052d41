//! The grammar reads every construct in a time that grows with its length: it counts pest's calls.
//! The limit of calls is one for the process, so this file has one test.

use std::num::NonZeroUsize;

use mpgx_lang::parse::parse;
use mpgx_lang::problem::Problems;
use mpgx_lang::source::Sources;

fn fits(text: &str, calls: usize) -> bool {
    pest::set_call_limit(NonZeroUsize::new(calls));
    let (mut sources, mut problems) = (Sources::default(), Problems::default());
    let file = sources.add("a.scn", text.to_owned());
    parse(&sources, file, &mut problems);
    !problems.iter().any(|problem| problem.code.name == "too-complex")
}

fn calls(text: &str) -> usize {
    let (mut low, mut high) = (1, 1 << 22);
    assert!(fits(text, high), "{text}");
    while low < high {
        let middle = (low + high) / 2;
        if fits(text, middle) { high = middle } else { low = middle + 1 }
    }
    low
}

#[test]
fn twice_the_length_is_twice_the_work() {
    fits("let a = 1", 1);
    // what opens, what stands in the middle, what closes; a `?` at the end is a syntax error
    let nested = [
        ("let a = ", "(", "1", ")"),
        ("let a = ", "f(x, ", "1", ")"),
        ("let a = ", "min(x, ", "1", ")"),
        ("let a = ", "min(min, max, ", "1", "?"),
        ("let a = ", "|", "1", "|"),
        ("let a = ", "a[", "1", "]"),
        ("let a = ", "[", "1", "]"),
        ("let a = ", "(1, ", "1", ")"),
        ("let a = ", "if a then b else ", "c", ""),
        ("let a = ", "if ", "a", " then b else c"),
        ("let a = ", "sum(i in a) ", "x", ""),
        ("let a = ", "any(i, j in ", "x", ") y"),
        ("let a = ", "-", "x", ""),
        ("let a = ", "not ", "x", ""),
        ("let a = 1", " + 2 m/s^2", "", ""),
        ("let a = 1", " * (x, y)", "", ""),
        ("let a = x", " and y < |z|", "", ""),
        ("let a = x", "^x", "", ""),
        ("let a = x", " x", "", ""),
        ("let a = 1 m", "/s*m", "", ""),
        ("let a = [1", ", 2", "]", ""),
        ("let a = f(1", ", a = 2", ")", ""),
        ("use std", ".a", "", ""),
        ("use std.{a", ", b", "}", ""),
        ("world {", " a.b.c = 1\n", "}", ""),
        ("reward {", " /// doc\n a = -sum(i in b) |p[i]|\n", "}", ""),
        ("end {", " a when b > 1 costs 2 m\n", "}", ""),
        ("observe {", " a for i in b if c\n", "}", ""),
        ("compare {", " a(b = 1),", "}", ""),
        ("fn f(a : m", ", b : vec(m) = 1 in 0 .. 2", ") -> m = 1", ""),
        ("fn f() -> m {", " let a = b\n", "1 }", ""),
        ("motion f() {", " state a ~ b(1, 2)\n", "velocity = 1 }", ""),
        ("formation f() { slots {", " (1 m, 2 m)\n", "} }", ""),
        ("dimension a = b", " * c^(1/2)", "", ""),
        ("formation f() {", " edge 1 - 2 = a\n", "}", ""),
        ("formation F of a with b {", " edge c[1] - d = 2 m\n", "}", ""),
        ("randomise {", " a ~ uniform(1, 2)\n", "}", ""),
        ("obstacle o : polygon([(0, 0)", ", (1 m, 2 m)", "])", ""),
        ("observe each i in a {", " b for j in c if d { noise = 1 m }\n", "}", ""),
        ("sweep {", " (a.b, c) in [(1, 2)]\n", "}", ""),
        ("test \"t\" {", " place a at (1, 2)\n check b == c ± d\n", "}", ""),
        ("stage a {", " b.c = 1\n", "} until d < 1 over 2", ""),
    ];
    for (head, open, middle, close) in nested {
        let text = |times: usize| format!("{head}{}{middle}{}", open.repeat(times), close.repeat(times));
        let (once, twice) = (calls(&text(30)), calls(&text(60)));
        assert!(twice as f64 <= 2.3 * once as f64, "{head}{open}: {once} and {twice} calls");
    }
}
