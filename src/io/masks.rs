//! Masks of materials (`map_d`): solid texels and holes of an image.
//!
//! The alpha channel is used unless it is constant, else the luminance of the colours: solid from
//! one half on. Exporters name the image of the colours as a mask if its alpha channel is meant. If
//! it has none, dark colours are not holes, and the image is solid.

use std::sync::Arc;

use super::textures::{ReadMask, Textures, Unread};
use crate::scene::texture::Texture;

impl Textures<'_> {
    /// The mask in the image `name`, white where it is solid and black elsewhere, if it can be
    /// read; none without a hole. `colours` is the image of the material's colours.
    pub fn mask(&mut self, name: &str, colours: Option<&str>) -> ReadMask {
        let found = self.find(name)?;
        let of_colours = colours.is_some_and(|colours| self.find(colours).as_ref() == Ok(&found));
        let key = (found, of_colours);
        if let Some(known) = self.masks.get(&key) {
            return known.clone();
        }
        let mask = self.read_mask(&key.0, of_colours).map(|mask| mask.map(Arc::new));
        self.masks.insert(key, mask.clone());
        mask
    }

    #[cfg(feature = "textures")]
    fn read_mask(&mut self, found: &str, of_colours: bool) -> Result<Option<Texture>, Unread> {
        let image = self.decode(found)?.into_luma_alpha8();
        let [width, height] = [image.width(), image.height()];
        let texels = image.into_raw().as_chunks().0.to_vec();
        let has_alpha = texels.iter().any(|[_, alpha]| *alpha != texels[0][1]);
        let is_solid = |&[luminance, alpha]: &[u8; 2]| match (has_alpha, of_colours) {
            // Solid from a half on.
            (true, _) => alpha >= 128,
            (false, true) => true,
            (false, false) => luminance >= 128,
        };
        if texels.iter().all(is_solid) {
            return Ok(None);
        }
        let white = texels.iter().map(|texel| if is_solid(texel) { [255; 3] } else { [0; 3] });
        let mask = Texture::new(width, height, white.collect());
        mask.map(Some).ok_or_else(|| Unread::unreadable("no texels"))
    }

    #[cfg(not(feature = "textures"))]
    fn read_mask(&mut self, found: &str, _: bool) -> Result<Option<Texture>, Unread> {
        self.read(found).map(Some)
    }
}
