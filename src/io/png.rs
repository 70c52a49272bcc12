//! PNG output: tone-mapped colours for viewing.

use std::path::Path;

use super::{cannot_write, write_file};
use crate::camera::RadianceImage;
use crate::error::Error;
use crate::io::tone::ToneCurve;

/// Writes the image through a tone curve that fits it as 8-bit sRGB PNG.
///
/// # Errors
/// [`crate::ErrorKind::File`] when the file cannot be written.
pub fn write_png(path: impl AsRef<Path>, image: &RadianceImage) -> Result<(), Error> {
    write_png_with_tone(path, image, &ToneCurve::fit_image(image))
}

/// [`write_png`] with a tone curve of radiance, such as that of another image.
///
/// # Errors
/// Those of [`write_png`].
pub fn write_png_with_tone(
    path: impl AsRef<Path>,
    image: &RadianceImage,
    tone: &ToneCurve,
) -> Result<(), Error> {
    let bytes: Vec<u8> = image.pixels.iter().flat_map(|&c| tone.display(c)).collect();
    let mut png = std::io::Cursor::new(vec![]);
    image::write_buffer_with_format(
        &mut png,
        &bytes,
        image.width,
        image.height,
        image::ExtendedColorType::Rgb8,
        image::ImageFormat::Png,
    )
    .map_err(|e| cannot_write(path.as_ref(), e))?;
    write_file(path.as_ref(), |out| std::io::Write::write_all(out, png.get_ref()))
}
