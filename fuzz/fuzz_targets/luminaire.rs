//! Photometric files from anywhere: see `try_luminaire`.
#![no_main]

#[path = "../../tests/fuzz_corpus/luminaire.rs"]
mod luminaire;

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    luminaire::try_luminaire(input);
});
