//! OBJ files, libraries and images from anywhere: see `try_scene`.
#![no_main]

#[path = "../../tests/fuzz_corpus/scene.rs"]
mod scene;

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    scene::try_scene(input);
});
