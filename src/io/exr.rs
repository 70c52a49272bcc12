//! OpenEXR out: linear radiance, one 32-bit float a channel.

use std::path::Path;

use exr::prelude::WritableImage;

use super::{cannot_write, write_file};
use crate::camera::RadianceImage;
use crate::error::{Error, ErrorKind};
use crate::scene::Rgb;

/// Writes linear radiance, W/(m² sr), as a 32-bit float OpenEXR with channels R, G, B.
///
/// # Errors
/// [`crate::ErrorKind::File`] when the file cannot be written, or does not hold a radiance: above
/// 3.4e38. What is below 1e-38 becomes 0, or keeps few digits.
pub fn write_exr(path: impl AsRef<Path>, image: &RadianceImage) -> Result<(), Error> {
    let (width, height) = (image.width as usize, image.height as usize);
    let fits = |c: &Rgb| c.abs().max_element() <= f64::from(f32::MAX);
    if let Some(k) = image.pixels.iter().position(|c| !fits(c)) {
        let place = format!("{}: pixel {}, {}", path.as_ref().display(), k % width, k / width);
        let found = format!("radiance {} W/(m² sr)", image.pixels[k]);
        let remedy = "OpenEXR holds up to 3.4e38 a channel: scale exitances down";
        return Err(Error::new(ErrorKind::File, place, found, remedy));
    }
    let pixel = |at: exr::math::Vec2<usize>| {
        let [r, g, b] = image.pixels[at.y() * width + at.x()].as_vec3().to_array();
        (r, g, b)
    };
    let channels = exr::image::SpecificChannels::rgb(pixel);
    let encoded = exr::image::Image::from_encoded_channels(
        (width, height),
        exr::image::Encoding::FAST_LOSSLESS,
        channels,
    );
    let mut bytes = std::io::Cursor::new(vec![]);
    encoded.write().to_buffered(&mut bytes).map_err(|e| cannot_write(path.as_ref(), e))?;
    write_file(path.as_ref(), |out| std::io::Write::write_all(out, bytes.get_ref()))
}
