//! The arrangement with the prescribed distances that is nearest to how agents stand.

use crate::episode::Episode;
use crate::maths::{Vec2, add, distance, norm, scale, subtract};
use crate::task::Task;

/// A distance is met to within this, m.
const CLOSE_M: f64 = 1e-9;
/// Rounds over all edges, at most; distances that cannot be met together are then as near as they come.
const MOST_SWEEPS: usize = 300;

/// Moves the learned members of a formation, in `position`, to where its distances hold.
///
/// Edge by edge both ends move along it by the same way, an end that is not learned stays, until all hold: the
/// constraint projections of Ryckaert, Ciccotti and Berendsen (1977, SHAKE). They are the method of Kaczmarz on the
/// linearised constraints, whose limit is nearest to where it began.
pub(super) fn arrange(task: &Task, episode: &Episode, formation: usize, position: &mut [Vec2]) {
    let edges = task.model.formations[formation].edges();
    let mut scene = task.scene(episode);
    let mut tied: Vec<Tie> = Vec::with_capacity(edges.len());
    for (k, &ends) in edges.iter().enumerate() {
        let free = ends.map(|end| if task.learned.contains(&end) { 1.0 } else { 0.0 });
        if free != [0.0; 2] {
            tied.push(Tie { ends, length: scene.rest(formation, k, ends), free });
        }
    }
    for _ in 0..MOST_SWEEPS {
        tied.iter().for_each(|tie| tie.pull(position));
        let miss = |tie: &Tie| (distance(position[tie.ends[0]], position[tie.ends[1]]) - tie.length).abs();
        if tied.iter().all(|tie| miss(tie) < CLOSE_M) {
            break;
        }
    }
}

struct Tie {
    ends: [usize; 2],
    /// m.
    length: f64,
    /// 1 for an end that can move, 0 for one that cannot.
    free: [f64; 2],
}

impl Tie {
    /// Makes the distance right.
    fn pull(&self, position: &mut [Vec2]) {
        let [a, b] = self.ends;
        let way = subtract(position[b], position[a]);
        let now = norm(way);
        let along = if now > 0.0 { scale(way, 1.0 / now) } else { [1.0, 0.0] };
        let share = (now - self.length) / (self.free[0] + self.free[1]);
        position[a] = add(position[a], scale(along, share * self.free[0]));
        position[b] = subtract(position[b], scale(along, share * self.free[1]));
    }
}
