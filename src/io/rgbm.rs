//! Light maps as PNG images of 8 bits with a common factor in alpha (RGBM).
//!
//! A texel stands for range · (alpha · colour)², channel by channel, with alpha and colour in [0,
//! 1]: the square spends the 8 bits on dark texels as sRGB does. Alpha is the smallest of 255 steps
//! with which the brightest channel can be represented, so that a channel is off by half a step of
//! colour, squared: 0.4 % of the brightest one.

use super::Output;
use crate::error::Error;
use crate::light_map::{LightMap, MapPage};
use crate::scene::Rgb;

/// The irradiance that alpha and colour of 1 stand for in [`write_light_map_rgbm`], W/m²: the
/// largest of the map in any channel, so that all its pages have one; 1 where it is black.
pub fn rgbm_range(map: &LightMap) -> f64 {
    let largest = map.irradiance.iter().map(|e| e.max_element()).fold(0.0, f64::max);
    if largest > 0.0 { largest } else { 1.0 }
}

/// Writes the irradiance of a light map or a page of it as PNG: range · (alpha · colour)², W/m² per
/// channel, with the `range` of [`rgbm_range`]. A black texel has alpha 0.
///
/// # Errors
/// [`crate::ErrorKind::File`] when the file cannot be written.
pub fn write_light_map_rgbm<'a, 'o>(
    out: impl Into<Output<'o>>,
    map: impl Into<MapPage<'a>>,
    range: f64,
) -> Result<(), Error> {
    let (page, out) = (map.into(), out.into());
    let texels = page.of(&page.map.irradiance);
    let bytes: Vec<u8> = texels.into_iter().flat_map(|e| encoded(e, range)).collect();
    let [width, height] = page.size();
    let mut png = std::io::Cursor::new(vec![]);
    let (colours, format) = (image::ExtendedColorType::Rgba8, image::ImageFormat::Png);
    image::write_buffer_with_format(&mut png, &bytes, width, height, colours, format)
        .map_err(|e| out.cannot_write(e))?;
    out.write_bytes(png.get_ref())
}

/// Colour and alpha of a texel.
fn encoded(irradiance: Rgb, range: f64) -> [u8; 4] {
    let root = (irradiance.max(Rgb::ZERO) / range).map(f64::sqrt).min(Rgb::ONE);
    let alpha = (255.0 * root.max_element()).ceil();
    if alpha == 0.0 {
        return [0; 4];
    }
    let colour = (255.0 * root * (255.0 / alpha)).round();
    [colour.x as u8, colour.y as u8, colour.z as u8, alpha as u8]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texels_are_off_by_no_more_than_half_a_step_of_colour() {
        let range = 40.0;
        for k in 0..2000 {
            let brightness = range * (-f64::from(k) / 300.0).exp();
            let share = [k * 37 % 101, k * 53 % 101, 100].map(|x| f64::from(x) / 100.0);
            let irradiance = Rgb::from_array(share) * brightness;
            let [r, g, b, alpha] = encoded(irradiance, range).map(|x| f64::from(x) / 255.0);
            let decoded = range * (alpha * Rgb::new(r, g, b)).powf(2.0);
            // d(root) is half a step of colour times alpha, and root of the brightest channel is
            // above the alpha of a step less: off by (1 + d)² − 1 with d = 0.5/255 · a/(a − 1/255).
            let a = alpha.max(2.0 / 255.0);
            let d = 0.5 / 255.0 * a / (a - 1.0 / 255.0);
            let off = (decoded - irradiance).abs().max_element() / brightness;
            assert!(off <= 2.0 * d + d * d + 1e-12, "{k}: {off}");
        }
        assert_eq!(encoded(Rgb::ZERO, range), [0; 4]);
        assert_eq!(encoded(Rgb::splat(range), range), [255; 4]);
    }
}
