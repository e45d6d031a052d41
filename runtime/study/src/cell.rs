//! Cells: what a study is made of. One method, trained with one seed; or a controller, once.

use std::collections::BTreeSet;

use mpgx_lang::plan::{Method, Place, Plan};

use crate::error::StudyError;
use crate::hash::Identity;

/// A cell's folder name: the method's label and the seed, `mpg-003`.
pub type CellId = String;

/// One cell of a Plan.
#[derive(Clone, Debug, PartialEq)]
pub struct Cell {
    pub id: CellId,
    /// 0 for controllers.
    pub seed: u32,
    pub role: Role,
    pub method: Method,
}

/// Whether a method is trained.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    Learner,
    Controller,
}

impl Cell {
    fn new(method: &Method, role: Role, seed: u32) -> Cell {
        Cell { id: format!("{}-{seed:03}", method.label), seed, role, method: method.clone() }
    }

    /// What the files of this cell belong to.
    pub(crate) fn belongs_to(&self, study: &Identity) -> blake3::Hash {
        let mut hasher = blake3::Hasher::new();
        hasher.update(study.0.as_bytes());
        hasher.update(self.id.as_bytes());
        hasher.finalize()
    }
}

/// The cells of a Plan, the long ones (learners) first, all methods of one seed together.
pub fn cells(plan: &Plan) -> Result<Vec<Cell>, StudyError> {
    let methods = plan.learners.iter().chain(&plan.controllers);
    check_names("methods", methods.map(|method| (&method.label, &method.at)))?;
    let number = |seeds: usize| u32::try_from(seeds).unwrap_or(u32::MAX);
    let trained = (number(plan.first_seed)..number(plan.first_seed.saturating_add(plan.seeds)))
        .flat_map(|seed| plan.learners.iter().map(move |learner| Cell::new(learner, Role::Learner, seed)));
    let given = plan.controllers.iter().map(|controller| Cell::new(controller, Role::Controller, 0));
    Ok(trained.chain(given).collect())
}

/// Names that become folders: plain, and each once. `what` they are, in the plural.
pub(crate) fn check_names<'a>(
    what: &'static str,
    names: impl Iterator<Item = (&'a String, &'a Place)>,
) -> Result<(), StudyError> {
    let plain = |letter: char| letter.is_ascii_alphanumeric() || "_-=.,".contains(letter);
    let mut seen = BTreeSet::new();
    for (name, at) in names {
        let (label, at) = (name.clone(), at.clone());
        if name.is_empty() || name.len() > 100 || name.starts_with('.') || !name.chars().all(plain) {
            return Err(StudyError::Label { label, at });
        }
        if !seen.insert(name) {
            return Err(StudyError::SameLabel { what, label, at });
        }
    }
    Ok(())
}
