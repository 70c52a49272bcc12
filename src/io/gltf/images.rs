//! Images of a glTF scene as textures: colours, with what metal takes of them, and masks.

use std::sync::Arc;

use rustc_hash::FxHashMap;

use super::super::textures::Unread;
#[cfg(feature = "textures")]
use super::super::{specular::diffuse_share_of_metal, textures::Decoder};
use super::container::Buffers;
use super::document::Document;
#[cfg(feature = "textures")]
use crate::error::quoted;
#[cfg(feature = "textures")]
use crate::scene::WarningKind;
use crate::scene::texture::Texture;

/// Image of the colours, and of metallic and roughness with their factors, each if there is one.
type Colours = (Option<usize>, Option<Metal>);

/// The same, with the bits of the factors.
type ColourKey = (Option<usize>, Option<(usize, u64, u64)>);

/// An image of metallic (blue) and roughness (green), each by a factor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Metal {
    pub texture: usize,
    pub metallic: f64,
    pub roughness: f64,
}

/// What is solid of an image by its alpha channel.
#[derive(Clone, Debug)]
pub(super) enum Coverage {
    /// All of it.
    Solid,
    /// White parts are, black ones are holes.
    Mask(Arc<Texture>),
    /// Nothing; the mean of alpha, in [0, 1].
    Nothing(f64),
}

/// Textures of a document, each made once.
pub(super) struct Images<'a, 'b> {
    document: &'a Document,
    #[cfg_attr(not(feature = "textures"), allow(dead_code, reason = "no image is read"))]
    buffers: &'a Buffers<'b>,
    colours: FxHashMap<ColourKey, Result<Arc<Texture>, Unread>>,
    masks: FxHashMap<(usize, u64), Result<Coverage, Unread>>,
    #[cfg(feature = "textures")]
    decoder: Decoder,
    /// The image that was decoded last, by its number.
    #[cfg(feature = "textures")]
    last: Option<(usize, image::RgbaImage)>,
    /// Images that count in the limit.
    #[cfg(feature = "textures")]
    decoded: rustc_hash::FxHashSet<usize>,
}

impl<'a, 'b> Images<'a, 'b> {
    pub fn new(document: &'a Document, buffers: &'a Buffers<'b>) -> Images<'a, 'b> {
        let (colours, masks) = Default::default();
        Images {
            document,
            buffers,
            colours,
            masks,
            #[cfg(feature = "textures")]
            decoder: Decoder::default(),
            #[cfg(feature = "textures")]
            last: None,
            #[cfg(feature = "textures")]
            decoded: Default::default(),
        }
    }

    /// Texture `colour` times the share that its metal reflects diffusely; white where there is
    /// no texture.
    pub fn colours(
        &mut self,
        colour: Option<usize>,
        metal: Option<Metal>,
    ) -> Result<Arc<Texture>, Unread> {
        let bits = |m: Metal| (m.texture, m.metallic.to_bits(), m.roughness.to_bits());
        let key = (colour, metal.map(bits));
        if let Some(known) = self.colours.get(&key) {
            return known.clone();
        }
        let texture = self.make_colours((colour, metal)).map(Arc::new);
        self.colours.insert(key, texture.clone());
        texture
    }

    /// What is solid of texture `texture`: where alpha times `factor` is `cutoff` or more.
    pub fn coverage(
        &mut self,
        texture: usize,
        factor: f64,
        cutoff: f64,
    ) -> Result<Coverage, Unread> {
        let least = cutoff / factor * 255.0;
        let key = (texture, least.to_bits());
        if let Some(known) = self.masks.get(&key) {
            return known.clone();
        }
        let coverage = self.make_coverage(texture, factor, least);
        self.masks.insert(key, coverage.clone());
        coverage
    }

    /// Number of the image of a texture, in a format that is read.
    fn source(&self, texture: usize) -> Option<usize> {
        let texture = self.document.textures.get(texture)?.as_ref()?;
        let in_other = |name: &str| texture.extensions.get(name)?.get("source")?.as_u64();
        let webp = in_other("EXT_texture_webp").map(|source| source as usize);
        texture.source.or(webp)
    }
}

#[cfg(not(feature = "textures"))]
impl Images<'_, '_> {
    fn make_colours(&mut self, (colour, _): Colours) -> Result<Texture, Unread> {
        let _ = colour.and_then(|texture| self.source(texture));
        Err(without_feature())
    }

    fn make_coverage(&mut self, _: usize, _: f64, _: f64) -> Result<Coverage, Unread> {
        Err(without_feature())
    }

    /// Means of metallic and roughness over an image.
    pub fn mean_metal(&mut self, _: usize) -> Result<[f64; 2], Unread> {
        Err(without_feature())
    }
}

#[cfg(not(feature = "textures"))]
fn without_feature() -> Unread {
    Unread::unreadable("this program was built without the feature `textures`")
}

#[cfg(feature = "textures")]
impl Images<'_, '_> {
    /// The texels of a texture.
    fn decode(&mut self, texture: usize) -> Result<&image::RgbaImage, Unread> {
        let missing =
            |reason: String| Unread { kind: WarningKind::MissingTexture, reason: Some(reason) };
        let source = self.source(texture).ok_or_else(|| {
            let about = self.document.textures.get(texture).and_then(Option::as_ref);
            let extension = about.and_then(|texture| texture.extensions.keys().next());
            match extension {
                Some(name) if name == "KHR_texture_basisu" => missing(format!(
                    "{name} (KTX2) alone; npx @gltf-transform/cli ktxdecompress IN OUT makes PNG"
                )),
                Some(name) => missing(format!("{} alone", quoted(&[name]))),
                None => missing("a texture without an image".into()),
            }
        })?;
        let image = self.document.images.get(source).and_then(Option::as_ref);
        let image = image.ok_or_else(|| missing(format!("no image {source}")))?;
        if self.last.as_ref().is_none_or(|(number, _)| *number != source) {
            let bytes = self.buffers.image(image).map_err(|fault| missing(fault.found))?;
            let name = image.uri.as_deref().filter(|uri| !uri.starts_with("data:")).unwrap_or("");
            let is_again = !self.decoded.insert(source);
            let decoded = self.decoder.decode(bytes, name)?.into_rgba8();
            if is_again {
                self.decoder.give_back(decoded.width(), decoded.height());
            }
            self.last = Some((source, decoded));
        }
        Ok(&self.last.as_ref().ok_or_else(|| missing("no texels".into()))?.1)
    }

    fn make_colours(&mut self, (colour, metal): Colours) -> Result<Texture, Unread> {
        let plain = |image: &image::RgbaImage| -> Vec<[u8; 3]> {
            image.pixels().map(|p| [p[0], p[1], p[2]]).collect()
        };
        let colours = match colour {
            Some(texture) => {
                let image = self.decode(texture)?;
                Some((image.dimensions(), plain(image)))
            }
            None => None,
        };
        let Some(metal) = metal else {
            let ((width, height), texels) = colours.unwrap_or(((1, 1), vec![[255; 3]]));
            return Texture::new(width, height, texels)
                .ok_or_else(|| Unread::unreadable("no texels"));
        };
        let image = self.decode(metal.texture)?;
        let (width, height) = colours.as_ref().map_or(image.dimensions(), |(size, _)| *size);
        // Shares that are reflected, by roughness.
        let shares: Vec<f64> = (0..256u16)
            .map(|byte| diffuse_share_of_metal(metal.roughness * f64::from(byte) / 255.0))
            .collect();
        let texel = |x: u32, y: u32| {
            let across = |k: u32, from: u32, to: u32| {
                (u64::from(2 * k + 1) * u64::from(to) / (2 * u64::from(from))) as u32
            };
            let pixel =
                image.get_pixel(across(x, width, image.width()), across(y, height, image.height()));
            let metallic = (metal.metallic * f64::from(pixel[2]) / 255.0).clamp(0.0, 1.0);
            let share = 1.0 - metallic + metallic * shares[pixel[1] as usize];
            let at = (y * width + x) as usize;
            let colour = colours.as_ref().map_or([255; 3], |(_, texels)| texels[at]);
            colour.map(|byte| scaled_srgb(byte, share))
        };
        let texels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let texels = texels.map(|(x, y)| texel(x, y)).collect();
        Texture::new(width, height, texels).ok_or_else(|| Unread::unreadable("no texels"))
    }

    fn make_coverage(
        &mut self,
        texture: usize,
        factor: f64,
        least: f64,
    ) -> Result<Coverage, Unread> {
        let image = self.decode(texture)?;
        let is_solid = |pixel: &image::Rgba<u8>| f64::from(pixel[3]) >= least;
        if image.pixels().all(is_solid) {
            return Ok(Coverage::Solid);
        }
        if !image.pixels().any(is_solid) {
            let sum: f64 = image.pixels().map(|pixel| f64::from(pixel[3])).sum();
            let mean = factor * sum / 255.0 / image.pixels().len() as f64;
            return Ok(Coverage::Nothing(mean.clamp(0.0, 1.0)));
        }
        let (width, height) = image.dimensions();
        let white = image.pixels().map(|p| if is_solid(p) { [255; 3] } else { [0; 3] });
        let mask = Texture::new(width, height, white.collect());
        mask.map(|mask| Coverage::Mask(mask.into())).ok_or_else(|| Unread::unreadable("no texels"))
    }

    /// Means of metallic and roughness over an image.
    pub fn mean_metal(&mut self, texture: usize) -> Result<[f64; 2], Unread> {
        let image = self.decode(texture)?;
        let mean = |channel: usize| {
            let sum: f64 = image.pixels().map(|pixel| f64::from(pixel[channel])).sum();
            sum / 255.0 / image.pixels().len() as f64
        };
        Ok([mean(2), mean(1)])
    }
}

/// The byte of sRGB nearest to `share` of the light of another.
#[cfg(feature = "textures")]
fn scaled_srgb(byte: u8, share: f64) -> u8 {
    if share >= 1.0 {
        return byte;
    }
    let light = share * crate::scene::texture::linear_of_srgb(byte);
    let code = if light <= 0.0031308 {
        12.92 * light
    } else {
        1.055 * libm::pow(light, 1.0 / 2.4) - 0.055
    };
    (255.0 * code).round() as u8
}
