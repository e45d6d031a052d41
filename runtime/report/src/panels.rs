//! The parts of the page, in order. A panel is a file here, its template beside it, and one line below.

use minijinja::Value;

use crate::view::View;

mod comparison;
mod curves;
mod data;
mod failures;
mod health;
mod paper;
mod playback;
mod provenance;
mod reward;
mod sight;
mod verdict;

pub struct Panel {
    /// Anchor of the section.
    pub id: &'static str,
    pub title: &'static str,
    pub template: &'static str,
    /// Makes the panel live; the panel is complete without it.
    pub script: Option<&'static str>,
    /// Whether it takes what room the others leave, see [`View::room`].
    pub fills: bool,
    /// `None`: there is nothing to show.
    pub content: fn(&View) -> Option<Content>,
}

/// What fills a panel's template, and the data its script reads.
pub struct Content {
    pub context: Value,
    pub data: Option<serde_json::Value>,
}

pub const PANELS: &[Panel] = &[
    verdict::PANEL,
    playback::PANEL,
    sight::PANEL,
    curves::PANEL,
    comparison::PANEL,
    health::PANEL,
    paper::PANEL,
    reward::PANEL,
    failures::PANEL,
    provenance::PANEL,
    data::PANEL,
];
