//! Live progress: one line a running cell on a terminal, one line a finished cell elsewhere.

use std::collections::BTreeMap;
use std::io::IsTerminal;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};
use mpgx_study::Progress;
use mpgx_study::record::{CellRecord, LocaliserRecord, Timing};
use mpgx_study::{Cell, CellId, Role};

use crate::layout::{fold, width_of_stderr};

/// Shows a run on stderr.
pub struct Display {
    lines: MultiProgress,
    terminal: bool,
    running: Mutex<BTreeMap<CellId, ProgressBar>>,
    done: Mutex<Done>,
    started: Instant,
    trained: AtomicBool,
}

/// A line that fits.
fn template(width: Option<usize>) -> &'static str {
    match width.unwrap_or(80) {
        ..76 => "  {prefix:<12} {percent:>3}% {eta:>4} left",
        76..96 => "  {prefix:<18} {percent:>3}% {msg} {eta:>4} left",
        _ => "  {prefix:<18} {wide_bar:.cyan/dim} {percent:>3}% {msg} {eta:>4} left",
    }
}

/// Cells that are ready, of those to be made.
struct Done {
    count: usize,
    of: usize,
}

impl Display {
    /// For a study of `cells` cells.
    pub fn new(cells: usize) -> Self {
        let terminal = std::io::stderr().is_terminal();
        let target =
            if terminal { ProgressDrawTarget::stderr_with_hz(5) } else { ProgressDrawTarget::hidden() };
        Display {
            lines: MultiProgress::with_draw_target(target),
            terminal,
            running: Mutex::default(),
            done: Mutex::new(Done { count: 0, of: cells }),
            started: Instant::now(),
            trained: AtomicBool::new(false),
        }
    }

    /// Whether this run trained anything, or only found what an earlier one had made.
    pub fn trained(&self) -> bool {
        self.trained.load(Ordering::Relaxed)
    }

    /// Seconds since the start.
    pub fn elapsed_s(&self) -> f64 {
        self.started.elapsed().as_secs_f64()
    }

    fn running(&self) -> MutexGuard<'_, BTreeMap<CellId, ProgressBar>> {
        self.running.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A line that stays, above the moving ones.
    fn say(&self, line: &str) {
        let folded = fold(line, 10, width_of_stderr());
        let line = folded.trim_end();
        if self.terminal {
            self.lines.suspend(|| anstream::eprintln!("{line}"));
        } else {
            anstream::eprintln!("{line}");
        }
    }

    fn bar(&self, name: &str, steps: u64, of: u64) -> ProgressBar {
        // The template is a constant; were it wrong, the plain bar would do.
        let style = ProgressStyle::with_template(template(width_of_stderr()))
            .unwrap_or_else(|_| ProgressStyle::default_bar())
            .progress_chars("━━─");
        let bar = self.lines.add(ProgressBar::new(of).with_style(style).with_prefix(name.to_owned()));
        bar.set_position(steps);
        bar.reset_eta();
        bar
    }

    fn finish(&self, cell: &Cell, text: &str) {
        if let Some(bar) = self.running().remove(&cell.id) {
            bar.finish_and_clear();
            self.lines.remove(&bar);
        }
        let (count, of) = {
            let mut done = self.done.lock().unwrap_or_else(PoisonError::into_inner);
            done.count += 1;
            (done.count, done.of)
        };
        self.say(&format!("[{count:>3}/{of}] {:<18} {text}", cell.id));
    }
}

impl Progress for Display {
    fn cell_kept(&self, cell: &Cell, _record: &CellRecord) {
        self.finish(cell, "already done");
    }

    fn cell_started(&self, cell: &Cell, steps: u64, of: u64) {
        if cell.role == Role::Controller {
            return;
        }
        self.trained.store(true, Ordering::Relaxed);
        if !self.terminal {
            if steps > 0 {
                self.say(&format!("          {:<18} goes on at step {steps} of {of}", cell.id));
            }
            return;
        }
        self.running().insert(cell.id.clone(), self.bar(&cell.id, steps, of));
    }

    fn episode(&self, cell: &Cell, steps: u64, _of: u64, last_return: f64, error_m: f64) {
        if let Some(bar) = self.running().get(&cell.id) {
            bar.set_position(steps);
            bar.set_message(format!("return {last_return:>9.3}  error {:>7.1} mm", 1000.0 * error_m));
        }
    }

    fn cell_finished(&self, cell: &Cell, record: &CellRecord, timing: &Timing) {
        let text = match (&record.failure, &record.training) {
            (Some(failure), _) => format!("failed at step {}: {}", failure.step, failure.cause),
            (None, Some(training)) => {
                let rate = training.updates as f64 / timing.training_s.max(1e-9);
                let error = record.protocols.values().next().map_or(f64::NAN, |evaluation| {
                    evaluation.error_m.iter().sum::<f64>() / evaluation.error_m.len().max(1) as f64
                });
                format!(
                    "{:>6.1} s  {rate:>5.0} updates/s  held-out error {:>6.1} mm",
                    timing.training_s,
                    1000.0 * error
                )
            }
            (None, None) => "evaluated".to_string(),
        };
        self.finish(cell, &text);
    }

    fn localiser_started(&self, name: &str, steps: u64, of: u64) {
        self.trained.store(true, Ordering::Relaxed);
        let goes_on = if steps > 0 { format!(", goes on at step {steps}") } else { String::new() };
        self.say(&format!("          {name:<18} learns to tell poses, {of} steps{goes_on}"));
        if self.terminal {
            self.running().insert(name.to_owned(), self.bar(name, steps, of));
        }
    }

    fn localiser_step(&self, name: &str, steps: u64, of: u64, error_percent: f64) {
        if let Some(bar) = self.running().get(name) {
            bar.set_position(steps);
            bar.set_message(format!("position {error_percent:>5.2} % off"));
        } else if steps.is_multiple_of(of.div_ceil(10)) {
            self.say(&format!(
                "          {name:<18} step {steps} of {of}, position {error_percent:.2} % off"
            ));
        }
    }

    fn localiser_finished(&self, record: &LocaliserRecord) {
        if let Some(bar) = self.running().remove(&record.name) {
            bar.finish_and_clear();
            self.lines.remove(&bar);
        }
        let found = &record.network.all;
        let percent = |component: usize| found.percent.get(component).copied().flatten().unwrap_or(f64::NAN);
        let (x, y, median) = (percent(0), percent(1), 1000.0 * found.translation.median());
        self.say(&format!(
            "          {:<18} tells x and y to {x:.2} % and {y:.2} % of their ranges on unseen trials, half of them to {median:.0} mm",
            record.name
        ));
    }

    fn remark(&self, text: &str) {
        self.say(&format!("warning: {text}"));
    }

    fn warning(&self, cell: &Cell, text: &str) {
        self.say(&format!("warning: {}: {text}", cell.id));
    }
}
