//! Where lines begin, and how far they are indented.

use super::{Atom, Line};
use crate::parse::scan::Kind;

/// Settles the line ends: blocks that run over several lines begin and end with one, and have no blank lines at
/// their edges.
pub(super) fn breaks(atoms: &mut [Atom]) {
    for at in 0..atoms.len() {
        let Some(before) = at.checked_sub(1) else { continue };
        if atoms[before].kind == Kind::Doc {
            atoms[at].breaks = 1;
        } else if atoms[at].is("{") && !atoms[before].is_comment() {
            atoms[at].breaks = 0;
        }
        if atoms[before].kind == Kind::Open || atoms[at].kind == Kind::Close {
            atoms[at].breaks = atoms[at].breaks.min(1);
        }
    }
    for opening in 0..atoms.len() {
        let Some(closing) = atoms[opening].partner.filter(|closing| *closing > opening) else { continue };
        if closing == opening + 1 {
            atoms[closing].breaks = 0;
        } else if atoms[opening].is("{") && atoms[opening + 1..=closing].iter().any(|atom| atom.breaks > 0) {
            let remark = atoms[opening + 1].kind == Kind::Comment;
            atoms[opening + 1].breaks = if remark { atoms[opening + 1].breaks } else { 1 };
            atoms[closing].breaks = 1;
        }
    }
}

/// The lines, with their levels. `continued`: the atoms that go on with what stands before them.
pub(super) fn lines(atoms: &[Atom], continued: &[bool]) -> Vec<Line> {
    let (mut lines, mut open): (Vec<Line>, Vec<usize>) = (Vec::new(), Vec::new());
    for (at, atom) in atoms.iter().enumerate() {
        let closed = if atom.kind == Kind::Close { open.pop() } else { None };
        if at == 0 || atom.breaks > 0 {
            let inside = open.last().map_or(0, |level| level + 1);
            let goes_on = continued.get(at) == Some(&true) || (open.is_empty() && !atom.item);
            let level = match closed {
                Some(level) => level,
                None if atom.is_comment() => inside,
                None => inside + usize::from(goes_on),
            };
            lines.push(Line { level, start: at, end: at });
        }
        if let Some(line) = lines.last_mut() {
            line.end = at + 1;
            if atom.kind == Kind::Open {
                open.push(line.level);
            }
        }
    }
    // A remark stands at the level of what comes after it in its block.
    for index in (1..lines.len()).rev() {
        let after = atoms.get(lines[index].start).is_some_and(|atom| atom.kind != Kind::Close);
        let remark = atoms.get(lines[index - 1].start).is_some_and(Atom::is_comment);
        if after && remark {
            lines[index - 1].level = lines[index].level;
        }
    }
    lines
}
