//! Textures that materials name: `map_Kd`, `map_Ke` and `map_d` with their options, and the images.
//!
//! Images are PNG, JPEG, BMP, TGA or WebP, all of which hold sRGB. They are searched like libraries
//! ([`super::files`]). The declared size of an image is checked before memory is allocated for it.

use std::collections::HashMap;
#[cfg(feature = "textures")]
use std::io;
use std::sync::Arc;

use glam::DVec2;

use super::files::FileSource;
use super::text::finite;
#[cfg(feature = "textures")]
use crate::error::shortened;
use crate::scene::WarningKind;
use crate::scene::texture::Texture;

/// Maximum number of texels of all images of a scene together: each takes up to 15 bytes while it
/// is read, and 7 from then on. Plain choice.
#[cfg(feature = "textures")]
const MAX_TEXELS: u64 = 1 << 27;

/// Maximum number of texels along a side of an image. Plain choice.
#[cfg(feature = "textures")]
const MAX_SIDE: u32 = 1 << 15;

/// `map_Kd`, `map_Ke` or `map_d`.
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

/// A mask, if it has a hole.
pub(super) type ReadMask = Result<Option<Arc<Texture>>, Unread>;

/// Images by name, each read once.
pub(super) struct Textures<'a> {
    files: &'a FileSource<'a>,
    known: HashMap<String, Result<Arc<Texture>, Unread>>,
    /// Masks by name, and whether it is also the image of the material's colours: see
    /// [`super::masks`].
    pub(super) masks: HashMap<(String, bool), ReadMask>,
    #[cfg(feature = "textures")]
    decoder: Decoder,
}

/// Reads images, up to a number of texels in all.
#[cfg(feature = "textures")]
pub(super) struct Decoder {
    /// Remaining number of texels.
    texels_left: u64,
}

#[cfg(feature = "textures")]
impl Default for Decoder {
    fn default() -> Decoder {
        Decoder { texels_left: MAX_TEXELS }
    }
}

/// Why an image is not used: the kind, and a reason for kinds that have several.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Unread {
    pub kind: WarningKind,
    pub reason: Option<String>,
}

impl<'a> Textures<'a> {
    pub fn new(files: &'a FileSource<'a>) -> Textures<'a> {
        Textures {
            files,
            known: HashMap::new(),
            masks: HashMap::new(),
            #[cfg(feature = "textures")]
            decoder: Decoder::default(),
        }
    }

    /// Path of the image `name`.
    pub(super) fn find(&self, name: &str) -> Result<String, Unread> {
        let missing = Unread { kind: WarningKind::MissingTexture, reason: None };
        self.files.find(name).ok_or(missing)
    }

    /// The image `name`, if it exists and is readable.
    pub fn get(&mut self, name: &str) -> Result<Arc<Texture>, Unread> {
        let found = self.find(name)?;
        if let Some(known) = self.known.get(&found) {
            return known.clone();
        }
        let texture = self.read(&found).map(Arc::new);
        self.known.insert(found, texture.clone());
        texture
    }

    #[cfg(feature = "textures")]
    fn read(&mut self, found: &str) -> Result<Texture, Unread> {
        let image = self.decode(found)?;
        let (width, height) = (image.width(), image.height());
        let texels = image.into_rgb8().into_raw().as_chunks().0.to_vec();
        Texture::new(width, height, texels).ok_or_else(|| Unread::unreadable("no texels"))
    }

    /// The image at this path, if within the limits.
    #[cfg(feature = "textures")]
    pub(super) fn decode(&mut self, found: &str) -> Result<image::DynamicImage, Unread> {
        let bytes = self.files.read(found, 1 << 28).map_err(|e| match e.kind() {
            io::ErrorKind::FileTooLarge => Unread::large(e),
            _ => Unread::unreadable(e),
        })?;
        self.decoder.decode(bytes, found)
    }

    #[cfg(not(feature = "textures"))]
    pub(super) fn read(&mut self, _: &str) -> Result<Texture, Unread> {
        Err(Unread::unreadable("this program was built without the feature `textures`"))
    }
}

#[cfg(feature = "textures")]
impl Decoder {
    /// The image of the file `name` with this content, if within the limits.
    pub fn decode(&mut self, bytes: Vec<u8>, name: &str) -> Result<image::DynamicImage, Unread> {
        let length = bytes.len() as u64;
        let mut reader = image::ImageReader::new(io::Cursor::new(bytes));
        if let Ok(format) = image::ImageFormat::from_path(name) {
            reader.set_format(format);
        }
        // Some files named .png have another format; TGA has no signature.
        let mut reader = reader.with_guessed_format().map_err(Unread::unreadable)?;
        let format = reader.format();
        let mut limits = image::Limits::default();
        // Unpacked colour profiles and texts, which are read before the size is known.
        limits.max_alloc = Some(1 << 24);
        reader.limits(limits);
        let decoder = reader.into_decoder().map_err(Unread::undecoded)?;
        let (width, height) = image::ImageDecoder::dimensions(&decoder);
        // Maximum number of texels per byte. Deflate expands a byte to at most 1032 (258 from two
        // bits: RFC 1951, 3.2.5), of eight texels each. JPEG has at least a bit for each 8 × 8
        // texels (ITU-T T.81, F and G), BMP and TGA have two bytes for each run of up to 255 and
        // 128. So a file of a hundred bytes cannot pass as a truncated one of 10 000 × 10 000
        // texels. WebP codes an image of one colour without a bit for each texel (RFC 9649, 5.2):
        // plain choice.
        let texels_a_byte = match format {
            Some(image::ImageFormat::Png) => 8 * 1032,
            Some(image::ImageFormat::WebP) => 1 << 17,
            _ => 512,
        };
        self.check(width, height, length * texels_a_byte)?;
        let image = image::DynamicImage::from_decoder(decoder).map_err(Unread::undecoded)?;
        self.texels_left -= u64::from(width) * u64::from(height);
        Ok(image)
    }

    /// Leaves the texels of an image out of the limit, as it counts already.
    #[cfg(feature = "glb")]
    pub fn give_back(&mut self, width: u32, height: u32) {
        self.texels_left += u64::from(width) * u64::from(height);
    }

    /// Checks the size of an image whose file has bytes for at most `most` texels.
    fn check(&self, width: u32, height: u32, most: u64) -> Result<(), Unread> {
        let texels = u64::from(width) * u64::from(height);
        if width.max(height) > MAX_SIDE {
            let found = format!("{width} × {height} texels, and {MAX_SIDE} a side is the limit");
            return Err(Unread::large(found));
        }
        if texels > self.texels_left {
            return Err(Unread::large(format!(
                "{width} × {height} texels, and {MAX_TEXELS} of all images is the limit"
            )));
        }
        if texels > most {
            return Err(Unread::unreadable(format!(
                "its file is too short for the {width} × {height} texels that it claims"
            )));
        }
        Ok(())
    }
}

impl Unread {
    /// Its reason, and the treatment `done`.
    pub fn and_so(&self, done: &str) -> String {
        self.reason.as_ref().map_or(done.into(), |reason| format!("{reason}; {done}"))
    }

    #[cfg(feature = "textures")]
    fn large(reason: impl std::fmt::Display) -> Unread {
        Unread { kind: WarningKind::LargeTexture, reason: Some(reason.to_string()) }
    }

    pub(super) fn unreadable(reason: impl std::fmt::Display) -> Unread {
        Unread { kind: WarningKind::UnreadableTexture, reason: Some(reason.to_string()) }
    }

    #[cfg(feature = "textures")]
    fn undecoded(e: image::ImageError) -> Unread {
        match e {
            image::ImageError::Limits(e) => Unread::large(e),
            e => Unread::unreadable(shortened(&e.to_string()).escape_debug()),
        }
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

    /// A grey TGA image of this size.
    #[cfg(feature = "textures")]
    fn tga(width: u8, height: u8) -> Vec<u8> {
        let header = [0, 0, 3, 0, 0, 0, 0, 0, 0, 0, 0, 0, width, 0, height, 0, 8, 0];
        [&header[..], &vec![200; usize::from(width) * usize::from(height)]].concat()
    }

    #[cfg(feature = "textures")]
    #[test]
    fn images_beyond_the_texels_of_a_scene_are_not_read() {
        let (large, small) = (tga(9, 9), tga(3, 3));
        let files: [(&str, &[u8]); 3] = [("a.tga", &large), ("b.tga", &large), ("c.tga", &small)];
        let files = FileSource::in_memory(&files);
        let mut textures =
            Textures { decoder: Decoder { texels_left: 100 }, ..Textures::new(&files) };
        let mut size = |name| textures.get(name).map(|texture| texture.size());
        assert_eq!(size("a.tga"), Ok([9, 9]));
        let unread = size("b.tga").unwrap_err();
        assert_eq!(unread.kind, WarningKind::LargeTexture);
        let reason = unread.reason.clone().unwrap();
        assert!(reason.starts_with("9 × 9 texels") && reason.contains("134217728"), "{reason}");
        // Images that still fit are read, and each counts once.
        assert_eq!(size("c.tga"), Ok([3, 3]));
        assert_eq!(
            [size("b.tga"), size("a.tga"), size("c.tga")],
            [Err(unread), Ok([9, 9]), Ok([3, 3])]
        );
        assert_eq!(textures.decoder.texels_left, 100 - 81 - 9);
    }
}
