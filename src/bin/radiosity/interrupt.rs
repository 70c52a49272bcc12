//! Ctrl-C, and what else asks the program to end (SIGTERM, as of a batch system whose time is up;
//! SIGHUP): the first one stops the work at its next progress report, so that what there is can be
//! written; the second ends the program at once.
//!
//! ```text
//! Ctrl-C ──► flag ──► next progress report: Break ──► results are written ──► exit status 130
//! Ctrl-C again ─────────────────────────────────────────────────────────────► exit status 130
//! ```
//!
//! Before [`catch`] is called, Ctrl-C ends the program as it does any other. A bake calls it at its
//! first progress report: before that there is nothing to write.

use std::ops::ControlFlow;
use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};

use radiosity::work::agree;

/// Exit status of a program that was interrupted: 128 + SIGINT, as shells have it.
pub const EXIT_STATUS: u8 = 130;

static STOPPED: AtomicBool = AtomicBool::new(false);

/// From here on the first Ctrl-C, SIGTERM or SIGHUP stops the work.
pub fn catch() {
    static CAUGHT: Once = Once::new();
    CAUGHT.call_once(|| {
        let caught = ctrlc::set_handler(|| {
            if STOPPED.swap(true, Ordering::Relaxed) {
                std::process::exit(EXIT_STATUS.into());
            }
            eprintln!("stopping, to write what there is; Ctrl-C again ends at once");
        });
        if let Err(error) = caught {
            eprintln!("warning: Ctrl-C will lose what was done: {error}");
        }
    });
}

/// Whether the program, in any of its processes, was asked to end.
pub fn stopped() -> bool {
    agree(flow()).is_break()
}

/// What progress callbacks answer: break after Ctrl-C.
pub fn flow() -> ControlFlow<()> {
    if STOPPED.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
}
