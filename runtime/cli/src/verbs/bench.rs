//! `mpgx bench`: how fast this machine is, and how near to what it could do.

use clap::ValueEnum;
use mpgx_learn::measure::Shape;
use serde_json::json;

use crate::bench::{Figure, Windows, compiler, environment, kernels, learners, limits, tracking, training};
use crate::failure::{Exit, Failure};

#[derive(clap::Args)]
#[command(after_help = "Example: mpgx bench learners --batch 16,100,256

Figures are medians over windows of processor time. Shares are of the roofline measured in the same run:
for each part of the work the time to compute or to move its bytes, whichever is longer.")]
pub struct Args {
    /// What to measure; all of it by default
    #[arg(value_enum)]
    parts: Vec<Part>,
    /// Mini-batches
    #[arg(long, value_delimiter = ',', default_value = "16", value_name = "N,…")]
    batch: Vec<usize>,
    /// Length of the state
    #[arg(long, default_value_t = 4, value_name = "N")]
    state: usize,
    /// Length of the action
    #[arg(long, default_value_t = 2, value_name = "N")]
    action: usize,
    /// Environments that step side by side
    #[arg(long, value_delimiter = ',', default_value = "1,32,4096", value_name = "N,…")]
    environments: Vec<usize>,
    /// Algorithms
    #[arg(long, value_delimiter = ',', default_value = "mpg", value_name = "NAME,…")]
    algorithms: Vec<String>,
    /// What updates the networks
    #[arg(long, value_parser = ["native", "dfdx"], default_value = "native")]
    backend: String,
    /// Seconds of a window
    #[arg(long, default_value_t = 0.2)]
    seconds: f64,
    /// Windows of each figure
    #[arg(long, default_value_t = 11)]
    windows: usize,
    /// One JSON object
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum Part {
    /// The machine's limits and each kernel of the learners
    Kernels,
    /// Updates a second
    Learners,
    /// Updates of two learners at once, on two threads
    Cores,
    /// Steps of training, with the simulator
    Training,
    /// Steps of the simulator
    Environment,
    /// Compilation of the built-in scenarios
    Compiler,
}

pub fn run(args: Args) -> Result<Exit, Failure> {
    let wants = |part| args.parts.is_empty() || args.parts.contains(&part);
    let windows = Windows { count: args.windows, seconds: args.seconds };
    if args.environments.iter().any(|count| !(1..=1 << 20).contains(count)) {
        return Err(Failure::new(Exit::BadInput, "1 to 1048576 environments step side by side"));
    }
    let mut out = Printer { json: args.json, parts: Vec::new() };
    let learns = [Part::Kernels, Part::Learners, Part::Cores, Part::Training].into_iter().any(wants);
    for &batch in args.batch.iter().filter(|_| learns) {
        let shape = shape(&args, batch)?;
        let limits = limits(windows, &shape);
        if wants(Part::Kernels) {
            out.part("kernels", kernels::figures(windows, &shape, &limits));
        }
        for name in &args.algorithms {
            let plan = tracking::plan(name, batch, &args.backend)?;
            if wants(Part::Learners) {
                out.part("learners", vec![learners::one(windows, &plan, &shape, &limits)?]);
            }
            if wants(Part::Cores) {
                out.part("cores", vec![learners::two(windows, &plan, &shape)?]);
            }
            if wants(Part::Training) {
                out.part("training", vec![training::figure(windows, &plan, batch)?]);
            }
        }
    }
    if wants(Part::Environment) {
        out.part("environment", environment::figures(windows, &args.environments));
    }
    if wants(Part::Compiler) {
        out.part("compiler", compiler::figures(windows));
    }
    out.end();
    Ok(Exit::Done)
}

/// The learner of the paper at a mini-batch.
fn shape(args: &Args, batch: usize) -> Result<Shape, Failure> {
    if [batch, args.state, args.action].contains(&0) || batch > 65_536 || args.state.max(args.action) > 4096 {
        let message = "a mini-batch has 1 to 65536 transitions, a state and an action 1 to 4096 numbers";
        return Err(Failure::new(Exit::BadInput, message));
    }
    Ok(Shape { state: args.state, action: args.action, hidden: vec![400, 300], batch, delay: 2 })
}

struct Printer {
    json: bool,
    parts: Vec<serde_json::Value>,
}

impl Printer {
    fn part(&mut self, part: &'static str, figures: Vec<Figure>) {
        for Figure { what, value, unit, share } in figures {
            if self.json {
                self.parts.push(
                    json!({ "part": part, "what": what, "value": value, "unit": unit, "share": share }),
                );
            } else {
                let share =
                    share.map_or(String::new(), |share| format!("{:5.0} % of the roofline", 100.0 * share));
                println!("{part:<12} {what:<48} {:>10} {unit:<10} {share}", digits(value));
            }
        }
    }

    fn end(self) {
        if self.json {
            println!("{}", json!({ "kernels": mpgx_learn::simd_level(), "figures": self.parts }));
        }
    }
}

/// Four significant digits.
fn digits(value: f64) -> String {
    let before = value.abs().log10().floor().max(0.0) as usize;
    format!("{value:.*}", 3usize.saturating_sub(before))
}
