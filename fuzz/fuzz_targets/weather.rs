//! Weather files from anywhere: see `try_weather`.
#![no_main]

#[path = "../../tests/fuzz_corpus/weather.rs"]
mod weather;

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    weather::try_weather(input);
});
