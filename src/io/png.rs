//! PNG output: tone-mapped colours for viewing.

use super::Output;
use crate::camera::RadianceImage;
use crate::error::Error;
use crate::io::tone::ToneCurve;

/// Writes the image through a tone curve that fits it as 8-bit sRGB PNG.
///
/// # Errors
/// [`crate::ErrorKind::File`] when the file cannot be written.
pub fn write_png<'o>(out: impl Into<Output<'o>>, image: &RadianceImage) -> Result<(), Error> {
    write_png_with_tone(out, image, &ToneCurve::fit_image(image))
}

/// [`write_png`] with a tone curve of radiance, such as that of another image.
///
/// # Errors
/// Those of [`write_png`].
pub fn write_png_with_tone<'o>(
    out: impl Into<Output<'o>>,
    image: &RadianceImage,
    tone: &ToneCurve,
) -> Result<(), Error> {
    let out = out.into();
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
    .map_err(|e| out.cannot_write(e))?;
    out.write_bytes(png.get_ref())
}
