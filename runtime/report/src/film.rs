//! What a robot's camera showed in an episode that is played back: many small pictures as one.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use mpgx_lang::plan::{GroupId, Localised, Protocol};
use mpgx_vision::Image;
use mpgx_vision::dataset::png_bytes;
use serde::Serialize;

use crate::view::View;

/// Pictures of an episode at most, and in a row of the sheet.
const PICTURES: usize = 50;
const COLUMNS: usize = 10;
/// Shades of a colour that are kept, so that the sheet is small.
const SHADES: u8 = 32;
/// Letters that a film may have.
const MOST: usize = 600_000;

#[derive(Serialize)]
pub struct Film {
    pub protocol: usize,
    pub method: usize,
    pub seed: u32,
    pub episode: usize,
    /// Whose camera.
    agent: usize,
    /// Steps from one picture to the next.
    every: usize,
    count: usize,
    columns: usize,
    width: usize,
    height: usize,
    /// As an address.
    pub src: String,
}

/// Of the first learner's first robot in the first protocol in which robots are told their poses by what they see.
pub fn film(view: &View) -> Option<Film> {
    let plan = view.input.plan;
    let (protocol, of) = plan.protocols.iter().enumerate().find(|(_, of)| seeing(view, of).is_some())?;
    let agent = view.world(of).first_of(seeing(view, of)?);
    let (seed, evaluation) = view.first()?.evaluations(&of.name).next()?;
    let trajectory = evaluation.trajectories.first()?;
    let horizon = view.world(of).horizon;
    let every = horizon.div_ceil(PICTURES).max(1);
    let pictures = mpgx_study::film(plan, protocol, 0, trajectory, agent, (0..horizon).step_by(every))?;
    let (width, height) = pictures.first().map(|picture| (picture.width, picture.height))?;
    let bytes = png_bytes(&sheet(&pictures, width, height)).ok()?;
    let src = format!("data:image/png;base64,{}", STANDARD.encode(bytes));
    let count = pictures.len();
    let film = Film {
        protocol,
        method: 0,
        seed,
        episode: 0,
        agent,
        every,
        count,
        columns: COLUMNS,
        width,
        height,
        src,
    };
    (film.src.len() <= MOST).then_some(film)
}

/// The group that a network tells its poses in a protocol.
fn seeing(view: &View, protocol: &Protocol) -> Option<GroupId> {
    let world = protocol.world.as_deref().unwrap_or(&view.input.plan.world);
    let looks = |localised: &&Localised| {
        let localiser = view.input.plan.localisers.get(localised.via);
        localiser.is_some_and(|localiser| view.input.localisers.contains_key(&localiser.name))
    };
    world.localised.iter().find(looks).map(|localised| localised.group)
}

/// The pictures in rows.
fn sheet(pictures: &[Image], width: usize, height: usize) -> Image {
    let rows = pictures.len().div_ceil(COLUMNS);
    let mut sheet = Image {
        width: COLUMNS * width,
        height: rows * height,
        rgb: vec![0; 3 * COLUMNS * width * rows * height],
    };
    let step = u8::MAX / (SHADES - 1);
    for (number, picture) in pictures.iter().enumerate() {
        let (left, top) = (number % COLUMNS * width, number / COLUMNS * height);
        for (y, row) in picture.rgb.chunks(3 * width).enumerate() {
            let start = 3 * ((top + y) * sheet.width + left);
            for (to, from) in sheet.rgb.iter_mut().skip(start).zip(row) {
                *to = (from.saturating_add(step / 2) / step).saturating_mul(step);
            }
        }
    }
    sheet
}
