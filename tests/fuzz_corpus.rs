//! Replays what fuzzing kept: inputs that each reach code that no other does, and, by name, those
//! that once crashed or took too long. `cargo +nightly fuzz run obj` looks for more.

#[path = "../fuzz/try_scene.rs"]
mod try_scene;

use std::fs;
use std::path::Path;

#[test]
fn every_input_of_the_corpus_keeps_its_promises() {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus/obj");
    let (mut inputs, mut scenes) = (0, 0);
    for file in fs::read_dir(corpus).unwrap() {
        let path = file.unwrap().path();
        // DepthMode when it panics.
        println!("{}", path.display());
        inputs += 1;
        scenes += usize::from(try_scene::try_scene(&fs::read(path).unwrap()).is_some());
    }
    println!("{inputs} inputs, {scenes} scenes");
    assert!(scenes > 40 && inputs - scenes > 40, "{inputs} inputs, {scenes} scenes");
}
