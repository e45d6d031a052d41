//! Training allocates nothing once its buffers stand. Alone in its binary: the allocator is global.
#![allow(clippy::unwrap_used, unsafe_code)]

mod support;
#[allow(dead_code)]
#[path = "support/task.rs"]
mod task;

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicU64, Ordering};

use mpgx_lang::plan::Setting;
use mpgx_learn::{ALGORITHMS, Config, Learner};

/// The system's allocator; counts what is asked for.
struct Counting;

static ALLOCATIONS: AtomicU64 = AtomicU64::new(0);

// SAFETY: every call goes on to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the caller's promise.
        unsafe { System.alloc(layout) }
    }

    unsafe fn realloc(&self, old: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the caller's promise.
        unsafe { System.realloc(old, layout, size) }
    }

    unsafe fn dealloc(&self, old: *mut u8, layout: Layout) {
        // SAFETY: the caller's promise.
        unsafe { System.dealloc(old, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Steps of exploration, storing and updates; how often memory was asked for in them.
fn allocations(learner: &mut Learner, task: &mut task::Task, steps: u32) -> u64 {
    let before = ALLOCATIONS.load(Ordering::Relaxed);
    task.steps(learner, steps);
    ALLOCATIONS.load(Ordering::Relaxed) - before
}

/// One test, so that no other thread asks for memory meanwhile.
#[test]
fn training_allocates_nothing_but_a_replay_that_grows() {
    assert!(
        allocations(&mut small("mpg", "relu", 1e6), &mut task::Task::new(), 100) > 0,
        "nothing is counted"
    );
    for algorithm in ALGORITHMS {
        for activation in ["relu", "tanh"] {
            // Full after 50 steps.
            let mut learner = small(algorithm, activation, 50.0);
            let mut task = task::Task::new();
            task.steps(&mut learner, 60);
            let updates = learner.updates();
            assert_eq!(allocations(&mut learner, &mut task, 100), 0, "{algorithm} {activation}");
            assert_eq!(learner.updates() - updates, 100);
        }
    }
    let (mut learner, mut task) = (small("mpg", "relu", 3000.0), task::Task::new());
    task.steps(&mut learner, 20);
    // 1,024 rows at first, then doubled, at last the cap itself.
    assert_eq!(allocations(&mut learner, &mut task, 4000), 2);
}

fn small(algorithm: &str, activation: &str, replay: f64) -> Learner {
    let mut settings = support::settings(algorithm, &[24, 17], 16);
    settings.settings.insert("activation".to_owned(), Setting::Word(activation.to_owned()));
    settings.settings.insert("replay".to_owned(), Setting::Number(replay));
    task::learner(&Config::from_extern(&settings).unwrap(), 0)
}
