//! OBJ and MTL from anywhere: see `try_scene`.
#![no_main]

#[path = "../try_scene.rs"]
mod try_scene;

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    try_scene::try_scene(input);
});
