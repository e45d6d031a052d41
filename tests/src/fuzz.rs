//! Strange scenarios by the million: none may panic, hang, or come back other than it was printed.

mod corpus;
mod front;
mod grammar;
mod inputs;
mod rules;
mod shrink;

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

pub use front::{Reached, survives};
pub use inputs::{Inputs, Kind};

/// Inputs that a thread takes at a time.
const BATCH: u64 = 256;
/// A stack as every thread of the program has it.
const STACK: usize = 2 << 20;

/// An input that shows a fault of the program.
#[derive(Clone, Debug)]
pub struct Finding {
    pub number: u64,
    /// As small as it could be made.
    pub text: String,
    pub fault: String,
}

/// What came of a range of inputs.
#[derive(Debug, Default)]
pub struct Tally {
    pub findings: Vec<Finding>,
    /// How many inputs of each kind came how far.
    pub reached: BTreeMap<(Kind, Reached), u64>,
}

impl Tally {
    pub fn inputs(&self) -> u64 {
        self.reached.values().sum::<u64>() + self.findings.len() as u64
    }

    /// Inputs whose syntax is right, or more.
    pub fn at_least(&self, least: Reached) -> u64 {
        self.reached.iter().filter(|((_, reached), _)| *reached >= least).map(|(_, count)| count).sum()
    }
}

/// Tries inputs on threads, until the range is done or `stop` says so. `begun` hears of each batch before it is
/// tried, from the thread of that number: a stack that overflows leaves no other trace.
pub fn fuzz(
    inputs: &Inputs,
    numbers: Range<u64>,
    threads: usize,
    begun: impl Fn(usize, Range<u64>) + Sync,
    stop: impl Fn() -> bool + Sync,
) -> Tally {
    let (next, tally) = (AtomicU64::new(numbers.start), Mutex::new(Tally::default()));
    let work = |thread| {
        while !stop() {
            let first = next.fetch_add(BATCH, Ordering::Relaxed);
            if first >= numbers.end {
                break;
            }
            let batch = first..(first + BATCH).min(numbers.end);
            begun(thread, batch.clone());
            let found = tried(inputs, batch);
            let mut tally = tally.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
            tally.findings.extend(found.findings);
            found
                .reached
                .into_iter()
                .for_each(|(way, count)| *tally.reached.entry(way).or_default() += count);
        }
    };
    let work = &work;
    std::thread::scope(|scope| {
        for thread in 0..threads {
            let started =
                std::thread::Builder::new().stack_size(STACK).spawn_scoped(scope, move || work(thread));
            if started.is_err() {
                work(thread);
            }
        }
    });
    tally.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner)
}

fn tried(inputs: &Inputs, numbers: Range<u64>) -> Tally {
    let mut tally = Tally::default();
    for number in numbers {
        let (kind, text) = inputs.make(number);
        match survives(&text) {
            Ok(reached) => *tally.reached.entry((kind, reached)).or_default() += 1,
            Err(fault) => {
                let text = shrink::shrunk(&text, |text| survives(text).is_err());
                let fault = survives(&text).err().unwrap_or(fault);
                tally.findings.push(Finding { number, text, fault });
            }
        }
    }
    tally
}
