//! Progress on stderr: one line that is rewritten on a terminal, a line now and then elsewhere. Ctrl-C is noted here.

use crate::nlp::Iteration;
use std::io::{IsTerminal, Write, stderr};
use std::sync::Arc;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

/// Off a terminal, how many iterations pass between two lines.
const LINE_EVERY: usize = 10;

/// Whether Ctrl-C was pressed. The first call installs the handler; a second Ctrl-C ends the process at once.
pub(super) fn interrupted() -> &'static Arc<AtomicBool> {
    static FLAG: OnceLock<Arc<AtomicBool>> = OnceLock::new();
    FLAG.get_or_init(|| {
        let flag = Arc::new(AtomicBool::new(false));
        let set = Arc::clone(&flag);
        // Without a handler Ctrl-C still ends the process, only less politely.
        let _ = ctrlc::set_handler(move || {
            if set.swap(true, Ordering::Relaxed) {
                std::process::exit(130);
            }
        });
        flag
    })
}

/// Shows the solver's progress and ends the solve on Ctrl-C. `log` prints every iteration.
#[must_use]
pub(super) fn solver_progress(quiet: bool, log: bool) -> crate::plan::Progress {
    let stop = Arc::clone(interrupted());
    let rewrite = stderr().is_terminal() && !log;
    if log {
        eprintln!("iteration    duration/ms   infeasibility   optimality      barrier");
    }
    Box::new(move |iteration: &Iteration, duration_s: f64| {
        if log {
            eprintln!(
                "{:>9}  {:>13.6}  {:>14.3e}  {:>11.3e}  {:>11.3e}{}",
                iteration.number,
                duration_s * 1e3,
                iteration.primal_infeasibility,
                iteration.dual_infeasibility,
                iteration.barrier,
                if iteration.restoring {
                    "  restoring feasibility"
                } else {
                    ""
                }
            );
        } else if !quiet && (rewrite || iteration.number.is_multiple_of(LINE_EVERY)) {
            let (start, end) = if rewrite {
                ("\r\x1b[K", "")
            } else {
                ("", "\n")
            };
            // A closed stderr is no reason to stop planning.
            let _ = write!(
                stderr(),
                "{start}planning: iteration {}, {:.3} ms, infeasibility {:.1e}{end}",
                iteration.number,
                duration_s * 1e3,
                iteration.primal_infeasibility
            );
            let _ = stderr().flush();
        }
        !stop.load(Ordering::Relaxed)
    })
}

/// Ends a line that was being rewritten.
pub(super) fn end_progress(quiet: bool, log: bool) {
    if !quiet && !log && stderr().is_terminal() {
        eprint!("\r\x1b[K");
    }
}

/// Says what is being done now.
pub(super) fn step(what: &str) {
    eprintln!("{what}");
}

/// Shows how far something is, in a line that is rewritten; nothing elsewhere than on a terminal.
pub(super) fn bar(what: &str, done: u32, of: u32, words: &str) {
    const WIDTH: usize = 30;
    if !stderr().is_terminal() {
        return;
    }
    let share = f64::from(done) / f64::from(of.max(1));
    let full = ((share * WIDTH as f64) as usize).min(WIDTH);
    let bar = "#".repeat(full) + &"-".repeat(WIDTH - full);
    // A closed stderr is no reason to stop.
    let _ = write!(stderr(), "\r\x1b[K{what} [{bar}] {words}");
    let _ = stderr().flush();
}

/// Ends the line of a bar.
pub(super) fn end_bar() {
    if stderr().is_terminal() {
        eprint!("\r\x1b[K");
    }
}
