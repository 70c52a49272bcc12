//! Materials of a glTF file: the light is their colour.

use std::collections::BTreeMap;

use gltf_json::material::{
    AlphaCutoff, AlphaMode, PbrBaseColorFactor, PbrMetallicRoughness, StrengthFactor,
};
use gltf_json::texture::Info;
use gltf_json::validation::Checked::Valid;
use gltf_json::{Index, Material, Texture, Value};

use super::file::notes_of;
use crate::scene::{self, Rgb};

/// How the faces of a primitive are shown.
#[derive(Clone, Copy, Default)]
pub(super) struct Look {
    /// The texture that is multiplied with the colours of vertices, and its set of coordinates.
    pub texture: Option<(Index<Texture>, u32)>,
    /// Whether that has holes in its alpha channel.
    pub has_mask: bool,
    /// Whether both sides are seen.
    pub is_double_sided: bool,
}

/// A material of the scene as an unlit one: white, times texture and colours of vertices. Clear
/// panes are transparent.
pub(super) fn unlit(material: &scene::Material, look: Look) -> Material {
    let channels = |c: Rgb| Value::from(c.to_array().to_vec());
    let notes = BTreeMap::from([
        ("reflectance", channels(material.reflectance)),
        ("exitance", channels(material.exitance)),
    ]);
    let passed = material.clear_transmittance().map(|share| share.element_sum() / 3.0);
    let alpha_mode = match (passed, look.has_mask) {
        (Some(_), _) => AlphaMode::Blend,
        (None, true) => AlphaMode::Mask,
        (None, false) => AlphaMode::Opaque,
    };
    let alpha = 1.0 - passed.unwrap_or(0.0) as f32;
    let texture = look.texture.map(|(index, tex_coord)| Info {
        index,
        tex_coord,
        extensions: None,
        extras: None,
    });
    let unlit = gltf_json::extensions::material::Unlit {};
    Material {
        name: Some(material.name.clone()),
        pbr_metallic_roughness: PbrMetallicRoughness {
            base_color_factor: PbrBaseColorFactor([1.0, 1.0, 1.0, alpha]),
            base_color_texture: texture,
            metallic_factor: StrengthFactor(0.0),
            ..Default::default()
        },
        alpha_mode: Valid(alpha_mode),
        alpha_cutoff: (alpha_mode == AlphaMode::Mask).then_some(AlphaCutoff(0.5)),
        double_sided: look.is_double_sided,
        extensions: Some(gltf_json::extensions::material::Material { unlit: Some(unlit) }),
        extras: notes_of(&notes),
        ..Default::default()
    }
}
