//! Input of radiance images: OpenEXR and Radiance's RGBE, such as environment maps.

use std::io::Cursor;
use std::path::Path;

use super::Input;
use super::files::MAX_BYTES;
use crate::error::{Error, ErrorKind};
use crate::scene::Rgb;

/// Reads a picture of linear radiance, OpenEXR (`.exr`) or Radiance (`.hdr`, `.pic`): pixels per
/// line, and all pixels line by line from the top, as in the file. Negative values become 0. For
/// [`Sky::picture`](crate::Sky::picture).
///
/// # Errors
/// [`ErrorKind::File`] when the file cannot be read, is neither, or has pixels that are not finite.
pub fn read_radiance<'i>(file: impl Into<Input<'i>>) -> Result<(u32, Vec<Rgb>), Error> {
    let file = file.into();
    let (bytes, path) = (file.read(MAX_BYTES, REMEDY)?, file.path());
    let (width, pixels) = match bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
        true => from_exr(&bytes).map_err(|e| wrong(path, e.to_string()))?,
        false => from_hdr(&bytes).map_err(|e| wrong(path, e.to_string()))?,
    };
    if let Some(k) = pixels.iter().position(|pixel| !pixel.is_finite()) {
        let (x, y) = (k % width, k / width);
        return Err(wrong(path, format!("pixel {x} of line {y} is {}", pixels[k])));
    }
    let pixels = pixels.into_iter().map(|pixel| pixel.max(Rgb::ZERO)).collect();
    Ok((width as u32, pixels))
}

const REMEDY: &str = "give a picture of finite radiance, OpenEXR with R, G and B or Radiance RGBE";

fn wrong(path: &Path, found: String) -> Error {
    Error::new(ErrorKind::File, path.display().to_string(), found, REMEDY)
}

fn from_exr(bytes: &[u8]) -> Result<(usize, Vec<Rgb>), exr::error::Error> {
    use exr::prelude::{ReadChannels, ReadLayers};
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            |size, _| (size.width(), vec![Rgb::ZERO; size.area()]),
            |(width, pixels): &mut (usize, Vec<Rgb>), at, (r, g, b): (f32, f32, f32)| {
                pixels[at.y() * *width + at.x()] = Rgb::new(r.into(), g.into(), b.into());
            },
        )
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))?;
    Ok(image.layer_data.channel_data.pixels)
}

fn from_hdr(bytes: &[u8]) -> image::ImageResult<(usize, Vec<Rgb>)> {
    let decoder = image::codecs::hdr::HdrDecoder::new(Cursor::new(bytes))?;
    let image = image::DynamicImage::from_decoder(decoder)?.into_rgb32f();
    let pixel = |p: &image::Rgb<f32>| Rgb::from_array(p.0.map(f64::from));
    Ok((image.width() as usize, image.pixels().map(pixel).collect()))
}
