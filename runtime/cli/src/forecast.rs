//! What a run is going to do, told before it does it.

use std::fmt::Write;
use std::path::Path;

use mpgx_study::storage::RealDisk;
use mpgx_study::{Part, Todo, cells, estimate, load, seconds};

use crate::bytes::Bytes;
use crate::failure::{Exit, Failure};

/// One line a study, then what those cells will take that are not finished yet. Refuses what could take more than
/// `most_memory`, before anything is spent.
pub fn of(
    parts: &[&Part],
    folder: &Path,
    threads: usize,
    most_memory: Option<Bytes>,
) -> Result<String, Failure> {
    let mut out = String::new();
    let (mut steps, mut updates, mut all, mut left) = (0, 0, 0, 0);
    let (mut memory, mut disk, mut room) = (0.0f64, 0.0, 0.0f64);
    let mut rests = Vec::new();
    for part in parts {
        let (plan, into) = (&part.plan, folder.join(&part.folder));
        let planned = cells(plan)?.len();
        let _ = writeln!(
            out,
            "{}: {} of {}; {}; into {}",
            name(part),
            plural(plan.seeds, "seed"),
            plan.learners.iter().map(|learner| learner.label.as_str()).collect::<Vec<_>>().join(", "),
            plural(planned, "cell"),
            into.display()
        );
        all += planned;
        let todo = Todo::of(plan, load(&RealDisk::new(&into)).ok().as_ref())?;
        let it = estimate(plan, &todo, threads)?;
        if todo.cells.is_empty() {
            continue;
        }
        left += todo.cells.len();
        (steps, updates) = (steps + it.steps, updates + it.updates);
        room = room.max(disk + it.most_disk_bytes);
        disk += it.disk_bytes;
        memory = memory.max(it.memory_bytes);
        rests.push((plan, todo));
    }
    let memory = Bytes(memory);
    if let Some(most) = most_memory.filter(|most| memory > *most) {
        let message = format!("it could take {memory} of memory, more than {most}");
        let help = "fewer `--threads`, a smaller `replay`, or fewer `channels` of a network that sees";
        return Err(Failure::new(Exit::BadInput, message).help(help));
    }
    if parts.len() > 1 {
        let _ = writeln!(out, "in all {} of {}", plural(all, "cell"), plural(parts.len(), "study"));
    }
    if left > 0 {
        let already =
            if left < all { format!(" for the {} left", plural(left, "cell")) } else { String::new() };
        let _ = writeln!(
            out,
            "at most {} steps, {} updates, {memory} of memory, {} of disk ({} while it runs); about {}{already}",
            count(steps),
            count(updates),
            Bytes(disk),
            Bytes(room),
            time(seconds(&rests, threads)?),
        );
    }
    Ok(out)
}

/// The scenario's name and, where it is one, the variant's: `square_unison, variant wide`.
pub fn name(part: &Part) -> String {
    match part.variant.as_str() {
        "" => part.plan.name.clone(),
        variant => format!("{}, variant {variant}", part.plan.name),
    }
}

fn plural(count: usize, thing: &str) -> String {
    match (count, thing) {
        (1, _) => format!("1 {thing}"),
        (_, "study") => format!("{count} studies"),
        _ => format!("{count} {thing}s"),
    }
}

/// Digits in groups of three.
fn count(number: u64) -> String {
    let digits = number.to_string();
    let groups: Vec<&str> =
        digits.as_bytes().rchunks(3).rev().filter_map(|group| str::from_utf8(group).ok()).collect();
    groups.join(",")
}

fn time(seconds: f64) -> String {
    match seconds {
        ..1.0 => "a second".into(),
        ..100.0 => format!("{seconds:.0} s"),
        ..6000.0 => format!("{:.0} min", seconds / 60.0),
        _ => format!("{:.1} h", seconds / 3600.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantities_are_short() {
        assert_eq!([0, 999, 1000, 1234567].map(count), ["0", "999", "1,000", "1,234,567"]);
        assert_eq!([0.2, 42.4, 600.0, 7200.0].map(time), ["a second", "42 s", "10 min", "2.0 h"]);
        assert_eq!((plural(1, "cell"), plural(3, "study")), ("1 cell".into(), "3 studies".into()));
    }
}
