//! Replays states that fuzzing kept: inputs that each reach code that no other does, and, by name,
//! those that once broke something. `cargo +nightly fuzz run state` looks for more.

#[path = "../fuzz/try_state.rs"]
mod try_state;

use std::fs;
use std::path::Path;

#[test]
fn every_input_of_the_corpus_keeps_its_promises() {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus/state");
    let (mut taken, mut refused) = (0, 0);
    for file in fs::read_dir(corpus).unwrap() {
        let path = file.unwrap().path();
        // DepthMode when it panics.
        println!("{}", path.display());
        match try_state::try_state(&fs::read(path).unwrap()) {
            true => taken += 1,
            false => refused += 1,
        }
    }
    println!("{taken} taken, {refused} refused");
    assert!(taken > 10 && refused > 10, "{taken} taken, {refused} refused");
}

/// States of today's solver are what the corpus begins with: RADIOSITY_SEEDS=FOLDER writes them there.
#[test]
fn states_of_every_method_are_taken() {
    for (name, input) in try_state::seeds() {
        assert!(try_state::try_state(&input), "{name}");
        if let Some(folder) = std::env::var_os("RADIOSITY_SEEDS") {
            fs::write(Path::new(&folder).join(name), &input).unwrap();
        }
    }
}
