//! The hash of what a scenario means.

use crate::plan::{Place, Plan, World};

/// BLAKE3 of the Plan without places, comments and texts, as hexadecimal digits. Layout, comments, line ends and
/// the names of files do not change it; whatever changes a run does.
pub fn meaning_hash(plan: &Plan) -> String {
    let mut plan = plan.clone();
    plan.doc.clear();
    for param in &mut plan.params {
        (param.doc, param.text, param.at) = (String::new(), String::new(), Place::default());
    }
    for method in plan.learners.iter_mut().chain(&mut plan.controllers) {
        method.at = Place::default();
    }
    for claim in &mut plan.claims {
        (claim.text, claim.at) = (String::new(), Place::default());
    }
    for protocol in &mut plan.protocols {
        protocol.at = Place::default();
        if let Some(world) = &mut protocol.world {
            clear(world);
        }
    }
    clear(&mut plan.world);
    blake3::hash(plan.to_ron().as_bytes()).to_hex().to_string()
}

fn clear(world: &mut World) {
    for group in &mut world.groups {
        group.at = Place::default();
    }
    for formation in &mut world.formations {
        formation.at = Place::default();
    }
    for observation in &mut world.observe {
        (observation.text, observation.at) = (String::new(), Place::default());
    }
    for term in &mut world.reward {
        (term.doc, term.at) = (String::new(), Place::default());
    }
    for end in &mut world.ends {
        end.at = Place::default();
    }
}
