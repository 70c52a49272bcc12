//! Images from anywhere: see `try_texture`.
#![no_main]

#[path = "../../tests/fuzz_corpus/texture.rs"]
mod texture;

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    texture::try_texture(input);
});
