//! NPZ files from anywhere: see `try_npz`.
#![no_main]

#[path = "../../tests/fuzz_corpus/npz.rs"]
mod npz;

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    npz::try_npz(input);
});
