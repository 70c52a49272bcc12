//! States of solves from anywhere: see `try_state`.
#![no_main]

#[path = "../try_state.rs"]
mod try_state;

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    try_state::try_state(input);
});
