//! What the fuzz target `stl` does with an input, and the replay of its corpus.

use radiosity::io::SceneSettings;

use super::scene::{check_error, check_scene};

/// Reads an STL file, with every facet a group if its first byte is odd. Answers whether it was
/// taken; panics where a scene or an error breaks its promises.
pub fn try_stl(input: &[u8]) -> bool {
    let Some((&choice, stl)) = input.split_first() else { return false };
    let mut settings = SceneSettings::default();
    settings.facets = choice & 1 != 0;
    match settings.read("it.stl", stl, &[]) {
        Ok(scene) => check_scene(&scene, stl.len()),
        Err(e) => {
            check_error(&e);
            return false;
        }
    }
    true
}
