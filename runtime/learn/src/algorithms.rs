//! The learning algorithms. They share one actor-critic loop and differ in the value that the critics are
//! pulled towards: each is one function, `bootstrap`, in a file of its own.

pub mod ddpg;
pub mod mean;
pub mod mpg;
pub mod td3;

use crate::config::DeltaKind;

/// The algorithms by the names that `stdlib/learn.scn` declares.
pub const ALGORITHMS: &[&str] = &["mpg", "td3", "td3_original", "mean", "ddpg"];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Algorithm {
    /// Momentum Policy Gradient, [`mpg::bootstrap`].
    Mpg,
    /// Twin Delayed DDPG, [`td3::bootstrap`].
    Td3,
    /// The mean of the twins, [`mean::bootstrap`].
    Mean,
    /// Deep Deterministic Policy Gradient, [`ddpg::bootstrap`].
    Ddpg,
}

impl Algorithm {
    /// The algorithm of that name in [`ALGORITHMS`]. `td3_original` is TD3 with other settings.
    pub fn named(name: &str) -> Option<Self> {
        match name {
            "mpg" => Some(Self::Mpg),
            "td3" | "td3_original" => Some(Self::Td3),
            "mean" => Some(Self::Mean),
            "ddpg" => Some(Self::Ddpg),
            _ => None,
        }
    }

    /// The value of the next states that y = r + γ · value uses. All slices: one entry a transition.
    pub(crate) fn bootstrap(
        self,
        q_hat: [&[f32]; 2],
        delta_last: &mut [f32],
        delta_kind: DeltaKind,
        value: &mut [f32],
    ) {
        match self {
            Self::Mpg => mpg::bootstrap(q_hat, delta_last, delta_kind, value),
            Self::Td3 => td3::bootstrap(q_hat, value),
            Self::Mean => mean::bootstrap(q_hat, value),
            Self::Ddpg => ddpg::bootstrap(q_hat[0], value),
        }
    }
}
