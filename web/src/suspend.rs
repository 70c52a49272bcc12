//! Waits for a device in the middle of a call: JavaScript suspends it meanwhile, by its Promise
//! Integration (`js/suspend.js`).

#![allow(unsafe_code, reason = "functions of a module that wasm-bindgen must not wrap")]

use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Wake, Waker};

use radiosity::backend::gpu::set_block_on;

#[link(wasm_import_module = "../js/suspend.js")]
unsafe extern "C" {
    /// Returns once `wake` was called since it last returned, and at the latest after 4 ms.
    fn suspend();
    fn wake();
}

struct Waiting;

impl Wake for Waiting {
    fn wake(self: Arc<Self>) {
        // SAFETY: no arguments, no results.
        unsafe { wake() }
    }
}

/// Lets the library wait for devices: in calls that may be suspended.
pub fn allow_waits() {
    set_block_on(block_on);
}

fn block_on(mut future: Pin<&mut dyn Future<Output = ()>>) {
    let waker = Waker::from(Arc::new(Waiting));
    while future.as_mut().poll(&mut Context::from_waker(&waker)).is_pending() {
        // SAFETY: no arguments, no results. Calls in the meantime leave the stack as they found it.
        unsafe { suspend() }
    }
}
