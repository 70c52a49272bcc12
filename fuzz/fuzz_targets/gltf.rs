//! glTF files from anywhere: see `try_gltf`.
#![no_main]

#[path = "../../tests/fuzz_corpus/gltf.rs"]
mod gltf;
#[path = "../../tests/fuzz_corpus/scene.rs"]
mod scene;

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    gltf::try_gltf(input);
});
