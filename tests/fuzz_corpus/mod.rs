//! Replays what fuzzing kept: inputs that each reach code that no other does, and, by name, those
//! that once crashed, took too long or broke something. `docs/robustness.md` says how to look for
//! more.

#[cfg(feature = "glb")]
mod gltf;
mod luminaire;
#[cfg(feature = "npz")]
mod npz;
mod ply;
mod scene;
mod state;
mod stl;
mod texture;
mod weather;

use std::fs;
use std::path::Path;

/// Runs `accepts` on every input of a corpus: how many it accepted, and how many it refused.
fn replay(corpus: &str, accepts: impl Fn(&[u8]) -> bool) -> (usize, usize) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus").join(corpus);
    let (mut accepted, mut refused) = (0, 0);
    for file in fs::read_dir(folder).unwrap() {
        let path = file.unwrap().path();
        // Captured, and shown when the input makes it panic.
        println!("{}", path.display());
        if accepts(&fs::read(path).unwrap()) {
            accepted += 1;
        } else {
            refused += 1;
        }
    }
    println!("{accepted} accepted, {refused} refused");
    (accepted, refused)
}

#[test]
fn every_obj_input_keeps_its_promises() {
    let (accepted, refused) = replay("obj", |input| scene::try_scene(input).is_some());
    assert!(accepted > 40 && refused > 40, "{accepted} accepted, {refused} refused");
}

#[test]
fn every_state_input_keeps_its_promises() {
    let (accepted, refused) = replay("state", state::try_state);
    assert!(accepted > 10 && refused > 10, "{accepted} accepted, {refused} refused");
}

#[test]
fn every_image_keeps_its_promises() {
    let (accepted, refused) = replay("texture", texture::try_texture);
    assert!(accepted > 15 && refused > 0, "{accepted} accepted, {refused} refused");
}

#[test]
fn every_ply_input_keeps_its_promises() {
    let (accepted, refused) = replay("ply", ply::try_ply);
    assert!(accepted > 4 && refused > 1, "{accepted} accepted, {refused} refused");
}

#[test]
fn every_stl_input_keeps_its_promises() {
    let (accepted, refused) = replay("stl", stl::try_stl);
    assert!(accepted > 4 && refused > 4, "{accepted} accepted, {refused} refused");
}

#[test]
#[cfg(feature = "glb")]
fn every_gltf_file_keeps_its_promises() {
    let (accepted, refused) = replay("gltf", gltf::try_gltf);
    assert!(accepted > 10 && refused > 10, "{accepted} accepted, {refused} refused");
}

#[test]
fn every_photometric_file_keeps_its_promises() {
    let (accepted, refused) = replay("luminaire", luminaire::try_luminaire);
    assert!(accepted > 8 && refused > 8, "{accepted} accepted, {refused} refused");
}

#[test]
fn every_weather_file_keeps_its_promises() {
    let (accepted, refused) = replay("weather", weather::try_weather);
    assert!(accepted > 4 && refused > 4, "{accepted} accepted, {refused} refused");
}

#[test]
#[cfg(feature = "npz")]
fn every_matrix_keeps_its_promises() {
    let (accepted, refused) = replay("npz", npz::try_npz);
    assert!(accepted > 1 && refused > 4, "{accepted} accepted, {refused} refused");
}

/// States of today's solver are what the corpus begins with: RADIOSITY_SEEDS=FOLDER writes them
/// there.
#[test]
fn accepts_states_of_every_method() {
    for (name, input) in state::seeds() {
        assert!(state::try_state(&input), "{name}");
        if let Some(folder) = std::env::var_os("RADIOSITY_SEEDS") {
            fs::write(Path::new(&folder).join(name), &input).unwrap();
        }
    }
}
