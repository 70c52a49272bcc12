//! The images of a glTF file: the look of each textured material under its light, as PNG.
//!
//! A viewer multiplies the image by `COLOR_0`, but the tone curve rolls off highlights by the
//! luminance of texture times light. So the image is the texture as the tone curve shows it under
//! one light, that of the material's median vertex, and `COLOR_0` is the ratio of the colours of
//! the texture's mean under the light at a vertex and under that light: exact for the mean and for
//! the median light, close between them.

use std::collections::BTreeMap;

use glam::DVec2;
use image::ExtendedColorType::{self, Rgb8, Rgba8};
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ImageEncoder, ImageResult};
use rayon::prelude::*;

use super::primitives::Shown;
use crate::io::tone::{ToneCurve, srgb};
use crate::scene::{Material, Rgb};

/// The images of a file, one for each textured material.
pub(super) struct Images {
    of_materials: BTreeMap<u32, Image>,
}

/// A textured material as it looks under one light.
pub(super) struct Image {
    png: Vec<u8>,
    /// Factor of the image, whose brightest channel is 1, for that look.
    peak: f64,
    /// The colour of the material's mean in that light, linear.
    mean: Rgb,
}

impl Images {
    /// The images of all materials of `surfaces`: textured ones, of some material, with the
    /// irradiances at their vertices.
    ///
    /// # Errors
    /// When one cannot be encoded.
    pub fn new<'a>(
        materials: &[Material],
        tone: &ToneCurve,
        surfaces: impl Iterator<Item = (u32, Shown<'a>, Vec<Rgb>)>,
    ) -> ImageResult<Images> {
        let mut textured: BTreeMap<u32, (Shown<'_>, Vec<Rgb>)> = BTreeMap::new();
        for (material, shown, irradiances) in surfaces {
            textured.entry(material).or_insert((shown, vec![])).1.extend(irradiances);
        }
        let image = |(number, (shown, irradiances)): (u32, (Shown<'_>, Vec<Rgb>))| {
            let material = &materials[number as usize];
            let image = Image::new(material, shown, median(irradiances, material, tone), tone)?;
            Ok((number, image))
        };
        let of_materials = textured.into_iter().map(image).collect::<ImageResult<_>>()?;
        Ok(Images { of_materials })
    }

    /// All of them as PNG, in the order of materials.
    pub fn into_files(self) -> impl Iterator<Item = Vec<u8>> {
        self.of_materials.into_values().map(|image| image.png)
    }

    pub fn get(&self, material: u32) -> Option<&Image> {
        self.of_materials.get(&material)
    }

    /// Index of a material's image among all.
    pub fn number(&self, material: u32) -> Option<usize> {
        self.of_materials.keys().position(|&known| known == material)
    }
}

impl Image {
    fn new(
        material: &Material,
        shown: Shown<'_>,
        irradiance: Rgb,
        tone: &ToneCurve,
    ) -> ImageResult<Image> {
        let colour = |texel: Rgb| {
            let scaled = |mean: Rgb| shown.colours.map_or(mean, |map| map.scaled(texel, mean));
            tone.linear(if shown.emits {
                scaled(material.exitance) + material.albedo() * irradiance
            } else {
                material.exitance + scaled(material.albedo()) * irradiance
            })
        };
        let texels = Texels::new(shown);
        // Computed twice: storing all colours of a large image would take gigabytes.
        let colours = || texels.all().map(|texel| colour(texels.colour(texel)));
        let peak = colours().map(Rgb::max_element).reduce(|| 0.0, f64::max);
        let byte = |c: Rgb| (c / if peak > 0.0 { peak } else { 1.0 }).to_array().map(srgb);
        let bytes = colours().map(byte);
        let (bytes, format) = match shown.mask {
            None => (bytes.collect::<Vec<_>>().into_flattened(), Rgb8),
            Some(_) => {
                let alpha = texels.all().map(|texel| u8::from(texels.is_solid(texel)) * u8::MAX);
                let bytes = bytes.zip(alpha).map(|([r, g, b], alpha)| [r, g, b, alpha]);
                (bytes.collect::<Vec<_>>().into_flattened(), Rgba8)
            }
        };
        let png = png(&bytes, texels.size, format)?;
        Ok(Image { png, peak, mean: tone.linear(mean_radiosity(material, irradiance)) })
    }

    /// `COLOR_0` for light under which the material's mean has this `colour`: within [0, 1], as
    /// glTF requires.
    pub fn vertex_colour(&self, colour: Rgb) -> Rgb {
        let relative = Rgb::select(self.mean.cmpgt(Rgb::ZERO), colour / self.mean, Rgb::ONE);
        (self.peak * relative).min(Rgb::ONE)
    }
}

/// The texels of an image that shows one texture, or colours and mask together: along each side the
/// larger number of texels of the two.
struct Texels<'a> {
    shown: Shown<'a>,
    size: [u32; 2],
}

impl Texels<'_> {
    fn new(shown: Shown<'_>) -> Texels<'_> {
        let both = [shown.colours, shown.mask].into_iter().flatten();
        let sizes = both.map(|map| map.texture.size());
        let size = sizes.reduce(|[a, b], [c, d]| [a.max(c), b.max(d)]).unwrap_or([1, 1]);
        Texels { shown, size }
    }

    /// Centres of all texels, in texture coordinates as in the file, rows from the top.
    fn all(&self) -> impl IndexedParallelIterator<Item = DVec2> {
        let [width, height] = self.size;
        let frame = self.shown.frame().map(|map| map.placement.inverse());
        let count = width as usize * height as usize;
        (0..count).into_par_iter().map(move |k| {
            let [x, y] = [k % width as usize, k / width as usize].map(|k| k as f64 + 0.5);
            let place = DVec2::new(x / f64::from(width), 1.0 - y / f64::from(height));
            frame.map_or(place, |to_file| to_file.transform_point2(place))
        })
    }

    fn colour(&self, texel: DVec2) -> Rgb {
        self.shown.colours.map_or(Rgb::ONE, |map| map.texel(texel))
    }

    fn is_solid(&self, texel: DVec2) -> bool {
        self.shown.mask.is_none_or(|mask| mask.is_solid(texel))
    }
}

/// A PNG file of these pixels.
pub(in crate::io) fn png(
    bytes: &[u8],
    [width, height]: [u32; 2],
    format: ExtendedColorType,
) -> ImageResult<Vec<u8>> {
    let mut png = vec![];
    PngEncoder::new_with_quality(&mut png, CompressionType::Default, FilterType::Adaptive)
        .write_image(bytes, width, height, format)?;
    Ok(png)
}

/// Radiosity of a surface with the means of its material's textures everywhere, W/m².
pub(super) fn mean_radiosity(material: &Material, irradiance: Rgb) -> Rgb {
    material.exitance + material.albedo() * irradiance
}

/// The irradiance whose mean radiosity is shown with the median brightness, among lit vertices; if
/// none is lit, one that the curve shows well.
fn median(mut irradiances: Vec<Rgb>, material: &Material, tone: &ToneCurve) -> Rgb {
    let brightness = |e: &Rgb| tone.linear(mean_radiosity(material, *e)).element_sum();
    irradiances.retain(|e| brightness(e) > 0.0);
    if irradiances.is_empty() {
        return Rgb::splat(1.0 / tone.exposure());
    }
    let middle = irradiances.len() / 2;
    let order = |a: &Rgb, b: &Rgb| brightness(a).total_cmp(&brightness(b));
    *irradiances.select_nth_unstable_by(middle, order).1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_that_comes_through_is_in_the_mean() {
        let [transmittance, exitance] = [0.25, 3.0].map(Rgb::splat);
        let leaf = Material { transmittance, exitance, ..Material::grey("leaf", 0.5) };
        assert_eq!(mean_radiosity(&leaf, Rgb::splat(8.0)), Rgb::splat(3.0 + 0.75 * 8.0));
    }
}
