//! The gradient law of formations given by distances.

use super::Controller;
use super::bonds::Bonds;
use crate::episode::Episode;
use crate::maths::{dot, scale, subtract};
use crate::task::Task;

/// Each agent goes down the gradient of γ = ¼ Σ (|p_i − p_j|² − d_ij²)² over the edges:
///
/// u_i = −gain Σ_j (|p_i − p_j|² − d_ij²) (p_i − p_j)
///
/// (Krick, Broucke and Francis, "Stabilisation of infinitesimally rigid formations of multi-robot networks",
/// Int. J. Control 82, 2009; Oh, Park and Ahn, "A survey of multi-agent formation control", Automatica 53, 2015).
/// Of a formation of places, d_ij is the distance of the places.
pub(super) struct DistanceGradient {
    bonds: Bonds,
    /// 1/(m² s).
    gain: f64,
}

impl DistanceGradient {
    pub fn new(bonds: Bonds, gain: f64) -> Self {
        DistanceGradient { bonds, gain }
    }
}

impl Controller for DistanceGradient {
    fn command(&mut self, task: &Task, episode: &Episode, action: &mut [f32]) {
        let mut scene = task.scene(episode);
        self.bonds.command(
            task,
            episode,
            action,
            |_| [0.0; 2],
            |edge| {
                let [a, b] = edge.ends;
                let way = subtract(episode.position(a), episode.position(b));
                let rest = scene.rest(edge.formation, edge.number, edge.ends);
                scale(way, -self.gain * (dot(way, way) - rest * rest))
            },
        );
    }
}
