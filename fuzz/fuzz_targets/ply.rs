//! PLY files from anywhere: see `try_ply`.
#![no_main]

#[path = "../../tests/fuzz_corpus/ply.rs"]
mod ply;

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    ply::try_ply(input);
});
