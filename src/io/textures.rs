//! Textures that materials name: `map_Kd` and `map_Ke` with their options, and the images.
//!
//! Images are PNG, JPEG, BMP or TGA, all of which hold sRGB. They are looked for as libraries are
//! ([`super::files`]). What an image claims to be is checked before memory is taken for it.

use std::collections::HashMap;
use std::sync::Arc;

use glam::DVec2;

use super::files::FileSource;
use super::text::finite;
use crate::scene::texture::Texture;

/// Texels that all images of a scene may have together: each takes up to 15 bytes while it is
/// read, and 7 from then on. Chosen by hand.
#[cfg(feature = "textures")]
const MAX_TEXELS: u64 = 1 << 27;

/// Bytes that the file of an image may have. Chosen by hand.
#[cfg(feature = "textures")]
const MAX_IMAGE_BYTES: u64 = 1 << 28;

/// Texels that an image may have along a side. Chosen by hand.
#[cfg(feature = "textures")]
const MAX_SIDE: u32 = 1 << 15;

/// `map_Kd` or `map_Ke`.
#[derive(Debug, PartialEq)]
pub(super) struct TextureStatement {
    pub name: String,
    pub scale: DVec2,
    pub offset: DVec2,
    pub clamped: bool,
    /// Whether there are options that are not used.
    pub more: bool,
}

impl TextureStatement {
    /// `[-s u [v [w]]] [-o u [v [w]]] [-clamp on] NAME`; other options are skipped with their
    /// values. The name may have spaces.
    pub fn parse(text: &str) -> TextureStatement {
        let mut rest = text.trim();
        let (mut scale, mut offset) = (DVec2::ONE, DVec2::ZERO);
        let (mut clamped, mut more) = (false, false);
        let take = |rest: &mut &str| {
            let (word, after) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
            *rest = after.trim_start();
            word.to_string()
        };
        while let Some(option) = rest.split_whitespace().next().filter(|w| w.starts_with('-')) {
            let option = option.to_ascii_lowercase();
            let words = match option.as_str() {
                "-o" | "-s" | "-t" => 3,
                "-mm" => 2,
                "-blendu" | "-blendv" | "-boost" | "-texres" | "-clamp" | "-bm" | "-imfchan"
                | "-type" | "-cc" | "-colorspace" => 1,
                _ => break,
            };
            take(&mut rest);
            let numbers = words == 3;
            let mut values = vec![];
            while values.len() < words {
                let next = rest.split_whitespace().next();
                if next.is_none_or(|word| numbers && finite(word).is_none()) {
                    break;
                }
                values.push(take(&mut rest));
            }
            let number = |k: usize| values.get(k).and_then(|word| finite(word));
            match option.as_str() {
                "-o" => offset = DVec2::new(number(0).unwrap_or(0.0), number(1).unwrap_or(0.0)),
                "-s" => scale = DVec2::new(number(0).unwrap_or(1.0), number(1).unwrap_or(1.0)),
                "-clamp" => clamped = values.first().is_some_and(|v| v.eq_ignore_ascii_case("on")),
                _ => more = true,
            }
        }
        TextureStatement { name: rest.trim_matches('"').into(), scale, offset, clamped, more }
    }
}

/// Images by name, each read once.
pub(super) struct Textures<'a> {
    files: &'a FileSource<'a>,
    known: HashMap<String, Option<Arc<Texture>>>,
    /// Texels of all images so far.
    #[cfg(feature = "textures")]
    texels: u64,
}

impl<'a> Textures<'a> {
    pub fn new(files: &'a FileSource<'a>) -> Textures<'a> {
        Textures {
            files,
            known: HashMap::new(),
            #[cfg(feature = "textures")]
            texels: 0,
        }
    }

    /// The image `name`, if it is there and can be read.
    pub fn get(&mut self, name: &str) -> Option<Arc<Texture>> {
        let found = self.files.find(name)?;
        if let Some(known) = self.known.get(&found) {
            return known.clone();
        }
        let texture = self.read(&found).map(Arc::new);
        self.known.insert(found, texture.clone());
        texture
    }

    #[cfg(feature = "textures")]
    fn read(&mut self, found: &str) -> Option<Texture> {
        let bytes = self.files.read(found, MAX_IMAGE_BYTES).ok()?;
        let mut reader = image::ImageReader::new(std::io::Cursor::new(bytes));
        if let Ok(format) = image::ImageFormat::from_path(found) {
            reader.set_format(format);
        }
        // Some are called .png and are none; TGA cannot be told by its content.
        let mut reader = reader.with_guessed_format().ok()?;
        let mut limits = image::Limits::default();
        limits.max_image_width = Some(MAX_SIDE);
        limits.max_image_height = Some(MAX_SIDE);
        limits.max_alloc = Some(8 * (MAX_TEXELS - self.texels));
        reader.limits(limits);
        let image = reader.decode().ok()?.into_rgb8();
        let (width, height) = image.dimensions();
        let texels = u64::from(width) * u64::from(height);
        if self.texels + texels > MAX_TEXELS {
            return None;
        }
        self.texels += texels;
        let texels = image.into_raw().chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
        Texture::new(width, height, texels)
    }

    #[cfg(not(feature = "textures"))]
    fn read(&mut self, _: &str) -> Option<Texture> {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statements_have_options_before_the_name() {
        let parsed = TextureStatement::parse;
        let plain = |name: &str| TextureStatement {
            name: name.into(),
            scale: DVec2::ONE,
            offset: DVec2::ZERO,
            clamped: false,
            more: false,
        };
        assert_eq!(parsed("old wood 2.png "), plain("old wood 2.png"));
        assert_eq!(parsed("\"old wood.png\""), plain("old wood.png"));
        assert_eq!(parsed("-wood-.png"), plain("-wood-.png"));
        let (scale, offset) = (DVec2::new(2.0, 3.0), DVec2::new(0.5, 0.0));
        let wanted = TextureStatement { scale, offset, clamped: true, ..plain("a b.png") };
        assert_eq!(parsed("-s 2 3 1 -o 0.5 -clamp on a b.png"), wanted);
        let more = TextureStatement { more: true, ..plain("a.png") };
        for text in
            ["-bm 1 a.png", "-mm 0 1 a.png", "-t 1 2 3 -blendu on a.png", "-imfchan l a.png"]
        {
            assert_eq!(parsed(text), more, "{text}");
        }
        assert_eq!(parsed("-s"), plain(""));
        assert_eq!(parsed(""), plain(""));
    }
}
