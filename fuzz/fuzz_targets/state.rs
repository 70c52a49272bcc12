//! States of solves from anywhere: see `try_state`.
#![no_main]

#[path = "../../tests/fuzz_corpus/state.rs"]
mod state;

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    state::try_state(input);
});
