//! The images of a glTF file: the texture that a material is shown with, as PNG.
//!
//! A viewer multiplies the image with `COLOR_0`. So that the product is the colour of the light
//! around a vertex where the image has its mean, `COLOR_0` is that colour divided by the mean.

use std::sync::Arc;

use glam::DVec2;
use image::ExtendedColorType::Rgb8;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ImageEncoder, ImageResult};

use super::primitives::Primitive;
use crate::scene::texture::{MaterialTextures, Texture, TextureMap};
use crate::scene::{Material, Rgb};

/// The image that a surface is shown with: of the light that it emits, else of what it reflects.
pub(super) fn shown(textures: &MaterialTextures) -> Option<&TextureMap> {
    textures.exitance.as_ref().or(textures.reflectance.as_ref())
}

/// Texture coordinates of `map`'s image, v downwards as in glTF, at `place` of the scene's file.
pub(super) fn image_place(map: Option<&TextureMap>, place: DVec2) -> DVec2 {
    let place = map.map_or(place, |map| place * map.scale + map.offset);
    DVec2::new(place.x, 1.0 - place.y)
}

/// Radiosity of a surface that has the means of its material's textures everywhere, W/m².
pub(super) fn mean_radiosity(material: &Material, irradiance: Rgb) -> Rgb {
    material.exitance + material.reflectance * irradiance
}

/// What makes `colour` when it is multiplied with the mean of `map`'s image, over the triangles of
/// its material: in [0, 1], as glTF has it, so that dark images cannot be shown brighter than they
/// are.
pub(super) fn before_image(map: &TextureMap, colour: Rgb) -> Rgb {
    let mean = map.mean / map.factor;
    // Where the image, or what it is multiplied with, has nothing, any number does.
    let lit = map.mean.cmpgt(Rgb::ZERO) & map.factor.cmpgt(Rgb::ZERO);
    Rgb::select(lit, colour / mean, Rgb::ONE).min(Rgb::ONE)
}

/// The images of all primitives, each once.
#[derive(Default)]
pub(super) struct Images {
    textures: Vec<Arc<Texture>>,
    /// The same as PNG files.
    pub encoded: Vec<Vec<u8>>,
}

impl Images {
    /// # Errors
    /// When an image has more bytes than memory has room for.
    pub fn of(primitives: &[Primitive<'_>]) -> ImageResult<Images> {
        let mut images = Images::default();
        for texture in primitives.iter().filter_map(|p| Some(&p.map?.texture)) {
            if images.number(texture).is_none() {
                images.encoded.push(encoded(texture)?);
                images.textures.push(texture.clone());
            }
        }
        Ok(images)
    }

    pub fn number(&self, texture: &Arc<Texture>) -> Option<usize> {
        self.textures.iter().position(|known| Arc::ptr_eq(known, texture))
    }

    /// Bytes of all.
    pub fn length(&self) -> u64 {
        self.encoded.iter().map(|image| image.len() as u64).sum()
    }
}

fn encoded(texture: &Texture) -> ImageResult<Vec<u8>> {
    let mut bytes = vec![];
    let [width, height] = texture.size();
    let texels = texture.texels().as_flattened();
    PngEncoder::new_with_quality(&mut bytes, CompressionType::Default, FilterType::Adaptive)
        .write_image(texels, width, height, Rgb8)?;
    Ok(bytes)
}
