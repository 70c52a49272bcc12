//! STL files from anywhere: see `try_stl`.
#![no_main]

#[path = "../../tests/fuzz_corpus/stl.rs"]
mod stl;
#[path = "../../tests/fuzz_corpus/scene.rs"]
mod scene;

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    stl::try_stl(input);
});
