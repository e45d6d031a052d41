//! What is seen, and what tells poses.

use super::Lower;
use crate::hir::{self, Hir};
use crate::plan::{Extern, Landmark, Localised, Localiser, Plan, Scenery};
use crate::problem::{Code, Problem, Problems};

impl Lower<'_> {
    pub fn scenery(&mut self) -> Option<Option<Scenery>> {
        let world = self.case.world;
        let Some(room) = &world.room else { return Some(None) };
        let room = self.chosen(room)?;
        let lighting = match &world.lighting {
            Some(lighting) => Some(self.chosen(lighting)?),
            None => None,
        };
        let mut landmarks = Vec::new();
        for landmark in &world.landmarks {
            let what = self.extern_(landmark.what.as_ref()?)?;
            let places = self.constant(self.case.landmarks(landmark), landmark.span)?;
            let at = self.sources.place(landmark.span);
            landmarks.extend(places.into_iter().enumerate().map(|(number, (position_m, heading_rad))| {
                Landmark {
                    name: landmark.member(number),
                    what: what.clone(),
                    position_m,
                    heading_rad,
                    at: at.clone(),
                }
            }));
        }
        Some(Some(Scenery { room, lighting, landmarks }))
    }

    pub fn chosen(&mut self, chosen: &hir::Chosen) -> Option<Extern> {
        self.extern_(chosen.what.as_ref()?)
    }

    pub fn localiser(&mut self, localiser: &hir::Localiser) -> Option<Localiser> {
        let what = self.extern_(localiser.what.as_ref()?)?;
        Some(Localiser { name: localiser.name.clone(), what, at: self.sources.place(localiser.span) })
    }

    pub fn localised(&self, localised: &hir::Localised) -> Localised {
        let hir::Localised { group, via, odometry, span } = *localised;
        Localised { group, via, odometry, at: self.sources.place(span) }
    }
}

/// A network learns what one kind of camera shows: all groups that it localises, in all evaluations, have the same.
pub fn one_camera_each(plan: &Plan, hir: &Hir, problems: &mut Problems) -> Option<()> {
    let mut known = vec![None; hir.localisers.len()];
    let mut right = Some(());
    for (protocol, typed) in plan.protocols.iter().zip(&hir.protocols) {
        let (Some(world), Some(changed)) = (&protocol.world, &typed.changed) else { continue };
        for localised in &changed.world.localised {
            let looks = hir.localisers.get(localised.via).is_some_and(hir::Localiser::looks);
            let camera = world.groups.get(localised.group).and_then(|group| group.camera.as_ref());
            let (true, Some(known)) = (looks, known.get_mut(localised.via)) else { continue };
            let (first, span) = *known.get_or_insert((camera, localised.span));
            if first != camera {
                let name = hir.localisers.get(localised.via).map_or("", |localiser| localiser.name.as_str());
                let message = format!("`{name}` would look through two kinds of camera");
                let problem =
                    Problem::error(&OTHER_CAMERAS, message).at(localised.span, "through one camera");
                problems.push(
                    problem
                        .with(span, "through another")
                        .help("give the groups equal cameras, or each its own `localiser`"),
                );
                right = None;
            }
        }
    }
    right
}

pub const OTHER_CAMERAS: Code = Code {
    name: "other-cameras",
    explain: "\
A network is trained on what one kind of camera shows. Another height, tilt or field of view would need another
network, so all groups that one localiser serves, in all evaluations, have equal cameras.

    localiser low  = resnet
    localiser high = resnet
    observe { camera(follower) via low, camera(scout) via high }",
};
