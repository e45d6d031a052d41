//! What policies see of environments side by side.

use mpgx_random::{Purpose, Stream};

use super::Observed;
use crate::batch::Tile;
use crate::lanes::{LANES, Plane};
use crate::program::Scenes;
use crate::task::Task;

impl Observed {
    fn visit_lanes(&self, scene: &mut Scenes, mut visit: impl FnMut(&mut Scenes)) {
        match &self.each {
            None => visit(scene),
            Some(each) => each.visit_lanes(scene, |scene| {
                visit(scene);
                [false; LANES]
            }),
        }
    }
}

/// Writes the values of the lanes that have an entry, each where its own come next.
fn write(scene: &Scenes, next: &mut [usize; LANES], vector: bool, mut put: impl FnMut(usize, usize, usize)) {
    for (lane, next) in next.iter_mut().enumerate().filter(|(lane, _)| scene.active[*lane]) {
        for axis in 0..1 + usize::from(vector) {
            put(lane, *next, axis);
            *next += 1;
        }
    }
}

impl Task {
    /// [`Task::observe_member`] in each lane: `out` is `[lanes in use][member][state]`.
    pub(crate) fn observe_lanes(&self, tile: &Tile, step: usize, out: &mut [f32]) {
        let row = self.members() * self.state_len;
        if row == 0 {
            return;
        }
        for member in 0..self.members() {
            let mut scene = self.scenes(tile, step);
            self.bind_lanes(&mut scene, member);
            let mut noise: Option<Vec<Stream>> = self.noisy.then(|| {
                tile.keys.map(|key| key.address(Purpose::Sensor, member, step as u64).stream()).into()
            });
            let (mut next, mut kept) = ([0; LANES], 0);
            for observed in &self.observed {
                let vector = observed.axes() == 2;
                let first = next;
                let late = &tile.late[self.row(observed, kept, step + 1, member)];
                kept += observed.late();
                observed.visit_lanes(&mut scene, |scene| {
                    let now = late.is_empty().then(|| observed.value.eval_lanes(scene));
                    let noises = observed.noise.as_ref().map(|deviation| {
                        let deviation = deviation.eval_lanes(scene);
                        normals(scene, noise.as_deref_mut(), vector)
                            .map(|axis| std::array::from_fn(|lane| deviation[lane] * axis[lane]))
                    });
                    write(scene, &mut next, vector, |lane, entry, axis| {
                        let mut x = match &now {
                            Some(now) => now[axis][lane],
                            None => late.get(entry - first[lane]).map_or(0.0, |late| late[lane]),
                        };
                        if let Some(noises) = &noises {
                            let noises: &Plane = noises;
                            x += noises[axis][lane];
                        }
                        if let Some(out) = out.get_mut(lane * row + member * self.state_len + entry) {
                            *out = x as f32;
                        }
                    });
                });
            }
        }
    }

    /// [`Task::remember`] in each lane.
    pub(crate) fn remember_lanes(&self, tile: &mut Tile, step: usize) {
        if tile.late.is_empty() {
            return;
        }
        let mut late = std::mem::take(&mut tile.late);
        let mut kept = 0;
        for observed in self.observed.iter().filter(|observed| observed.delay > 0) {
            for member in 0..self.members() {
                let mut scene = self.scenes(tile, step);
                self.bind_lanes(&mut scene, member);
                let row = &mut late[self.row(observed, kept, step, member)];
                let mut next = [0; LANES];
                observed.visit_lanes(&mut scene, |scene| {
                    let value = observed.value.eval_lanes(scene);
                    write(scene, &mut next, observed.axes() == 2, |lane, entry, axis| {
                        if let Some(kept) = row.get_mut(entry) {
                            kept[lane] = value[axis][lane];
                        }
                    });
                });
            }
            kept += observed.late();
        }
        tile.late = late;
    }
}

/// The next standard normal numbers of each lane that has an entry, one or two.
fn normals(scene: &Scenes, streams: Option<&mut [Stream]>, vector: bool) -> Plane {
    let mut out = [[0.0; LANES]; 2];
    for (lane, stream) in streams.unwrap_or_default().iter_mut().enumerate() {
        for axis in out.iter_mut().take(if vector { 2 } else { 1 }).filter(|_| scene.active[lane]) {
            axis[lane] = stream.normal();
        }
    }
    out
}
