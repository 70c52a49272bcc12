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
use std::sync::{Once, OnceLock};
use std::time::{Duration, Instant};

use radiosity::work::agree;

/// Exit status of a program that was interrupted: 128 + SIGINT, as shells have it.
pub const EXIT_STATUS: u8 = 130;

/// How long results are made after Ctrl-C: half of the two seconds in which the program is to end.
const TIME_FOR_RESULTS: Duration = Duration::from_secs(1);

/// When the program was asked to end.
static STOPPED: OnceLock<Instant> = OnceLock::new();

/// From here on the first Ctrl-C, SIGTERM or SIGHUP stops the work.
pub fn catch() {
    static CAUGHT: Once = Once::new();
    CAUGHT.call_once(|| {
        let caught = ctrlc::set_handler(|| {
            if STOPPED.set(Instant::now()).is_err() {
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
    flow_after(Duration::ZERO)
}

/// The same of what results are made by: break a second after Ctrl-C.
pub fn flow_of_results() -> ControlFlow<()> {
    flow_after(TIME_FOR_RESULTS)
}

fn flow_after(time: Duration) -> ControlFlow<()> {
    match STOPPED.get().is_some_and(|stopped| stopped.elapsed() >= time) {
        true => ControlFlow::Break(()),
        false => ControlFlow::Continue(()),
    }
}
