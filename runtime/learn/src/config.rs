//! The settings of the learners, as `stdlib/learn.scn` declares them.

use mpgx_lang::plan::{Curve, Extern, Schedule, Setting};

use crate::algorithms::Algorithm;
use crate::error::LearnError;
use crate::kernels::Activation;
use crate::varying::Varying;

/// The settings that every algorithm here has.
pub const SETTINGS: &[&str] = &[
    "episodes",
    "steps",
    "gamma",
    "actor_rate",
    "critic_rate",
    "rate_end",
    "batch",
    "hidden",
    "activation",
    "replay",
    "warm_up",
    "tau",
    "polyak",
    "inner",
    "delay",
    "delay_counter",
    "inner_batch",
    "critic_pair",
    "train_noise",
    "train_clip",
    "explore_noise",
    "explore_min",
    "explore_bound",
    "explore_decay",
    "explore_every",
    "noise_reading",
    "delta_reset",
    "delta_kind",
    "target_actor",
    "terminal_mask",
    "backend",
];

/// Floats that the layers of one network and their outputs for one mini-batch may have (1 GiB).
const ROOM: f64 = (1u64 << 28) as f64;

/// What the updates before an actor update are counted over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Count {
    Run,
    Step,
}

/// Whether each inner update draws its own mini-batch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InnerBatch {
    Fresh,
    Shared,
}

/// After what the exploration noise shrinks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decay {
    Episode,
    Step,
}

/// How the shrinking exploration noise and its bound `explore_min` go together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bound {
    /// v ← max(λ v, v_min)
    Max,
    /// v ← min(λ v, v_min), as the paper prints.
    Min,
}

/// At which states and actions the critics meet their targets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CriticPair {
    /// (s, u): where the transition began.
    Taken,
    /// (s′, u′): where the target was taken, as the paper prints.
    Next,
}

/// Which critics τ Q + (1 − τ) Q̂ is written into.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Polyak {
    Target,
    /// As the paper prints.
    Online,
}

/// What the noise settings give.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoiseReading {
    Variance,
    Deviation,
}

/// Whether δ = |q̂₁ − q̂₂| is taken for each transition or as its mean over the mini-batch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DeltaKind {
    Element,
    Mean,
}

/// What computes the updates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Backend {
    /// Kernels of our own, with the same bits on every machine.
    Native,
    /// Automatic differentiation with dfdx.
    Dfdx,
}

/// All settings of a learner; the declaration in `stdlib/learn.scn` tells what each means.
///
/// A schedule says all of its setting: `rate_end` lowers plain step sizes only, and `explore_decay` and
/// `explore_min` shrink a plain exploration noise only.
#[derive(Clone, Debug, PartialEq)]
pub struct Config {
    pub algorithm: Algorithm,
    pub episodes: u64,
    pub steps: u64,
    pub gamma: Varying,
    pub actor_rate: Varying,
    pub critic_rate: Varying,
    pub rate_end: f64,
    pub batch: usize,
    pub hidden: Vec<usize>,
    pub activation: Activation,
    pub replay: usize,
    pub warm_up: u64,
    pub tau: Varying,
    pub polyak: Polyak,
    pub inner: u64,
    pub delay: u64,
    pub delay_counter: Count,
    pub inner_batch: InnerBatch,
    pub critic_pair: CriticPair,
    pub train_noise: Varying,
    pub train_clip: f64,
    pub explore_noise: Varying,
    pub explore_min: f64,
    pub explore_bound: Bound,
    pub explore_decay: f64,
    pub explore_every: Decay,
    pub noise_reading: NoiseReading,
    pub delta_reset: bool,
    pub delta_kind: DeltaKind,
    pub target_actor: bool,
    pub terminal_mask: bool,
    pub backend: Backend,
}

impl Config {
    /// Reads every setting. Errors name the algorithm or the setting that is unknown, missing or out of range.
    pub fn from_extern(what: &Extern) -> Result<Self, LearnError> {
        let algorithm = Algorithm::named(&what.name)
            .ok_or_else(|| LearnError::UnknownAlgorithm { name: what.name.clone() })?;
        if let Some(setting) = what.settings.keys().find(|name| !SETTINGS.contains(&name.as_str())) {
            let (algorithm, setting) = (what.name.clone(), setting.clone());
            return Err(LearnError::UnknownSetting { algorithm, setting });
        }
        let read = Settings(what);
        let config = Self {
            algorithm,
            episodes: read.count("episodes", 1e9)?,
            steps: read.count("steps", 1e9)?,
            gamma: read.varying("gamma", 1.0)?,
            actor_rate: read.varying("actor_rate", 1.0)?,
            critic_rate: read.varying("critic_rate", 1.0)?,
            rate_end: read.number("rate_end", 1.0)?,
            batch: read.count("batch", 65536.0)? as usize,
            hidden: read.sizes("hidden")?,
            activation: read.word("activation", &[("relu", Activation::Relu), ("tanh", Activation::Tanh)])?,
            replay: read.count("replay", 1e8)? as usize,
            warm_up: read.whole("warm_up", 0.0, 1e9)?,
            tau: read.varying("tau", 1.0)?,
            polyak: read.word("polyak", &[("target", Polyak::Target), ("online", Polyak::Online)])?,
            inner: read.count("inner", 1000.0)?,
            delay: read.count("delay", 1000.0)?,
            delay_counter: read.word("delay_counter", &[("run", Count::Run), ("step", Count::Step)])?,
            inner_batch: read
                .word("inner_batch", &[("fresh", InnerBatch::Fresh), ("shared", InnerBatch::Shared)])?,
            critic_pair: read
                .word("critic_pair", &[("taken", CriticPair::Taken), ("next", CriticPair::Next)])?,
            train_noise: read.varying("train_noise", 100.0)?,
            train_clip: read.number("train_clip", 1e9)?,
            explore_noise: read.varying("explore_noise", 100.0)?,
            explore_min: read.number("explore_min", 100.0)?,
            explore_bound: read.word("explore_bound", &[("max", Bound::Max), ("min", Bound::Min)])?,
            explore_decay: read.number("explore_decay", 1.0)?,
            explore_every: read
                .word("explore_every", &[("episode", Decay::Episode), ("step", Decay::Step)])?,
            noise_reading: read.word(
                "noise_reading",
                &[("variance", NoiseReading::Variance), ("deviation", NoiseReading::Deviation)],
            )?,
            delta_reset: read.truth("delta_reset")?,
            delta_kind: read
                .word("delta_kind", &[("element", DeltaKind::Element), ("mean", DeltaKind::Mean)])?,
            target_actor: read.truth("target_actor")?,
            terminal_mask: read.truth("terminal_mask")?,
            backend: read.word("backend", &[("native", Backend::Native), ("dfdx", Backend::Dfdx)])?,
        };
        config.check_room()?;
        Ok(config)
    }

    fn check_room(&self) -> Result<(), LearnError> {
        let weights: f64 = self.hidden.windows(2).map(|pair| pair[0] as f64 * pair[1] as f64).sum();
        let outputs: f64 = self.hidden.iter().map(|&units| units as f64 * self.batch as f64).sum();
        if weights + outputs <= ROOM {
            return Ok(());
        }
        Err(LearnError::WrongSetting {
            setting: "hidden",
            expected: format!("small enough for {ROOM} floats of weights and outputs"),
            found: format!("{:?} with batches of {}", self.hidden, self.batch),
        })
    }
}

/// Reads settings by name and kind.
struct Settings<'a>(&'a Extern);

impl Settings<'_> {
    fn get(&self, setting: &'static str) -> Result<&Setting, LearnError> {
        let missing = || LearnError::MissingSetting { algorithm: self.0.name.clone(), setting };
        self.0.settings.get(setting).ok_or_else(missing)
    }

    /// In 0..=high.
    fn number(&self, setting: &'static str, high: f64) -> Result<f64, LearnError> {
        match self.get(setting)? {
            Setting::Number(value) if (0.0..=high).contains(value) => Ok(*value),
            found => Err(wrong(setting, format!("a number in 0 .. {high}"), found)),
        }
    }

    /// A number in 0..=high, or a schedule that stays there.
    fn varying(&self, setting: &'static str, high: f64) -> Result<Varying, LearnError> {
        let found = self.get(setting)?;
        let varying = match found {
            Setting::Number(value) => Some(Varying::Constant(*value)),
            Setting::Schedule(schedule) if is_sound(schedule) => Some(Varying::Scheduled(*schedule)),
            _ => None,
        };
        let within = |varying: &Varying| varying.ends().iter().all(|value| (0.0..=high).contains(value));
        varying
            .filter(within)
            .ok_or_else(|| wrong(setting, format!("a number in 0 .. {high} or a schedule of such"), found))
    }

    /// A whole number in 1..=high.
    fn count(&self, setting: &'static str, high: f64) -> Result<u64, LearnError> {
        self.whole(setting, 1.0, high)
    }

    /// A whole number in low..=high.
    fn whole(&self, setting: &'static str, low: f64, high: f64) -> Result<u64, LearnError> {
        match self.get(setting)? {
            Setting::Number(value) if (low..=high).contains(value) && value.fract() == 0.0 => {
                Ok(*value as u64)
            }
            found => Err(wrong(setting, format!("a whole number in {low} .. {high}"), found)),
        }
    }

    /// One or more sizes of layers.
    fn sizes(&self, setting: &'static str) -> Result<Vec<usize>, LearnError> {
        let fits = |size: &f64| (1.0..=65536.0).contains(size) && size.fract() == 0.0;
        match self.get(setting)? {
            Setting::List(sizes) if (1..=16).contains(&sizes.len()) && sizes.iter().all(fits) => {
                Ok(sizes.iter().map(|&size| size as usize).collect())
            }
            found => Err(wrong(setting, "1 to 16 whole numbers in 1 .. 65536".to_owned(), found)),
        }
    }

    fn truth(&self, setting: &'static str) -> Result<bool, LearnError> {
        match self.get(setting)? {
            Setting::Truth(value) => Ok(*value),
            found => Err(wrong(setting, "true or false".to_owned(), found)),
        }
    }

    fn word<T: Copy>(&self, setting: &'static str, words: &[(&str, T)]) -> Result<T, LearnError> {
        let found = self.get(setting)?;
        let chosen = words.iter().find(|(word, _)| matches!(found, Setting::Word(w) if w == word));
        let names = || words.iter().map(|(word, _)| *word).collect::<Vec<_>>().join(" or ");
        chosen.map(|(_, value)| *value).ok_or_else(|| wrong(setting, names(), found))
    }
}

fn is_sound(schedule: &Schedule) -> bool {
    let Schedule { curve, from, to, begin, end } = *schedule;
    let ordered = 0.0 <= begin && begin <= end && end <= 1.0;
    ordered && (curve != Curve::Geometric || (from > 0.0 && to > 0.0))
}

fn wrong(setting: &'static str, expected: String, found: &Setting) -> LearnError {
    LearnError::WrongSetting { setting, expected, found: format!("{found:?}") }
}
