//! What stands below each other in consecutive lines.

use super::{Atom, Line};
use crate::parse::scan::Kind;

/// The lines that align: as far in, with the same sign after the names, and the same word before them.
#[derive(PartialEq)]
struct Like<'a> {
    level: usize,
    sign: &'a str,
    word: Option<&'a str>,
}

/// Widens gaps so that signs, types and remarks of consecutive lines of a kind stand below each other.
pub(super) fn align(atoms: &mut [Atom], lines: &[Line]) {
    let mut runs: Vec<(Like, Vec<(usize, usize)>)> = Vec::new();
    let mut open = false;
    for line in lines {
        let first = &atoms[line.start];
        open &= first.breaks < 2;
        if first.is_comment() {
            continue;
        }
        let Some((like, sign)) = sign(atoms, line) else {
            open = false;
            continue;
        };
        match runs.last_mut().filter(|(other, _)| open && *other == like) {
            Some((_, run)) => run.push((line.start, sign)),
            None => runs.push((like, vec![(line.start, sign)])),
        }
        open = true;
    }
    let runs: Vec<Vec<(usize, usize)>> = runs.into_iter().map(|(_, run)| run).collect();
    for run in &runs {
        stand_below(atoms, run);
        // `name : word = default`: the defaults too.
        let mut typed = Vec::new();
        for (_, sign) in run {
            let is = |at: usize, text| atoms.get(at).is_some_and(|atom| atom.is(text) && atom.breaks == 0);
            if is(*sign, ":") && is(sign + 2, "=") {
                typed.push((*sign, sign + 2));
            } else {
                stand_below(atoms, &std::mem::take(&mut typed));
            }
        }
        stand_below(atoms, &typed);
    }
    let mut remarks: Vec<(usize, usize)> = Vec::new();
    let mut level = 0;
    for line in lines {
        let last = line.end - 1;
        let remark = last > line.start && atoms[last].kind == Kind::Comment;
        if !remark || atoms[line.start].breaks > 1 || line.level != level {
            stand_below(atoms, &std::mem::take(&mut remarks));
        }
        if remark {
            remarks.push((line.start, last));
            level = line.level;
        }
    }
    stand_below(atoms, &remarks);
}

/// Widens the gap before the second atom of each pair so that all are as far from the first.
fn stand_below(atoms: &mut [Atom], pairs: &[(usize, usize)]) {
    let width = |atoms: &[Atom], from: usize, to: usize| -> usize {
        let gaps: usize = atoms[from + 1..to].iter().map(|atom| atom.gap).sum();
        gaps + atoms[from..to].iter().map(|atom| atom.text.chars().count()).sum::<usize>()
    };
    let widest = pairs.iter().map(|(from, to)| width(atoms, *from, *to)).max().unwrap_or(0);
    for (from, to) in pairs {
        atoms[*to].gap += widest - width(atoms, *from, *to);
    }
}

/// The sign after the names that begin a line.
fn sign<'a>(atoms: &'a [Atom], line: &Line) -> Option<(Like<'a>, usize)> {
    let names = atoms[line.start..line.end].iter();
    let names =
        names.take_while(|atom| (atom.kind == Kind::Word && !atom.is("when")) || atom.is(".")).count();
    let at = line.start + names;
    let sign = atoms[..line.end].get(at).filter(|_| names > 0)?;
    let second = atoms.get(line.start + 1).filter(|second| names > 1 && second.kind == Kind::Word);
    let word = second.map(|_| atoms[line.start].text.as_str());
    let code = atoms[line.start..line.end].iter().rposition(|atom| !atom.is_comment());
    let sign = match sign.text.as_str() {
        "=" | "~" => "=",
        ":" => ":",
        "when" => "when",
        // A block on one line.
        "{" if word.is_some() && sign.gap > 0 && sign.partner == code.map(|code| line.start + code) => "{",
        _ => return None,
    };
    Some((Like { level: line.level, sign, word }, at))
}
