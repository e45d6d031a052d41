//! Signals that ask a run to stop.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGUSR1};
use signal_hook::iterator::Signals;

use crate::failure::{Exit, Failure};

/// Bytes of the stack of who only waits.
const STACK: usize = 1 << 18;

/// A flag that the first Ctrl-C, SIGTERM, SIGHUP or SIGUSR1 (which batch systems send before the time is up) raises; a
/// second one stops at once.
///
/// # Errors
/// If the system takes no handler.
pub fn flag() -> Result<Arc<AtomicBool>, Failure> {
    let deaf = |why| Failure::new(Exit::Internal, format!("cannot listen for signals: {why}"));
    let mut signals = Signals::new([SIGINT, SIGTERM, SIGHUP, SIGUSR1]).map_err(deaf)?;
    let flag = Arc::new(AtomicBool::new(false));
    let raised = Arc::clone(&flag);
    let listen = move || {
        for _ in signals.forever() {
            if raised.swap(true, Ordering::SeqCst) {
                std::process::exit(Exit::Interrupted as i32);
            }
            eprintln!("\nstopping at the next checkpoint; once more stops at once");
        }
    };
    std::thread::Builder::new().name("signals".into()).stack_size(STACK).spawn(listen).map_err(deaf)?;
    Ok(flag)
}
