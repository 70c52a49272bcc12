//! Waiting for the device: the only module that does.
//!
//! ```text
//! native    the thread sleeps in the driver until a submission is done
//! browsers  results arrive between turns of the event loop: a function of the host's suspends the
//!           call meanwhile (set_block_on)
//! ```

use futures_channel::oneshot::Receiver;

/// Maximum time of a wait, s. A batch takes a fraction of a second, on slow devices seconds;
/// watchdogs of drivers act earlier. Plain choice.
const SECONDS: u64 = 120;

/// What is said where an answer will never come.
const LOST: &str = "the device was lost";

fn late() -> String {
    format!("no answer for {SECONDS} s")
}

#[cfg(not(target_family = "wasm"))]
pub use native::{answer, block_on, check};
#[cfg(target_family = "wasm")]
pub use web::{BlockOn, answer, block_on, check, set_block_on};

#[cfg(not(target_family = "wasm"))]
mod native {
    use std::panic::{AssertUnwindSafe, catch_unwind};
    use std::time::Duration;

    pub use pollster::block_on;

    use super::*;
    use crate::error::Error;

    /// An error where nothing can be waited for.
    pub fn check() -> Result<(), Error> {
        Ok(())
    }

    /// What `receiver` is sent once this submission and all before it are done; with `None`, once
    /// all are. Else why there is nothing.
    pub fn answer<T>(
        device: &wgpu::Device,
        _queue: &wgpu::Queue,
        submission_index: Option<wgpu::SubmissionIndex>,
        mut receiver: Receiver<T>,
        _is_lost: impl Fn() -> bool,
    ) -> Result<T, String> {
        let timeout = Some(Duration::from_secs(SECONDS));
        let poll = || device.poll(wgpu::PollType::Wait { submission_index, timeout });
        // wgpu 30 panics when the device is lost during a wait.
        match catch_unwind(AssertUnwindSafe(poll)) {
            Ok(Ok(_)) => receiver.try_recv().ok().flatten().ok_or_else(|| LOST.into()),
            Ok(Err(wgpu::PollError::Timeout)) => Err(late()),
            Ok(Err(e)) => {
                // A device that was lost before the submission reports it when it is polled again.
                let poll = || device.poll(wgpu::PollType::Poll);
                let _ = catch_unwind(AssertUnwindSafe(poll));
                Err(e.to_string())
            }
            Err(_) => Err(LOST.into()),
        }
    }
}

#[cfg(target_family = "wasm")]
mod web {
    use std::pin::{Pin, pin};
    use std::sync::OnceLock;
    use std::task::Poll;

    use super::*;
    use crate::error::{Error, ErrorKind};
    use crate::progress::Instant;

    /// Runs a future to its end, while the event loop turns: polls it whenever its waker is woken,
    /// and at least every few milliseconds.
    pub type BlockOn = fn(Pin<&mut dyn Future<Output = ()>>);

    static BLOCK_ON: OnceLock<BlockOn> = OnceLock::new();

    /// How calls of this crate wait for a device in a browser, where a thread that sleeps receives
    /// no results: by suspending WebAssembly (JavaScript Promise Integration), say. The first call
    /// holds. Without it no device can be opened.
    pub fn set_block_on(block_on: BlockOn) {
        let _ = BLOCK_ON.set(block_on);
    }

    /// An error where nothing can be waited for.
    pub fn check() -> Result<(), Error> {
        let missing = || {
            let found = "no function that waits for it";
            let remedy = "call set_block_on first, or use the CPU";
            Error::new(ErrorKind::Device, "graphics device", found, remedy)
        };
        BLOCK_ON.get().map(|_| ()).ok_or_else(missing)
    }

    /// The result of `future`, which is waited for.
    pub fn block_on<F: Future>(future: F) -> F::Output {
        let mut result = None;
        {
            let task = pin!(async { result = Some(future.await) });
            BLOCK_ON.get().expect("checked when the device was opened")(task);
        }
        result.expect("the future was run to its end")
    }

    /// What `receiver` is sent.
    pub fn answer<T>(
        _device: &wgpu::Device,
        queue: &wgpu::Queue,
        _submission: Option<wgpu::SubmissionIndex>,
        mut receiver: Receiver<T>,
        is_lost: impl Fn() -> bool,
    ) -> Result<T, String> {
        let start = Instant::now();
        block_on(std::future::poll_fn(|context| match Pin::new(&mut receiver).poll(context) {
            Poll::Ready(answer) => Poll::Ready(answer.map_err(|_| LOST.into())),
            Poll::Pending if is_lost() => Poll::Ready(Err(LOST.into())),
            Poll::Pending if start.elapsed().as_secs() >= SECONDS => Poll::Ready(Err(late())),
            Poll::Pending => {
                // Firefox (153) looks for results when something is submitted, and otherwise ten
                // times a second.
                queue.submit([]);
                Poll::Pending
            }
        }))
    }
}
