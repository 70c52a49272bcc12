//! What the fuzz target `gltf` does with an input, and the replay of its corpus.
//!
//! ```text
//!   settings (a byte)   0 strict, 1 facets, 2 texture coordinates, 3 lamps in watts
//!   JSON of a document
//!   %%                  a line that parts it from its buffer, which is that of a binary file
//! ```
//!
//! A file that begins with `glTF` is read as it is.

use radiosity::SceneSettings;
use radiosity::io::LampUnits;

use super::scene::{check_error, check_scene, settle};

/// Scenes of more triangles are only read.
const MOST_TRIANGLES: usize = 64;

const SEPARATOR: &[u8] = b"\n%%\n";

/// Reads a glTF file. Answers whether it was taken; panics where a scene or an error breaks its
/// promises.
pub fn try_gltf(input: &[u8]) -> bool {
    let Some((&choice, file)) = input.split_first() else { return false };
    let mut settings = SceneSettings::default();
    settings.strict = choice & 1 != 0;
    settings.facets = choice & 2 != 0;
    settings.texture_coordinates = choice & 4 != 0;
    if choice & 8 != 0 {
        settings.lamp_units = LampUnits::Watts;
    }
    match settings.read("it.glb", &binary(file), &[]) {
        Ok(scene) => {
            // An instance takes a byte of the file at least, and has all triangles of its mesh.
            let count = scene.triangles().len();
            assert!(count <= file.len().saturating_mul(file.len()));
            check_scene(&scene, usize::MAX);
            if count <= MOST_TRIANGLES {
                settle(&scene);
            }
            true
        }
        Err(e) => {
            check_error(&e);
            false
        }
    }
}

/// A binary file of a document and its buffer.
fn binary(file: &[u8]) -> Vec<u8> {
    if file.starts_with(b"glTF") {
        return file.into();
    }
    let at = file.windows(SEPARATOR.len()).position(|w| w == SEPARATOR);
    let (json, buffer) = match at {
        Some(at) => (&file[..at], &file[at + SEPARATOR.len()..]),
        None => (file, &[][..]),
    };
    let mut bytes = b"glTF".to_vec();
    let total = 12 + 8 + json.len().next_multiple_of(4) + 8 + buffer.len();
    for number in [2, total, json.len().next_multiple_of(4)] {
        bytes.extend((number as u32).to_le_bytes());
    }
    bytes.extend(b"JSON");
    bytes.extend(json);
    bytes.resize(bytes.len().next_multiple_of(4), b' ');
    bytes.extend((buffer.len() as u32).to_le_bytes());
    bytes.extend(b"BIN\0");
    bytes.extend(buffer);
    bytes
}
