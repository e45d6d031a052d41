//! Time of a whole compilation, `cargo bench -p mpgx-tests`: a scenario of 200 lines, one of three robots beside one
//! of a thousand, and every construct at n and 2 n copies (medians; a ratio of 2 is linear, below 2 a constant part).

use std::time::Instant;

use mpgx_lang::compile;
use mpgx_lang::source::NoFiles;

const ROUNDS: usize = 41;

/// What every scenario here has, with so many followers.
fn scenario(followers: usize) -> String {
    format!(
        "scenario bench
use std.motion.{{circle, random_velocity}}
use std.formation.{{square, line}}
use std.start.{{near, uniform_in}}
use std.reward.collisions
world {{ dt = 0.1 s, safety = 0.1 m }}
agent leader : point {{
    arena  = box(-1 m .. 1 m, -1 m .. 1 m)
    speed  = -0.5 m/s .. 0.5 m/s
    motion = circle(0.6 m, 0.3 m/s)
}}
agents follower[{followers}] : point {{
    speed   = -0.7 m/s .. 0.7 m/s
    control = learned
    start   ~ near(F[i], 0.1 m)
}}
formation F of follower = line(0.4 m) about leader
learn mpg with tuned
"
    )
}

const REWARD: &str = "reward { gap = -sum(i in follower) |p[i] - F[i]|, crash = -1 m * collisions() }\n";
const OBSERVE: &str = "observe { F[i] - p[i] for i in follower }\n";

/// Milliseconds of a compilation: the median.
fn time(text: &str) -> f64 {
    let once = || {
        let start = Instant::now();
        let it = compile("bench.scn", text.to_owned(), &[], &NoFiles);
        let taken = start.elapsed();
        assert!(it.plan.is_some(), "{:?}", it.problems.iter().map(|p| &p.message).collect::<Vec<_>>());
        taken.as_secs_f64() * 1e3
    };
    let mut times: Vec<f64> = (0..ROUNDS).map(|_| once()).collect();
    times.sort_by(f64::total_cmp);
    times[ROUNDS / 2]
}

/// `line` with each `#` replaced by the numbers 1 to `count`.
fn copies(line: &str, count: usize) -> String {
    (1..=count).map(|k| line.replace('#', &k.to_string()) + "\n").collect()
}

fn main() {
    let base = scenario(3) + OBSERVE + REWARD;
    let filler = "/// A length.\nparam length_# = # m in 0 m .. 1 km\nfn twice_#(x : length = length_#) -> length = 2 * x + length_#\n\
                  let both_# = twice_#() + twice_#(1 m)\n";
    let long = base.clone() + &copies(filler, 44);
    println!("{:24} {:8.3} ms", format!("{} lines", base.lines().count()), time(&base));
    println!("{:24} {:8.3} ms", format!("{} lines", long.lines().count()), time(&long));
    println!("{:24} {:8.3} ms", "1,000 robots", time(&(scenario(1000) + OBSERVE + REWARD)));
    let constructs = [
        ("param", "param a_# = 1 m in 0 m .. 1 km"),
        ("let", "let a_# = 2 * 3 m + 1 m"),
        ("fn", "fn f_#<D>(x : D, y : D) -> D = if x > y then x else y + x"),
        ("dist", "dist d_#(c : point) -> point = c + (normal(0 m, 1 m), uniform(0 m, 1 m))"),
        ("motion", "motion m_#() { state a ~ uniform(0, 1)\nnext a = a + 1\nposition = (a * 1 m, 0 m) }"),
        ("shape", "formation s_#(d : length = 1 m) { slot k of n = (k * d, 0 m) }"),
        ("unit", "unit u_# = 3 m"),
        ("dimension", "dimension q_# = length^2 / time"),
        (
            "agents",
            "agents extra_#[3] : point { speed = 0 m/s .. 1 m/s, motion = random_velocity, start = (# m, 0 m) }",
        ),
        ("obstacle", "obstacle o_# : disc(0.1 m) { position = (# m, 5 m) }"),
        ("formation", "formation G_# of follower = line(0.5 m) about leader"),
        ("edges", "formation E_# of follower { edge follower[1] - follower[2] = # m }"),
        ("require", "require |p[leader]| < # m"),
        ("evaluate", "evaluate e_# { leader.speed = 0 m/s .. # m/s }"),
        ("expect", "expect held_out.error < # m"),
    ];
    for (name, line) in constructs {
        row(name, &|count| base.clone() + &copies(line, count));
    }
    let head = scenario(3);
    row("reward term", &|n| {
        head.clone()
            + OBSERVE
            + "reward {\n"
            + &copies("a_# = -sum(i in follower) |p[i] - F[i]| * #", n)
            + "}\n"
    });
    row("observation", &|n| {
        head.clone() + REWARD + "observe {\n" + &copies("p[i] - F[i] for i in follower", n) + "}\n"
    });
    row("end", &|n| base.clone() + "end {\n" + &copies("e_# when |p[leader]| > # m costs 1 m", n) + "}\n");
    row("sum", &|n| {
        let sum = (0..n).map(|_| " - |p[leader]|").collect::<String>();
        head.clone() + OBSERVE + &format!("reward {{ a = 0 m{sum} }}\n").replace(" m - ", " m\n - ")
    });
}

/// n, 2 n, and their ratio.
fn row(name: &str, text: &dyn Fn(usize) -> String) {
    let count = if name == "sum" { 60 } else { 40 };
    let (once, twice) = (time(&text(count)), time(&text(2 * count)));
    println!("{name:24} {once:8.3} ms {twice:8.3} ms  x {:.2}", twice / once);
}
