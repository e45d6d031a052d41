//! What is done with a world: what is observed and rewarded, learned, evaluated, claimed and tested.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::{AgentId, Binder, Expr, IndexSet, Place, Plan, World};

/// A stage of a curriculum.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stage {
    pub name: String,
    /// Of the same state and action as the world of training.
    pub world: Box<World>,
    /// The stage is over when this holds.
    pub until: Option<Until>,
    /// The stage is over after this many environment steps at the latest.
    pub most_steps: Option<usize>,
    pub at: Place,
}

/// Whether the mean of a measure over the last training episodes lies on one side of a bound.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Until {
    /// `return`, `error_m`, `steps` (length of an episode) or `failures` (share of episodes that ended as one).
    pub measure: String,
    pub below: bool,
    /// SI.
    pub bound: f64,
    /// Episodes of this stage that the mean is taken of; with fewer it does not hold.
    pub episodes: usize,
}

/// A scenario derived from another by changing something.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Variant {
    pub name: String,
    /// What it changes, as written: `k_o = 0.5`.
    pub text: String,
    pub plan: Box<Plan>,
    pub at: Place,
}

/// A test of the scenario: an episode whose course it prescribes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Test {
    pub name: String,
    pub steps: Vec<TestStep>,
    pub at: Place,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum TestStep {
    /// Puts an agent or obstacle at a position (m) at rest; of one with a motion, until its next step.
    Place { agent: AgentId, position: Expr, at: Place },
    /// Turns an agent to a heading (rad).
    Turn { agent: AgentId, heading: Expr, at: Place },
    /// The velocity command (m/s) of a learned agent from now on; zero before.
    Steer { agent: AgentId, velocity: Expr, at: Place },
    /// Steps of the world, without putting agents back into their arenas.
    Step { steps: usize, at: Place },
    /// `actual` (if it is a number) is for the message. Terms, reward and measures are those of the present state.
    Check { text: String, actual: Option<Expr>, holds: Expr, at: Place },
}

/// One item of the learner's state: a number or a vector, in SI units, for each member of `over`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Observation {
    /// As written, for people.
    pub text: String,
    pub value: Expr,
    /// A vector gives two entries, x and y.
    pub vector: bool,
    /// `None`: once.
    pub over: Option<Each>,
    /// Standard deviation of the normal noise on each entry, in the value's SI unit.
    pub noise: Option<Expr>,
    /// Steps by which the value is late; in the first steps of an episode it is that of the start.
    pub delay: usize,
    pub at: Place,
}

/// `for i in set`; not over pairs or edges.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Each {
    pub var: Binder,
    pub set: IndexSet,
    pub filter: Option<Box<Expr>>,
}

/// A named part of the reward.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Term {
    pub name: String,
    pub doc: String,
    /// A number in SI units.
    pub value: Expr,
    /// Dimension as text; the same for all terms.
    pub dimension: String,
    pub at: Place,
}

/// A condition that ends an episode. Reaching the horizon does as well and is not listed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct End {
    pub name: String,
    pub when: Expr,
    /// Whether this is a failure, after which nothing can be gained. If not, learning looks beyond it, as beyond
    /// the horizon.
    pub failure: bool,
    /// Taken from the reward of that step (a number in SI units, not negative).
    pub cost: Option<Expr>,
    pub at: Place,
}

/// A learner or controller as chosen by the scenario.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Method {
    /// The name in tables and folders.
    pub label: String,
    pub what: Extern,
    pub at: Place,
}

/// Something that Rust provides, with all its settings.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Extern {
    pub name: String,
    pub settings: BTreeMap<String, Setting>,
}

/// The value of a setting, SI.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Setting {
    Number(f64),
    Truth(bool),
    /// One of the words that the declaration lists.
    Word(String),
    Range(f64, f64),
    List(Vec<f64>),
    Schedule(Schedule),
}

/// A number that changes over training: `from` up to the share `begin` of training, then along `curve` to `to` at
/// the share `end`, and `to` from there on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Schedule {
    pub curve: Curve,
    pub from: f64,
    pub to: f64,
    /// 0 to 1, not above `end`.
    pub begin: f64,
    pub end: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Curve {
    Linear,
    /// Half a wave of a cosine.
    Cosine,
    /// The same factor at each step; both ends are positive.
    Geometric,
}

/// A held-out evaluation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Protocol {
    pub name: String,
    pub episodes: usize,
    /// `None`: the world of training.
    pub world: Option<Box<World>>,
    pub at: Place,
}

/// `expect …`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Claim {
    /// As written.
    pub text: String,
    pub kind: ClaimKind,
    pub at: Place,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum ClaimKind {
    /// The interval of a statistic lies on one side of a bound.
    Bound { protocol: String, metric: String, method: String, below: bool, bound: f64, confidence: f64 },
    /// One method is better than another; the interval of the difference excludes 0.
    Beats { better: String, worse: String, protocol: String, metric: String, confidence: f64 },
}

/// As it would be written, in SI units.
impl std::fmt::Display for Setting {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let number = |value: &f64| {
            let size = value.abs();
            let plain = size == 0.0 || (1e-3..1e6).contains(&size);
            if plain { value.to_string() } else { format!("{value:e}") }
        };
        match self {
            Setting::Number(value) => f.write_str(&number(value)),
            Setting::Truth(truth) => write!(f, "{truth}"),
            Setting::Word(word) => f.write_str(word),
            Setting::Range(low, high) => write!(f, "{} .. {}", number(low), number(high)),
            Setting::List(all) => {
                write!(f, "[{}]", all.iter().map(number).collect::<Vec<_>>().join(", "))
            }
            Setting::Schedule(Schedule { curve, from, to, begin, end }) => {
                let curve = format!("{curve:?}").to_lowercase();
                let (from, to, begin, end) = (number(from), number(to), 100.0 * begin, 100.0 * end);
                write!(f, "{curve}({from}, {to}, begin = {begin}%, end = {end}%)")
            }
        }
    }
}
